# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The papers' networks and fastcal's on two real arms, a UR5 and a UR10, over random splits of their public rows."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.processes import workers
from fastcal.errors import InvalidInput
from fastcal.networks.problem import lengths_mm
from fastcal_studies.learning import HAS_TORCH, WITHOUT_TORCH
from fastcal_studies.real_data import CAMPAIGNS, Campaign, split
from fastcal_studies.real_page import page, sentence
from fastcal_studies.simulated import left
from fastcal_studies.study import Run

DEFAULT_SPLITS = 10
METHODS = ("bp", "bso", "somm", "ca", "ga_dnn", "mlp", "gp")
PROFILES = "geometry,joint_profile"

REFERENCE = (
    "UR5: github.com/pauljac7700/serial_robots_datasets. UR10: github.com/christianlandgraf/ipa-robot-accuracy. Both "
    "under the MIT licence."
)
HOW = (
    "UR5: 1,000 poses of a grid, a laser tracker, one target on the flange's axis. UR10: 1,495 (b) and 2,773 (c) poses "
    "of one arm, months apart, a tracker with a T-Mac. Files as published; nominal arms as shipped.",
    "Each split deals the rows at random, 70 % to learn and 30 % held back; seed k deals split k and starts all its "
    "networks. Geometry is fitted to the rows learnt, base and tool among it, with the default loss.",
    "Every network is one network, learnt from the same residuals of the same rows, without guard and without rivals: "
    "none is chosen by what it leaves. Nothing was tuned on these rows for the papers' networks, which have the sizes "
    "of their papers; fastcal's mlp and gp were developed while these sets were known.",
)


def run_real(
    folder: Path,
    *,
    splits: int = DEFAULT_SPLITS,
    full: bool = False,
    threads: int = 1,
    cluster: str | None = None,
    progress: Callable[[str], None] | None = None,
) -> Run:
    """The content of paper.json.

    Args:
        folder: With ur5_tracker/raw and ur10_tmac/raw, the files as published.
        splits: Of each campaign, seeds 0, 1, ...
        full: The papers' whole search budgets.
        threads: Splits at a time; the numbers do not depend on it.
        cluster: Address of a Dask scheduler to run on.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: No split, no torch, or a file is missing or not as published.
    """
    if splits < 1:
        raise InvalidInput(f"a study needs at least one split, got {splits}")
    if not HAS_TORCH:
        raise InvalidInput(f"the study of real arms: {WITHOUT_TORCH}")
    for campaign in CAMPAIGNS:
        campaign.rows(folder)  # all are there before long work begins
    todo = [(campaign, seed) for campaign in CAMPAIGNS for seed in range(splits)]
    runs: list[Run] = []
    with workers(min(threads, len(todo)), cluster) as side_by_side:
        for run in side_by_side.results(partial(one_split, folder=folder, full=full), todo):
            runs.append(run)
            if progress is not None:
                progress(f"{len(runs)} of {len(todo)} splits measured")
    return content(runs, full=full)


def one_split(what: tuple[Campaign, int], folder: Path, full: bool) -> Run:
    """What each method leaves [mm] of the rows that one split holds back."""
    from fastcal_studies.real_methods import behind

    campaign, seed = what
    learnt, unseen = split(campaign.rows(folder), seed)
    nominal = campaign.nominal()
    geometry = calibrate(nominal, learnt).model
    profiles = calibrate(nominal, learnt, effects=PROFILES).model
    curved = behind(profiles, learnt, unseen, ("bso", "somm"), seed, full)
    return {
        "campaign": campaign.name,
        "seed": seed,
        "rows": {"learnt": len(learnt), "unseen": len(unseen)},
        "unseen": {
            "geometry": lengths_mm(left(geometry, unseen)),
            "profiles": lengths_mm(left(profiles, unseen)),
            **behind(geometry, learnt, unseen, METHODS, seed, full),
            **{f"{name}_profiles": found for name, found in curved.items()},
        },
    }


def content(runs: Sequence[Run], *, full: bool = False) -> dict[str, Any]:
    """paper.json from the runs."""
    shown = dataclasses.asdict(page(runs))
    splits = len({run["seed"] for run in runs})
    return {
        "paper": {"name": "real", "robot": "UR5 and UR10", "reference": REFERENCE, "arm": HOW},
        "arms": splits,
        "simulated": False,
        "sentence": sentence(runs),
        "full": full,
        **shown,
        "runs": list(runs),
    }
