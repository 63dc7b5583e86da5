# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Corners found in pictures that fastcal draws itself, against where they are."""

import builtins
import sys
import warnings
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fastcal.camera.finding import find_board
from fastcal.camera.grids import _black_first
from fastcal.camera.opencv import opencv
from fastcal.camera.other_size import other_size
from fastcal.camera.rendering import Exposure, render
from fastcal.errors import InvalidInput
from fastcal.io.lens_file import read_target
from fastcal.robot.rig import board_corners

from .board_scene import BOARDS, CAMERA, POINTS, before_camera, drawn, views

WITHIN_PX = 0.1  # RMS of a corner's distance from the truth
LEAST_SHARE = {"april_grid": 0.8, "charuco": 0.9}  # of the corners; of the other kinds all


BRIGHT = ("circles", "asymmetric circles", "points")  # the kinds that are printed in the negative, too


def misses(uv: np.ndarray, true: np.ndarray, *, turnable: bool) -> np.ndarray:
    """(K,) distances [px] of what was found; a board that looks the same may be read from its other end."""
    ways = [uv, uv[::-1]] if turnable else [uv]
    found = [np.linalg.norm(way - true, axis=1) for way in ways]
    return min((each[np.isfinite(each)] for each in found), key=lambda each: float(np.sqrt(np.mean(each**2))))


@pytest.mark.parametrize(("kind", "bright"), [*((kind, False) for kind in BOARDS), *((kind, True) for kind in BRIGHT)])
def test_corners_of_every_kind_of_board_are_found_to_a_tenth_of_a_pixel(kind: str, *, bright: bool) -> None:
    board = BOARDS[kind]
    errors, asked = [], 0
    for k, T in enumerate(views(board, 5, seed=1)):
        picture = render(CAMERA, board, T, exposure=Exposure(blur_px=0.5 + 0.1 * k, noise=1.0 + 0.5 * k), seed=k)
        seen = find_board(255 - picture if bright else picture, board)
        assert seen.why == ""
        errors.append(misses(seen.uv, drawn(board, T), turnable=kind == "circles"))
        asked += len(seen.uv)
    every = np.concatenate(errors)
    assert len(every) >= LEAST_SHARE.get(kind, 1.0) * asked
    assert float(np.sqrt(np.mean(every**2))) < WITHIN_PX
    assert every.max() < 1.0


def test_a_picture_is_drawn_where_the_lens_draws_it() -> None:
    """The middle of a far disc, without blur and noise, is where its darkness weighs."""
    board = {"kind": "points", "points_mm": [[0.0, 0, 0], [400, 0, 0], [400, 300, 0], [0, 300, 0]]}
    T = before_camera(board, [0.0, 0.0, 0.0], [0.0, 0.0, 0.8])
    grey = render(CAMERA, board, T, exposure=Exposure(blur_px=0.0, noise=0.0, behind=220.0)).astype(float)
    for u, v in drawn(board, T):
        rows, columns = np.mgrid[int(v) - 130 : int(v) + 131, int(u) - 130 : int(u) + 131]
        inside = (rows >= 0) & (columns >= 0) & (rows < 960) & (columns < 1280)
        weight = (220 - grey[rows[inside], columns[inside]]) / 190
        found = np.array([np.sum(weight * columns[inside]), np.sum(weight * rows[inside])]) / weight.sum()
        # A disc seen straight on keeps its middle but for what the lens bends over its radius.
        assert np.linalg.norm(found - (u, v)) < 1.0


def test_an_asymmetric_grid_is_numbered_from_its_own_first_circle() -> None:
    board = BOARDS["asymmetric circles"]
    for turn in (0.0, 90.0, 180.0, 270.0):
        T = before_camera(board, [10.0, -15.0, turn], [0.0, 0.0, 0.6])
        seen = find_board(render(CAMERA, board, T), board)
        assert np.linalg.norm(seen.uv - drawn(board, T), axis=1).max() < 0.3, turn


def test_a_grid_of_the_other_kind_is_said() -> None:
    for kind, other in (("circles", {"asymmetric": True}), ("asymmetric circles", {"asymmetric": False})):
        board = BOARDS[kind]
        picture = render(CAMERA, board, before_camera(board, [5.0, -5.0, 0.0], [0.0, 0.0, 0.6]))
        why = find_board(picture, board | other).why
        assert ("but a symmetric one" if kind == "circles" else "but an asymmetric one (asymmetric: true)") in why


def test_circles_of_an_asymmetric_grid_are_where_opencv_and_kalibr_put_them(tmp_path: Path) -> None:
    at = 1e3 * board_corners(BOARDS["asymmetric circles"])
    assert at[:5] == pytest.approx(np.array([[0, 0, 0], [40, 0, 0], [80, 0, 0], [120, 0, 0], [20, 20, 0]]))
    (tmp_path / "target.yaml").write_text(
        "target_type: circlegrid\ntargetCols: 4\ntargetRows: 11\nspacingMeters: 0.02\nasymmetricGrid: True\n"
    )
    assert read_target(tmp_path / "target.yaml") == BOARDS["asymmetric circles"]


