# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an export holds, in columns of the contract; what it leaves open is asked for, never guessed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.importers import families
from fastcal.importers.clock import Times, read_times
from fastcal.importers.export import Export, number
from fastcal.importers.label_columns import LabelColumn, label_columns
from fastcal.importers.orientation import converted
from fastcal.importers.words import ANGLES, LENGTHS, Title
from fastcal.said import first_few, said

Column = FloatArray | list[str]
FULL_TURN = 6.3  # joints in degrees of a calibration go farther than this number, those in radians don't
SMALL_LENGTH = 10.0  # an arm's points in millimetres go farther than this number, those in metres don't
_ENOUGH = 6  # rows that are enough to decide
_MOST_NAMED = 20  # columns that are left out
_FEW_NAMED = 4  # titles that are not known
_FALSE = frozenset({"0", "no", "false", "n", "nein", "non", "invalid", "falsch"})
_LABELS = frozenset({"station", "mount", "plane", "anchor"})


@dataclass(frozen=True)
class Reading:
    """Rows of an export.

    Attributes:
        dialect: Whose export it is.
        path: The file.
        columns: By the contract's names with the export's units, one value a row.
        joints: Their number; 0 where the export has none.
        measured: Whether it holds points (or lengths) that were measured.
        names: A name a row; None where it has none.
        counted: Whether the names are mere numbers.
        times: None where it has none.
        lines: The line of each row.
        computed: The title of a pose that a controller computed, which is never taken.
        mapped: Columns of the contract that a map named.
        labels: Columns that could name the rows, those that say so first.
        unknown: Titles of columns that say nothing that is known, and are not taken.
        sheet: Of a workbook.
        notes: What a reader should know.
        target: Of a cell, of which the measured columns are; empty: the tool.
    """

    dialect: str
    path: str
    columns: dict[str, Column]
    joints: int
    measured: bool
    names: list[str] | None
    counted: bool
    times: Times | None
    lines: list[int]
    computed: str | None = None
    mapped: frozenset[str] = frozenset()
    labels: list[LabelColumn] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    sheet: str | None = None
    notes: list[str] = field(default_factory=list)
    target: str = ""

    def __len__(self) -> int:
        return len(self.lines)

    def rows(self, chosen: Sequence[int]) -> Reading:
        """Some of its rows, in the order given."""
        index = np.asarray(chosen, dtype=int)
        columns = {
            n: v[index] if isinstance(v, np.ndarray) else [v[k] for k in chosen] for n, v in self.columns.items()
        }
        return replace(
            self,
            columns=columns,
            names=None if self.names is None else [self.names[k] for k in chosen],
            times=None if self.times is None else Times(self.times.seconds[index], self.times.kind),
            lines=[self.lines[k] for k in chosen],
            labels=[column.rows(chosen) for column in self.labels],
        )

    def label(self, row: int) -> str:
        """A row for messages: its name, else its number from 1."""
        return self.names[row] if self.names is not None and self.names[row] else f"row {row + 1}"


def interpret(
    export: Export, *, convention: str | None = None, joint_kinds: Sequence[str] | None = None, wanted: str = "any"
) -> Reading:
    """The rows of an export in columns of the contract.

    Args:
        export: The table.
        convention: What its angles are (`orientation.CONVENTIONS`), where the user gives it.
        joint_kinds: revolute or prismatic, of the robot; None: not known.
        wanted: `joints` or `points` where the user has chosen it, else `any`.

    Raises:
        InvalidInput, ParseError: Something can't be decided or read; one sentence with the option that decides.
    """
    if not export.headed:
        export = _without_titles(export, joint_kinds, wanted)
    sent, read, notes = families.joints(export, None if joint_kinds is None else len(joint_kinds))
    beside, computed = (None, None) if wanted == "joints" else families.point(export, bool(sent))
    if wanted == "points":
        sent, read = [], []
    places = [] if beside is None else [families.grouped(export)[beside][axis] for axis in "xyz"]
    own = families.own(export)
    lengths = [name for name in own if name.startswith("distance_")]
    rows, left = _kept(export, sent, [*places, *(own[name][0] for name in lengths)])
    notes = [*export.notes, *notes, *left]
    used = {*sent, *(place for place in read if place is not None), *places}
    columns: dict[str, Column] = {}
    if sent:
        columns |= _joint_columns(export, sent, read, rows, joint_kinds, notes)
    if beside is not None:
        columns |= _point_columns(export, places, rows, notes)
        if found := families.orientation(export, beside):
            columns |= _orientation_columns(export, found, rows, convention, notes)
            used |= {*found.places}
    for name, (place, _) in own.items():
        columns[name] = [export.rows[k][place] for k in rows] if name in _LABELS else export.numbers(place, rows)
    used |= {place for name, (place, _) in own.items() if name not in _LABELS}
    names, counted = _names(export, rows)
    return Reading(
        export.dialect,
        export.grid.path,
        columns,
        len(sent),
        bool(places or lengths),
        names,
        counted,
        _times(export, rows),
        [export.lines[k] for k in rows],
        computed,
        export.mapped,
        label_columns(export, rows, used),
        _unknown(export, rows),
        export.grid.sheet,
        notes,
    )


