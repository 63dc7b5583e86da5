# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Runs a study: arm by arm, on as many cores or on a Dask cluster as there are, into the content of paper.json."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol, cast

import joblib

from fastcal.errors import InvalidInput
from fastcal.papers.exhibits import Page

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
    return cast("Study", importlib.import_module(f"fastcal.papers.{name}"))


def run_study(
    name: str,
    *,
    arms: int = DEFAULT_ARMS,
    full: bool = False,
    threads: int = 1,
    cluster: str | None = None,
    progress: Callable[[str], None] | None = None,
) -> Run:
    """The content of paper.json.

    Args:
        name: Of the study, one of NAMES.
        arms: How many simulated arms, seeds 0, 1, ...
        full: The paper's whole search budgets, where the default is a smaller one.
        threads: Arms at a time; the numbers do not depend on it.
        cluster: Address of a Dask scheduler to run on.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: An unknown name, or no arm.
    """
    module = load_study(name)
    if arms < 1:
        raise InvalidInput(f"a study needs at least one arm, got {arms}")
    runs: list[Run] = []
    with _workers(cluster):
        work = joblib.Parallel(n_jobs=min(threads, arms) if cluster is None else arms, return_as="generator")
        for run in work(joblib.delayed(module.one_arm)(seed, full) for seed in range(arms)):
            runs.append(run)
            if progress is not None:
                progress(f"{len(runs)} of {arms} arms measured")
    return content(name, runs, full=full)


def content(name: str, runs: Sequence[Run], *, full: bool = False) -> Run:
    """paper.json from the runs: what was measured and what the page shows of it."""
    module = load_study(name)
    shown = module.page(runs)
    page = dataclasses.asdict(shown)
    for headline, entry in zip(shown.headlines, page["headlines"], strict=True):
        entry |= {"reached": headline.reached, "bettered": headline.bettered}
    return {
        "paper": {"name": name, **dataclasses.asdict(module.PAPER)},
        "arms": len(runs),
        "full": full,
        **page,
        "runs": list(runs),
    }


@contextmanager
def _workers(cluster: str | None) -> Iterator[None]:
    """Where the arms are run meanwhile: here, or on a cluster.

    Raises:
        InvalidInput: A cluster without Dask, or one that does not answer.
    """
    if cluster is None:
        yield
        return
    try:
        from dask.distributed import Client
    except ImportError:
        raise InvalidInput("a cluster needs Dask: pip install 'fastcal[cluster]'") from None
    try:
        client = Client(cluster)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InvalidInput(f"no Dask scheduler answers at {cluster}: {error}") from None
    with client, joblib.parallel_config("dask"):
        yield
