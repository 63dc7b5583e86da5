# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A lens from pictures of boards alone, drawn by OpenCV, where the file has none or one that is far off."""

from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.calibration.lens_start import started_lenses
from fastcal.calibration.unknowns import CORNERS
from fastcal.errors import ParseError
from fastcal.io.robot_file import load_robot
from fastcal.robot.rig import board_corners
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

FOCAL, CENTRE = (880.0, 884.0), (650.0, 340.0)
BENT = {"pinhole": [-0.35, 0.12, 0.001, -0.001, 0.0], "fisheye": [-0.03, 0.01, 0.0, 0.0]}
BOARD = {"on": "world", "kind": "checkerboard", "columns": 10, "rows": 7, "square_mm": 25}


def arm(**camera: Any) -> Robot:
    cameras = {"wrist": {"on": "arm", "size_px": [1280, 720], **camera}}
    return load_robot({**load_robot("ur5e").spec, "cameras": cameras, "boards": {"b": BOARD}})


def seen(rig: Robot, model: str, *, slant: float, seed: int) -> dict[str, FloatArray]:
    """Corners of twelve pictures, a tenth of them with a misread corner."""
    random, points = np.random.default_rng(seed), board_corners(rig.description.boards["b"])
    K = np.array([[FOCAL[0], 0, CENTRE[0]], [0, FOCAL[1], CENTRE[1]], [0, 0, 1.0]])
    out = []
    for _ in range(12):
        turn = cv2.Rodrigues(np.radians(random.uniform(-slant, slant, 3) * [1, 1, 3]))[0]
        at = turn @ -points.mean(axis=0) + [*random.uniform(-60, 60, 2) * 1e-3, random.uniform(0.3, 0.5)]
        draw = cv2.projectPoints if model == "pinhole" else cv2.fisheye.projectPoints
        given = points.reshape(-1, 1, 3), cv2.Rodrigues(turn)[0], at, K, np.array(BENT[model])
        uv = draw(*given)[0].reshape(-1, 2)
        out.append((uv + 0.1 * random.standard_normal(uv.shape)).ravel())
    return {CORNERS: np.array(out)}


@pytest.mark.parametrize("model", ["pinhole", "fisheye"])
@pytest.mark.parametrize("seed", [11, 12])
def test_a_lens_that_the_file_lacks_is_found(model: str, seed: int) -> None:
    rig = arm(model=model)
    assert rig.description.cameras["wrist"]["intrinsics"] == "identify"
    found, notes = started_lenses(rig.description, seen(rig, model, slant=30, seed=seed))
    np.testing.assert_allclose(found["wrist"]["focal_px"], FOCAL, rtol=0.01)
    np.testing.assert_allclose(found["wrist"]["centre_px"], CENTRE, atol=12)
    assert notes[0].startswith("camera wrist: the fit starts from the lens that the boards in its pictures show")


def test_a_lens_that_fits_stays() -> None:
    lens = {"focal_px": list(FOCAL), "centre_px": list(CENTRE), "distortion": BENT["pinhole"]}
    rig = arm(intrinsics="identify", **lens)
    tables = seen(rig, "pinhole", slant=30, seed=13)
    assert started_lenses(rig.description, tables) == ({}, [])
    twice = arm(intrinsics="identify", **{**lens, "focal_px": [2 * f for f in FOCAL]})
    np.testing.assert_allclose(started_lenses(twice.description, tables)[0]["wrist"]["focal_px"], FOCAL, rtol=0.01)
    known = arm(**{**lens, "focal_px": [2 * f for f in FOCAL]})  # is not asked for
    assert started_lenses(known.description, tables) == ({}, [])


def test_boards_that_face_the_camera_leave_a_lens_that_is_one() -> None:
    rig = arm()
    found, _ = started_lenses(rig.description, seen(rig, "pinhole", slant=0.5, seed=14))
    camera = found.get("wrist", rig.description.cameras["wrist"])
    assert all(400 < f < 5000 for f in camera["focal_px"])
    np.testing.assert_allclose(camera["centre_px"], [639.5, 359.5], atol=150)


def test_a_known_lens_needs_its_focal_length() -> None:
    with pytest.raises(ParseError, match="expected focal lengths where intrinsics are known"):
        arm(intrinsics="known")
