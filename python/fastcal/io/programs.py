# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robot programs from files and into files; a KRL .src and the .dat of the same name are one program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from fastcal.errors import InvalidInput
from fastcal.io.atomic import atomic_path
from fastcal.io.regular_file import read_bytes
from fastcal.programs import Document, Program, read_program

MAX_BYTES = 4_000_000
_OF_ONE_NAME = {".src": ".dat"}


def load_program(path: str | os.PathLike[str]) -> Program:
    """Reads a program, and with a .src the .dat that lies beside it.

    Raises:
        ParseError: A file can't be read, or a target in it isn't made of the numbers it needs; names the line.
        InvalidInput: No language has this ending.
    """
    files = [Path(path)]
    partner = _OF_ONE_NAME.get(files[0].suffix.lower())
    if partner is not None:
        beside = [files[0].with_suffix(ending) for ending in (partner, partner.upper())]
        files += [file for file in beside if file.is_file()][:1]
    return read_program({str(file): read_bytes(file, MAX_BYTES) for file in files})


def write_program(path: str | os.PathLike[str], documents: Sequence[Document]) -> list[Path]:
    """Writes the files of a program under the name of `path`, all or none; returns their paths.

    Raises:
        InvalidInput: A file cannot be written, or `path` has the ending of another language.
    """
    target = Path(path)
    suffixes = [Path(document.name).suffix for document in documents]
    if target.suffix.lower() != suffixes[0].lower():
        raise InvalidInput(f"{path}: a {suffixes[0]} program stays one; give a name that ends in {suffixes[0]}")
    paths = [target, *(target.with_suffix(suffix) for suffix in suffixes[1:])]
    with ExitStack() as stack:
        temporary = [stack.enter_context(atomic_path(each)) for each in paths]
        for place, document in zip(temporary, documents, strict=True):
            place.write_bytes(document.text.encode("latin-1"))
    return paths
