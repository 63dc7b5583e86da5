# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joins a controller's joints with an instrument's points: by name, by time or by order, and tries the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.importers.controller_joints import si_joints
from fastcal.importers.label_columns import LabelColumn, LabelMatch, best_match
from fastcal.importers.pairing import FEWEST_ROWS, Pairing, pair_by_robot
from fastcal.importers.reading import Column, Reading, unknown_note
from fastcal.importers.standstills import core, standstills
from fastcal.importers.timing import pairs_by_time
from fastcal.robot.robot import Robot
from fastcal.said import first_few, said
from fastcal.said import joined as in_a_row
from fastcal.units import from_si, parse_name, to_si

Pair = tuple[int, int]  # pose, point
_RECORD = 3.0  # rows of one list a row of the other: it is a record of the motion
_STILL_JOINT = 3.5e-4  # [rad or m]
_STILL_POINT = 3e-4  # [m]
_MOST = 0.7  # of the shorter list that the robot must confirm
_LISTED = 12
_HOW = {"by name": said("by name"), "by time": said("by time"), "by order": said("by order")}
ROBOT_GIVEN = said("--robot ROBOT")
_MOST_TRIED = 25_000_000  # poses times points whose distances are compared


@dataclass
class _Join:
    """A join as it is made."""

    points: Reading
    poses: Reading
    robot: Robot | None
    match: LabelMatch | None = None
    notes: list[str] = field(default_factory=list)


def joined(points: Reading, poses: Reading, robot: Robot | None) -> Reading:
    """One row a measured pose: columns of both, in the order of the poses.

    Raises:
        InvalidInput: It can't be known which point belongs to which pose; names the option that would decide.
    """
    join = _Join(points, poses, robot)
    pairs, how = _by_name_or_time(join)
    if how is None:
        _reduce_records(join)
        pairs, how = _by_order(join)
    elif how == "by name":
        left_points, left_poses = _left(join, pairs or [])
        _note_left_over(join, left_points, left_poses)
    pairs = _tried(join, pairs, how)
    if not pairs:
        raise InvalidInput(f"{points.path}: no point belongs to a pose of {poses.path}")
    note = said("{count} points joined with their poses {how}{titles}", count=len(pairs), how=_HOW[str(how)],
                titles=_titles(join))  # fmt: skip
    at, to = join.poses.rows([i for i, _ in pairs]), join.points.rows([j for _, j in pairs])
    columns: dict[str, Column] = {**at.columns, **{n: v for n, v in to.columns.items() if n not in at.columns}}
    names, counted = _names(join, at, to, pairs)
    taken = {title for match in [join.match] if match is not None for title in (match.poses.title, match.points.title)}
    return replace(
        to,
        columns=columns,
        joints=at.joints,
        names=names,
        counted=counted,
        times=to.times or at.times,
        labels=[],
        unknown=[title for title in points.unknown if f"'{title}'" not in taken],
        notes=[
            *points.notes,
            *poses.notes,
            *unknown_note([title for title in poses.unknown if f"'{title}'" not in taken], poses.path),
            note,
            *join.notes,
        ],
    )


def _titles(join: _Join) -> str:
    """Which columns have the same names, for the note."""
    if join.match is None:
        return ""
    points, poses = join.match.points.title, join.match.poses.title
    if points == poses:
        return f" ({points})"
    return said(" ({points} of the points, {poses} of the poses)", points=points, poses=poses)


def _names(join: _Join, at: Reading, to: Reading, pairs: Sequence[Pair]) -> tuple[list[str] | None, bool]:
    """The names of the joined rows, and whether they only count: those by which they were joined, the points' first."""
    if join.match is not None:
        points, poses = join.match.points, join.match.poses
        if points.has_letters or not poses.has_letters:
            return [points.texts[j] for _, j in pairs], not points.has_letters
        return [poses.texts[i] for i, _ in pairs], False
    named = to if to.names is not None and not to.counted else at
    return named.names, named.counted


