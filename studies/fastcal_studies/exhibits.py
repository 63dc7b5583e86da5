# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a study shows: tables and figures as plain data, so that the page is drawn from paper.json and nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fastcal.units import factor
from fastcal_studies.simulated import WORLD_NAMES

Triple = tuple[float | None, float | None, float | None]
MM, DEG = factor("mm"), factor("deg")  # [m], [rad]: what a paper prints, and what is drawn
STATISTICS = ("mean", "std", "max")
MEAN_LENGTH = (8 / np.pi) ** 0.5  # of three normal deviates of 1: what a tracker's noise alone leaves


@dataclass(frozen=True)
class Spread:
    """A number of several arms: its median, the smallest and the largest."""

    median: float
    low: float
    high: float


Cell = str | float | Spread | None


@dataclass(frozen=True)
class Table:
    """A table of the paper: `rows` of cells, the first of each its label; `number` as in the paper ("Table 5")."""

    number: str
    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    note: str = ""
    kind: str = "table"


@dataclass(frozen=True)
class Series:
    """One curve: `mark` is line, points or bars; `role` gives its colour: paper, before, method, best, or a number."""

    name: str
    x: Sequence[float | str]
    y: Sequence[float]
    role: str = "method"
    mark: str = "line"


@dataclass(frozen=True)
class Chart:
    """A figure of the paper; axis titles name their units."""

    number: str
    title: str
    x: str
    y: str
    series: Sequence[Series]
    note: str = ""
    logarithmic: bool = False
    kind: str = "chart"


@dataclass(frozen=True)
class Absent:
    """A table or figure of the paper that is not here, and why."""

    number: str
    why: str
    kind: str = "absent"


Exhibit = Table | Chart | Absent


@dataclass(frozen=True)
class Section:
    """A part of the page."""

    title: str
    lead: str
    exhibits: Sequence[Exhibit]


@dataclass(frozen=True)
class Headline:
    """A measure by which the paper judges itself; smaller is better.

    Attributes:
        measure: What, with its unit.
        paper: The paper's own figure.
        method: The paper's method on the simulated arms.
        best: fastcal's best on the same data; `best_is` says which it is.
        why: Where the method does not reach the paper's figure, what was measured about why.
    """

    measure: str
    paper: float
    method: Spread
    best: Spread
    best_is: str
    why: str = ""

    @property
    def reached(self) -> bool:
        """Does the paper's method get to the paper's figure on the median arm?"""
        return self.method.median <= self.paper

    @property
    def bettered(self) -> bool:
        """Is fastcal's best strictly better than the paper's method here?"""
        return self.best.median < self.method.median


@dataclass(frozen=True)
class Page:
    """All that a study shows."""

    headlines: Sequence[Headline]
    sections: Sequence[Section]
    remarks: Sequence[str] = field(default=())


def spread(runs: Sequence[dict[str, object]], *path: str) -> Spread:
    """The number at `path` of every run; None (a parameter on its bound has no std) is left out."""
    values = []
    for run in runs:
        found: object = run
        for key in path:
            found = found[key]  # type: ignore[index]
        if found is not None:
            values.append(float(found))  # type: ignore[arg-type]
    if not values:
        return Spread(np.nan, np.nan, np.nan)
    return Spread(float(np.median(values)), float(np.min(values)), float(np.max(values)))


def lengths_mm(errors: np.ndarray) -> dict[str, float]:
    """mean, std (n - 1) and max of the lengths of errors (N, 3) [m], in mm."""
    length = np.linalg.norm(errors, axis=1) / MM
    return {"mean": float(length.mean()), "std": float(length.std(ddof=1)), "max": float(length.max())}


def statistics_rows(
    runs: Sequence[dict[str, object]],
    label: str,
    paper: Triple,
    method: Sequence[str] | None,
    best: Sequence[str] | None,
) -> list[list[Cell]]:
    """Three rows, mean, std and max: the paper's, its method's at the path `method`, fastcal's best at `best`."""
    return [
        [f"{label}, {name}", given, *(None if path is None else spread(runs, *path, name) for path in (method, best))]
        for name, given in zip(STATISTICS, paper, strict=True)
    ]


def terms_table(rows: Sequence[Sequence[Cell]]) -> Table:
    """What each line of a study was given: the rows, the loads, whether the base was refitted, the budget."""
    return Table(
        "Equal terms",
        "what each line was given",
        ("", "rows fitted", "loads", "base and tool", "budget"),
        rows,
        "Rows that a line is judged on are fitted by none.",
    )


def worlds_section(runs: Sequence[dict[str, object]], measure: str, lines: Mapping[str, str]) -> Section:
    """The same comparison with hidden errors of three forms: `lines` names the entries of each world of a run."""
    rows: list[list[Cell]] = [
        [what, *(spread(runs, "worlds", world, key) for key in lines)] for world, what in WORLD_NAMES.items()
    ]
    return Section(
        "Three worlds",
        "The hidden errors outside all models of this study are waves of the joints, which is the very form of "
        "fastcal's mlp and gp. Here they take two other forms of the same size (RMS at the point).",
        [Table("Three worlds", f"{measure} (mm)", ("hidden errors", *lines.values()), rows)],
    )


def worlds_won(runs: Sequence[dict[str, object]], line: str, rival: str) -> str:
    """In how many worlds the median of one line is below that of another: "2 of 3 worlds"."""
    won = [spread(runs, "worlds", w, line).median < spread(runs, "worlds", w, rival).median for w in WORLD_NAMES]
    return f"{sum(won)} of {len(won)} worlds"


COMPARED = ("mm", "paper", "paper's method here", "fastcal's best")
