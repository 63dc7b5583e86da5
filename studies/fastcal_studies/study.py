# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Runs a study: arm by arm, on as many cores or on a Dask cluster as there are, into the content of paper.json."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, cast

from fastcal.calibration.processes import workers
from fastcal.errors import InvalidInput
from fastcal_studies.exhibits import Page

Run = dict[str, Any]
NAMES = ("siasun_sr210d", "kuka_kr500", "pmc6va030", "staubli_rx160l", "spray_7dof")
DEFAULT_ARMS = 3


@dataclass(frozen=True)
class Paper:
    """A paper and what of its arm the study had to choose.

    Attributes:
        robot: Name of the shipped arm.
        reference: Authors, title, place.
        arm: What the hidden arm is made of: printed parameters first, then what the paper leaves out.
    """

    robot: str
    reference: str
    arm: Sequence[str]


class Study(Protocol):
    """What the module of a study has."""

    PAPER: Paper

    def one_arm(self, seed: int, full: bool) -> Run:
        """Simulates, measures and calibrates one arm; numbers, texts and lists of them."""

    def page(self, runs: Sequence[Run]) -> Page:
        """Tables and figures from the runs of all arms; fits nothing."""


def load_study(name: str) -> Study:
    """The module of a study.

    Raises:
        InvalidInput: There is none of that name.
    """
    if name not in NAMES:
        raise InvalidInput(f"unknown paper '{name}', expected one of {', '.join(NAMES)}")
    return cast("Study", importlib.import_module(f"fastcal_studies.{name}"))


def run_study(
    name: str,
    *,
    arms: int = DEFAULT_ARMS,
    full: bool = False,
    threads: int = 1,
    cluster: str | None = None,
    diagnose: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Run:
    """The content of paper.json.

    Args:
        name: Of the study, one of NAMES.
        arms: How many simulated arms, seeds 0, 1, ...
        full: The paper's whole search budgets, where the default is a smaller one.
        threads: Arms at a time; the numbers do not depend on it.
        cluster: Address of a Dask scheduler to run on.
        diagnose: Diagnose the arms on the study's own rows as well: a section of the page.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: An unknown name, or no arm.
    """
    module = load_study(name)
    if arms < 1:
        raise InvalidInput(f"a study needs at least one arm, got {arms}")
    runs: list[Run] = []
    with workers(min(threads, arms), cluster) as side_by_side:
        for run in side_by_side.results(partial(module.one_arm, full=full), range(arms)):
            runs.append(run)
            if progress is not None:
                progress(f"{len(runs)} of {arms} arms measured")
    told = None
    if diagnose:
        from fastcal_studies.diagnoses import diagnosed  # builds on this module

        told = diagnosed(name, arms, progress)
    return content(name, runs, full=full, told=told)


def content(name: str, runs: Sequence[Run], *, full: bool = False, told: Sequence[Run] | None = None) -> Run:
    """paper.json from the runs: what was measured and what the page shows of it; `told` by a diagnosis of each arm."""
    module = load_study(name)
    shown = module.page(runs)
    if told is not None:
        from fastcal_studies.diagnoses import section  # builds on this module

        shown = dataclasses.replace(shown, sections=[*shown.sections, section(told)])
    page = dataclasses.asdict(shown)
    for headline, entry in zip(shown.headlines, page["headlines"], strict=True):
        entry |= {"reached": headline.reached, "bettered": headline.bettered}
    return {
        "paper": {"name": name, **dataclasses.asdict(module.PAPER)},
        "arms": len(runs),
        "full": full,
        **page,
        "runs": list(runs),
        **({} if told is None else {"diagnoses": list(told)}),
    }
