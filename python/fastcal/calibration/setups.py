# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Several set-ups of the instrument and of the target: where each station and each mount stands, in closed form.

Points p_i = B_s (f_i + R_i t_m) of the arm's flange poses (R_i, f_i), with a base pose B_s for each station and a tool
point t_m for each mount. In turns: B_s by W. Kabsch, "A solution for the best rotation to relate two sets of vectors"
(1976), over the rows of a station; t_m by linear least squares over those of a mount, without what all B_s may move.
The first station and mount are base and tool, the others parameters of `station_offset` and `tool_shift`:
exp(log(B_1^-1 B_s)) and R_tool^T (t_m - t_1).

A target whose orientation M_i is measured may turn from mount to mount as well: X_m, with R_m the rotation nearest to
the sum of (R_s R_i)^T M_i over its rows, and `tool_shift` of a pose, exp(log(X_1^-1 X_m)). Its tool points begin at
those of a rigid fit of each mount's rows (`alignment.align`): R_m may be any.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.calibration.alignment import align
from fastcal.effects.entries import parse_effects
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import best_motion, nearest_rotation, rotations
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
_MOST = 0.5  # of a label's rows
_ROUNDS = 30
_PATIENCE = 1e-9  # [m] change of the error that is none
_AXES = ("x", "y", "z")


def with_setups(spec: Spec, data: Dataset, moved: Collection[str] = ()) -> Spec:
    """The spec with a start for each station and mount, base and tool of the first among it.

    Effects that are asked for get their values. Where labels differ by so much that one base and tool can't serve all,
    the effects are added, and those `moved`. Without labels, or with too few points of all but one, the spec is
    returned; a label of too few points starts as the first.
    """
    given = {entry["effect"]: entry for entry in spec.get("effects") or []}
    stations, mounts = (_codes(given, *names) for names in _columns(data))
    if data.position is None or (stations is None and mounts is None):
        return spec
    bare = Robot({**spec, "effects": [], "correction": None, "calibration": None})
    rows = _of_enough_rows(np.flatnonzero(np.isfinite(data.position).all(axis=1)), stations, mounts)
    code = {"station_offset": _of(stations, rows), "tool_shift": _of(mounts, rows)}
    if len(rows) == 0 or all(len(np.unique(c)) < 2 for c in code.values()):
        return spec
    frames = _flange(bare, data.q[rows])
    p = data.position[rows]
    tool = pose(spec["tool"])
    near = _tool_points(bare, data, rows, *code.values())
    bases, tools, left = _fit(frames, p, code["station_offset"], code["tool_shift"], near)
    setup = np.unique(np.column_stack(list(code.values())), axis=0, return_inverse=True)[1].ravel()
    apart = np.maximum(_medians(left, setup), np.median(left))
    R_base = bases[code["station_offset"], :3, :3]
    least = 0.0 if "tool_shift" in moved else FAR
    turns = _turns(frames, data, rows, R_base, code["tool_shift"], least) if _may_turn(given) else None
    if turns is not None:
        tool[:3, :3] = turns[0]

    def are_one(effects: set[str]) -> bool:
        """Does one base, or one tool, serve all labels of these effects, the others' set-ups apart?"""
        if turns is not None and "tool_shift" in effects:
            return False
        one = {name: np.zeros_like(numbers) if name in effects else numbers for name, numbers in code.items()}
        start = near[:1] if "tool_shift" in effects else near
        left = _fit(frames, p, one["station_offset"], one["tool_shift"], start)[2]
        return bool(np.all(_medians(left, setup) <= FAR * apart))

    needed = _needed({name for name in code if name not in given}, are_one, moved)
    out = plain_copy(spec)
    start = se3.pose(tool[:3, :3], tools[0])
    out = with_frames(out, bases[0], start) if needed or set(given) & set(code) else out
    for effect, labels, values in (
        ("station_offset", stations, _offsets(bases)),
        ("tool_shift", mounts, _shifts(tools, turns, tool[:3, :3])),
    ):
        if labels is None or (effect not in given and effect not in needed):
            continue
        option, names = labels[1], labels[2]
        entry = next((e for e in out["effects"] if e["effect"] == effect), None) if effect in given else None
        if entry is None:
            owner = "base" if effect == "station_offset" else "tool"
            entry = {"effect": effect, "owner": owner, option: list(names)}
            entry |= {"target": "pose"} if turns is not None and effect == "tool_shift" else {}
            out["effects"] = [*(out.get("effects") or []), entry]
        if not entry.get("parameters"):
            entry["parameters"] = {name: {"value": value, "std": None} for name, value in values.items()}
    return out


