# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cache of large computed objects, limited in bytes."""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")
MOST_BYTES = 256e6


class Recent(Generic[T]):
    """What was worked out for owners, the latest asked for; it goes with them.

    Args:
        size: Bytes of one.
        most: Bytes of all that are kept; the latest is, however large.
    """

    def __init__(self, size: Callable[[T], float], most: float = MOST_BYTES) -> None:
        self._size, self._most = size, most
        self._kept: OrderedDict[int, T] = OrderedDict()
        self._asked: set[int] = set()
        self._bytes = 0.0
        self._lock = threading.RLock()  # an owner may end while it is held

    def of(self, owner: object, made: Callable[[], T]) -> T:
        """That of an owner, made where it is not kept."""
        key = id(owner)
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        found = made()
        with self._lock:
            if key not in self._asked:
                self._asked.add(key)
                weakref.finalize(owner, self._forget, key)
            self._drop(key)
            self._kept[key] = found
            self._bytes += self._size(found)
            while self._bytes > self._most and len(self._kept) > 1:
                self._drop(next(iter(self._kept)))
        return found

    def was_asked(self, owner: object) -> bool:
        """Was it ever made for this owner?"""
        return id(owner) in self._asked

    def _drop(self, key: int) -> None:
        if key in self._kept:
            self._bytes -= self._size(self._kept.pop(key))

    def _forget(self, key: int) -> None:
        with self._lock:
            self._drop(key)
            self._asked.discard(key)
