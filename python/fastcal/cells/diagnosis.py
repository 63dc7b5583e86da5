# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the diagnosis of a cell found: its ways, the causes with the cell's names, and the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fastcal.cells.cell import Cell
from fastcal.cells.gap import CellStep
from fastcal.cells.paths import Way
from fastcal.cells.readings import Readings
from fastcal.diagnosis import Diagnosis
from fastcal.diagnosis.result import Finding
from fastcal.display.shown import PlottedCell
from fastcal.place import Place
from fastcal.robot.robot_spec import Entry, Spec
from fastcal.said import Said, said

_LIKE_WEIGHTS = said(
    "the sensor stands on an arm that moves: bending and tilting there under the weight of the links were not "
    "tested as alternatives"
)
_PLACED = ("on", "xyz_mm", "rpy_deg", "fixed", "intrinsics")  # what a way says otherwise, or asks for
_LISTED = 4  # names of a sentence where most are no more than possible


@dataclass(frozen=True, eq=False)
class WayDiagnosis:
    """One way, and what was found in it."""

    way: Way
    found: Diagnosis

    @property
    def joints(self) -> list[str]:
        """As the cell calls joints 1 ... of the way."""
        return [str(Place(arm.name, "joint", index + 1)) for arm, index in self.way.joints]

    def mended(self, cell: Cell, owner: str) -> Cell:
        """A cell whose camera or board `owner` is as this way found it, where it stood."""
        found = self.found.model.description

        def there(members: Mapping[str, Spec], own: Mapping[str, Spec]) -> dict[str, Spec]:
            if owner not in members or owner not in own:
                return dict(members)
            kept = {key: value for key, value in members[owner].items() if key in _PLACED}
            return {**members, owner: {**self.way.told_member(owner, own[owner]), **kept}}

        return replace(cell, cameras=there(cell.cameras, found.cameras), boards=there(cell.boards, found.boards))


@dataclass(frozen=True, eq=False)
class Step:
    """That something moved at one moment, as one way found it, and what the cell calls it.

    Attributes:
        begins: Is it what the way begins at, and not its target?
        moment: At which [s], or from which row on.
        name: Effect and owner.
        alike: What else it may have been.
        first: The moment of the first of the same in all ways, by which two of one member are told apart.
    """

    each: WayDiagnosis
    finding: Finding
    begins: bool
    moment: float
    name: tuple[str, str] = ("", "")
    alike: tuple[tuple[str, str], ...] = ()
    first: float = 0.0