def test_a_checkerboard_that_has_two_ends_is_numbered_from_its_black_one() -> None:
    board = BOARDS["checkerboard"]  # 17 columns and rows: the first square is black, the last is white
    for turn in (0.0, 90.0, 180.0, 270.0):
        T = before_camera(board, [15.0, -10.0, turn], [0.0, 0.0, 0.6])
        seen = find_board(render(CAMERA, board, T), board)
        assert np.linalg.norm(seen.uv[0] - drawn(board, T)[0]) < 0.3, turn


@pytest.mark.parametrize(("kind", "white", "blur_px", "least"), [("charuco", 400, 2, 4), ("checkerboard", 500, 2, 0)])
def test_an_overexposed_board_is_said_where_little_of_it_is_found(
    kind: str, white: float, blur_px: float, least: int
) -> None:
    """Before a dark wall, so that the picture's mean is that of any other."""
    board = BOARDS[kind]
    T = before_camera(board, [10.0, -15.0, 5.0], [0.0, 0.0, 0.6])
    seen = find_board(render(CAMERA, board, T, exposure=Exposure(blur_px, black=60, white=white, behind=40)), board)
    assert least <= seen.count < len(seen.uv) / 2
    assert " % of the picture are overexposed" in (seen.doubt if least else seen.why)


def test_a_sharp_board_bears_overexposure() -> None:
    board = BOARDS["checkerboard"]
    T = before_camera(board, [10.0, -15.0, 5.0], [0.0, 0.0, 0.6])
    seen = find_board(render(CAMERA, board, T, exposure=Exposure(black=60, white=400, behind=40)), board)
    assert seen.why + seen.doubt == ""
    assert np.sqrt(np.mean(np.sum((seen.uv - drawn(board, T)) ** 2, axis=1))) < 0.1


@pytest.mark.parametrize("kind", BOARDS)
def test_a_picture_without_its_board_says_why(kind: str) -> None:
    grey = np.full((960, 1280), 110, np.uint8)
    seen = find_board(grey, BOARDS[kind])
    assert seen.count == 0
    assert "blurred or empty" in seen.why
    # Of another size: a ChArUco board of the same one is a checkerboard.
    other = BOARDS["charuco" if kind == "checkerboard" else "checkerboard"] | {"columns": 8}
    picture = render(CAMERA, other, before_camera(other, [0.0, 0.0, 0.0], [0.0, 0.0, 0.6]))
    assert find_board(picture, BOARDS[kind]).count == 0


def test_a_checkerboard_of_another_size_is_said_with_the_one_that_is_there() -> None:
    """The search for the size that is not there took 12 s a picture."""
    board = BOARDS["checkerboard"]
    picture = render(CAMERA, board, before_camera(board, [0.0, 0.0, 0.0], [0.0, 0.0, 0.6]))
    across, down = board["columns"] - 1, board["rows"] - 1
    seen = find_board(picture, board | {"columns": board["columns"] + 1})
    assert seen.count == 0
    there = {f"{across} x {down}", f"{down} x {across}"}
    assert seen.why.split("; ")[0].rpartition("one of ")[2].split(" inner")[0].strip() in there


def test_a_dark_picture_is_called_dark() -> None:
    assert "dark" in find_board(np.full((480, 640), 8, np.uint8), BOARDS["checkerboard"]).why
    assert "too bright" in find_board(np.full((480, 640), 250, np.uint8), BOARDS["checkerboard"]).why


def test_half_a_marked_board_is_found_by_the_half_that_is_there() -> None:
    board = BOARDS["charuco"]
    T = before_camera(board, [10.0, 0.0, 5.0], [0.22, 0.0, 0.5])
    true = drawn(board, T)
    seen = find_board(render(CAMERA, board, T), board)
    outside = (true[:, 0] > 1279) | (true[:, 1] < 0) | (true[:, 1] > 959)
    assert outside.any()
    assert 0 < seen.count < len(true)
    assert np.isnan(seen.uv[outside]).all()
    error = np.linalg.norm(seen.uv - true, axis=1)
    assert np.nanmax(error) < 0.5


@pytest.mark.parametrize("points", [POINTS, [*POINTS[:2], *POINTS[3:5], POINTS[6]]], ids=["eight", "five"])
def test_large_dots_are_found_where_a_lens_bends_their_outlines(points: list[list[int]]) -> None:
    """A large dot: its outline has its middle pixels from the dot's own, by more than a homography says."""
    board = {"kind": "points", "points_mm": [[float(x) for x in point] for point in points]}
    camera = CAMERA | {"distortion": [-0.25, 0.08, 2e-4, -1e-4, 0.0]}
    errors = []
    for k, turn in enumerate((20.0, 140.0, -100.0)):
        T = before_camera(board, [25.0 - 20.0 * k, -20.0, turn], [0.02, -0.01, 0.3])
        seen = find_board(render(camera, board, T, seed=k), board)
        assert seen.why == ""
        errors.append(misses(seen.uv, drawn(board, T, camera), turnable=False))
    assert float(np.sqrt(np.mean(np.concatenate(errors) ** 2))) < WITHIN_PX