def confirmed(reading: Reading, robot: Robot) -> Reading:
    """Rows that came as joints with points, tried on the robot; a slip of whole rows, as by clocks, is mended.

    What the robot does not explain is left as it is and said: it may be a pose of another kind.
    """
    join = _Join(reading, reading, robot)
    try:
        pairs = _tried(join, [(k, k) for k in range(len(reading))], "by time") or []
    except InvalidInput:
        note = said(
            "on the robot the points could not be confirmed: they do not fit it, nor with rows missing or shifted"
        )
        return replace(reading, notes=[*reading.notes, note])
    at, to = reading.rows([i for i, _ in pairs]), reading.rows([j for _, j in pairs])
    joints = {name: column for name, column in at.columns.items() if _is_of_joint(name)}
    return replace(to, columns=to.columns | joints, notes=[*reading.notes, *join.notes])


def _is_of_joint(name: str) -> bool:
    return name[0] == "q" and name[1].isdigit()


def _by_name_or_time(join: _Join) -> tuple[list[Pair] | None, str | None]:
    points, poses = join.points, join.poses
    match = best_match(poses.labels, points.labels, points.path, ask=join.robot is None)
    if match is not None:
        join.match = match
        _note_counter(join, match)
        return match.pairs, "by name"
    timed = pairs_by_time(si_joints(poses), poses.times, points.times)
    if timed is None:
        return None, None
    if timed.shift:
        hours = float(timed.shift / 3600)
        join.notes.append(said("the two clocks differ by {hours:+g} h, which is taken into account", hours=hours))
    if moving := timed.moving:
        join.notes.append(
            said(
                "{count} points were taken while the arm moved and are left out: {rows}",
                count=len(moving),
                rows=_listed(points, moving),
            )
        )
    if outside := timed.outside:
        join.notes.append(
            said(
                "{count} points have no pose at their time and are left out: {rows}",
                count=len(outside),
                rows=_listed(points, outside),
            )
        )
    if join.robot is None:
        join.notes.append(
            said("nothing but the two clocks joins them: {robot} would check that they agree", robot=ROBOT_GIVEN)
        )
    if len(poses) < _RECORD * len(points):
        return timed.pairs, "by time"
    # Of a record of the motion the other samples are no poses that could have lost their point.
    join.poses, join.points = poses.rows([i for i, _ in timed.pairs]), points.rows([j for _, j in timed.pairs])
    return [(k, k) for k in range(len(timed.pairs))], "by time"


def _note_counter(join: _Join, match: LabelMatch) -> None:
    """Says where a list only counts its rows, and the other is in another order."""
    rows = [point for _, point in match.pairs]
    if join.robot is not None or rows == sorted(rows) or match.poses.counts == match.points.counts:
        return
    counter, path = (match.poses, join.poses.path) if match.poses.counts else (match.points, join.points.path)
    join.notes.append(
        f"{counter.title} counts the rows of {path}: if it is no name, the join is wrong; --robot ROBOT would check it"
    )


def _refuse_names_that_differ(join: _Join) -> None:
    """Refuses to join by order lists whose rows have names that nobody has read, and says where one alone has them.

    Raises:
        InvalidInput: Both have such a column, and no robot is there to check the order.
    """
    points, poses = (
        [column for column in each.labels if not (column.counts or column.timed or column.is_reading)]
        for each in (join.points, join.poses)
    )
    if points and poses and not all(columns[0].read for columns in (points, poses)) and join.robot is None:
        raise InvalidInput(
            f"{join.points.path}: {_some(points)} may name the points, and {_some(poses)} the poses of "
            f"{join.poses.path}, but they do not agree, so that nothing but the order would join them: say which "
            "columns have the names with --map, name: TITLE, or give the arm with --robot ROBOT, which tries the order"
        )
    for columns, reading, other in ((points, join.points, join.poses), (poses, join.poses, join.points)):
        if columns:
            join.notes.append(f"{_some(columns)} of {reading.path} may name the rows; {other.path} has no such names")