@dataclass(frozen=True, eq=False)
class CellFinding:
    """A cause, its owner as the cell calls it.

    Attributes:
        finding: Of the way that shows it most clearly.
        entry: Of that way's model; None where it is not in there.
        seen_by: Targets whose readings name it.
        not_seen_by: Targets that its place moves too, and whose readings do not.
        steps: Of all ways that find it, where it is that a member of the cell was moved.
        like_weights: Could what the weights of links do, seen from an arm that moves, look like it?
    """

    finding: Finding
    entry: Entry | None
    seen_by: tuple[str, ...]
    not_seen_by: tuple[str, ...] = ()
    like_weights: bool = False
    steps: tuple[Step, ...] = ()

    @property
    def doubts(self) -> list[Said]:
        """Why the grade is not better, as far as the other ways and the sensor say so."""
        others = ", ".join(self.not_seen_by)
        moves = said("it moves {others} too, and these readings do not identify it", others=others)
        return [*([moves] if others else []), *([_LIKE_WEIGHTS] if self.like_weights else [])]

    @property
    def reasons(self) -> list[str]:
        """Why the grade is not better."""
        return [*self.finding.reasons, *self.doubts]

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `effects`: that of the finding, and whose readings name it."""
        whose = {"reasons": self.reasons, "seen_by": list(self.seen_by), "not_seen_by": list(self.not_seen_by)}
        return self.finding.to_json_dict() | whose


@dataclass(frozen=True, eq=False)
class CellDiagnosis(PlottedCell):
    """What `diagnose_cell` found.

    Attributes:
        cell: As it is written: what predicts postures best that were held out.
        effects: Of all ways, the clearest first.
        gap: Before, with the geometry, and as it is written; empty where the geometry alone could not be fitted.
        readings: What was read; None: only the ways' own rows are known.
    """

    cell: Cell
    ways: list[WayDiagnosis]
    effects: list[CellFinding]
    notes: list[str] = field(default_factory=list)
    gap: list[CellStep] = field(default_factory=list)
    readings: Readings | None = None

    @property
    def told(self) -> tuple[list[CellFinding], int]:
        """What a sentence lists: what is sure, and of the rest the clearest; and how many more there are."""
        sure = [of for of in self.effects if of.finding.grade != "C"]
        rest = [of for of in self.effects if of.finding.grade == "C"]
        room = len(rest) if len(self.effects) <= _LISTED else max(_LISTED - 1 - len(sure), 0)
        return [*sure, *rest[:room]], len(rest) - len(rest[:room])

    @property
    def verdict(self) -> str:
        """none, named, one_of, several or unexplained, as of one arm."""
        if any(each.found.unexplained is not None for each in self.ways):
            return "unexplained"
        if not self.effects:
            return "none"
        if len(self.effects) > 1:
            return "several"
        return "one_of" if self.effects[0].finding.equivalents else "named"

    @property
    def sentence(self) -> str:
        """What was found, in words."""
        listed, more = self.told
        named = [f"{of.finding.label} (grade {of.finding.grade})" for of in listed]
        named += [f"{more} more that are merely possible (grade C)"] if more else []
        rest = [
            f"something remains in what was read of {each.way.name}, most of it at "
            f"{each.way.owner(each.found.unexplained.owner)}"
            for each in self.ways
            if each.found.unexplained is not None
        ]
        if not named and not rest:
            return "No missing effect is detectable above the noise of these readings."
        text = "; ".join([*([f"Missing: {', '.join(named)}"] if named else []), *rest])
        return f"{text[0].upper()}{text[1:]}."

    @property
    def status(self) -> str:
        """converged, or what the first way says that did not: see `Diagnosis.status`."""
        return next((each.found.status for each in self.ways if each.found.status != "converged"), "converged")

    def to_json_dict(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        rest = [each for each in self.ways if each.found.unexplained is not None]
        return {
            "status": self.status,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "effects": [of.to_json_dict() for of in self.effects],
            "unexplained": _unexplained(rest[0]) if rest else None,
            "untestable": self._untestable(),
            "gap": [step.to_json_dict() for step in self.gap],
            "ways": {each.way.name: _way_json(each) for each in self.ways},
            "notes": self.notes,
        }

    def _untestable(self) -> list[dict[str, str]]:
        """What no way can test, each once."""
        tested = {
            (of.effect, each.way.owner(of.owner)): {**vars(of), "owner": each.way.owner(of.owner)}
            for each in self.ways
            for of in each.found.untestable
        }
        return list(tested.values())


def _unexplained(each: WayDiagnosis) -> dict[str, Any]:
    rest = each.found.unexplained
    if rest is None:
        raise ValueError(f"{each.way.name} leaves nothing unexplained")
    return {
        "owner": each.way.owner(rest.owner),
        "share": rest.share,
        "depends_on": [each.way.column(name) for name in rest.depends_on],
        "added": rest.added,
        "formulas": list(rest.formulas),
        "way": each.way.name,
    }


def _way_json(each: WayDiagnosis) -> dict[str, Any]:
    """What was found in one way: an entry of `ways`."""
    found = each.found
    return {
        "arms": [arm.name for arm in each.way.arms],
        "joints": each.joints,
        "status": found.status,
        "verdict": found.verdict,
        "unexplained": None if found.unexplained is None else _unexplained(each),
        "noise": {name: of.to_json_dict() for name, of in found.noise.items()},
        "train": found.train.to_json_dict(),
        "test": None if found.test is None else found.test.to_json_dict(),
        "gap": [step.to_json_dict() for step in found.gap],
        "outliers": found.outliers,
    }
