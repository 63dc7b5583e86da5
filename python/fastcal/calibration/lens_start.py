# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Initial estimate of a camera's intrinsics from pictures of flat boards alone.

Of a row of focal lengths that is taken with which the boards' poses leave the least; Levenberg's and Marquardt's steps
then find focal lengths, centre, distortion and poses together. A picture's own six columns are eliminated from the
normal equations first: with J = [A_i B_i] of a picture's lens and pose, sum A_i' (I - B_i B_i^+) A_i is what shows the
lens. Boards that face the camera show no focal length: centre, distortion and the ratio of the focal lengths are then
held near what lenses have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.board_poses import board_poses, moved
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import Seeing, board_corners, lens_numbers, pictures
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]
Spec = dict[str, Any]

_FOCAL = (0.5, 0.65, 0.8, 1.0, 1.25, 1.6, 2.0, 2.6, 3.5)  # times the longer side of the picture: 90 to 16 degrees
_MOST = 30  # pictures
_TRIED = 8  # of them, for the first focal length
_BETTER = 1.2  # times better: what the file has is no start
_STEPS, _GAIN = 40, 1e-6
_CENTRE, _RATIO, _BEND = 0.1, 0.05, (0.5, 0.5, 0.01, 0.01, 0.5, 0.5, 0.5, 0.5)  # of sizes: what lenses have
_GROSS = 4.0  # times the median of what is left: a picture that was misread


@dataclass(frozen=True, eq=False)
class Lens:
    """A camera with the lens that was found, and what its pictures leave [px], before and now."""

    camera: Spec
    before: float
    after: float


def with_started_lenses(robot: Robot, data: Dataset) -> tuple[Robot, list[str]]:
    """The arm with such lenses, and a sentence of each."""
    lenses, notes = started_lenses(robot.description, data.observed)
    return (robot.with_(cameras={**robot.description.cameras, **lenses}) if lenses else robot), notes


def started_lenses(rig: Seeing, tables: Mapping[str, FloatArray]) -> tuple[dict[str, Spec], list[str]]:
    """The cameras whose lens is to be identified and was given far off, with a better one, and a sentence of each.

    Args:
        rig: With the cameras and boards.
        tables: CORNERS (N, 2 K) [px].
    """
    out: dict[str, Spec] = {}
    notes: list[str] = []
    if CORNERS not in tables:
        return out, notes
    for name, camera in rig.cameras.items():
        if camera["intrinsics"] != "identify":
            continue
        found = _lens(name, rig, tables[CORNERS])
        if found is None or found.before < _BETTER * found.after:
            continue
        out[name] = found.camera
        focal = ", ".join(f"{f:.0f}" for f in found.camera["focal_px"])
        notes.append(
            f"camera {name}: the fit starts from the lens that the boards in its pictures show, with focal lengths "
            f"{focal} px ({found.after:.2g} px are left of it, {found.before:.2g} with that of the file)"
        )
    return out, notes