def _unknown(export: Export, rows: Sequence[int]) -> list[str]:
    """The titles of columns that hold something and say nothing that is known."""
    if not export.headed:
        return []
    return [
        title
        for place, (title, known) in enumerate(zip(export.titles, export.meanings, strict=True))
        if title and known is None and any(export.rows[row][place] for row in rows)
    ]


def unknown_note(titles: Sequence[str], path: str) -> list[str]:
    """The sentence on columns that are not known, where there are any."""
    if not titles:
        return []
    named = first_few(list(map(repr, titles)), _MOST_NAMED)
    return [said("columns of {path} that are not known are left out: {columns}", path=path, columns=named)]


def _without_titles(export: Export, joint_kinds: Sequence[str] | None, wanted: str) -> Export:
    """Titles for a table that has none, where there is but one way to read it."""
    width = len(export.titles)
    sample = export.rows[: 20 * _ENOUGH]
    numeric = [all(number(row[place]) is not None for row in sample) for place in range(width)]
    texts = [place for place in range(width) if not numeric[place] and any(row[place] for row in sample)]
    values = [place for place in range(width) if numeric[place]]
    counter = _counter(export, values, sample)
    rest = [place for place in values if place != counter]
    axes = len(joint_kinds) if joint_kinds is not None else len(rest)
    meanings: list[Title | None] = [None] * width
    broken = any("[" in row[place] or "(" in row[place] for row in sample for place in texts)
    if wanted == "joints" and len(rest) == axes and axes > 3 and not broken:
        for joint, place in enumerate(rest, start=1):
            meanings[place] = Title(f"q{joint}")
    elif wanted != "joints" and len(rest) == 3 and (texts or wanted == "points"):
        for axis, place in zip("xyz", rest, strict=True):
            meanings[place] = Title(axis)
    else:
        titles = ", ".join(f"'{title:.40}'" for title in export.titles[:_FEW_NAMED] if title)
        if titles:
            raise InvalidInput(
                f"{export.grid.path}: none of its {width} titles is known ({titles}, ...); name them by title, or by "
                "number from 1, with --map (fastcal import --print-map writes one to start from)"
            )
        raise InvalidInput(
            f"{export.grid.path}: has no header, so its {width} columns are not known; name them by their "
            "numbers from 1 with --map (fastcal import --print-map writes one to start from)"
        )
    if texts:
        meanings[texts[-1]] = Title("name")
    elif counter is not None:
        meanings[counter] = Title("number")
    return replace(export, meanings=meanings, headed=True)


def _counter(export: Export, places: Sequence[int], sample: Sequence[Sequence[str]]) -> int | None:
    """The first column if it counts the rows."""
    if not places or len(sample) < 3:
        return None
    found = export.numbers(places[0], range(len(sample)))
    return places[0] if (np.diff(found) == 1).all() and (found == np.round(found)).all() else None


