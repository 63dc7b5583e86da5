# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots with closed loops against pinocchio: passive joints, poses and Jacobians of the models of a folder.

FOLDER holds a folder a model with `robot.urdf` and `robot.yaml`, as https://github.com/Gepetto/example-parallel-robots
(BSD-3) has them in `robots/`: pairs of frames that coincide, and the motors. Pinocchio closes the loops by Newton's
method of its own here, on all equations; both then say where the last link is and how it moves with the motors. A
spherical joint stands as three hinges; a passive joint that no loop holds, as the spin of a rod between two balls, is
held where it is.

    python bench/python/bench_closed_loops.py FOLDER [--postures 20] [--out bench/python/bench_closed_loops.json]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import scipy.linalg
import yaml
from numpy.typing import NDArray

from fastcal import _core
from fastcal.io.atomic import write_text
from fastcal.io.robot_file import load_robot

Array = NDArray[np.float64]
SPREAD = 0.1  # [rad], a tenth of it [m]
STEPS = 10  # on the way to a posture
CLOSED = 1e-12
INDEPENDENT = 1e-6
AXES = {"X": [1.0, 0.0, 0.0], "Y": [0.0, 1.0, 0.0], "Z": [0.0, 0.0, 1.0]}


@dataclass
class Closure:
    """Two places that coincide: joints of the model and the places in their frames."""

    joints: tuple[int, int]
    places: tuple[Any, Any]
    with_turn: bool


@dataclass
class Mechanism:
    """Hinges and slides in depth-first order, from 1, as pinocchio counts them."""

    model: Any
    motors: list[str]
    closures: list[Closure] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.data = self.model.createData()

    def equations(self, q: Array) -> tuple[Array, Array]:
        """All closures' equations, and their derivative by all joints."""
        pin.computeJointJacobians(self.model, self.data, q)
        values, slopes = [], []
        for closure in self.closures:
            T, J = [], []
            for joint, place in zip(closure.joints, closure.places, strict=True):
                T.append(self.data.oMi[joint] * place)
                there = pin.getJointJacobian(self.model, self.data, joint, pin.LOCAL) if joint else self.still()
                J.append(place.toActionMatrixInverse() @ there)
            M = T[0].actInv(T[1])
            motion = J[1] - M.toActionMatrixInverse() @ J[0]
            if closure.with_turn:
                values.append(pin.log6(M).vector)
                slopes.append(pin.Jlog6(M) @ motion)
            else:
                values.append(M.translation)
                slopes.append(M.rotation @ motion[:3])
        return np.concatenate(values), np.concatenate(slopes)

    def still(self) -> Array:
        return np.zeros((6, self.model.nv))

    def close(self, q: Array, moved: list[int]) -> tuple[Array, float]:
        """q with the joints `moved` where all equations hold, and the largest that is left."""
        q = q.copy()
        for _ in range(100):
            e, J = self.equations(q)
            if np.abs(e).max() < CLOSED:
                break
            step = -np.linalg.lstsq(J[:, moved], e, rcond=INDEPENDENT)[0]
            q[moved] += step * min(1.0, 0.2 / max(np.abs(step).max(), 1e-300))
        return q, float(np.abs(self.equations(q)[0]).max())

    def tool(self, q: Array, motors: list[int], passive: list[int]) -> tuple[Array, Array]:
        """Pose of the last link, and its motion (6, motors) in the axes of the world."""
        _, C = self.equations(q)
        pin.updateFramePlacements(self.model, self.data)
        last = self.model.njoints - 1
        J = pin.getJointJacobian(self.model, self.data, last, pin.LOCAL_WORLD_ALIGNED)
        follows = -np.linalg.lstsq(C[:, passive], C[:, motors], rcond=INDEPENDENT)[0]
        return self.data.oMi[last].homogeneous.copy(), J[:, motors] + J[:, passive] @ follows


def read(folder: Path) -> Mechanism:
    """The mechanism of a folder; spherical and universal joints as hinges, fixed ones dropped."""
    urdf = pin.buildModelFromUrdf(str(folder / "robot.urdf"))
    said = yaml.safe_load((folder / "robot.yaml").read_text(encoding="utf-8"))
    kinds = dict(zip(said.get("joint_name", []), said.get("joint_type", []), strict=True))
    out = pin.Model()
    stands: dict[int, tuple[int, Any]] = {0: (0, pin.SE3.Identity())}
    for j in range(1, urdf.njoints):
        parent, place = stands[urdf.parents[j]]
        place = place * urdf.jointPlacements[j]
        kind = kinds.get(urdf.names[j], urdf.joints[j].shortname().removeprefix("JointModel"))
        if kind == "FIXED":
            stands[j] = (parent, place)
            continue
        turns = kind in ("RX", "RY", "RZ") or kind.startswith(("SPHERICAL", "UJOINT"))
        axes = "XYZ" if kind == "SPHERICAL" else kind[-2:] if kind.startswith("UJOINT") else kind[-1]
        for axis in axes:
            name = urdf.names[j] if len(axes) == 1 else f"{urdf.names[j]}_{axis}"
            joint = getattr(pin, f"JointModel{'R' if turns else 'P'}{axis}")()
            parent = out.addJoint(parent, joint, place, name)
            place = pin.SE3.Identity()
        stands[j] = (parent, pin.SE3.Identity())
    closures = []
    for names, kind in zip(said["closed_loop"], said["type"], strict=True):
        missing = [name for name in names if not urdf.existFrame(name)]
        if missing:
            raise ValueError(f"robot.urdf has no frame {missing[0]}")
        frames = [urdf.frames[urdf.getFrameId(name)] for name in names]
        ends = [(stands[f.parentJoint][0], stands[f.parentJoint][1] * f.placement) for f in frames]
        closures.append(Closure((ends[0][0], ends[1][0]), (ends[0][1], ends[1][1]), kind.lower() == "6d"))
    return Mechanism(out, said["name_mot"], closures)


