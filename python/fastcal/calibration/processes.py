# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Work side by side: in this process, in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from fastcal.errors import InvalidInput

_FEWEST = 5  # items in a share
_SCHEMES = ("tcp", "tls", "ws", "wss", "inproc")
_MESSAGE = 2**22  # bytes: Dask warns of messages of more than ten million


@dataclass(frozen=True)
class SideBySide:
    """Work for many at once.

    Attributes:
        count: How many are at work at once.
        results: What a function returns for each of some arguments, in their order.
    """

    count: int
    results: Callable[[Callable[[Any], Any], Sequence[Any]], Iterator[Any]]

    def shares(self, items: Sequence[Any], most: int) -> list[Sequence[Any]]:
        """Items in parts, in order, at most so many in one.

        Each part has its price, so the first are large; the last are small, so that all end together.
        """
        parts, at = [], 0
        while at < len(items):
            size = min(most, max(_FEWEST, (len(items) - at) // (3 * self.count)))
            parts.append(items[at : at + size])
            at += size
        return parts


@contextmanager
def workers(jobs: int, cluster: str | None) -> Iterator[SideBySide]:
    """Those who work side by side.

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
        yield SideBySide(1, map)
    else:
        import joblib

        def in_processes(work: Any, parts: Sequence[Any]) -> Iterator[Any]:
            parallel = joblib.Parallel(n_jobs=jobs, return_as="generator", batch_size=1)
            return iter(parallel(joblib.delayed(work)(part) for part in parts))

        yield SideBySide(jobs, in_processes)


@contextmanager
def _dask(address: str) -> Iterator[SideBySide]:
    scheme = address.partition("://")[0] if "://" in address else "tcp"
    if scheme not in _SCHEMES:
        raise InvalidInput(f"{address}: expected the address of a Dask scheduler, such as tcp://10.0.0.1:8786")
    try:
        from distributed import Client
        from distributed.protocol.pickle import dumps
    except ImportError:
        raise InvalidInput("a cluster needs Dask: pip install 'fastcal[cluster]' brings it") from None
    try:
        client = Client(address, timeout="10s", set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        raise InvalidInput(f"{address}: there is no Dask scheduler that answers: {error}") from None

    count = max(1, sum(client.nthreads().values()))  # type: ignore[no-untyped-call]

    def on_cluster(work: Any, parts: Sequence[Any]) -> Iterator[Any]:
        # Few messages, since each has its price; the first parts are at work while the rest are packed.
        futures: list[Any] = []
        packed: list[bytes] = []
        for number, part in enumerate(parts, start=1):
            packed.append(dumps((work, part)))  # type: ignore[no-untyped-call]
            if number in (2 * count, len(parts)) or sum(map(len, packed)) > _MESSAGE:
                futures += client.map(_worked_out, packed, pure=False)
                packed = []
        return (pickle.loads(future.result()) for future in futures)  # noqa: S301 - written by our own workers

    with client:
        yield SideBySide(count, on_cluster)


def _worked_out(packed: bytes) -> bytes:
    """What a piece of work returns: both travel as one block, where Dask would send each array by itself."""
    work, part = pickle.loads(packed)  # noqa: S301 - written by `on_cluster`
    return pickle.dumps(work(part), pickle.HIGHEST_PROTOCOL)
