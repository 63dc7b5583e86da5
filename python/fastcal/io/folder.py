# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Folders of files that belong together: written beside their place, and moved there when all are complete."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from fastcal.errors import InvalidInput


def check_folder(path: str | os.PathLike[str]) -> None:
    """Refuses a place where no folder can be written, before the long work whose results it shall take.

    Raises:
        InvalidInput: There is a file, or the place cannot be written to.
    """
    found = _nearest(Path(path))
    if not found.is_dir():
        raise InvalidInput(f"{path}: cannot be written: {found} is not a folder")
    if not os.access(found, os.W_OK | os.X_OK):
        raise InvalidInput(f"{path}: cannot be written: {found} does not allow it")


@contextmanager
def atomic_folder(path: str | os.PathLike[str], owned: Iterable[str] = ()) -> Iterator[Path]:
    """Gives an empty temporary folder; moves its files into the folder `path` if the block succeeds.

    An older folder at `path` stays as it was until then, and stays if the block raises. Its other files stay always,
    except those named in `owned`: they are of an older result and go where the new one has none of that name.

    Raises:
        InvalidInput: The folder cannot be written there.
    """
    check_folder(path)
    target = Path(path)
    # In the nearest folder that is there: on the same disk, where moving is all or nothing, and no folder stays behind.
    temporary = _nearest(target) / f".{secrets.token_hex(6)}"
    try:
        temporary.mkdir()
        yield temporary
        target.mkdir(parents=True, exist_ok=True)
        for stale in owned:
            if not (temporary / stale).exists():
                (target / stale).unlink(missing_ok=True)
        for file in sorted(temporary.iterdir()):
            file.replace(target / file.name)
    except OSError as error:
        raise InvalidInput(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _nearest(path: Path) -> Path:
    """The path itself, or the nearest of its parents that is there."""
    path = path.absolute()
    return next(place for place in (path, *path.parents) if place.exists())