def axis_of(model: Any, j: int) -> list[float]:
    return AXES[model.joints[j].shortname()[-1]]


def origin_of(T: Any) -> dict[str, list[float]]:
    rpy = _core.rotation_to_rpy(T.rotation)
    return {"xyz_mm": (1e3 * T.translation).tolist(), "rpy_deg": np.degrees(rpy).tolist()}


def pin_of(model: Any, j: int, place: Any) -> tuple[str, Any]:
    """Link and place in its frame: the mount of the next joint where that stands on it alone."""
    if j == 0:
        return "base", place
    alone = [k for k in range(1, model.njoints) if model.parents[k] == j]
    if len(alone) == 1:
        turn = _core.rotation_to_axis(axis_of(model, alone[0]))
        place = (model.jointPlacements[alone[0]] * pin.SE3(turn, np.zeros(3))).actInv(place)
    return f"link{j}", place


def joint_of(model: Any, j: int, start: float, is_passive: bool) -> dict[str, Any]:
    slides = model.joints[j].shortname()[-2] == "P"
    unit, value = ("mm", 1e3 * start) if slides else ("deg", np.degrees(start))
    joint = {"name": f"axis{j}", "type": "prismatic" if slides else "revolute", "axis": axis_of(model, j)}
    joint |= {"origin": origin_of(model.jointPlacements[j]), f"start_{unit}": float(value)}
    joint |= {f"min_{unit}": -9999.0, f"max_{unit}": 9999.0}
    if model.parents[j] != j - 1:
        joint["on"] = "base" if model.parents[j] == 0 else f"link{model.parents[j]}"
    return joint | ({"passive": True} if is_passive else {})


def file_of(mechanism: Mechanism, start: Array, passive: list[int]) -> dict[str, Any]:
    """The robot file of fastcal."""
    model = mechanism.model
    joints = [joint_of(model, j, start[j - 1], j - 1 in passive) for j in range(1, model.njoints)]
    loops = []
    for k, closure in enumerate(mechanism.closures):
        turns = ["rx", "ry", "rz"] if closure.with_turn else []
        loop: dict[str, Any] = {"name": f"loop_{k + 1}", "fixed": ["x", "y", "z", *turns]}
        for end, j, place in zip(("from", "to"), closure.joints, closure.places, strict=True):
            loop[end], at = pin_of(model, j, place)
            loop |= {f"{end}_{key}": value for key, value in origin_of(at).items()}
        loops.append(loop)
    return {"name": "model", "kinematics": "urdf", "joints": joints, "loops": loops}


def compare(folder: Path, postures: int, seed: int) -> dict[str, Any]:
    """Largest differences of one model over random postures near a start that closes."""
    mechanism = read(folder)
    model = mechanism.model
    names = list(model.names)[1:]
    given = [names.index(name) for name in mechanism.motors if name in names]
    every = [j for j in range(model.nv) if j not in given]
    start, gap = mechanism.close(np.zeros(model.nv), every)
    if gap > CLOSED:
        start, gap = mechanism.close(np.zeros(model.nv), list(range(model.nv)))
    out: dict[str, Any] = {"model": folder.name, "joints": model.nv, "motors": len(given)}
    if gap > CLOSED:
        return out | {"left_out": f"pinocchio's equations leave {gap:.2g} at the start"}
    J = mechanism.equations(start)[1][:, every]
    _, R, order = scipy.linalg.qr(J, pivoting=True, mode="economic")
    size = np.abs(np.diag(R))
    rank = int(np.sum(size > INDEPENDENT * size[0]))
    passive = sorted(every[k] for k in order[:rank])
    motors = [j for j in range(model.nv) if j not in passive]
    out |= {"passive": len(passive), "held": len(every) - rank}
    robot = load_robot(file_of(mechanism, start, passive))
    random = np.random.default_rng(seed)
    scale = np.array([0.1 if kind == "prismatic" else 1.0 for kind in robot.joint_types])
    worst = np.zeros(4)
    compared = 0
    for _ in range(postures):
        wanted = start.copy()
        wanted[given] += SPREAD * scale[given] * random.uniform(-1, 1, len(given))
        q, left = start, 0.0
        for step in range(1, STEPS + 1):
            q = q.copy()
            q[motors] = start[motors] + step / STEPS * (wanted - start)[motors]
            q, left = mechanism.close(q, passive)
        assembly = robot.assemble(q)
        if left > 1e-10 or assembly.status != ["closed"]:
            continue
        compared += 1
        pose, J_tool = mechanism.tool(q, motors, passive)
        ours = assembly.q
        errors = [
            assembly.gap[0],
            np.abs(ours[0] - q).max(),
            np.abs(robot.forward(ours)[0] - pose).max(),
            np.abs(robot.joint_jacobian(ours)[0][:, motors] - J_tool).max(),
        ]
        worst = np.maximum(worst, errors)
    if not compared:
        return out | {"left_out": "no posture near the start was closed by both"}
    keys = ("gap", "passive_joints", "pose", "jacobian")
    return out | {"postures": compared} | {key: float(f"{value:.2e}") for key, value in zip(keys, worst, strict=True)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--postures", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rows = []
    for path in sorted(given.folder.glob("*/robot.yaml")):
        try:
            rows.append(compare(path.parent, given.postures, given.seed))
        except (ValueError, RuntimeError, IndexError) as error:
            rows.append({"model": path.parent.name, "left_out": str(error)[:200]})
        print(rows[-1], flush=True)
    if given.out is not None:
        write_text(given.out, json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
