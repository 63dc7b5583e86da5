# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the study of real arms shows: what each method leaves, and which differences are certain."""

from __future__ import annotations

from collections.abc import Sequence

from fastcal_studies.exhibits import Cell, Chart, Exhibit, Page, Section, Series, Table, spread
from fastcal_studies.paired import Paired, paired
from fastcal_studies.study import Run

NAMES = {
    "geometry": "geometry alone",
    "bp": "backpropagation, one layer of 20",
    "bso": "BSO-MLP (SR210D)",
    "somm": "SOMM-ANN (PMC)",
    "ca": "CA-SOMM-ANN (PMC)",
    "ga_dnn": "GA-DNN (RX160L)",
    "profiles": "joint profiles (no network)",
    "bso_profiles": "BSO-MLP behind joint profiles",
    "somm_profiles": "SOMM-ANN behind joint profiles",
    "mlp": "mlp",
    "gp": "gp",
}
BUDGETS = {
    "geometry": "none",
    "bp": "400 epochs",
    "bso": "a swarm of 30, then the same 400 epochs",
    "somm": "200 epochs of three networks, the paper's sizes",
    "ca": "a classifier and twice SOMM-ANN's",
    "ga_dnn": "5 generations of 100, then 400 epochs",
    "profiles": "none: one fit with geometry",
    "bso_profiles": "BSO-MLP's",
    "somm_profiles": "SOMM-ANN's",
    "mlp": "twice 150 epochs",
    "gp": "60 steps on 200 rows, then exact up to 1,500 rows",
}
PAPERS = ("bp", "bso", "somm", "ca", "ga_dnn")
OURS = ("mlp", "gp")
CURVED = ("profiles", "bso_profiles", "somm_profiles")
STATISTICS = ("mean", "rms", "max")


def page(runs: Sequence[Run]) -> Page:
    """A section a campaign."""
    return Page([], [_section(name, own) for name, own in by_campaign(runs).items()], [_profiles(runs)])


def by_campaign(runs: Sequence[Run]) -> dict[str, list[Run]]:
    """The splits of each campaign, in the order of the runs."""
    out: dict[str, list[Run]] = {}
    for run in runs:
        out.setdefault(run["campaign"], []).append(run)
    return out


def compared(runs: Sequence[Run], first: str, second: str, statistic: str = "mean") -> Paired:
    """What `first` leaves more than `second`, over the splits of one campaign [mm]."""
    more, less = ([run["unseen"][name][statistic] for run in runs] for name in (first, second))
    rows = runs[0]["rows"]
    return paired(more, less, rows["learnt"], rows["unseen"])


def best(runs: Sequence[Run], names: Sequence[str], statistic: str = "mean") -> str:
    """The method of the least median."""
    return min(names, key=lambda name: spread(runs, "unseen", name, statistic).median)


def sentence(runs: Sequence[Run]) -> str:
    """Where fastcal's networks win against the papers', and where they do not."""
    wins: list[str] = []
    not_wins: list[str] = []
    for name, own in by_campaign(runs).items():
        for statistic in STATISTICS:
            ours, rival = best(own, OURS, statistic), best(own, PAPERS, statistic)
            found = compared(own, rival, ours, statistic)
            (wins if found.low > 0 else not_wins).append(f"{name} {statistic}")
    text = f"The better of mlp and gp leaves less than the best of the papers' networks in {_listed(wins)}"
    return text + (f"; it is not certain to in {_listed(not_wins)}." if not_wins else ", everywhere measured.")


def _listed(words: Sequence[str]) -> str:
    if not words:
        return "none of the measures"
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _profiles(runs: Sequence[Run]) -> str:
    """What the curves of the joints, which need no network, leave beside the networks."""
    parts = []
    for name, own in by_campaign(runs).items():
        ours, curved = best(own, OURS), best(own, CURVED[1:])
        found = compared(own, curved, ours)
        far = "certain" if found.is_certain else "not certain"
        profiles, behind, least = (spread(own, "unseen", key, "mean").median for key in ("profiles", curved, ours))
        parts.append(
            f"{name}: joint profiles {profiles:.3f} mm, {NAMES[curved]} {behind:.3f}, {ours} {least:.3f}; the last two "
            f"differ by {found.mean:.4f} ({found.low:.4f} to {found.high:.4f}), which is {far}"
        )
    return (
        "Most of the lead is the joints' own curves, which the papers' networks have to learn as three coordinates. "
        + ("; ".join(parts) + ".")
    )


def _section(name: str, runs: Sequence[Run]) -> Section:
    rows: list[list[Cell]] = [
        [NAMES[key], BUDGETS[key], *(spread(runs, "unseen", key, statistic) for statistic in STATISTICS)]
        for key in NAMES
    ]
    rival = best(runs, PAPERS)
    pairs = [(first, second) for second in OURS for first in ("geometry", rival, *CURVED)] + [("mlp", "gp")]
    differences: list[list[Cell]] = [
        [f"{NAMES[first]} less {second}", found.mean, found.low, found.high, found.p]
        for first, second in pairs
        for found in (compared(runs, first, second),)
    ]
    counts = runs[0]["rows"]
    splits = [run["seed"] for run in runs]
    exhibits: list[Exhibit] = [
        Table(
            "Errors",
            f"{name}, {counts['unseen']} rows held back (mm)",
            ("", "budget", *STATISTICS),
            rows,
            "Medians of the splits, in brackets the least and the greatest. All are behind the geometry of the same "
            "rows, one network each, but those that say otherwise.",
        ),
        Table(
            "Differences",
            f"{name}, of the mean errors (mm)",
            ("", "mean", "95 % from", "to", "p"),
            differences,
            "By the corrected resampled t test of Nadeau and Bengio (2003): the splits share rows, which the plain t "
            "test takes for independent evidence.",
        ),
        Chart(
            "Splits",
            f"{name}, mean error by split",
            "split",
            "mean error (mm)",
            [
                Series(NAMES[key], splits, [run["unseen"][key]["mean"] for run in runs], role, "points")
                for key, role in (("geometry", "before"), (rival, "method"), ("profiles", "0"), ("mlp", "best"))
            ],
        ),
    ]
    return Section(name, f"{counts['learnt']} rows are learnt, {counts['unseen']} held back.", exhibits)
