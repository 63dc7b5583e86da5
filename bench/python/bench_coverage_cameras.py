# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do 95 % intervals hold the truth for cameras, boards, lenses and the arm that carries them?

Each set has an arm of its own (geometry off by 0.5 mm and 0.5 mrad), a camera on its flange whose place and lens are
off from what its file says, a board, and pictures with noise; all is identified from the corners. Which parameters the
gauge holds is no matter of noise, and what a held one is off moves into others: so the truth of a set is what the same
pictures with a thousandth of their noise give for the very same parameters.

    python bench/python/bench_coverage_cameras.py [--sets 20] [--jobs N] [--first 0] [--out FILE]
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from coverage_of_parts import count_parts
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.simulation import perturbed
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners
from fastcal.robot.robot import Robot
from fastcal.robot.se3 import inverse

FloatArray = NDArray[np.float64]

ARM = "ur5e"
PICTURES = 60
NOISE_PX, FAINT = 0.1, 1e-3
SIZE = (1280, 960)
CAMERA: dict[str, Any] = {"on": "arm", "size_px": list(SIZE), "model": "pinhole", "intrinsics": "identify"}
CAMERA |= {"xyz_mm": [0.0, -60.0, 40.0], "rpy_deg": [0.0, 0.0, 0.0], "focal_px": [1200.0, 1200.0]}
CAMERA |= {"centre_px": [640.0, 480.0], "distortion": [-0.1, 0.05, 0.0, 0.0, 0.0]}
BOARD: dict[str, Any] = {"on": "world", "kind": "checkerboard", "columns": 10, "rows": 8, "square_mm": 25.0}
HOME = np.radians([20.0, -80.0, 100.0, -110.0, -90.0, 0.0])
AROUND = np.radians([25.0, 20.0, 25.0, 35.0, 35.0, 120.0])
DISTANCE_M = (0.2, 0.9)
PARTS = ("arm", "camera", "lens", "board")


def drawn(random: np.random.Generator) -> tuple[Robot, Robot, FloatArray, FloatArray, list[float]]:
    """The arm with its cell as the file has them, the true arm, T_flange_camera, T_world_board and the true lens."""
    bare = load_robot(ARM)
    truth = perturbed(bare, seed=int(random.integers(2**31)))
    wrist = pose(
        {
            "xyz_mm": (np.array(CAMERA["xyz_mm"]) + random.normal(0, 3, 3)).tolist(),
            "rpy_deg": random.normal(0, 2, 3).tolist(),
        }
    )
    focal, centre = 1200 * (1 + random.normal(0, 0.01, 2)), np.array(CAMERA["centre_px"]) + random.normal(0, 8, 2)
    bend = np.array(CAMERA["distortion"]) + random.normal(0, [0.02, 0.02, 2e-4, 2e-4, 0.0])
    before = np.asarray(bare.forward(HOME[np.newaxis]))[0] @ pose(CAMERA)
    plate = before @ pose({"xyz_mm": [-110.0, -85.0, 450.0], "rpy_deg": random.uniform(-15, 15, 3).tolist()})
    board = BOARD | {"xyz_mm": (1e3 * plate[:3, 3]).tolist()}
    board["rpy_deg"] = np.degrees(_core.rotation_to_rpy(plate[:3, :3])).tolist()
    robot = load_robot({**bare.spec, "cameras": {"wrist": CAMERA}, "boards": {"plate": board}})
    return robot, truth, wrist, plate, [*focal, *centre, *bend]


def taken(
    truth: Robot, wrist: FloatArray, plate: FloatArray, lens: list[float], random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Postures (PICTURES, 6) [rad] in which the whole board is in the picture, and its corners (PICTURES, 2 K) [px]."""
    corners = board_corners(BOARD)
    postures, uv = [], []
    while len(uv) < PICTURES:
        q = HOME + random.uniform(-1, 1, 6) * AROUND
        T = inverse(np.asarray(truth.forward(q[np.newaxis]))[0] @ wrist) @ plate
        at = corners @ T[:3, :3].T + T[:3, 3]
        if at[:, 2].min() < DISTANCE_M[0] or at[:, 2].max() > DISTANCE_M[1]:
            continue
        seen = np.asarray(_core.draw("pinhole", lens, at))
        if (seen > 0).all() and (seen < SIZE).all():
            postures.append(q)
            uv.append(seen.ravel())
    return np.array(postures), np.array(uv)


def trial(seed: int) -> dict[str, list[tuple[float, bool]]] | None:
    """Misses in deviations by part, and whether the interval holds the truth; None where it did not converge."""
    random = np.random.default_rng([46, seed])
    robot, truth, wrist, plate, lens = drawn(random)
    q, uv = taken(truth, wrist, plate, lens, random)
    noise = NOISE_PX * random.standard_normal(uv.shape)

    def seen(scale: float) -> Dataset:
        poses = Dataset.from_arrays(q, robot=robot, source="pictures")
        return replace(poses, observed={"corner": uv + scale * noise})

    found = calibrate(robot, seen(1.0))
    if found.status != "converged" or found.held:
        return None
    names = [f"{p.owner} {p.name.rpartition('_')[0]}" for p in found.parameters if p.owner.startswith("joint")]
    there = calibrate(robot, seen(FAINT), parameters=names, loss="none", checks=False)
    if there.status != "converged" or labels(there) != labels(found):
        return None
    out: dict[str, list[tuple[float, bool]]] = {part: [] for part in PARTS}
    # A lens is told by its changes of where the fit began, which the pictures say and their noise changes.
    began = iter(lens_of(there) - lens_of(found) - lens_changes(there) + lens_changes(found))
    for p, (low, high), other in zip(found.parameters, found.interval(), there.parameters, strict=True):
        part = part_of(p.owner, p.unit)
        true = other.value + (float(next(began)) if part == "lens" else 0.0)
        out[part].append(((p.value - true) / (p.std or np.nan), bool(low <= true <= high)))
    return out


def lens_of(found: CalibrationResult) -> FloatArray:
    """(9,) focal lengths, centre and distortion of the camera as identified."""
    camera = found.model.description.cameras["wrist"]
    return np.array([*camera["focal_px"], *camera["centre_px"], *camera["distortion"]])


def lens_changes(found: CalibrationResult) -> FloatArray:
    """(9,) of the lens by where the fit began."""
    return np.array([p.value for p in found.parameters if part_of(p.owner, p.unit) == "lens"])


def labels(found: CalibrationResult) -> list[tuple[str, str]]:
    """Owner and name of what was identified."""
    return [(p.owner, p.name) for p in found.parameters]


def part_of(owner: str, unit: str) -> str:
    """Which of PARTS a parameter is of."""
    if owner.startswith("camera"):
        return "camera" if unit in ("mm", "deg") else "lens"
    return "board" if owner.startswith("board") else "arm"


if __name__ == "__main__":
    count_parts(__doc__, trial, PARTS)
