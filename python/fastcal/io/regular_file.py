# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Files in: regular ones of a reasonable size, so that no pipe, device or endless file holds a command up."""

from __future__ import annotations

import os
import stat

from fastcal.errors import ParseError, TooLarge
from fastcal.io import inputs


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
