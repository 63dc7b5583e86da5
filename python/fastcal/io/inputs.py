# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The files that a command has read: readers note them, writers refuse to replace them.

So it does not matter how a file was named: on the command line, in a list, by another file, by a link, or by the name
that goes with another's.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from fastcal.errors import InvalidInput

_File = tuple[int, int]  # device and inode
_noted: ContextVar[set[_File] | None] = ContextVar("noted", default=None)


@contextmanager
def kept() -> Iterator[None]:
    """While a command runs, what it reads may not be what it writes; a program may load and save as it likes."""
    token = _noted.set(set())
    try:
        yield
    finally:
        _noted.reset(token)


@contextmanager
def replaceable() -> Iterator[None]:
    """What is read in the block is the command's own earlier result, which a new one may replace."""
    token = _noted.set(None)
    try:
        yield
    finally:
        _noted.reset(token)


def note(found: os.stat_result) -> None:
    """Notes a file that is being read."""
    noted = _noted.get()
    if noted is not None:
        noted.add((found.st_dev, found.st_ino))


def refuse(target: Path) -> None:
    """Refuses a place to write to that is a file which was read.

    Raises:
        InvalidInput: It is: under this name or another.
    """
    noted = _noted.get()
    if not noted:
        return
    try:
        found = target.stat()
    except OSError:  # there is none yet
        return
    if (found.st_dev, found.st_ino) in noted:
        raise InvalidInput(f"{target}: is an input of this command; choose another output")