def _kept(export: Export, sent: Sequence[int], measured: Sequence[int]) -> tuple[list[int], list[str]]:
    """The rows that hold what they should, and what was left out."""
    rows, dropped = list(range(len(export.rows))), []
    notes: list[str] = []
    if valid := families.labelled(export, "valid"):
        good = [k for k in rows if export.rows[k][valid[0]].strip().lower() not in _FALSE]
        if len(good) < len(rows):
            notes.append(
                said(
                    "{count} rows that {column} calls not valid are left out",
                    count=len(rows) - len(good),
                    column=export.title(valid[0]),
                )
            )
        rows = good
    for what, places in ((said("joints"), sent), (said("a measured point"), measured)):
        if places:
            dropped = [k for k in rows if not any(number(export.rows[k][place]) is not None for place in places)]
            # NaN, n/a and --- are short; text, and formulas without a value, are asked about.
            filled = [k for k in dropped if any(len(export.rows[k][place]) > 3 for place in places)]
            if filled:
                export.numbers(next(place for place in places if export.rows[filled[0]][place]), [filled[0]])
            if dropped and len(dropped) < len(rows):
                listed = ", ".join(str(export.lines[k]) for k in dropped[:6]) + (", ..." if len(dropped) > 6 else "")
                notes.append(
                    said(
                        "{count} rows without {what} are left out (lines {lines})",
                        count=len(dropped),
                        what=what,
                        lines=listed,
                    )
                )
                rows = [k for k in rows if k not in set(dropped)]
    if not rows:
        raise export.error("holds no rows of numbers")
    return rows, notes


def _joint_columns(
    export: Export,
    sent: Sequence[int],
    read: Sequence[int | None],
    rows: Sequence[int],
    joint_kinds: Sequence[str] | None,
    notes: list[str],
) -> dict[str, Column]:
    kinds = list(joint_kinds or []) + ["revolute"] * len(sent)
    columns: dict[str, Column] = {}
    assumed, largest = [], 0.0
    for joint, place in enumerate(sent, start=1):
        values = export.numbers(place, rows)
        turning = kinds[joint - 1] == "revolute"
        unit = _stated(export, place, "angle" if turning else "length")
        if unit is None:
            unit = ("deg", 1.0) if turning else ("mm", 1.0)
            assumed.append(joint)
            largest = max(largest, float(np.nanmax(np.abs(values), initial=0.0))) if turning else np.inf
        columns[f"q{joint}_{unit[0]}"] = values * unit[1]
    for joint, back in enumerate(read, start=1):
        if back is not None:
            unit = _stated(export, back, "angle" if kinds[joint - 1] == "revolute" else "length") or ("deg", 1.0)
            columns[f"q{joint}_read_{unit[0]}"] = export.numbers(back, rows) * unit[1]
    if assumed:
        first = export.title(sent[assumed[0] - 1])
        if largest <= FULL_TURN and len(rows) >= _ENOUGH:
            raise InvalidInput(
                f"{export.grid.path}: {first} and the other joints have no unit and stay within {largest:.3g}: "
                f"say which it "
                f"is with --map, q1_rad: {first} or q1_deg: {first}"
            )
        notes.append(said("joints without a unit ({column} ...) are taken as degrees", column=first))
    return columns


def _point_columns(export: Export, places: Sequence[int], rows: Sequence[int], notes: list[str]) -> dict[str, Column]:
    units = [_stated(export, place, "length") for place in places]
    values = [export.numbers(place, rows) for place in places]
    if any(unit is None for unit in units):
        title = export.title(places[0])
        largest = max(float(np.nanmax(np.abs(column), initial=0.0)) for column in values)
        if largest < SMALL_LENGTH and len(rows) >= _ENOUGH:
            raise InvalidInput(
                f"{export.grid.path}: {title} and the other coordinates have no unit and stay within "
                f"{largest:.3g}: say "
                f"which it is with --map, x_m: {title} or x_mm: {title}"
            )
        notes.append(said("coordinates without a unit ({column} ...) are taken as millimetres", column=title))
    found = [unit or ("mm", 1.0) for unit in units]
    return {f"{axis}_{unit[0]}": column * unit[1] for axis, unit, column in zip("xyz", found, values, strict=True)}


