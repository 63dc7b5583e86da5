# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Files in: regular ones of a reasonable size, so that no pipe, device or endless file holds a command up."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from fastcal.errors import ParseError, TooLarge
from fastcal.io import inputs


def is_there(path: str | os.PathLike[str]) -> bool:
    """Is there a file or a folder? No where the name is too long or holds what no name can, for which Path raises."""
    return _mode(path) != 0


def is_folder(path: str | os.PathLike[str]) -> bool:
    """Is there a folder?"""
    return stat.S_ISDIR(_mode(path))


def is_file(path: str | os.PathLike[str]) -> bool:
    """Is there a regular file?"""
    return stat.S_ISREG(_mode(path))


def _mode(path: str | os.PathLike[str]) -> int:
    try:
        return Path(path).stat().st_mode
    except (OSError, ValueError):
        return 0


def read_bytes(path: str | os.PathLike[str], most: int) -> bytes:
    """The content of a regular file of at most `most` bytes.

    Raises:
        TooLarge: It is a folder, a pipe or a device, or too large.
        ParseError: There is no such file, or it can't be read.
    """
    try:
        # Without waiting: to open a pipe would last until somebody writes into it.
        opened = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            found = os.fstat(opened)
            if not stat.S_ISREG(found.st_mode):
                kind = "a folder" if stat.S_ISDIR(found.st_mode) else "a pipe or a device"
                raise TooLarge(f"is not a file that can be read, but {kind}", path)
            inputs.note(found)
            with os.fdopen(opened, "rb", closefd=False) as file:
                content = b"" if found.st_size > most else file.read(most + 1)
        finally:
            os.close(opened)
    except FileNotFoundError:
        raise ParseError("there is no such file", path) from None
    except (OSError, ValueError) as error:
        if isinstance(error, ParseError):
            raise
        raise ParseError(f"cannot be read: {getattr(error, 'strerror', None) or error}", path) from None
    if max(len(content), found.st_size) > most:
        raise TooLarge(f"expected a file of at most {most} bytes, got {max(len(content), found.st_size)}", path)
    return content
