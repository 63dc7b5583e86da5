# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Calibrates or diagnoses the arms of a fleet side by side: in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence, Sized
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from fastcal.calibration.parallel import one_blas_thread
from fastcal.calibration.processes import SideBySide, workers
from fastcal.fleet.arms import Arm, check_names
from fastcal.fleet.one_arm import FILES, calibrate_arm, diagnose_arm
from fastcal.fleet.result import ArmResult, Fleet
from fastcal.io.folder import check_folder
from fastcal.said import said

Progress = Callable[[str], None]
Work = Callable[..., ArmResult]  # of an arm, and the folder that it gets or None

SUSPECT = 3.0  # times the median of the fleet: such an arm gets all checks
FEWEST = 5  # arms: fewer have no median to speak of
_MOST = 60  # arms that a worker takes at once


def _arms(arms: Sized) -> str:
    return said("1 arm") if len(arms) == 1 else said("{count} arms", count=len(arms))


def calibrate_many(
    arms: Sequence[Arm],
    *,
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    cluster: str | None = None,
    check_all: bool = False,
    reports: bool = False,
    language: str = "en",
    progress: Progress | None = None,
    **options: Any,
) -> Fleet:
    """Calibrates many arms, each as `calibrate` does; one that can't be is a row with the reason.

    What `calibrate` asks of columns and residuals takes ten times as long as the fit. It is asked of arms that fit
    worse than the others do (three times the median error before or after), and of all arms of a small fleet.

    Args:
        arms: From `read_list`, or made of robots and data sets; names differ.
        out: A folder: each arm gets one in it, and an arm whose files and options are those of an earlier run is taken
            from there. None: nothing is written.
        jobs: Processes; no result depends on it.
        cluster: Address of a Dask scheduler, such as "tcp://10.0.0.1:8786"; its workers see the same files.
        check_all: Ask it of every arm.
        reports: Write a page for every arm (0.1 s each).
        language: Of these pages: en or de.
        progress: Called with a sentence at each step.
        **options: effects, loss, priors ... of `calibrate`.

    Raises:
        InvalidInput: Two arms of one name, a place that can't be written to, or a cluster that can't be reached.
    """
    _check(arms, out)
    check_all = check_all or len(arms) < FEWEST
    report = progress or _silent

    with one_blas_thread(), workers(jobs, cluster) as side_by_side:  # to set it takes a third of an arm's time

        def run(some: Sequence[Arm], checks: bool) -> list[ArmResult]:
            work = partial(calibrate_arm, options=options, checks=checks, report=reports, language=language)
            return _rows(some, work, out, _MOST, side_by_side, report)

        report(said("calibrating {arms}", arms=_arms(arms)))
        found = dict(zip((arm.name for arm in arms), run(arms, check_all), strict=True))
        if not check_all and (odd := suspects(list(found.values()))):
            report(said("examining {arms} more closely", arms=_arms(odd)))
            again = run([arm for arm in arms if arm.name in odd], True)
            found |= {row.name: row for row in again}
    return Fleet(list(found.values()))


def diagnose_many(
    arms: Sequence[Arm],
    *,
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    cluster: str | None = None,
    language: str = "en",
    progress: Progress | None = None,
    **options: Any,
) -> Fleet:
    """Diagnoses many arms, each as `diagnose` does; one that can't be is a row with the reason.

    Args:
        arms: As for `calibrate_many`.
        out: A folder: each arm gets one in it, with the files of `fastcal diagnose`, and an arm whose files and options
            are those of an earlier run is taken from there. None: nothing is written.
        jobs: Processes; no result depends on it.
        cluster: Address of a Dask scheduler; its workers see the same files.
        language: Of the arms' pages: en or de.
        progress: Called with a sentence at each step.
        **options: exclude, sigma, as_read of `diagnose`.

    Raises:
        InvalidInput: Two arms of one name, a place that can't be written to, or a cluster that can't be reached.
    """
    _check(arms, out)
    report = progress or _silent
    with workers(jobs, cluster) as side_by_side:
        report(said("diagnosing {arms}", arms=_arms(arms)))
        work = partial(diagnose_arm, options=options, language=language)
        return Fleet(_rows(arms, work, out, 1, side_by_side, report))


def suspects(rows: Sequence[ArmResult]) -> set[str]:
    """Names of the arms that fit worse than others of which the same was read, or not at all: the checks say why."""
    odd = {row.name for row in rows if row.status != "converged"}
    for kind in {row.kind for row in rows}:
        for field in ("before", "after"):
            known = [(value, r.name) for r in rows if r.kind == kind and (value := getattr(r, field)) is not None]
            if known:
                limit = SUSPECT * median(value for value, _ in known)
                odd |= {name for value, name in known if value > limit}
    return odd


def _check(arms: Sequence[Arm], out: str | os.PathLike[str] | None) -> None:
    check_names(arms)
    if out is not None:
        for arm in arms:
            check_folder(Path(out) / arm.name, FILES)


def _silent(text: str) -> None:
    """No progress is asked for."""


def _rows(
    arms: Sequence[Arm],
    work: Work,
    out: str | os.PathLike[str] | None,
    most: int,
    side_by_side: SideBySide,
    report: Progress,
) -> list[ArmResult]:
    """What `work` makes of each arm, so many at once."""
    parts = side_by_side.shares(arms, most)
    found: list[ArmResult] = []
    for part in side_by_side.results(partial(_batch, work=work, out=None if out is None else str(out)), parts):
        found += part
        report(said("{found} of {arms} done", found=len(found), arms=_arms(arms)))
    return found


@one_blas_thread()
def _batch(arms: Sequence[Arm], *, work: Work, out: str | None) -> list[ArmResult]:
    return [work(arm, folder=None if out is None else str(Path(out) / arm.name)) for arm in arms]
