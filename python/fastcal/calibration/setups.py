# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Several set-ups of the instrument and of the target: where each station and each mount stands, in closed form.

Points p_i = B_s (f_i + R_i t_m) of the arm's flange poses (R_i, f_i), with a base pose B_s for each station and a tool
point t_m for each mount. In turns: B_s by W. Kabsch, "A solution for the best rotation to relate two sets of vectors"
(1976), over the rows of a station; t_m by linear least squares over those of a mount, without what all B_s may move.
The first station and mount are base and tool, the others parameters of `station_offset` and `tool_shift`:
exp(log(B_1^-1 B_s)) and R_tool^T (t_m - t_1).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.effects.entries import parse_effects
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import best_motion
from fastcal.robot import se3
from fastcal.robot.core_model import pose
from fastcal.robot.identified_spec import with_frames
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot import Robot, Spec
from fastcal.said import said
from fastcal.units import from_si

FAR = 3.0  # times the error of set-ups of their own: where one base and tool for all leave that, they are not one
_FEWEST = 5  # points of a set-up that stands by itself
_GROSS = 3.0  # times the median
_ROUNDS = 30
_PATIENCE = 1e-9  # [m] change of the error that is none
_AXES = ("x", "y", "z")


def with_setups(spec: Spec, data: Dataset) -> Spec:
    """The spec with a start for each station and mount, base and tool of the first among it.

    Effects that are asked for get their values. Where labels differ by so much that one base and tool can't serve all,
    the effects are added. Without labels, or with too few points of one, the spec is returned.
    """
    given = {entry["effect"]: entry for entry in spec.get("effects") or []}
    stations, mounts = (_codes(given, *names) for names in _columns(data))
    if data.position is None or (stations is None and mounts is None):
        return spec
    bare = Robot({**spec, "effects": [], "correction": None, "calibration": None})
    whole = np.isfinite(data.position).all(axis=1)
    rows = np.flatnonzero(whole)
    code = {"station_offset": _of(stations, rows), "tool_shift": _of(mounts, rows)}
    if any(np.bincount(c).min() < _FEWEST for c in code.values()):
        return spec
    frames = _flange(bare, data.q[rows])
    p = data.position[rows]
    tool = pose(spec["tool"])
    bases, tools, apart = _fit(frames, p, code["station_offset"], code["tool_shift"], tool[:3, 3])

    def are_one(effects: set[str]) -> bool:
        """Does one base, or one tool, serve all labels of these effects, the others' set-ups apart?"""
        one = {name: np.zeros_like(numbers) if name in effects else numbers for name, numbers in code.items()}
        return bool(_fit(frames, p, one["station_offset"], one["tool_shift"], tool[:3, 3])[2] <= FAR * apart)

    open_ = {name for name in code if name not in given}
    # Either may do where stations and mounts changed together: then both are added.
    needed = set() if are_one(open_) else {name for name in open_ if not are_one({name})} or open_
    out = plain_copy(spec)
    start = se3.pose(tool[:3, :3], tools[0])
    out = with_frames(out, bases[0], start) if needed or set(given) & set(code) else out
    for effect, labels, values in (
        ("station_offset", stations, _offsets(bases)),
        ("tool_shift", mounts, _shifts(tools, tool[:3, :3])),
    ):
        if labels is None or (effect not in given and effect not in needed):
            continue
        option, names = labels[1], labels[2]
        entry = next((e for e in out["effects"] if e["effect"] == effect), None) if effect in given else None
        if entry is None:
            owner = "base" if effect == "station_offset" else "tool"
            entry = {"effect": effect, "owner": owner, option: list(names)}
            out["effects"] = [*(out.get("effects") or []), entry]
        if not entry.get("parameters"):
            entry["parameters"] = {name: {"value": value, "std": None} for name, value in values.items()}
    return out


def added_setups(start: Robot, robot: Robot, effects: str | Sequence[str]) -> list[str]:
    """A sentence for each effect that `with_setups` added to what was asked for."""
    there = robot.entries
    asked = {entry["effect"] for entry in [*there, *parse_effects(effects, robot.core, there)[1]]}
    out: list[str] = []
    for entry in start.entries:
        if entry["effect"] in ("station_offset", "tool_shift") and entry["effect"] not in asked:
            is_station = entry["effect"] == "station_offset"
            listed = ", ".join(entry["stations" if is_station else "mounts"])
            of = (
                said("stations {listed}: each has a base of its own", listed=listed)
                if is_station
                else said("mounts {listed}: each has a tool point of its own", listed=listed)
            )
            out.append(said("{of} ({effect}), as one does not fit all rows", of=of, effect=entry["effect"]))
    return out


def _columns(data: Dataset) -> list[tuple[str, str, IntArray | None, tuple[str, ...]]]:
    return [
        ("station_offset", "stations", data.station, data.station_names),
        ("tool_shift", "mounts", data.mount, data.mount_names),
    ]


def _codes(
    given: dict[str, Any], effect: str, option: str, codes: IntArray | None, names: tuple[str, ...]
) -> tuple[IntArray, str, list[str]] | None:
    """Numbers of the labels in the order of the effect's own list, the option and the list; None: one label or none."""
    if codes is None or len(np.unique(codes)) < 2:
        return None
    present = [names[i] for i in dict.fromkeys(codes.tolist())]
    listed = [str(name) for name in given.get(effect, {}).get(option, present)]
    if not set(present) <= set(listed):
        return None  # another sentence says so
    place = np.array([listed.index(name) if name in listed else 0 for name in names])
    return np.asarray(place[codes], dtype=np.int64), option, listed


