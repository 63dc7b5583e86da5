# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robot programs from files and into files; a KRL .src and the .dat of the same name are one program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from fastcal.errors import InvalidInput
from fastcal.io.atomic import atomic_paths
from fastcal.io.regular_file import read_bytes
from fastcal.programs import SUFFIXES, Document, Program, is_program, language_of, other_language, read_program

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


def programs_in(folder: Path, output: Path) -> tuple[list[Path], list[Path]]:
    """The programs in a folder and those below it, in the order of their names; a .dat goes with the .src of its name.

    The second list has files that end as programs do and are none: the reports in a FANUC controller's backup.

    Raises:
        InvalidInput: There is none, or what is to be written would lie among them.
    """
    if output.resolve() == folder.resolve() or folder.resolve() in output.resolve().parents:
        raise InvalidInput(f"{output}: expected a folder that is not in {folder}, whose programs are read")
    if output.exists() and not output.is_dir():
        raise InvalidInput(f"{output}: is a file; the programs of a folder are written into a folder")
    named = sorted(path for path in folder.rglob("*") if path.is_file() and language_of(path.name) is not None)
    reports = [path for path in named if not is_program(path.name, path.read_bytes()[:MAX_BYTES])]
    files = [path for path in named if path not in reports]
    sources = {path.with_suffix("") for path in files if path.suffix.lower() in _OF_ONE_NAME}
    partners = set(_OF_ONE_NAME.values())
    found = [
        path
        for path in files
        if path.suffix.lower() not in partners or (path.with_suffix("") not in sources and _is_data_list(path))
    ]
    if not found:
        raise InvalidInput(f"{folder}: holds no robot program; known by their endings are {', '.join(SUFFIXES)}")
    return found, reports


def _is_data_list(path: Path) -> bool:
    """Is it a data list of KRL? Files of other kinds end in .dat as well."""
    with path.open("rb") as file:
        return b"DEFDAT" in file.read(MAX_BYTES).upper()


def others_in(folder: Path) -> list[tuple[Path, str]]:
    """The robot programs in a folder and below it that are in languages that are not read, each with its language."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    found = ((path, other_language(path.name)) for path in files)
    return [(path, language) for path, language in found if language is not None]


def write_programs(programs: Sequence[tuple[Path, Sequence[Document]]], *, make_folders: bool = False) -> list[Path]:
    """Writes several programs, each under a name of its own, all or none; returns the paths of their files.

    Raises:
        InvalidInput: A file cannot be written, or a path has the ending of another language.
    """
    places = [program_files(path, documents) for path, documents in programs]
    if make_folders:
        for path, _ in programs:
            path.parent.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        for files, (_, documents) in zip(places, programs, strict=True):
            write_documents(stack.enter_context(atomic_paths(files)), documents)
    return [file for files in places for file in files]


def program_files(path: Path, documents: Sequence[Document]) -> list[Path]:
    """The files of one program, the first at `path`.

    Raises:
        InvalidInput: `path` has the ending of another language.
    """
    suffixes = [Path(document.name).suffix for document in documents]
    if path.suffix.lower() != suffixes[0].lower():
        raise InvalidInput(f"{path}: a {suffixes[0]} program stays one; give a name that ends in {suffixes[0]}")
    return [path, *(path.with_suffix(suffix) for suffix in suffixes[1:])]


def write_documents(files: Sequence[Path], documents: Sequence[Document]) -> None:
    """Writes each document into its file, as the controllers read them."""
    for file, document in zip(files, documents, strict=True):
        file.write_bytes(document.text.encode("latin-1"))
