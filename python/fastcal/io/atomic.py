# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Files that appear whole or not at all: written beside their place under another name, then moved there.

Their content is on the disk before the move, and the move before the call returns, so that a power cut too leaves
either the old file or the new one. What a killed process left behind is removed by the next that writes there.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from fastcal.errors import InvalidInput
from fastcal.io import inputs

try:
    import fcntl
except ImportError:  # Windows: nothing is locked, so nothing is taken for abandoned
    fcntl = None  # type: ignore[assignment]

PREFIX = ".fastcal-"
_HEX = 12  # digits
# The whole name of a temporary folder, or of a file with its ending.
_OWN = re.compile(rf"{re.escape(PREFIX)}[0-9a-f]{{{_HEX}}}(\..+)?", re.DOTALL)
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

    They are complete on the disk before the first is replaced, and are replaced without a pause, so that a kill hardly
    ever falls in between. The older others are removed first: if one does, some are missing, and none stands beside a
    file of another result.

    Raises:
        InvalidInput: A file cannot be written there, or it was read by this command.
    """
    # A link is followed, as a plain write would, so that it stays a link.
    targets = [Path(path).resolve() for path in paths]
    finish = _nothing if all(target.parent in _BEING_FILLED for target in targets) else sync
    try:
        with ExitStack() as stack:
            temporaries = []
            for path, target in zip(paths, targets, strict=True):
                inputs.refuse(target)
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
            for temporary, target in zip(temporaries, targets, strict=True):
                temporary.replace(target)
            for parent in dict.fromkeys(target.parent for target in targets):
                finish(parent)
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
    place, lock = _locked_place(parent, ending, folder=folder)
    try:
        if folder:
            _BEING_FILLED.add(place)
        yield place
    finally:
        _BEING_FILLED.discard(place)
        remove(place)
        if lock >= 0:
            os.close(lock)


def _locked_place(parent: Path, ending: str, *, folder: bool) -> tuple[Path, int]:
    """A new place and the descriptor that holds its lock, -1 where the file system has none: then nobody cleans up.

    Another process may take a new place for an abandoned one before it is locked; then another place is made.
    """
    while True:
        place = parent / f"{PREFIX}{secrets.token_hex(_HEX // 2)}{ending}"
        if folder:
            place.mkdir()
        else:
            os.close(os.open(place, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        try:
            lock = os.open(place, os.O_RDONLY)
        except FileNotFoundError:
            continue
        except OSError:  # a system whose folders can't be opened
            return place, -1
        held = locked(lock)
        if held and _is(place, lock):
            return place, lock
        os.close(lock)
        if held is None:
            return place, -1


def locked(descriptor: int) -> bool | None:
    """Whether this process has the lock of an open file or folder now, without waiting; None: it can't be locked."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _is(place: Path, descriptor: int) -> bool:
    """Whether the name still belongs to what is open."""
    try:
        return os.path.samestat(place.lstat(), os.fstat(descriptor))
    except OSError:
        return False


def remove_abandoned(parent: Path) -> None:
    """Removes temporary files and folders of fastcal in `parent` whose owner was killed: nobody holds their lock.

    What has another name than these have is somebody else's and stays.
    """
    if fcntl is None:
        return
    with suppress(OSError):
        for place in parent.glob(f"{PREFIX}*"):
            kind = _OWN.fullmatch(place.name)
            if kind is None or place.is_symlink() or place.is_dir() == bool(kind[1]):
                continue
            with suppress(OSError):
                found = os.open(place, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
                try:
                    if locked(found) and _is(place, found):
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
    with suppress(OSError):  # systems whose folders can't be opened, and file systems that can't do it for them
        found = os.open(place, os.O_RDONLY)
        try:
            os.fsync(found)
        finally:
            os.close(found)
