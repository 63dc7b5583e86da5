# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Folders of files that belong together: written beside their place, and put there in one step when all are complete.

An older folder is exchanged for the new one by a single system call; its other files are in both, by hard links, before
that. Where this can't be done (another file system inside it, no hard links, the working directory itself, more than
`MOST_LINKS` other files) the files are replaced one by one.
"""

from __future__ import annotations

import ctypes
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path

from fastcal.errors import InvalidInput
from fastcal.io import inputs
from fastcal.io.atomic import locked, sync, temporary_place

MOST_LINKS = 10_000
_AT_FDCWD, _RENAME_EXCHANGE = -100, 2


def check_folder(path: str | os.PathLike[str], owned: Iterable[str] = ()) -> None:
    """Refuses a place where no folder can be written, before the long work whose results it shall take.

    Raises:
        InvalidInput: There is a file, the place cannot be written to, or one of the files `owned` is a folder there.
    """
    found = _nearest(Path(path))
    if not found.is_dir():
        raise InvalidInput(f"{path}: cannot be written: {found} is not a folder")
    if not os.access(found, os.W_OK | os.X_OK):
        raise InvalidInput(f"{path}: cannot be written: {found} does not allow it")
    for name in owned:
        if (Path(path) / name).is_dir():
            raise InvalidInput(f"{path}: cannot be written: {Path(path) / name} is a folder")


@contextmanager
def atomic_folder(path: str | os.PathLike[str], owned: Iterable[str] = ()) -> Iterator[Path]:
    """Gives an empty temporary folder; puts its files into the folder `path` if the block succeeds.

    An older folder at `path` stays as it was until then, and stays if the block raises. Its other files stay always,
    except those whose names match `owned`: they are of an older result and go where the new one has none of that name.

    Raises:
        InvalidInput: The folder cannot be written there.
    """
    owned = tuple(owned)
    check_folder(path, owned)
    target = Path(path).resolve()
    try:
        # Beside the target, or in the nearest folder that is there: on the same disk, and no folder stays behind.
        with temporary_place(_nearest(target.parent), "", folder=True) as temporary:
            yield temporary
            new = _names(temporary)
            check_folder(path, new)
            for name in new:
                inputs.refuse(target / name)
            for name in new:
                sync(temporary / name)
            _put(temporary, target, owned)
            sync(target.parent)
    except (OSError, UnicodeEncodeError) as error:
        raise InvalidInput(f"{path}: cannot be written: {getattr(error, 'strerror', None) or error}") from error


def _put(temporary: Path, target: Path, owned: tuple[str, ...]) -> None:
    """Makes the files in `temporary` those of `target`."""
    if not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        sync(temporary)
        temporary.rename(target)
        return
    new = _names(temporary)
    stale = [name for name in _names(target) if name not in new and any(fnmatchcase(name, each) for each in owned)]
    if not Path.cwd().is_relative_to(target):  # whoever stands in the folder would be left in the old one
        with suppress(OSError):
            _link_others(target, temporary, {*new, *stale})
            shutil.copystat(target, temporary)
            sync(temporary)
            with _held(target):  # under the temporary name it would be taken for abandoned
                exchange(temporary, target)
                _move_late_comers(temporary, target, {*new, *stale})
            return
    for name in new:
        (temporary / name).replace(target / name)
    for name in stale:
        (target / name).unlink()
    sync(target)


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Keeps the lock of a folder, whatever it is called meanwhile."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        locked(descriptor)
        yield
    finally:
        os.close(descriptor)


def _link_others(source: Path, place: Path, left_out: set[str]) -> None:
    """Gives every other file of `source` a second name in `place`; folders in it are made again.

    Raises:
        OSError: Something can't have one; `place` is then as it was.
    """
    made: list[Path] = []
    try:
        for folder, folders, files in os.walk(source, onerror=_raise):
            inside = Path(folder).relative_to(source)
            top = inside == Path()
            for name in [*folders, *files]:
                old, twin = Path(folder) / name, place / inside / name
                if top and name in left_out:
                    continue
                if len(made) == MOST_LINKS:
                    raise OSError(f"more than {MOST_LINKS} other files")
                if old.is_dir() and not old.is_symlink():
                    twin.mkdir()
                    shutil.copystat(old, twin)
                else:
                    os.link(old, twin, follow_symlinks=False)
                made.append(twin)
    except OSError:
        for twin in reversed(made):
            twin.rmdir() if twin.is_dir() and not twin.is_symlink() else twin.unlink()
        raise


def exchange(first: Path, second: Path) -> None:
    """Gives two folders each other's name in one step.

    Raises:
        OSError: The system or the file system can't.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "renameat2"):
        raise OSError("this system has no renameat2")
    names = (ctypes.c_char_p(os.fsencode(first)), ctypes.c_char_p(os.fsencode(second)))
    if libc.renameat2(_AT_FDCWD, names[0], _AT_FDCWD, names[1], ctypes.c_uint(_RENAME_EXCHANGE)) != 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def _move_late_comers(old: Path, target: Path, left_out: set[str]) -> None:
    """Files that somebody put into the folder while it was being exchanged follow it."""
    for name in _names(old):
        if name not in left_out and not os.path.lexists(target / name):
            (old / name).rename(target / name)


def _names(folder: Path) -> list[str]:
    return sorted(place.name for place in folder.iterdir())


def _raise(error: OSError) -> None:
    raise error


def _nearest(path: Path) -> Path:
    """The path itself, or the nearest of its parents that is there."""
    place = path.absolute()
    while not place.exists():
        place = place.parent
    return place
