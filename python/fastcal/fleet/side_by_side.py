# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Calibrates the arms of a fleet side by side: in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from fastcal.calibration.parallel import one_blas_thread
from fastcal.errors import InvalidInput
from fastcal.fleet.arms import Arm, check_names
from fastcal.fleet.one_arm import FILES, calibrate_arm
from fastcal.fleet.result import ArmResult, Fleet
from fastcal.io.folder import check_folder

Progress = Callable[[str], None]
Work = Callable[[Arm], ArmResult]

SUSPECT = 3.0  # times the median of the fleet: such an arm gets all checks
FEWEST = 5  # arms: fewer have no median to speak of
_BATCH = 25  # arms that a worker takes at once


def calibrate_many(
    arms: Sequence[Arm],
    *,
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    cluster: str | None = None,
    check_all: bool = False,
    reports: bool = False,
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
        progress: Called with a sentence at each step.
        **options: effects, loss, priors ... of `calibrate`.

    Raises:
        InvalidInput: Two arms of one name, a place that can't be written to, or a cluster that can't be reached.
    """
    check_names(arms)
    if jobs < 1:
        raise InvalidInput(f"jobs must be at least 1, got {jobs}")
    if out is not None:
        for arm in arms:
            check_folder(Path(out) / arm.name, FILES)
    report = progress or (lambda text: None)
    check_all = check_all or len(arms) < FEWEST

    with workers(jobs, cluster) as side_by_side:

        def run(some: Sequence[Arm], checks: bool) -> list[ArmResult]:
            work = partial(
                _batch, options=options, checks=checks, out=None if out is None else str(out), report=reports
            )
            parts = [some[at : at + _BATCH] for at in range(0, len(some), _BATCH)]
            found: list[ArmResult] = []
            for part in side_by_side(work, parts):
                found += part
                report(f"{len(found)} of {len(some)} arms")
            return found

        report(f"calibrating {len(arms)} arms")
        found = dict(zip((arm.name for arm in arms), run(arms, check_all), strict=True))
        if not check_all and (odd := suspects(list(found.values()))):
            report(f"looking closer at {len(odd)} arms")
            again = run([arm for arm in arms if arm.name in odd], True)
            found |= {row.name: row for row in again}
    return Fleet(list(found.values()))


def suspects(rows: Sequence[ArmResult]) -> set[str]:
    """Names of the arms that fit worse than others do, or not at all: the checks say why."""
    odd = {row.name for row in rows if row.status != "converged"}
    for field in ("before_mm", "after_mm"):
        known = [(getattr(row, field), row.name) for row in rows if getattr(row, field) is not None]
        if known:
            limit = SUSPECT * median(value for value, _ in known)
            odd |= {name for value, name in known if value > limit}
    return odd


@one_blas_thread()
def _batch(
    arms: Sequence[Arm], *, options: dict[str, Any], checks: bool, out: str | None, report: bool
) -> list[ArmResult]:
    return [
        calibrate_arm(
            arm, options, checks=checks, folder=None if out is None else str(Path(out) / arm.name), report=report
        )
        for arm in arms
    ]


@contextmanager
def workers(jobs: int, cluster: str | None) -> Iterator[Callable[[Any, Sequence[Any]], Iterator[Any]]]:
    """A function that calls another with each of some arguments, side by side, and gives what they return, in order.

    Raises:
        InvalidInput: The cluster can't be reached, or Dask is not installed.
    """
    if cluster is not None:
        with _dask(cluster) as side_by_side:
            yield side_by_side
    elif jobs == 1:
        yield map
    else:
        import joblib

        def in_processes(work: Any, parts: Sequence[Any]) -> Iterator[Any]:
            parallel = joblib.Parallel(n_jobs=jobs, return_as="generator", batch_size=1)
            return iter(parallel(joblib.delayed(work)(part) for part in parts))

        yield in_processes


@contextmanager
def _dask(address: str) -> Iterator[Callable[[Any, Sequence[Any]], Iterator[Any]]]:
    try:
        from distributed import Client
    except ImportError:
        raise InvalidInput("--cluster needs Dask: pip install 'fastcal[cluster]' brings it") from None
    try:
        client = Client(address, timeout="10s", set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        raise InvalidInput(f"{address}: there is no Dask scheduler that answers: {error}") from None

    def on_cluster(work: Any, parts: Sequence[Any]) -> Iterator[Any]:
        futures = client.map(work, parts, pure=False)
        return (future.result() for future in futures)

    with client:
        yield on_cluster
