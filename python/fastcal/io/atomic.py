# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Files that appear whole or not at all: written beside their place under another name, then moved there."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fastcal.errors import InvalidInput


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Gives a temporary name in the same folder, with the same ending; moves it to `path` if the block succeeds.

    An older file at `path` stays as it was until then, and stays if the block raises.

    Raises:
        InvalidInput: The file cannot be written there.
    """
    # A link is followed, as a plain write would, so that it stays a link.
    target = Path(path).resolve()
    temporary = target.with_name(f".{secrets.token_hex(6)}.{target.name}")
    try:
        # A move onto /dev/null would replace the device.
        if target.exists() and not target.is_file():
            raise InvalidInput(f"{path}: cannot be written: it is not a regular file")
        yield temporary
        temporary.replace(target)
    except OSError as error:
        raise InvalidInput(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes UTF-8 text with unix line ends, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Writes bytes, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)