def _may_turn(given: dict[str, Any]) -> bool:
    """Is tool_shift not asked for, or of a pose?"""
    return "tool_shift" not in given or given["tool_shift"].get("target") == "pose"


def _needed(open_: set[str], are_one: Callable[[set[str]], bool], moved: Collection[str]) -> set[str]:
    """The effects that are added; either may do where stations and mounts changed together, and then both are."""
    needed = set() if are_one(open_) else {name for name in open_ if not are_one({name})} or open_
    return needed | (open_ & set(moved))


def thrown_out(robot: Robot, data: Dataset, outliers: Sequence[int]) -> set[str]:
    """The effects of labels, none of a robot's own, that a fit leaves out most rows of one and not of another.

    A robust loss takes the rows of a mount that sits elsewhere by a millimetre or two for gross errors.
    """
    out = set()
    for effect, _, codes, _ in _columns(data):
        if codes is None or any(entry["effect"] == effect for entry in robot.entries):
            continue
        count = np.bincount(codes)
        share = np.bincount(codes[list(outliers)], minlength=len(count)) / np.maximum(count, 1)
        if np.any(share[count >= _FEWEST] > _MOST) and np.any(share[count >= _FEWEST] <= _MOST):
            out.add(effect)
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
                else said("mounts {listed}: each has a tool of its own, turned as well", listed=listed)
                if entry.get("target") == "pose"
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


def _of_enough_rows(rows: IntArray, *labels: tuple[IntArray, str, list[str]] | None) -> IntArray:
    """Those of the rows whose labels have _FEWEST of them."""
    for each in labels:
        codes = _of(each, rows)
        rows = rows[np.bincount(codes)[codes] >= _FEWEST]
    return rows


def _of(labels: tuple[IntArray, str, list[str]] | None, rows: IntArray) -> IntArray:
    return np.zeros(len(rows), dtype=np.int64) if labels is None else labels[0][rows]


def _flange(bare: Robot, q: FloatArray) -> FloatArray:
    """(N, 4, 4) of the flange in the base."""
    T = bare.forward(q)
    return np.asarray(np.linalg.inv(bare.T_world_base) @ T @ np.linalg.inv(bare.T_flange_tool))


def _medians(values: FloatArray, group: IntArray) -> FloatArray:
    """(G,) of the values of each group."""
    return np.array([np.median(values[group == g]) for g in np.unique(group)])


def _tool_points(bare: Robot, data: Dataset, rows: IntArray, station: IntArray, mount: IntArray) -> FloatArray:
    """Tool points (M, 3) to begin at: the robot file's; where orientations are measured, of a fit of each by itself."""
    points = np.tile(pose(bare.spec["tool"])[:3, 3], (int(mount.max()) + 1, 1))
    if data.rotation is None or len(points) == 1:
        return points
    for m in np.unique(mount):
        most = np.bincount(station[mount == m]).argmax()
        found = align(bare, data.select(rows[(mount == m) & (station == most)]))
        if found.found:
            points[m] = np.asarray(found.T_flange_tool)[:3, 3]
    return points


def _turns(
    frames: FloatArray, data: Dataset, rows: IntArray, R_base: FloatArray, mount: IntArray, at_least: float
) -> FloatArray | None:
    """(M, 3, 3) of the target on the flange at each mount; None where one does for all, or none is measured.

    One does where it leaves no mount `at_least` times the angles of its own.
    """
    if data.rotation is None or mount.max(initial=0) == 0:
        return None
    seen = np.isfinite(data.rotation[rows]).all(axis=1)
    if np.bincount(mount[seen])[np.unique(mount)].min() < _FEWEST:
        return None
    on_flange = (R_base @ frames[:, :3, :3])[seen].transpose(0, 2, 1) @ rotations(data.rotation[rows[seen]])
    mount = mount[seen]
    there = np.unique(mount)
    own = np.tile(_middle(on_flange[mount == there[0]]), (int(there[-1]) + 1, 1, 1))
    for m in there[1:]:
        own[m] = _middle(on_flange[mount == m])
    one = _middle(on_flange)
    apart = np.median(_angles(own[mount], on_flange))
    far = max(float(np.median(_angles(one, on_flange[mount == m]))) for m in there)
    return own if far > at_least * apart else None