def _of(labels: tuple[IntArray, str, list[str]] | None, rows: IntArray) -> IntArray:
    return np.zeros(len(rows), dtype=np.int64) if labels is None else labels[0][rows]


def _flange(bare: Robot, q: FloatArray) -> FloatArray:
    """(N, 4, 4) of the flange in the base."""
    T = bare.forward(q)
    return np.asarray(np.linalg.inv(bare.T_world_base) @ T @ np.linalg.inv(bare.T_flange_tool))


def _fit(
    frames: FloatArray, p: FloatArray, station: IntArray, mount: IntArray, tool: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Bases (S, 4, 4), tool points (M, 3) and the median error that they leave [m]."""
    tools = np.tile(tool, (int(mount.max()) + 1, 1))
    bases = np.tile(np.eye(4), (int(station.max()) + 1, 1, 1))
    before, sound = np.inf, np.ones(len(p), dtype=bool)
    for _ in range(_ROUNDS):
        at = frames[:, :3, 3] + np.einsum("nij,nj->ni", frames[:, :3, :3], tools[mount])
        for s in range(len(bases)):
            bases[s] = _agreeing_pose(at[station == s], p[station == s])
        left = p - np.einsum("nij,nj->ni", bases[station, :3, :3], at) - bases[station, :3, 3]
        length = np.linalg.norm(left, axis=1)
        # Gross points would turn a base, and with it what all others say of the tool.
        sound = length <= _GROSS * max(float(np.median(length)), _PATIENCE)
        tools = _tools(frames[sound], p[sound], bases[station[sound], :3, :3], station[sound], mount[sound], tools)
        error = float(np.median(length))
        if abs(before - error) < _PATIENCE:
            break
        before = error
    return bases, tools, error


def _agreeing_pose(a: FloatArray, b: FloatArray) -> FloatArray:
    """The pose (4, 4) that takes points a (N, 3) to b, but for points that are far off the others' (trimmed Kabsch)."""
    used = np.ones(len(a), dtype=bool)
    T = best_motion(a, b)
    for _ in range(_ROUNDS):
        length = np.linalg.norm(b - a @ T[:3, :3].T - T[:3, 3], axis=1)
        limit = max(_GROSS * float(np.median(length)), float(np.sort(length)[min(_FEWEST, len(length)) - 1]), _PATIENCE)
        again = length <= limit
        if (again == used).all():
            break
        used = again
        T = best_motion(a[used], b[used])
    return T


def _tools(
    frames: FloatArray, p: FloatArray, R_base: FloatArray, station: IntArray, mount: IntArray, near: FloatArray
) -> FloatArray:
    """Tool points (M, 3) for known base rotations (N, 3, 3), each station's place free; near where nothing shows."""
    turned = np.einsum("nij,njk->nik", R_base, frames[:, :3, :3])
    left = p - np.einsum("nij,nj->ni", R_base, frames[:, :3, 3]) - np.einsum("nij,nj->ni", turned, near[mount])
    count = len(near)
    A = np.zeros((len(p), 3, 3 * count))
    for m in range(count):
        A[mount == m, :, 3 * m : 3 * m + 3] = turned[mount == m]
    for s in range(int(station.max()) + 1):
        own = station == s
        A[own] -= A[own].mean(axis=0)
        left[own] -= left[own].mean(axis=0)
    J = A.reshape(-1, 3 * count)
    H = J.T @ J + 1e-5 * len(p) * np.eye(3 * count)
    return np.asarray(near + np.linalg.solve(H, J.T @ left.ravel()).reshape(count, 3))


def _offsets(bases: FloatArray) -> dict[str, float]:
    """Parameters of station_offset, edge units: the twist from the first base, along the measuring frame's axes."""
    out: dict[str, float] = {}
    R = bases[0][:3, :3]
    for s, B in enumerate(bases[1:], start=2):
        v, w = _log(np.linalg.inv(bases[0]) @ B)
        for axis, name in enumerate(_AXES):
            out[f"station{s}_{name}_mm"] = from_si(float((R @ v)[axis]), "mm")
        for axis, name in enumerate(_AXES):
            out[f"station{s}_r{name}_rad"] = float((R @ w)[axis])
    return out


def _shifts(tools: FloatArray, R_tool: FloatArray) -> dict[str, float]:
    """Parameters of tool_shift, edge units."""
    return {
        f"mount{m}_{name}_mm": from_si(float((R_tool.T @ (t - tools[0]))[axis]), "mm")
        for m, t in enumerate(tools[1:], start=2)
        for axis, name in enumerate(_AXES)
    }


def _log(T: FloatArray) -> tuple[FloatArray, FloatArray]:
    """V and w with exp([v; w]) = T: w by the core, v = V(w)^-1 p."""
    w = np.asarray(_core.log_so3(np.ascontiguousarray(T[:3, :3])))
    angle = float(np.linalg.norm(w))
    K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    bend = 1 / 12 if angle < 1e-4 else (1 - angle * np.sin(angle) / (2 * (1 - np.cos(angle)))) / angle**2
    return np.asarray((np.eye(3) - K / 2 + bend * K @ K) @ T[:3, 3]), w
