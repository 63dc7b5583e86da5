# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which language a program is in, by the ending of its file's name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import PurePath

from fastcal.errors import InvalidInput
from fastcal.programs import fanuc, krl, rapid, urscript
from fastcal.programs.makers import other_language, refusal
from fastcal.programs.program import Document, Program

_READERS: dict[str, Callable[[tuple[Document, ...]], Program]] = {
    ".mod": rapid.read,
    ".prg": rapid.read,
    ".sys": rapid.read,
    ".modx": rapid.read,
    ".src": krl.read,
    ".dat": krl.read,
    ".ls": fanuc.read,
    ".script": urscript.read,
    ".urscript": urscript.read,
}
SUFFIXES = tuple(_READERS)
_COUNTED = {".ls": "a FANUC controller shows joint 3 from the horizontal, which is pendant: [{joint: 3, plus: 2}]"}


def language_of(name: str) -> str | None:
    """The ending that identifies the language of a file, None where it is no program's."""
    suffix = PurePath(name).suffix.lower()
    return suffix if suffix in _READERS else None


def doubts_on_joints(name: str, robot: str) -> list[str]:
    """A sentence where the controllers of a program, by its file's name, count joints otherwise than a chain does.

    Args:
        name: Of the program's file.
        robot: The name of a robot whose file does not say how its controller counts.
    """
    counted = _COUNTED.get(language_of(name) or "")
    doubt = f"the robot file of {robot} has no pendant, so joints are taken as its own: {counted}; pendant: [] says so"
    return [] if counted is None else [doubt]


def is_program(name: str, content: bytes) -> bool:
    """Is a file with the ending of a program one? LS files may be a controller's reports."""
    return language_of(name) != ".ls" or fanuc.is_program(content.decode("latin-1"))


def read_program(files: Mapping[str, bytes]) -> Program:
    """A program from the content of its files (a .src and its .dat are one program).

    Raises:
        ParseError: A target can't be read; names file and line.
        InvalidInput: No language that is read has this ending.
    """
    names = list(files)
    other = other_language(names[0], files[names[0]])
    if other is not None:
        raise InvalidInput(refusal(names[0], other))
    suffix = language_of(names[0])
    if suffix is None:
        raise InvalidInput(f"{names[0]}: not the ending of a robot program; known are {', '.join(SUFFIXES)}")
    # Latin-1 gives every byte back, whatever the encoding of the comments is.
    return _READERS[suffix](tuple(Document(name, content.decode("latin-1")) for name, content in files.items()))
