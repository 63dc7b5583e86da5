# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""No command writes over what it reads, however the paths are spelled."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, ParamSpec

P = ParamSpec("P")
OUTPUTS = ("output", "corrections", "report", "storage")
# What commands write into a folder; a file of another name in there is not touched.
RESULTS = (
    "model.yaml",
    "result.json",
    "diagnosis.json",
    "training.json",
    "compare.json",
    "history.json",
    "fleet.csv",
    "paper.json",
    "accept.json",
    "report.html",
    "poses.csv",
)
_COMPANIONS = (".safetensors", ".urdf", ".dat", ".DAT")  # files that another one names or implies
_MOST_TEXT = 1_000_000


def keeps_its_inputs(command: Callable[P, None]) -> Callable[P, None]:
    """The command, which refuses outputs that are one of its inputs before it does anything."""

    @functools.wraps(command)
    def checked(*args: P.args, **kwargs: P.kwargs) -> None:
        from fastcal.io import inputs

        check(dict(kwargs))
        with inputs.kept():  # what is named elsewhere than on the line is known when it is read
            command(*args, **kwargs)

    return checked


def check(given: dict[str, Any]) -> None:
    """Refuses outputs among the values of a command's parameters that are the same file as an input.

    Raises:
        InvalidInput: One is: the same path, another spelling of it, a link to it, or a second name of the same file.
    """
    read = [path for name, value in given.items() if name not in OUTPUTS for path in _files(value)]
    refuse(read, [given[name] for name in OUTPUTS if isinstance(given.get(name), Path)])


def refuse(read: Iterable[Path], outputs: Iterable[Path]) -> None:
    """Refuses outputs, files or folders of results, that are the same file as one of those that are read.

    Raises:
        InvalidInput: One is, or is what belongs to one: the .dat of a program, the network of a model.
    """
    from fastcal.errors import InvalidInput

    known = {_identity(file) for path in read for file in (path, *_companions(path)) if _is_file(file)}
    for output in outputs:
        for written in _written(output):
            if _identity(written) in known:
                raise InvalidInput(f"{written}: is an input of this command; choose another output")


def _identity(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_dev, found.st_ino


def _files(value: Any) -> Iterator[Path]:
    """The files that a parameter's value names, if it names any."""
    for each in value if isinstance(value, list | tuple) else (value,):
        if isinstance(each, str | Path) and _is_file(Path(each)):
            yield Path(each)


def _companions(path: Path) -> Iterator[Path]:
    """Files beside an input that are read with it: the network or URDF that a model names, the .dat of a .src."""
    beside = [path.with_suffix(ending) for ending in (".dat", ".DAT", ".Dat")] if path.suffix.lower() == ".src" else []
    if path.suffix.lower() in (".yaml", ".yml") and path.is_file() and path.stat().st_size < _MOST_TEXT:
        text = path.read_text(encoding="utf-8", errors="replace")
        beside = [other for other in path.parent.iterdir() if other.suffix in _COMPANIONS and other.name in text]
    yield from filter(_is_file, beside)


def _written(output: Path) -> Iterator[Path]:
    """The files that are there already and that a command would write: the output and what goes with it, or results."""
    for path in [output / name for name in RESULTS] if output.is_dir() else [output, *_companions(output)]:
        if _is_file(path):
            yield path


def _is_file(path: Path) -> bool:
    from fastcal.io.regular_file import is_folder, is_there

    return is_there(path) and not is_folder(path)
