# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Real arms without any instrument: a ball in a socket, fitted at one place of the room and tested at the others.

The sets are those of MUKCa (G. Franzese et al., "MUKCa: Accurate and Affordable Cobot Calibration Without External
Measurement Devices", 2025; github.com/platonics-delft/kinematics_calibration, MIT): a block with two sockets, 50 mm
apart, was put at several places, and the ball on the arm's hand was brought into each socket in some thirty postures.
The touches at the front are fitted. What counts are the others: how far touches of one socket are from their mean, mm
RMS; nothing is fitted to them. panda_1 was known before; the two dinova showed that a diagnosis of touches let the arm
shrink, which it no longer may, and that an arm is to be held by places held out whole, which was made by them.

`published` is MUKCa's own method, written anew: least squares of the spread of each socket, of the error of their
distance, and of 1e-4 times the squared changes [m, rad] of six numbers a joint, the ball's excepted. `calibrate` and
`diagnose` are fastcal's, without options; the distance of the sockets is a known distance of the robot file.

    git clone https://github.com/platonics-delft/kinematics_calibration
    python bench/python/bench_sockets.py kinematics_calibration [--out FILE]
"""

from __future__ import annotations

import argparse
import json
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.io.atomic import write_text

FloatArray = NDArray[np.float64]
Touches = tuple[FloatArray, FloatArray]  # (N, n) joint positions [rad] in either socket of a block

URDFS = {"panda_1_with_sensor": "panda_plus_bota", "panda": "panda", "kuka": "iiwa14", "dinova": "gen3lite"}
DISTANCE_MM = 50.0
RIDGE = 1e-4
_TIP = "ball_link"


@dataclass(frozen=True)
class Joint:
    """A joint of a URDF: where it is drawn, xyz [m] and rpy [rad], and its axis; None where it is fixed."""

    origin: FloatArray
    axis: FloatArray | None
    of_ball: bool


def chain(urdf: Path) -> list[Joint]:
    """The joints from the root to the ball."""
    tree = ET.parse(urdf)  # noqa: S314  the file is the user's own clone's
    above = {joint.find("child").attrib["link"]: joint for joint in tree.getroot().iter("joint")}
    link, joints = _TIP, []
    while link in above:
        joint = above[link]
        origin, axis = joint.find("origin").attrib, joint.find("axis")
        numbers = [float(value) for key in ("xyz", "rpy") for value in origin.get(key, "0 0 0").split()]
        turns = joint.attrib["type"] != "fixed"
        own = np.array([float(value) for value in axis.attrib["xyz"].split()]) if turns else None
        joints.append(Joint(np.array(numbers), own, joint.attrib["name"] == "ball_joint"))
        link = joint.find("parent").attrib["link"]
    return joints[::-1]


def ball(joints: list[Joint], origins: FloatArray, q: FloatArray) -> FloatArray:
    """(N, 3) places of the ball [m]."""
    R, p, k = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3)), 0
    for joint, origin in zip(joints, origins, strict=True):
        p = p + R @ origin[:3]
        R = R @ Rotation.from_euler("xyz", origin[3:]).as_matrix()
        if joint.axis is not None:
            R = R @ Rotation.from_rotvec(q[:, k : k + 1] * joint.axis).as_matrix()
            k += 1
    return p


def published(joints: list[Joint], blocks: list[Touches]) -> FloatArray:
    """(J, 6) origins of the joints by the method of the paper."""
    nominal = np.array([joint.origin for joint in joints])
    free = [i for i, joint in enumerate(joints) if joint.axis is not None or joint.of_ball]
    held = np.array([not joints[i].of_ball for i in free])

    def origins(x: FloatArray) -> FloatArray:
        out = nominal.copy()
        out[free] = x.reshape(-1, 6)
        return out

    def residuals(x: FloatArray) -> FloatArray:
        now = origins(x)
        parts = [np.sqrt(len(blocks) * RIDGE) * (now - nominal)[free][held].ravel()]
        for block in blocks:
            found = [ball(joints, now, q) for q in block]
            means = [points.mean(axis=0) for points in found]
            count = sum(map(len, found))
            parts += [(points - mean).ravel() / np.sqrt(count) for points, mean in zip(found, means, strict=True)]
            parts.append(np.array([np.linalg.norm(means[0] - means[1]) - DISTANCE_MM / 1e3]))
        return np.concatenate(parts)

    return origins(least_squares(residuals, nominal[free].ravel(), x_scale="jac", max_nfev=100).x)


def spread_mm(found: list[FloatArray]) -> float:
    """How far touches (N, 3) of one socket are from their mean, RMS over the touches of all sockets."""
    square = np.concatenate([np.sum((points - points.mean(axis=0)) ** 2, axis=1) for points in found])
    return float(1e3 * np.sqrt(square.mean()))


def written(folder: Path, urdf: Path, blocks: Mapping[str, Touches]) -> tuple[Path, Path]:
    """The robot and the touches as fastcal's files."""
    (folder / "arm.urdf").write_text(urdf.read_text())
    robot = {
        "name": urdf.stem,
        "kinematics": "urdf",
        "urdf": "arm.urdf",
        "tip_link": _TIP,
        "known_distances": [
            {"from": f"socket {name}_0", "to": f"socket {name}_1", "mm": DISTANCE_MM, "sigma_mm": 0.1}
            for name in blocks
        ],
    }
    (folder / "robot.yaml").write_text(json.dumps(robot))  # which is YAML too
    joints = next(iter(blocks.values()))[0].shape[1]
    lines = [",".join([*(f"q{k + 1}_rad" for k in range(joints)), "socket"])]
    for name, block in blocks.items():
        lines += [",".join([*map(repr, row), f"{name}_{k}"]) for k, q in enumerate(block) for row in q.tolist()]
    (folder / "touches.csv").write_text("\n".join(lines) + "\n")
    return folder / "robot.yaml", folder / "touches.csv"


def one(data: Path, name: str) -> dict[str, Any]:
    """The figures of one arm."""
    urdf = data / "urdf" / f"{next(urdf for begin, urdf in URDFS.items() if name.startswith(begin))}.urdf"
    places = sorted(folder.name for folder in (data / "data" / name).iterdir() if (folder / "hole_0.csv").exists())
    touched = {
        place: tuple(np.loadtxt(data / "data" / name / place / f"hole_{k}.csv", delimiter=",", ndmin=2) for k in (0, 1))
        for place in places
    }
    front = next(place for place in places if place.startswith("front"))
    unseen = [q for place in places if place != front for q in touched[place]]
    joints = chain(urdf)
    nominal = np.array([joint.origin for joint in joints])
    with tempfile.TemporaryDirectory() as folder:
        robot, touches = written(Path(folder), urdf, {front: touched[front]})
        calibrated = fastcal.calibrate(robot, touches).model
        diagnosed = fastcal.diagnose(robot, touches)
    origins = published(joints, [touched[front]])
    models = {"calibrate": calibrated, "diagnose": diagnosed.model}
    return {
        "places": len(places),
        "touches": [sum(map(len, touched[front])), sum(map(len, unseen))],
        "nominal": spread_mm([ball(joints, nominal, q) for q in unseen]),
        "published": spread_mm([ball(joints, origins, q) for q in unseen]),
        **{key: spread_mm([model.forward(q)[:, :3, 3] for q in unseen]) for key, model in models.items()},
        "named": [f"{effect.effect}@{effect.owner} ({effect.grade})" for effect in diagnosed.effects],
    }


def main() -> None:
    """Runs the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="a clone of the repository")
    parser.add_argument("--out", type=Path, help="write the figures, JSON")
    options = parser.parse_args()
    sets = [folder.name for folder in sorted((options.data / "data").iterdir()) if folder.is_dir()]
    figures = {}
    for name in sets:
        # Sets named _clean repeat rows of others; the two that stand in a room's frame have one place.
        places = [folder for folder in (options.data / "data" / name).iterdir() if folder.is_dir()]
        if name.endswith("_clean") or len(places) < 2:
            continue
        figures[name] = found = one(options.data, name)
        print(name, {key: round(of, 3) if isinstance(of, float) else of for key, of in found.items()}, flush=True)
    if options.out:
        write_text(options.out, json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