def _orientation_columns(
    export: Export, found: families.Orientation, rows: Sequence[int], asked: str | None, notes: list[str]
) -> dict[str, Column]:
    """The orientation in columns of the contract; asks for the convention where it is not given."""
    titles = [export.title(place) for place in found.places]
    ours = [f"{role}_{unit}" for role in found.roles for unit in ANGLES]
    literal = all(export.titles[place].lower() in ours for place in found.places)
    stated = export.orientation if len(found.roles) == 3 else None
    if (
        stated in ("abc", "wpr")
        and found.roles not in (("a", "b", "c"), ("w", "p", "r"))
        and not _mapped(export, found)
    ):
        stated = None
    convention = found.convention or asked or stated or ("rpy" if literal else None)
    if found.roles == ("q",) * 4 and convention not in ("wxyz", "xyzw"):
        raise InvalidInput(
            f"{export.grid.path}: {', '.join(titles)} may be a quaternion with the scalar first or last: say "
            f"which with "
            "--orientation wxyz or --orientation xyzw"
        )
    sizes = {"matrix": 9, "wxyz": 4, "xyzw": 4}
    if convention is None:
        raise InvalidInput(
            f"{export.grid.path}: {', '.join(titles)} may be roll, pitch and yaw, a rotation vector or turns "
            f"about moving "
            "axes: say which with --orientation rpy, abc, wpr, zyz, xyz_moving or rotation_vector, or with "
            "--map, which can "
            "also leave them out"
        )
    if sizes.get(convention, 3) != len(found.places):
        raise InvalidInput(
            f"{export.grid.path}: the orientation in {', '.join(titles)} is not of the kind {convention} that "
            f"was asked for"
        )
    values = np.column_stack([export.numbers(place, rows) for place in found.places])
    unit = _angle_unit(export, found, values, convention, notes)
    try:
        return dict(converted(convention, values, unit))
    except ValueError as error:
        row = rows[error.args[0]]
        raise export.error(f"{titles[0]} and the other numbers of the matrix are not a rotation", row) from None


def _mapped(export: Export, found: families.Orientation) -> bool:
    return any(title is not None and title.group == ("map",) for title in (export.meanings[k] for k in found.places))


def _angle_unit(
    export: Export, found: families.Orientation, values: FloatArray, convention: str, notes: list[str]
) -> tuple[str, float]:
    if convention in ("matrix", "wxyz", "xyzw"):
        return "1", 1.0
    unit = _stated(export, found.places[0], "angle")
    if unit is not None:
        return unit
    title = export.title(found.places[0])
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if convention == "rotation_vector":
        unit = ("rad", 1.0) if float(np.nanmax(np.linalg.norm(values, axis=1))) <= FULL_TURN else ("deg", 1.0)
    elif largest <= FULL_TURN and len(values) >= _ENOUGH:
        raise InvalidInput(
            f"{export.grid.path}: {title} and the other angles have no unit and stay within {largest:.3g}: say "
            f"which it is "
            f"with --map, rx_rad: {title} or rx_deg: {title}"
        )
    else:
        unit = ("deg", 1.0)
    notes.append(f"angles without a unit ({title} ...) are taken as {'radians' if unit[0] == 'rad' else 'degrees'}")
    return unit


def _stated(export: Export, place: int, kind: str) -> tuple[str, float] | None:
    """The unit that a column's title states, else the one of the whole file."""
    title = export.meanings[place]
    if title is not None and title.unit is not None:
        if title.unit[0] not in (LENGTHS if kind == "length" else ANGLES):
            if kind == "angle" and title.unit[0] in LENGTHS:
                return title.unit  # a sliding joint of an unknown robot
            raise export.error(f"column {export.title(place)}: '{title.unit[0]}' is no unit of {kind}")
        return title.unit
    return export.units.get(kind)


def _names(export: Export, rows: Sequence[int]) -> tuple[list[str] | None, bool]:
    """The names of the rows and whether they only count; the first column of names that differ wins."""
    for role in ("name", "number"):
        for place in families.labelled(export, role):
            export.check_calculated(place)
            texts = [export.rows[k][place] for k in rows]
            if len(set(texts)) * 2 > len(texts):
                return texts, all(number(text) is not None for text in texts)
    return None, False


def _times(export: Export, rows: Sequence[int]) -> Times | None:
    dates = families.labelled(export, "date")
    found = families.labelled(export, "time")
    given = [export.rows[k][dates[0]] for k in rows] if dates else None
    for place in found:
        title = export.meanings[place]
        unit = None if title is None else title.unit
        times = read_times([export.rows[k][place] for k in rows], given, unit)
        if times is not None:
            return times
    return None
