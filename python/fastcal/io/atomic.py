# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Files that appear whole or not at all: written beside their place under another name, then moved there.

Their content is on the disk before the move, and the move before the call returns, so that a power cut too leaves
either the old file or the new one. What a killed process left behind is removed by the next that writes there.
"""

from __future__ import annotations

import fcntl
import os
import secrets
import shutil
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from fastcal.errors import InvalidInput

PREFIX = ".fastcal-"
# Temporary folders that are being filled: their files come to the disk with them, so none is waited for on its own.
_BEING_FILLED: set[Path] = set()


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Gives a temporary name in the same folder, with the same ending; moves it to `path` if the block succeeds.

    An older file at `path` stays as it was until then, and stays if the block raises.

    Raises:
        InvalidInput: The file cannot be written there.
    """
    with atomic_paths([path]) as (temporary,):
        yield temporary


@contextmanager
def atomic_paths(paths: Sequence[str | os.PathLike[str]]) -> Iterator[list[Path]]:
    """`atomic_path` of files that belong together, such as a program and the plan that it follows.

    At any moment the files that are there are of one result, the old or the new: before the first is replaced the older
    others are removed. Killed in between, some are missing; none stands beside a file of another result.

    Raises:
        InvalidInput: A file cannot be written there.
    """
    # A link is followed, as a plain write would, so that it stays a link.
    targets = [Path(path).resolve() for path in paths]
    finish = _nothing if all(target.parent in _BEING_FILLED for target in targets) else sync
    try:
        with ExitStack() as stack:
            temporaries = []
            for path, target in zip(paths, targets, strict=True):
                # A move onto a device would replace it.
                if target.exists() and not target.is_file():
                    raise InvalidInput(f"{path}: cannot be written: it is not a regular file")
                place = temporary_place(target.parent, f".{target.name}", folder=False)
                temporaries.append(stack.enter_context(place))
            yield temporaries
            for temporary in temporaries:
                finish(temporary)
            for target in targets[1:]:
                target.unlink(missing_ok=True)
                finish(target.parent)
            for temporary, target in zip(temporaries, targets, strict=True):
                temporary.replace(target)
                finish(target.parent)
    except (OSError, UnicodeEncodeError) as error:
        names = " and ".join(map(str, paths))
        raise InvalidInput(f"{names}: cannot be written: {getattr(error, 'strerror', None) or error}") from error


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes UTF-8 text with unix line ends, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Writes bytes, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def temporary_place(parent: Path, ending: str, *, folder: bool) -> Iterator[Path]:
    """An empty file or folder of its own in `parent`, removed at the end; a lock on it says that its owner lives."""
    remove_abandoned(parent)
    place = parent / f"{PREFIX}{secrets.token_hex(6)}{ending}"
    lock = -1
    try:
        if folder:
            place.mkdir()
            _BEING_FILLED.add(place)
        else:
            os.close(os.open(place, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        with suppress(OSError):  # a file system without locks: then nobody removes what is abandoned
            lock = os.open(place, os.O_RDONLY)
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield place
    finally:
        _BEING_FILLED.discard(place)
        remove(place)
        if lock >= 0:
            os.close(lock)


def remove_abandoned(parent: Path) -> None:
    """Removes temporary files and folders in `parent` whose owner was killed: nobody holds their lock."""
    with suppress(OSError):
        for place in parent.glob(f"{PREFIX}*"):
            with suppress(OSError):
                found = os.open(place, os.O_RDONLY | os.O_NOFOLLOW)
                try:
                    fcntl.flock(found, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    remove(place)
                finally:
                    os.close(found)


def remove(place: Path) -> None:
    """Removes a file or a folder with all that is in it, if it is there and may be removed."""
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place, ignore_errors=True)
    else:
        with suppress(OSError):
            place.unlink()


def _nothing(_place: Path) -> None:
    """Instead of `sync`."""


def sync(place: Path) -> None:
    """Waits until a file, or the names in a folder, are on the disk."""
    found = os.open(place, os.O_RDONLY)
    try:
        with suppress(OSError):  # file systems that can't do it for folders
            os.fsync(found)
    finally:
        os.close(found)
