# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The map of an export: which of its columns is which of the contract's, kept in a YAML file (--map, --print-map)."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping as Map
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from fastcal.errors import InvalidInput, ParseError
from fastcal.importers.controller_joints import COUNTS_OTHERWISE, OF_A_MAP
from fastcal.importers.export import Export
from fastcal.importers.orientation import CONVENTIONS
from fastcal.importers.words import ANGLES, LENGTHS, Title
from fastcal.io.fields import Fields
from fastcal.io.text_encoding import codec_of
from fastcal.io.yaml_file import read_yaml

_UNITS = "|".join((*LENGTHS, *ANGLES))
_JOINT = re.compile(rf"([qj])(\d{{1,3}})(_read)?_({_UNITS})")
_PART = re.compile(rf"([xyz]|r[xyz])_({_UNITS})|(q[wxyz]|r[123][123])")
_OWN = re.compile(
    r"(payload|sigma|sigma_[xyz]|sigma_rot|temperature|time|f[xyz]|m[xyz]|current\d+|distance|tilt_[xy]|sigma_tilt)_\S+"
)
# What is read of a target that a cell's file names passes through as it is.
_OF_A_TARGET = re.compile(
    rf"(([xyz]|r[xyz]|distance|sigma|sigma_rot)_({_UNITS})|q[wxyz])@[a-z][a-z0-9_-]*(:[a-z][a-z0-9_-]*)?", re.IGNORECASE
)
_LABELS = ("name", "station", "mount", "plane", "anchor")


@dataclass(frozen=True)
class Mapping:
    """Answers about an export.

    Attributes:
        path: Its file, for messages.
        columns: A column of the contract, with the export's unit: the header of the export's column, or its number
            from 1.
        orientation: What three angles or nine numbers are; None: as the export gives it.
        sheet: The sheet of a workbook.
        skip_rows: Lines above the table that are passed over.
        encoding: Of the export's text; None: as it says, or the likeliest.
    """

    path: str = ""
    columns: Map[str, str | int] = field(default_factory=dict)
    orientation: str | None = None
    sheet: str | None = None
    skip_rows: int = 0
    encoding: str | None = None

    @property
    def target(self) -> str:
        """TARGET or TARGET:SENSOR of the first columns of a target: these are its points, those of others are beside.

        Empty where the map names no target, or points of the tool as well.
        """
        named = (ours.partition("@") for ours in self.columns)
        of = [view for quantity, at, view in named if at or _PART.fullmatch(quantity)]
        return next((view for view in of if view), "") if all(of) else ""

    def places(self, export: Export) -> dict[str, int]:
        """Where an export has the columns of the map.

        Raises:
            ParseError: A number lies beyond the export's columns.
        """
        titles = {title.lower(): place for place, title in reversed(list(enumerate(export.titles))) if title}
        found = {}
        for ours, theirs in self.columns.items():
            if isinstance(theirs, int):
                if not 1 <= theirs <= len(export.titles):
                    raise ParseError(
                        f"columns.{ours}: expected a number from 1 to {len(export.titles)}, the columns of "
                        f"{export.grid.path}, got {theirs}",
                        self.path,
                    )
                found[ours] = theirs - 1
            elif " ".join(theirs.split()).lower() in titles:
                found[ours] = titles[" ".join(theirs.split()).lower()]
        return found

    def applied(self, export: Export) -> Export:
        """The export with the meanings of the map; one that has none of its columns stays as it is."""
        places = self.places(export)
        if not places:
            return export
        keep = ("time", "date", "valid") if "name" in places else ("name", "number", "time", "date", "valid")
        only_labels = {*places} <= {*_LABELS}  # which say nothing of what was measured
        meanings = [
            title
            if title is not None and (title.role in keep or (only_labels and title.role not in ("name", "number")))
            else None
            for title in export.meanings
        ]
        for ours, place in places.items():
            meanings[place] = _title(self._own(ours))
        angles = any(_PART.fullmatch(self._own(ours)) and ours[0] == "r" for ours in places)
        orientation = self.orientation or ("rpy" if angles else None)
        if only_labels:
            return replace(export, meanings=meanings, mapped=frozenset(places))
        return replace(
            export,
            meanings=meanings,
            orientation=orientation or export.orientation,
            headed=True,
            mapped=frozenset(places),
            controller=False,
        )

    def _own(self, ours: str) -> str:
        """A column of `target` by what it is of the tool."""
        quantity, at, view = ours.partition("@")
        return quantity if at and view == self.target else ours


def _title(ours: str) -> Title:
    """What a key of a map says of the column; checked when the map was read."""
    if match := _JOINT.fullmatch(ours):
        group = ("map",) if match[1] == "q" else OF_A_MAP
        return Title(f"q{match[2]}", "actual" if match[3] else "plain", (match[4], 1.0), group)
    if match := _PART.fullmatch(ours):
        return Title(match[1] or match[3], "measured", (match[2], 1.0) if match[2] else None, ("map",))
    return Title("name") if ours == "name" else Title(ours, "own")