def _some(columns: Sequence[LabelColumn]) -> str:
    return " or ".join(column.title for column in columns[:3])


def _reduce_records(join: _Join) -> None:
    """A record of the motion, where the other list has a row a pose, becomes a row a standstill."""
    if len(join.poses) >= _RECORD * len(join.points):
        join.poses = _reduced(join, join.poses, si_joints(join.poses), _STILL_JOINT, "joints")
    elif len(join.points) >= _RECORD * len(join.poses) and (position := si_points(join.points)) is not None:
        join.points = _reduced(join, join.points, position, _STILL_POINT, "points")


def _reduced(join: _Join, reading: Reading, values: FloatArray, tolerance: float, what: str) -> Reading:
    found = standstills(values, tolerance)
    if not found:
        return reading
    join.notes.append(f"the {len(reading)} samples of the {what} hold {len(found)} standstills, whose means are taken")
    middle = [(start + end) // 2 for start, end in found]
    out = reading.rows(middle)
    numbers = [name for name, column in out.columns.items() if isinstance(column, np.ndarray)]
    for name in numbers:
        column = reading.columns[name]
        # Angles and quaternions may jump by a turn or a sign: their middle sample stands for them.
        if isinstance(column, np.ndarray) and name[0] in "qjxyz" and not name.startswith(("qw", "qx", "qy", "qz")):
            out.columns[name] = np.array([column[core(*stretch)].mean() for stretch in found])
    return replace(out, names=None, labels=[], times=None if out.times is None else out.times)


def _by_order(join: _Join) -> tuple[list[Pair] | None, str]:
    points, poses = join.points, join.poses
    _refuse_names_that_differ(join)
    if len(points) == len(poses):
        if join.robot is None:
            join.notes.append(
                said("nothing but the order joins them: {robot} would check that no row has slipped", robot=ROBOT_GIVEN)
            )
        return [(k, k) for k in range(len(points))], "by order"
    if join.robot is None:
        raise InvalidInput(
            said(
                "{path}: {points} points and {poses} poses, and neither names nor times show which belong together: "
                "{robot} would find out",
                path=points.path,
                points=len(points),
                poses=len(poses),
                robot=ROBOT_GIVEN,
            )
        )
    return None, "by order"


def _tried(join: _Join, pairs: list[Pair] | None, how: str) -> list[Pair] | None:
    """The pairs, confirmed or mended by the robot where one is given."""
    position = si_points(join.points)
    if join.robot is None:
        return pairs
    if position is None or np.isnan(position).any():
        join.notes.append(said("rows without a whole point can't be tried on the robot"))
        return pairs
    if len(join.points) * len(join.poses) > _MOST_TRIED:
        raise InvalidInput(
            f"{join.points.path}: {len(join.points)} points and {len(join.poses)} poses are too many to be tried on "
            "the robot; import a part of them, or leave --robot out"
        )
    if min(len(join.points), len(join.poses)) < FEWEST_ROWS:
        if pairs is None:
            raise InvalidInput(
                f"{join.points.path}: {len(join.points)} points and {len(join.poses)} poses; to find which "
                f"belong together "
                f"the robot needs at least {FEWEST_ROWS}"
            )
        join.notes.append(said("fewer than {count} rows can't be tried on the robot", count=FEWEST_ROWS))
        return pairs
    order = list(range(len(position)))
    if how == "by name" and pairs:
        # Names say the order: points are tried in that of the poses.
        order = [j for _, j in pairs] + sorted(set(order) - {j for _, j in pairs})
        order = list(dict.fromkeys(order))
    place = {j: k for k, j in enumerate(order)}
    expected = None if pairs is None else [(i, place[j]) for i, j in pairs]
    found = pair_by_robot(join.robot, si_joints(join.poses, join.robot), position[order], expected)
    if found is None or len(found.pairs) < _MOST * min(len(join.points), len(join.poses)):
        times, rest = divmod(len(join.points), len(join.poses))
        if times > 1 and rest == 0:
            raise InvalidInput(
                said(
                    "{path}: holds {times} points for each of the {count} poses of {poses}: expected one; points of "
                    "{times} targets go side by side into one row of a file, as x_mm@n1, x_mm@n2 ..., with targets n1, "
                    "n2 ... in the robot file",
                    path=join.points.path,
                    times=times,
                    count=len(join.poses),
                    poses=join.poses.path,
                )
            )
        raise InvalidInput(
            said(
                "{path}: the points do not fit this robot in the order of the poses, nor with rows missing or shifted: "
                "is it the right robot, and are units and joints of {poses} right?",
                path=join.points.path,
                poses=join.poses.path,
            )
        )
    mended = [(i, order[k]) for i, k in found.pairs]
    _note_mended(join, pairs, mended, found)
    return mended


def _note_mended(join: _Join, pairs: list[Pair] | None, mended: list[Pair], found: Pairing) -> None:
    """What the robot changed, in words."""
    rms = said("{rms:.3g} mm RMS", rms=float(from_si(found.rms, "mm")))
    if pairs is not None and set(pairs) == set(mended):
        join.notes.append(
            said("tried on the robot: every pair fits it ({rms} after a fit), no row has slipped", rms=rms)
        )
        return
    left_points, left_poses = _left(join, mended)
    before_points, before_poses = _left(join, pairs or [])
    changed = sorted(set(mended) - set(pairs or [])) if pairs is not None else []
    parts = []
    if pairs is None or changed:
        in_order = said("the order had rows missing or slipped, mended with the robot")
        swapped_too = said("rows were missing, shifted or swapped, mended with the robot")
        parts.append(swapped_too if _out_of_order(mended) else in_order)
    swapped = _out_of_order(mended)
    if swapped:
        parts.append(said("in another order than the poses: {rows}", rows=_listed(join.points, swapped)))
    lost = left_poses if pairs is None or changed else sorted(set(left_poses) - set(before_poses))
    extra = left_points if pairs is None or changed else sorted(set(left_points) - set(before_points))
    if lost:
        parts.append(said("poses missing a point that fits: {rows}", rows=_listed(join.poses, lost)))
    if extra:
        parts.append(said("points missing a pose that fits: {rows}", rows=_listed(join.points, extra)))
    kept = said("the {count} pairs that are kept fit to {rms}", count=len(mended), rms=rms)
    join.notes.append(in_a_row("; ", [*parts, kept]))


def _out_of_order(pairs: Sequence[Pair]) -> list[int]:
    """Points that were measured before one of an earlier pose."""
    highest, out = -1, []
    for _, j in pairs:
        if j < highest:
            out.append(j)
        highest = max(highest, j)
    return out


def _left(join: _Join, pairs: Sequence[Pair]) -> tuple[list[int], list[int]]:
    points = sorted({*range(len(join.points))} - {j for _, j in pairs})
    return points, sorted({*range(len(join.poses))} - {i for i, _ in pairs})


def _note_left_over(join: _Join, points: list[int], poses: list[int]) -> None:
    if points:
        join.notes.append(
            said(
                "{count} points without a pose of their name are left out: {rows}",
                count=len(points),
                rows=_listed(join.points, points),
            )
        )
    if poses:
        join.notes.append(
            said(
                "{count} poses without a point of their name are left out: {rows}",
                count=len(poses),
                rows=_listed(join.poses, poses),
            )
        )


def _listed(reading: Reading, rows: Sequence[int]) -> str:
    return first_few([reading.label(row) for row in rows], _LISTED)


def si_points(reading: Reading) -> FloatArray | None:
    """(N, 3) measured points [m]; None where lengths alone were measured."""
    columns = [column for axis in "xyz" if (column := _si(reading, axis)) is not None]
    return np.column_stack(columns) if len(columns) == len("xyz") else None


def _si(reading: Reading, quantity: str) -> FloatArray | None:
    for name, values in reading.columns.items():
        found, unit = parse_name(name)
        if found == quantity and unit is not None and isinstance(values, np.ndarray):
            return to_si(values, unit)
    return None