def _views(name: str, rig: Seeing, corners: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Points (K, 3) in sizes of their board and where they are seen (K, 2) [px], of the pictures with most corners."""
    out = []
    uv = corners.reshape(len(corners), -1, 2)
    for (camera, board), part in pictures(rig).items():
        points = board_corners(rig.boards[board])
        if camera != name or np.ptp(points[:, 2]) > 0:
            continue
        for seen in uv[:, part]:
            known = np.isfinite(seen).all(axis=1)
            out.append((points[known] / float(np.ptp(points)), seen[known]))
    out.sort(key=lambda view: -len(view[0]))
    return [view for view in out if len(view[0])][:_MOST]


def _lens(name: str, rig: Seeing, corners: FloatArray) -> Lens | None:
    camera = dict(rig.cameras[name])
    views = _views(name, rig, corners)
    placed = _placed(camera, views)
    if len(placed) < 3:
        return None
    before = _left(camera, placed)
    side = float(max(camera["size_px"]))
    starts = [camera, *(_with(camera, f * side) for f in _FOCAL)]
    some = views[:_TRIED]
    best = min(starts, key=lambda of: _left(of, _placed(of, some)))
    placed = _placed(best, views)
    own = np.array([_rms(best, *of) for of in placed])
    kept = [of for of, left in zip(placed, own, strict=True) if left <= _GROSS * np.median(own)]
    found = _refined(best, kept, side)
    return Lens(found, before, _left(found, _placed(found, views)))


def _with(camera: Spec, focal: float) -> Spec:
    """The camera with that focal length, its centre in the middle, and no distortion."""
    middle = [(side - 1) / 2 for side in camera["size_px"]]
    return {**camera, "focal_px": [focal] * 2, "centre_px": middle, "distortion": [0.0] * len(camera["distortion"])}


Placed = tuple[FloatArray, FloatArray, FloatArray]  # points, seen, pose


def _placed(camera: Spec, views: Sequence[tuple[FloatArray, FloatArray]]) -> list[Placed]:
    """The views whose board has a pose, with it."""
    out = []
    for points, seen in views:
        flat = {"kind": "points", "points_mm": from_si(points, "mm").tolist()}
        rows, T = board_poses(camera, flat, seen.reshape(1, -1), slice(0, len(points)))
        if len(rows):
            out.append((points, seen, T[0]))
    return out


def _drawn(camera: Spec, lens: FloatArray, points: FloatArray, T: FloatArray) -> FloatArray:
    p = points @ T[:3, :3].T + T[:3, 3]
    return np.asarray(_core.draw(camera["model"], lens.tolist(), np.ascontiguousarray(p)))


def _rms(camera: Spec, points: FloatArray, seen: FloatArray, T: FloatArray) -> float:
    r = _drawn(camera, np.array(lens_numbers(camera)), points, T) - seen
    return float(np.sqrt(np.mean(np.sum(r**2, axis=1))))


def _left(camera: Spec, placed: Sequence[Placed]) -> float:
    """What a picture leaves in the median [px]."""
    return float(np.median([_rms(camera, *of) for of in placed])) if placed else np.inf


def _refined(camera: Spec, placed: Sequence[Placed], side: float) -> Spec:
    """The camera with the lens that leaves the least."""
    lens = np.array(lens_numbers(camera))
    poses = [T for _, _, T in placed]
    count = len(lens) - 4
    # Each held number: its value, where it is likely, and how far off.
    likely = np.array([(of - 1) / 2 for of in camera["size_px"]] + [0.0] * count)
    width = np.array([_CENTRE * side] * 2 + list(_BEND[:count]))
    scale = np.array([side] * 4 + [1.0] * count)

    def held(x: FloatArray) -> FloatArray:
        return np.append((x[2:] - likely) / width, (x[0] - x[1]) / (_RATIO * side))

    H0 = np.zeros((len(lens) - 1, len(lens)))
    H0[:-1, 2:] = np.diag(scale[2:] / width)
    H0[-1, :2] = scale[:2] / (_RATIO * side) * [1, -1]
    cost, damping = _cost(camera, lens, placed, poses) + float(held(lens) @ held(lens)), 1e-3
    for _ in range(_STEPS):
        parts = [_columns(camera, lens, scale, view, T) for view, T in zip(placed, poses, strict=True)]
        N, g = H0.T @ H0, H0.T @ held(lens)
        for A, B, r in parts:
            Q = np.linalg.qr(B)[0]
            left = A - Q @ (Q.T @ A)
            N += left.T @ left
            g += left.T @ r
        by = -np.linalg.solve(N + damping * np.diag(np.diag(N)), g)
        tried = lens + scale * by
        moves = [np.linalg.lstsq(B, -r - A @ by, rcond=None)[0] for A, B, r in parts]
        there = [moved(T, np.asarray(move, dtype=np.float64)) for T, move in zip(poses, moves, strict=True)]
        now = _cost(camera, tried, placed, there) + float(held(tried) @ held(tried))
        if not now < cost:
            damping *= 10
            if damping > 1e6:
                break
            continue
        is_done = now > (1 - _GAIN) * cost
        lens, poses, cost, damping = tried, there, now, damping / 10
        if is_done:
            break
    numbers = lens.tolist()
    return {**camera, "focal_px": numbers[:2], "centre_px": numbers[2:4], "distortion": numbers[4:]}


def _cost(camera: Spec, lens: FloatArray, placed: Sequence[Placed], poses: Sequence[FloatArray]) -> float:
    drawn = zip(placed, poses, strict=True)
    total = sum(float(np.sum((_drawn(camera, lens, points, T) - seen) ** 2)) for (points, seen, _), T in drawn)
    return total if np.isfinite(total) else np.inf


def _columns(
    camera: Spec, lens: FloatArray, scale: FloatArray, view: Placed, T: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A (2 K, L) of the lens in `scale`, B (2 K, 6) of the pose, and the misfit r (2 K,), by differences."""
    points, seen, _ = view
    step = 1e-6
    at = _drawn(camera, lens, points, T)
    A = [(_drawn(camera, lens + step * e, points, T) - at).ravel() for e in np.diag(scale)]
    B = [(_drawn(camera, lens, points, moved(T, step * e)) - at).ravel() for e in np.eye(6)]
    return np.column_stack(A) / step, np.column_stack(B) / step, (at - seen).ravel()