def read_map(path: str | os.PathLike[str]) -> Mapping:
    """Reads a map.

    Raises:
        ParseError: A key or a value is invalid; one sentence with what would do.
    """
    name = os.fspath(path)
    fields = Fields(read_yaml(name), "", name)
    columns: dict[str, str | int] = {}
    given = fields.take("columns", {}) or {}
    if not isinstance(given, dict):
        raise ParseError(f"columns: expected our columns and the export's, {{q1_deg: J1, x_m: 8}}, got {given!r}", name)
    for ours, theirs in given.items():
        key, at, target = str(ours).strip().partition("@")
        key = key.lower() + at + target
        known = (form.fullmatch(key) for form in (_JOINT, _PART, _OWN, _OF_A_TARGET))
        if not (any(known) or key in _LABELS):
            raise ParseError(
                f"columns.{ours}: expected a column of a measurement file with its unit, such as q1_deg, x_mm, rx_rad, "
                "qw or r11, or x_mm@TARGET",
                name,
            )
        if isinstance(theirs, bool) or not isinstance(theirs, str | int):
            raise ParseError(f"columns.{ours}: expected a header or a number from 1, got {theirs!r}", name)
        columns[key] = theirs
    orientation, sheet, skip = fields.take("orientation", None), fields.take("sheet", None), fields.take("skip_rows", 0)
    encoding = fields.take("encoding", None)
    fields.done()
    if orientation is not None and orientation not in CONVENTIONS:
        raise ParseError(f"orientation: expected {', '.join(CONVENTIONS)}, got {orientation!r}", name)
    if isinstance(skip, bool) or not isinstance(skip, int) or skip < 0:
        raise ParseError(f"skip_rows: expected a number of lines, got {skip!r}", name)
    if encoding is not None and codec_of(str(encoding)) is None:
        raise ParseError(f"encoding: expected one such as utf-8, cp932, gbk or cp1252, got {encoding!r:.40}", name)
    as_text = None if encoding is None else str(encoding)
    return Mapping(name, columns, orientation, None if sheet is None else str(sheet), skip, as_text)


def map_text(exports: Sequence[Export | InvalidInput]) -> str:
    """A map to start from: what is known of each column as it is read, the others as comments."""
    lines = [
        "# Which column of the export is which of the measurement file: ours: theirs, by header or by number from 1.",
        "# Our name carries the unit that the export has: q1_deg or q1_rad, x_mm or x_m, rx_deg; also qw ..., "
        "r11 ... r33.",
        "columns:",
    ]
    unknown = []
    for export in exports:
        if isinstance(export, InvalidInput):
            continue
        for place, meaning in enumerate(export.meanings):
            title = export.titles[place]
            theirs = (
                json.dumps(title, ensure_ascii=False) if title and export.titles.count(title) == 1 else str(place + 1)
            )
            ours = None if meaning is None else _ours(meaning, export)
            if ours is None:
                unknown.append(f"#  ?: {theirs}" + ("" if title else f"   # such as {export.rows[0][place]}"))
            else:
                lines.append(f"  {ours}: {theirs}")
    if lines[-1] == "columns:":
        lines[-1] = "columns: {}"
    lines += [*(["# Not used, or not known:"] if unknown else []), *unknown]
    lines += [
        "# What three angles rx ry rz are, in this order, or nine numbers r11 ... r33:",
        f"#orientation: {' | '.join(CONVENTIONS)}",
    ]
    return "\n".join([*lines, "#sheet: Sheet1", "#skip_rows: 0", "#encoding: cp932", ""])


def _ours(meaning: Title, export: Export) -> str | None:
    """The name of a column in a map; None for what is not taken."""
    if meaning.sense in ("nominal", "deviation", "controller") and not meaning.role[1:].isdigit():
        return None
    role = {
        "w": "rx",
        "p": "ry",
        "r": "rz",
        "a": "rx",
        "b": "ry",
        "c": "rz",
        "roll": "rx",
        "pitch": "ry",
        "yaw": "rz",
    }.get(meaning.role, meaning.role)
    if meaning.sense == "own" or role in ("name", "qw", "qx", "qy", "qz") or re.fullmatch("r[123][123]", role):
        return role
    if role in ("x", "y", "z"):
        return f"{role}_{(meaning.unit or export.units.get('length') or ('mm', 1.0))[0]}"
    if role[0] == "q" and role[1:].isdigit() and export.dialect in COUNTS_OTHERWISE:
        role = f"j{role[1:]}"
    if role in ("rx", "ry", "rz") or role[1:].isdigit():
        return f"{role}_{(meaning.unit or export.units.get('angle') or ('deg', 1.0))[0]}"
    return None