def _middle(R: FloatArray) -> FloatArray:
    """The rotation (3, 3) that most of R (N, 3, 3) are near to: of their mean, but for those far from it."""
    used = np.ones(len(R), dtype=bool)
    for _ in range(_ROUNDS):
        middle = nearest_rotation(R[used].mean(axis=0))
        angle = _angles(middle, R)
        again = angle <= _GROSS * max(float(np.median(angle)), _PATIENCE)
        if (again == used).all():
            break
        used = again
    return middle


def _angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N,) sizes of a^T b, rotations (..., 3, 3) [rad]."""
    return np.asarray(2 * np.arcsin(np.minimum(np.linalg.norm(a - b, axis=(-2, -1)) / np.sqrt(8), 1.0)))


def _fit(
    frames: FloatArray, p: FloatArray, station: IntArray, mount: IntArray, near: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bases (S, 4, 4), tool points (M, 3), from those `near`, and the errors (N,) that they leave [m]."""
    tools = near.copy()
    bases = np.tile(np.eye(4), (int(station.max()) + 1, 1, 1))
    first, *others = np.unique(station)
    before, sound = np.inf, np.ones(len(p), dtype=bool)
    for _ in range(_ROUNDS):
        at = frames[:, :3, 3] + np.einsum("nij,nj->ni", frames[:, :3, :3], tools[mount])
        bases[:] = _agreeing_pose(at[station == first], p[station == first], bases[0, :3, :3])
        for s in others:
            bases[s] = _agreeing_pose(at[station == s], p[station == s], bases[0, :3, :3])
        left = p - np.einsum("nij,nj->ni", bases[station, :3, :3], at) - bases[station, :3, 3]
        length = np.linalg.norm(left, axis=1)
        # Gross points would turn a base, and with it what all others say of the tool.
        sound = length <= _GROSS * max(float(np.median(length)), _PATIENCE)
        tools = _tools(frames[sound], p[sound], bases[station[sound], :3, :3], station[sound], mount[sound], tools)
        error = float(np.median(length))
        if abs(before - error) < _PATIENCE:
            break
        before = error
    tools[np.setdiff1d(np.arange(len(tools)), mount)] = tools[mount.min()]
    return bases, tools, length


def _agreeing_pose(a: FloatArray, b: FloatArray, R: FloatArray) -> FloatArray:
    """The pose (4, 4) that takes points a (N, 3) to b, but for points that are far off the others' (trimmed Kabsch).

    About a line on which all of them lie it turns as the rotation R does.
    """
    used = np.ones(len(a), dtype=bool)
    T = best_motion(a, b, R)
    for _ in range(_ROUNDS):
        length = np.linalg.norm(b - a @ T[:3, :3].T - T[:3, 3], axis=1)
        limit = max(_GROSS * float(np.median(length)), float(np.sort(length)[min(_FEWEST, len(length)) - 1]), _PATIENCE)
        again = length <= limit
        if (again == used).all():
            break
        used = again
        T = best_motion(a[used], b[used], R)
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
    for s in np.unique(station):
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


def _shifts(tools: FloatArray, turns: FloatArray | None, R_tool: FloatArray) -> dict[str, float]:
    """Parameters of tool_shift, edge units: along the first tool's axes, with `turns` (M, 3, 3) the twist from it."""
    out: dict[str, float] = {}
    for m, t in enumerate(tools[1:], start=2):
        v, w = R_tool.T @ (t - tools[0]), np.zeros(3)
        if turns is not None:
            v, w = _log(np.linalg.inv(se3.pose(turns[0], tools[0])) @ se3.pose(turns[m - 1], t))
        out |= {f"mount{m}_{name}_mm": from_si(float(v[axis]), "mm") for axis, name in enumerate(_AXES)}
        if turns is not None:
            out |= {f"mount{m}_r{name}_rad": float(w[axis]) for axis, name in enumerate(_AXES)}
    return out


def _log(T: FloatArray) -> tuple[FloatArray, FloatArray]:
    """V and w with exp([v; w]) = T: w by the core, v = V(w)^-1 p."""
    w = np.asarray(_core.log_so3(np.ascontiguousarray(T[:3, :3])))
    angle = float(np.linalg.norm(w))
    K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    bend = 1 / 12 if angle < 1e-4 else (1 - angle * np.sin(angle) / (2 * (1 - np.cos(angle)))) / angle**2
    return np.asarray((np.eye(3) - K / 2 + bend * K @ K) @ T[:3, 3]), w