@pytest.mark.parametrize(
    ("points", "ways"),
    [
        ([[0, 0, 0], [150, 10, 0], [140, 110, 0], [-5, 90, 0]], 8),  # a homography takes any four to any four
        ([[0, 0, 0], [100, 0, 0], [130, 60, 0], [50, 110, 0], [-30, 60, 0]], 2),  # a mirror image of itself
    ],
)
def test_points_in_a_symmetric_arrangement_are_not_guessed(points: list[list[float]], ways: int) -> None:
    board = {"kind": "points", "points_mm": [[float(x) for x in point] for point in points]}
    T = before_camera(board, [15.0, -10.0, 40.0], [0.0, 0.0, 0.5])
    seen = find_board(render(CAMERA, board, T), board)
    assert seen.count == 0
    assert f"in {ways} ways" in seen.why


def test_points_in_space_are_said_to_be_beyond_it() -> None:
    board = {"kind": "points", "points_mm": [[0.0, 0, 0], [50, 0, 0], [50, 50, 0], [0, 50, 0], [20, 20, 40]]}
    assert "do not lie in a plane" in find_board(np.full((480, 640), 110, np.uint8), board).why
    with pytest.raises(InvalidInput, match="same z"):
        render(CAMERA, board, np.eye(4))


def test_an_unknown_dictionary_lists_those_that_there_are() -> None:
    board = BOARDS["charuco"] | {"dictionary": "9X9_3"}
    with pytest.raises(InvalidInput, match="5X5_250"):
        find_board(np.zeros((480, 640), np.uint8), board)
    with pytest.raises(InvalidInput, match="needs a larger dictionary"):
        find_board(
            np.zeros((480, 640), np.uint8), BOARDS["charuco"] | {"columns": 20, "rows": 10, "dictionary": "5X5_50"}
        )


def test_without_opencv_one_sentence_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def refused(name: str, *rest: Any, **more: Any) -> Any:
        if name == "cv2":
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.delitem(sys.modules, "cv2")
    monkeypatch.setattr(builtins, "__import__", refused)
    with pytest.raises(InvalidInput, match=r"pip install 'fastcal\[camera\]'"):
        opencv()


def test_an_old_opencv_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "__version__", "4.6.0")
    with pytest.raises(InvalidInput, match=r"4\.8 or newer, got 4\.6\.0"):
        opencv()


def test_corners_that_were_not_found_do_not_say_which_square_is_black() -> None:
    """Of a blurred picture one corner was lost, and numpy's warning reached the terminal."""
    board = BOARDS["checkerboard"]
    T = before_camera(board, [0.0, 0.0, 0.0], [0.0, 0.0, 0.6])
    grey, true = render(CAMERA, board, T), drawn(board, T)
    grid = true.reshape(board["rows"] - 1, board["columns"] - 1, 2)
    lost = grid.copy()
    lost[0, 1] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert _black_first(grey, lost) == pytest.approx(_black_first(grey, grid), rel=0.1)
        assert _black_first(grey, np.full_like(grid, np.nan)) == 0.0


@pytest.mark.parametrize("change", ["exchanged", "inner corners", "few markers", "mirrored", "none of these"])
def test_a_board_with_markers_that_is_not_found_is_said_with_what_is_there(tmp_path: Path, change: str) -> None:
    """Forty markers were seen, and not said that they are those of a board of another size, or mirrored."""
    board = BOARDS["charuco"]
    if change == "few markers":  # a dictionary that is too small for a board with a column and a row more
        board = board | {"columns": 10, "rows": 9, "dictionary": "4X4_50"}
    columns, rows = int(board["columns"]), int(board["rows"])
    grey = render(CAMERA, board, before_camera(board, [5.0, 0.0, 0.0], [0.0, 0.0, 0.6]))
    file = {
        "few markers": board | {"columns": rows, "rows": columns},
        "exchanged": board | {"columns": rows, "rows": columns},
        "inner corners": board | {"columns": columns - 1, "rows": rows - 1},
        "mirrored": board,
        "none of these": board | {"dictionary": "4X4_250"},
    }[change]
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), grey[:, ::-1] if change == "mirrored" else grey)
    says = other_size([path], {"plate": file})
    if change == "none of these":
        assert says == ""
    elif change == "mirrored":
        assert says.startswith("a.png is mirrored, left for right")
    else:
        assert says.endswith(f"for board plate write columns: {columns}, rows: {rows}")
