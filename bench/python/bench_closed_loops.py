# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots with closed loops against pinocchio: passive joints, poses and Jacobians of the models of a folder.

FOLDER holds a folder a model with `robot.urdf` and `robot.yaml`, as https://github.com/Gepetto/example-parallel-robots
(BSD-3) has them in `robots/`: pairs of frames that coincide, and the motors. Pinocchio closes the loops by Newton's
method of its own here, on all equations; fastcal reads the folder's `robot.yaml`. Both then say where a link at the
end is and how it moves with the motors. A spherical joint stands as three hinges; a passive joint that no loop holds,
as the spin of a rod between two balls, is held where it is.

    python bench/python/bench_closed_loops.py FOLDER [--models NAME ...] [--postures 20]
        [--out bench/python/bench_closed_loops.json]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import yaml
from numpy.typing import NDArray

from fastcal.errors import FastcalError
from fastcal.io.atomic import write_text
from fastcal.io.loop_lists import add_lists, urdf_of
from fastcal.io.robot_file import load_robot
from fastcal.io.urdf_mechanism import read_urdf_mechanism
from fastcal.robot.robot import Robot

Array = NDArray[np.float64]
SPREAD = 0.1  # [rad], a tenth of it [m]
STEPS = 10  # on the way to a posture
CLOSED = 1e-12
INDEPENDENT = 1e-6


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
    ends: list[str] = field(default_factory=list)

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
        """q with the joints `moved` where all equations hold, and the largest that is left.

        What is closed takes one step more: near a singular posture joints are off by many times what is left.
        """
        q = q.copy()
        closed = False
        for _ in range(100):
            e, J = self.equations(q)
            if closed:
                break
            closed = bool(np.abs(e).max() < CLOSED)
            step = -np.linalg.lstsq(J[:, moved], e, rcond=INDEPENDENT)[0]
            q[moved] += step * min(1.0, 0.2 / max(np.abs(step).max(), 1e-300))
        return q, float(np.abs(self.equations(q)[0]).max())

    def tool(self, tip: str, q: Array, motors: list[int], passive: list[int]) -> tuple[Array, Array]:
        """Pose of a link at the end, and its motion (6, motors) in the axes of the world."""
        _, C = self.equations(q)
        frame = self.model.getFrameId(tip)
        pin.updateFramePlacements(self.model, self.data)
        J = pin.getFrameJacobian(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
        follows = -np.linalg.lstsq(C[:, passive], C[:, motors], rcond=INDEPENDENT)[0]
        return self.data.oMf[frame].homogeneous.copy(), J[:, motors] + J[:, passive] @ follows


def read(folder: Path) -> Mechanism:
    """The mechanism of a folder; spherical and universal joints as hinges, fixed ones dropped."""
    urdf = pin.buildModelFromUrdf(str(urdf_of(folder / "robot.yaml")))
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
    tree = ElementTree.parse(urdf_of(folder / "robot.yaml")).getroot()  # noqa: S314 - as pinocchio has read it
    carriers = {joint.find("parent").attrib["link"] for joint in tree.findall("joint")}  # type: ignore[union-attr]
    tips = [link.attrib["name"] for link in tree.findall("link") if link.attrib["name"] not in carriers]
    for name in tips:
        frame = urdf.frames[urdf.getFrameId(name, pin.BODY)]
        parent, place = stands[frame.parentJoint]
        out.addFrame(pin.Frame(name, parent, place * frame.placement, pin.OP_FRAME))
    return Mechanism(out, said["name_mot"], closures, tips)


def tip_of(folder: Path, mechanism: Mechanism) -> tuple[Robot, str]:
    """The robot as fastcal reads the folder, and its tool's link: the first end of the URDF at which it can be."""
    said = "it has no link at which a tool can be"
    ends = [name for name in mechanism.ends if "closedloop" not in name]
    for name in ends:
        try:
            return load_robot(folder / "robot.yaml", tip_link=name), name
        except FastcalError as error:
            said = str(error)
    raise ValueError(said)


def starts_of(folder: Path) -> tuple[dict[str, float], set[str]]:
    """Where fastcal's reader lets each joint begin, and the joints that it holds there."""
    path = folder / "robot.yaml"
    of = read_urdf_mechanism(str(path), ElementTree.parse(urdf_of(path)).getroot())  # noqa: S314 - the same
    value = yaml.safe_load(path.read_text(encoding="utf-8"))
    add_lists(of, value, path)
    held = {joint.name for joint in of.joints if joint.kind == "fixed"}
    return {joint.name: joint.start for joint in of.joints}, held


def compare(folder: Path, postures: int, seed: int) -> dict[str, Any]:
    """Largest differences of one model over random postures near the start that fastcal's reader finds."""
    mechanism = read(folder)
    model = mechanism.model
    names = list(model.names)[1:]
    robot, tip = tip_of(folder, mechanism)
    starts, held = starts_of(folder)
    ours = [str(joint.name) for joint in robot.joints]
    motors = [name for k, name in enumerate(ours) if k not in robot.passive]
    shared = [name for k, name in enumerate(ours) if k in robot.passive and name in names]
    start = np.array([starts.get(name, 0.0) for name in names])
    passive = [k for k, name in enumerate(names) if name not in mechanism.motors and name not in held]
    start, gap = mechanism.close(start, passive)
    out: dict[str, Any] = {"model": folder.name, "tip": tip, "joints": model.nv, "motors": len(motors)}
    out |= {"passive": len(robot.passive), "held": len(held & set(names))}
    if gap > CLOSED:
        return out | {"left_out": f"pinocchio's equations leave {gap:.2g} at the start"}
    given = [names.index(name) for name in motors]
    random = np.random.default_rng(seed)
    scale = np.array([0.1 if joint.type == "prismatic" else 1.0 for joint in robot.joints if joint.name in motors])
    worst = np.zeros(4)
    compared = 0
    for _ in range(postures):
        wanted = start[given] + SPREAD * scale * random.uniform(-1, 1, len(given))
        q, left = start, 0.0
        for step in range(1, STEPS + 1):
            q = q.copy()
            q[given] = start[given] + step / STEPS * (wanted - start[given])
            q, left = mechanism.close(q, passive)
        sent = np.zeros((1, robot.joint_count))
        sent[0, [ours.index(name) for name in motors]] = q[given]
        assembly = robot.assemble(sent)
        if left > 1e-10 or assembly.status != ["closed"]:
            continue
        compared += 1
        pose, J_tool = mechanism.tool(tip, q, given, passive)
        turn = assembly.q[0, [ours.index(name) for name in shared]] - q[[names.index(name) for name in shared]]
        errors = [
            assembly.gap[0],
            np.abs(np.sin(turn / 2) * 2).max(initial=0.0),
            np.abs(robot.forward(assembly.q)[0] - pose).max(),
            np.abs(robot.joint_jacobian(assembly.q)[0][:, [ours.index(name) for name in motors]] - J_tool).max(),
        ]
        worst = np.maximum(worst, errors)
    if not compared:
        return out | {"left_out": "no posture near the start was closed by both"}
    keys = ("gap", "passive_joints", "pose", "jacobian")
    return out | {"postures": compared} | {key: float(f"{value:.2e}") for key, value in zip(keys, worst, strict=True)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--models", nargs="+", help="these of the folder alone")
    parser.add_argument("--postures", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rows = []
    for path in sorted(given.folder.glob("*/robot.yaml")):
        if given.models and path.parent.name not in given.models:
            continue
        try:
            rows.append(compare(path.parent, given.postures, given.seed))
        except (ValueError, RuntimeError, IndexError) as error:
            rows.append({"model": path.parent.name, "left_out": str(error)[:200]})
        print(rows[-1], flush=True)
    if given.out is not None:
        write_text(given.out, json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
