# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cameras and boards of an arm or a cell, as its spec has them, for the core: frames, corners, lenses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.place import place_of
from fastcal.robot.core_model import pose
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot_spec import Spec, frame_spec
from fastcal.robot.se3 import pose_of_six
from fastcal.units import from_si, to_si

Entries = Mapping[str, Spec] | None

SQUARES = ("checkerboard", "charuco")  # whose columns and rows are squares
WORLD = -1  # the measuring frame, among the frames of the chain
PLACEMENT = ("x", "y", "z", "rx", "ry", "rz")
BEND = ("along_mm", "twist_mm", "across_mm")  # heights of a bent board: z = a x^2 + b x y + c y^2
_LENGTHS = frozenset({"square_mm", "marker_mm", "tag_mm", "gap_mm"})  # of a board
_TURN = 1e-6  # [rad] of a difference
_TAG = ((0, 0), (1, 0), (1, 1), (0, 1))  # corners of a tag, as Kalibr counts them


class Seeing(Protocol):
    """What has cameras and boards: a robot's spec, or a cell."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    @property
    def cameras(self) -> Mapping[str, Spec]:
        """By their names."""
        ...

    @property
    def boards(self) -> Mapping[str, Spec]:
        """By their names."""
        ...


def has_rig(spec: Seeing) -> bool:
    """Are there a camera and a board?"""
    return bool(spec.cameras) and bool(spec.boards)


def board_corners(board: Mapping[str, Any]) -> FloatArray:
    """(K, 3) corners of a board in its frame [m], in the order of their numbers.

    Inner corners, or circles, row by row from the first, with x along a row; of an AprilGrid the four corners of each
    tag, tag by tag, as Kalibr counts them. Circles of an asymmetric grid are at ((2 i + j mod 2) s, j s), as OpenCV and
    Kalibr have them: column i, row j, s = `square_mm`.
    """
    if board["kind"] == "points":
        points: FloatArray = np.asarray(board["points_mm"], dtype=np.float64)
        return to_si(points, "mm")
    return _bent(_flat_corners(board), board.get("bend_mm"))


def _flat_corners(board: Mapping[str, Any]) -> FloatArray:
    squares = int(board["kind"] in SQUARES)  # corners lie between them
    across, down = np.meshgrid(np.arange(board["columns"] - squares), np.arange(board["rows"] - squares))
    at: FloatArray = np.column_stack([across.ravel(), down.ravel(), np.zeros(across.size)]).astype(np.float64)
    if board["kind"] == "april_grid":
        tag, step = float(board["tag_mm"]), float(board["tag_mm"] + board["gap_mm"])
        own: FloatArray = np.array([[x * tag, y * tag, 0.0] for x, y in _TAG])
        corners: FloatArray = (at[:, np.newaxis] * step + own).reshape(-1, 3)
        return to_si(corners, "mm")
    if board.get("asymmetric"):
        at[:, 0] = 2 * at[:, 0] + at[:, 1] % 2
    return to_si(at * float(board["square_mm"]), "mm")


def _bent(at: FloatArray, bend_mm: Sequence[float] | None) -> FloatArray:
    """Corners (K, 3) of a flat board [m] with z = a x^2 + b x y + c y^2, x and y from -1 to 1 over its corners."""
    if bend_mm is None:
        return at
    low, high = at[:, :2].min(axis=0), at[:, :2].max(axis=0)
    x, y = ((2 * at[:, :2] - low - high) / np.where(high > low, high - low, 1.0)).T
    height = np.column_stack([x**2, x * y, y**2]) @ np.asarray(bend_mm, dtype=np.float64)
    return np.column_stack([at[:, :2], to_si(height, "mm")])


def corner_counts(spec: Seeing) -> list[int]:
    """Corners of each board, in the order of the spec."""
    return [len(board_corners(board)) for board in spec.boards.values()]


def pictures(spec: Seeing) -> dict[tuple[str, str], slice]:
    """Where the corners of each camera and board are among the readings of a row."""
    out, first = {}, 0
    for camera in spec.cameras:
        for board, count in zip(spec.boards, corner_counts(spec), strict=True):
            out[camera, board] = slice(first, first + count)
            first += count
    return out


def frame_of(on: str, joint_count: int) -> int:
    """The frame of the chain that a name means: WORLD, 0 the base, 2 k that of link k."""
    if on == "world":
        return WORLD
    part = on.partition(".")[2]
    return 2 * joint_count if not part else 0 if part == "base" else 2 * place_of(part).number


def core_rig(spec: Seeing, frame_number: Callable[[str], int]) -> _core.Rig:
    """The rig of a spec as the core takes it; empty where it has none.

    `frame_number`: of a frame of the chain or tree, by what `on` calls it.
    """
    rig = _core.Rig()
    if not has_rig(spec):
        return rig
    for name, camera in spec.cameras.items():
        rig.add_camera(
            name,
            frame_number(camera["on"]),
            pose(camera),
            camera.get("fixed", False),
            camera["model"],
            lens_numbers(camera),
            camera["intrinsics"] == "identify",
        )
    for name, board in spec.boards.items():
        corners = board_corners(board)
        rig.add_board(name, frame_number(board["on"]), pose(board), board.get("fixed", False), corners)
    return rig


def lens_numbers(camera: Mapping[str, Any]) -> list[float]:
    """fx, fy, cx, cy and the coefficients of a camera."""
    return [*camera["focal_px"], *camera["centre_px"], *camera["distortion"]]


def sized(board: Mapping[str, Any], times: float) -> dict[str, Any]:
    """The board with its lengths so many times as large."""
    out = {key: of * times if key in _LENGTHS else of for key, of in board.items()}
    if "points_mm" in board:
        out["points_mm"] = (np.asarray(board["points_mm"], dtype=np.float64) * times).tolist()
    return out


def known_within(spec: Seeing, parameters: Sequence[_core.Parameter]) -> FloatArray:
    """Standard deviation [SI] of what the spec says of each unknown; infinite where it says nothing."""
    out = np.full(len(parameters), np.inf)
    for k, parameter in enumerate(parameters):
        entry = _entry(spec.cameras, spec.boards, parameter.owner)
        unit = "mm" if parameter.unit == "m" else "deg"
        if entry is not None and parameter.name in PLACEMENT and f"sigma_{unit}" in entry:
            out[k] = to_si(float(entry[f"sigma_{unit}"]), unit)
    return out


def about_found(parameters: Sequence[_core.Parameter], values: FloatArray) -> FloatArray:
    """(U, U) by which small errors of the unknowns, found as `values` (U,), are changes of the places found.

    A place T exp is T (exp(r), p); what p is off lies in the turned axes, and a turn that is off by dr turns by the
    right Jacobian of exp: R^T dp and log(exp(r)^T exp(r + dr)).
    """
    out = np.eye(len(parameters))
    places: dict[str, dict[str, int]] = {}
    for k, parameter in enumerate(parameters):
        places.setdefault(parameter.owner, {})[parameter.name] = k
    for at in places.values():
        if not set(PLACEMENT) <= at.keys():
            continue
        shift, turn = ([at[axis] for axis in part] for part in (PLACEMENT[:3], PLACEMENT[3:]))
        out[np.ix_(shift, shift)] = np.asarray(_core.exp_so3(values[turn])).T
        out[np.ix_(turn, turn)] = _about_turn(values[turn])
    return out


def _about_turn(r: FloatArray) -> FloatArray:
    """(3, 3) by which a small error of a turn exp(r) is one about it: log(exp(r)^T exp(r + dr)) over dr."""
    R = np.asarray(_core.exp_so3(r))
    ends = [
        [np.asarray(_core.log_so3(R.T @ _core.exp_so3(r + k * step))) for k in (1, -1)] for step in _TURN * np.eye(3)
    ]
    return np.column_stack([(there - back) / (2 * _TURN) for there, back in ends])


def with_found(spec: Spec, parameters: Sequence[_core.Parameter], values: FloatArray, std: FloatArray) -> Spec:
    """The spec with cameras and boards where they were found, and lenses as they were.

    Args:
        spec: With the cameras and boards that the fit started from; it is not changed.
        parameters: Unknowns of the observations.
        values: What was found of them, SI.
        std: Their standard deviations, NaN where they were held.
    """
    out = plain_copy(spec)
    found: dict[str, dict[str, tuple[float, float]]] = {}
    for parameter, value, deviation in zip(parameters, values.tolist(), std.tolist(), strict=True):
        found.setdefault(parameter.owner, {})[parameter.name] = (value, deviation)
    for owner, numbers in found.items():
        entry = _entry(out.get("cameras"), out.get("boards"), owner)
        if entry is None:
            continue
        identified: Spec = {}
        if "x" in numbers:
            T = pose(entry) @ pose_of_six(np.array([numbers[axis][0] for axis in PLACEMENT]))
            entry.update(frame_spec(T))
            identified["std_mm"] = _known([from_si(numbers[axis][1], "mm") for axis in PLACEMENT[:3]])
            identified["std_deg"] = _known([from_si(numbers[axis][1], "deg") for axis in PLACEMENT[3:]])
        if "fx" in numbers:
            lens = [name for name in numbers if name not in PLACEMENT]
            changed = [a + numbers[name][0] for a, name in zip(lens_numbers(entry), lens, strict=True)]
            entry["focal_px"], entry["centre_px"], entry["distortion"] = changed[:2], changed[2:4], changed[4:]
            identified["std_intrinsics"] = _known([numbers[name][1] for name in lens])
        entry["identified"] = identified
    return out


def _known(deviations: list[float]) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in deviations]


def _entry(cameras: Entries, boards: Entries, owner: str) -> Spec | None:
    """The camera or board that an unknown's owner names: "camera wrist"."""
    what, _, name = owner.partition(" ")
    return ({"camera": cameras, "board": boards}.get(what) or {}).get(name)
