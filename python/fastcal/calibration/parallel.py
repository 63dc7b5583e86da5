# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Independent pieces of work side by side, each worked out as it would be alone: no result depends on the threads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from concurrent.futures import Executor

Item = TypeVar("Item")
Result = TypeVar("Result")

_pool: ContextVar[tuple[Executor, int] | None] = ContextVar("pool", default=None)
_is_alone: ContextVar[bool] = ContextVar("is_alone", default=False)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Within, BLAS has one thread a call: how it shares a product out changes its last bits.

    It would spend most of its time waiting, too, where there are many small matrices.
    """
    if _is_alone.get():
        yield
        return
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        before = _is_alone.set(True)
        try:
            yield
        finally:
            _is_alone.reset(before)


@contextmanager
def workers(threads: int) -> Iterator[None]:
    """Within, `each` has so many threads, the caller's among them, and BLAS one a call."""
    from concurrent.futures import ThreadPoolExecutor  # only few commands need them

    with one_blas_thread(), ThreadPoolExecutor(max(threads - 1, 1)) as pool:
        before = _pool.set((pool, threads - 1) if threads > 1 else None)
        try:
            yield
        finally:
            _pool.reset(before)


def each(work: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """What `work` makes of each item, in their order; the first error where one fails.

    One thread outside of `workers`, and within a piece of work: a thread never waits for another one's turn. A single
    item is worked out as if it were the caller's own, who may share out its pieces.
    """
    helped, items = _pool.get(), list(items)
    if helped is None or len(items) < 2:
        return list(map(work, items))
    pool, helpers = helped
    results: list[Any] = [None] * len(items)
    errors: dict[int, Exception] = {}
    left = iter(range(len(items)))

    def some() -> None:
        for k in left:
            try:
                results[k] = work(items[k])
            except Exception as error:  # noqa: BLE001 - the caller raises it
                errors[k] = error

    others = [pool.submit(some) for _ in range(min(helpers, len(items) - 1))]
    before = _pool.set(None)
    try:
        some()
    finally:
        _pool.reset(before)
    for other in others:
        other.result()
    if errors:
        raise errors[min(errors)]
    return results
