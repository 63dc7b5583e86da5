# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the SR210D study shows of its searches and networks: tables 2, 8 and 9, figures 7 to 9, convergence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fastcal.report.formatting import plural
from fastcal_studies.exhibits import (
    COMPARED,
    Absent,
    Cell,
    Chart,
    Exhibit,
    Section,
    Series,
    Spread,
    Table,
    spread,
    statistics_rows,
)
from fastcal_studies.learning import WITHOUT_TORCH
from fastcal_studies.study import Run

SECONDS = {"BAS": 0.087843, "BSO": None, "PSO": 0.215134, "GA": 0.262317, "ABC": 0.132563}
STARTS = {"random": "a random start", "bso": "BSO, the paper's", "pso": "PSO", "ga": "GA", "abc": "ABC"}


def networks(runs: Sequence[Run]) -> Section:
    """The section where networks were trained."""
    found: list[list[Cell]] = [
        [
            name,
            seconds,
            scaled(spread(runs, "searches", name, "share"), 100),
            _median([run["searches"][name]["evaluations"] for run in runs]),
        ]
        for name, seconds in SECONDS.items()
    ]
    exhibits: list[Exhibit] = [
        Table(
            "Table 2",
            "searches on the Michalewicz function",
            ("", "paper (s)", "reached, % of the starts", "evaluations where reached"),
            found,
            "20 starts an arm, 3000 evaluations each, until within 0.0001 of the minimum. Seconds depend on the "
            "machine and the program, evaluations don't. BAS is sent out anew when its steps have died out.",
        ),
        _converging(
            "Searches",
            "Michalewicz function, the first arm's starts",
            "above the minimum",
            {name: runs[0]["searches"][name]["curve"] for name in SECONDS},
            "Median of 20 starts; all that is within 1e-7 of the minimum is drawn there.",
        ),
        _converging(
            "Starts",
            "the network's start, the first arm",
            "loss",
            {name: runs[0]["starts"][name] for name in SECONDS if name in runs[0]["starts"]},
            "As many evaluations each; from there all are trained by gradients. The least loss at the end: "
            f"{_first(runs)}.",
        ),
    ]
    for part, number, what, before, after in (
        ("learnt", "Table 8", "200 poses learnt", (0.9262, 0.1632, 1.7435), (0.5907, 0.0760, 0.8834)),
        ("unseen", "Table 9", "200 others", (0.9370, 0.1871, 1.7633), (0.6522, 0.0887, 0.9834)),
    ):
        rows = statistics_rows(runs, "before", before, ("networks", "before", part), ("networks", "best_before", part))
        rows += statistics_rows(runs, "after", after, ("networks", "bso", part), ("networks", "best", part))
        exhibits.append(Table(number, what, COMPARED, rows))
    rivals: list[list[Cell]] = [
        [name, *(spread(runs, "networks", key, part, "mean") for part in ("learnt", "unseen"))]
        for key, name in {**STARTS, "mlp": "fastcal's mlp behind the paper's model",
                          "bso_ours": "BSO-MLP behind fastcal's model",
                          "best_mlp": "fastcal's mlp behind fastcal's",
                          "by_current": "fastcal's gp behind compliances by current",
                          "best": "fastcal's gp behind fastcal's"}.items()
    ]  # fmt: skip
    exhibits.append(
        Table(
            "Rivals",
            "mean error (mm) with equal budgets",
            ("", "200 learnt", "200 others"),
            rivals,
            "The first five are one network of 20 sigmoids: its start from as many evaluations of each search, then "
            "the same 400 epochs.",
        )
    )
    more: list[list[Cell]] = [list(row) for row in by_rows(runs)]
    exhibits.append(Table("More poses", "fastcal's best by poses learnt (mm)", ("poses", "200 others, mean"), more))
    axes = runs[0]["axes"]
    exhibits.append(
        Chart("Figure 7", "residuals by axis before the network, 200 learnt, the first arm", "pose", "residual (mm)",
              [Series(axis, list(range(1, 201)), axes[axis], str(k), "points") for k, axis in enumerate("XYZ")])
    )  # fmt: skip
    own = runs[0]["networks"]
    for number, part in (("Figure 8", "learnt"), ("Figure 9", "unseen")):
        key = f"{part}_by_pose"
        exhibits.append(Chart(number, f"before and after the network, {part}, the first arm", "pose", "error (mm)",
                              [numbered("before", own["before"][key], "before"), numbered("BSO-MLP", own["bso"][key]),
                               numbered("fastcal's best", own["best"][key], "best")]))  # fmt: skip
    return Section(
        "The network for what no model has",
        "200 poses with 210 kg are learnt, 200 others are not. The paper's network maps joints to points.",
        exhibits,
    )


def _converging(number: str, title: str, value: str, curves: Mapping[str, Run], note: str) -> Chart:
    """The best value by evaluations of each search."""
    roles = {name: str(k) for k, name in enumerate(SECONDS)}  # the same colour in each chart
    series = [Series(name, curve["evaluations"], curve["values"], roles[name]) for name, curve in curves.items()]
    return Chart(number, title, "evaluations", value, series, note, logarithmic=True)


def _first(runs: Sequence[Run]) -> str:
    """How often each search finds the best start, in words."""
    best = [min(run["starts"], key=lambda name: run["starts"][name]["values"][-1]) for run in runs]
    return ", ".join(f"{name} on {plural(best.count(name), 'arm')}" for name in SECONDS if name in best)


def no_networks() -> Section:
    """The section where they are missing."""
    return Section(
        "The network for what no model has",
        "The paper's network maps joints to points.",
        [Absent(name, WITHOUT_TORCH) for name in ("Table 2", "Table 8", "Table 9", "Figure 7", "Figure 8", "Figure 9")],
    )


def by_rows(runs: Sequence[Run]) -> list[tuple[str, Spread]]:
    """Poses learnt, and the mean error of others."""
    counts = sorted(runs[0]["by_rows"], key=int)
    return [
        ("200", spread(runs, "networks", "best", "unseen", "mean")),
        *((n, spread(runs, "by_rows", n)) for n in counts),
    ]


def numbered(name: str, values: Sequence[float], role: str = "method") -> Series:
    """A curve over the poses, counted from 1."""
    return Series(name, list(range(1, len(values) + 1)), values, role)


def scaled(found: Spread, factor: float) -> Spread:
    """The same in another unit."""
    low, high = sorted((found.low * factor, found.high * factor))
    return Spread(found.median * factor, low, high)


def _median(values: Sequence[float | None]) -> float | None:
    known = sorted(value for value in values if value is not None)
    return known[len(known) // 2] if known else None
