# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Work side by side: in this process, in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from fastcal.errors import InvalidInput

SideBySide = Callable[[Callable[[Any], Any], Sequence[Any]], Iterator[Any]]


@contextmanager
def workers(jobs: int, cluster: str | None) -> Iterator[SideBySide]:
    """A function that calls another with each of some arguments, side by side, and gives what they return, in order.

    Args:
        jobs: Processes of this machine; no result may depend on it.
        cluster: Address of a Dask scheduler in their place, such as "tcp://10.0.0.1:8786".

    Raises:
        InvalidInput: No process, a cluster that can't be reached, or Dask is not installed.
    """
    if jobs < 1:
        raise InvalidInput(f"jobs must be at least 1, got {jobs}")
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
def _dask(address: str) -> Iterator[SideBySide]:
    try:
        from distributed import Client
        from distributed.protocol.pickle import dumps
    except ImportError:
        raise InvalidInput("a cluster needs Dask: pip install 'fastcal[cluster]' brings it") from None
    try:
        client = Client(address, timeout="10s", set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        raise InvalidInput(f"{address}: there is no Dask scheduler that answers: {error}") from None

    def on_cluster(work: Any, parts: Sequence[Any]) -> Iterator[Any]:
        # One after the other: the first are at work while the rest are packed.
        packed = (dumps((work, part)) for part in parts)  # type: ignore[no-untyped-call]
        futures = [client.submit(_worked_out, each, pure=False) for each in packed]
        return (pickle.loads(future.result()) for future in futures)  # noqa: S301 - written by our own workers

    with client:
        yield on_cluster


def _worked_out(packed: bytes) -> bytes:
    """What a piece of work returns: both travel as one block, where Dask would send each array by itself."""
    work, part = pickle.loads(packed)  # noqa: S301 - written by `on_cluster`
    return pickle.dumps(work(part), pickle.HIGHEST_PROTOCOL)
