# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The macros of a xacro file, expanded by the package xacro in the process that `xacro_file` has for it.

That package computes expressions by Python's eval behind a filter of names, which a nested lambda gets round. Here
`xacro_expressions` computes them, and eval, exec and compile are out of reach of xacro's modules.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from fastcal.errors import ParseError
from fastcal.io.xacro_expressions import evaluate

MACROS = 20_000  # calls; the largest public robots have hundreds


class NotExpandedError(Exception):
    """What is told as it stands: a ROS package is not on this machine, or the macros do not end."""


def expand(path: str, arguments: Mapping[str, str]) -> str:
    """The URDF text of a xacro file; changes the modules of xacro, so that it is for a process of its own.

    Raises:
        ParseError: xacro is not installed, a package or argument is missing, or the file can't be expanded.
        MemoryError: It needs more than this process may take.
    """
    try:
        return _expanded(path, arguments)
    except ImportError as error:
        raise ParseError(f"reading xacro needs the package {error.name}: pip install fastcal[ros]", path) from None
    except Exception as error:  # noqa: BLE001 - a file's expressions raise whatever Python raises
        inner: BaseException | None = error
        while inner is not None and not isinstance(inner, NotExpandedError | MemoryError):  # xacro wraps it
            inner = getattr(inner, "exc", None) or inner.__cause__ or inner.__context__
        if isinstance(inner, MemoryError):
            raise MemoryError from None
        raise ParseError(str(inner) if inner else _sentence(error), path) from None


def _expanded(path: str, arguments: Mapping[str, str]) -> str:
    import xacro
    from xacro import substitution_args

    def find(package: str) -> str:
        return _package(package, Path(path))

    expand_one, calls = xacro.handle_macro_call, itertools.count(1)

    def counted(*given: Any) -> Any:
        if next(calls) > MACROS:
            raise NotExpandedError(f"its macros call each other more than {MACROS} times, which no robot needs")
        return expand_one(*given)

    for module in (xacro, substitution_args):
        _forbid(module)
    xacro.handle_macro_call = counted
    xacro.safe_eval = evaluate
    substitution_args.eval = lambda expression, _globals, names: evaluate(expression, names)
    substitution_args._eval_find = substitution_args._eval_dict["find"] = find
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere, contextlib.redirect_stderr(nowhere):  # its warnings
        document = xacro.process_file(path, mappings=dict(arguments))
    return str(document.toprettyxml(indent="  "))


def _forbid(module: ModuleType) -> None:
    """Hides what runs code from a module, so that another version of it fails rather than runs a file's code."""

    def refuse(*_given: Any, **_words: Any) -> None:
        raise PermissionError("code in a robot file is never run")

    for name in ("eval", "exec", "compile", "__import__"):
        setattr(module, name, refuse)


def _sentence(error: Exception) -> str:
    message = " ".join(str(error).split()) or type(error).__name__
    if argument := re.search(r"Undefined substitution argument (\w+)", message):
        message = f"needs the argument {argument[1]}: give it as --xacro {argument[1]}:=VALUE"
    return f"xacro can't expand it: {message:.300}"


def _package(name: str, file: Path) -> str:
    """The folder of a ROS package: around the file, else where a sourced ROS has it."""
    for folder in _places(name, file.resolve()):
        if folder.is_dir() and (folder.name == name or _named(folder) == name):
            return str(folder)
    raise NotExpandedError(
        f"needs the ROS package '{name}', which is neither in the folders around the file nor in AMENT_PREFIX_PATH or "
        "ROS_PACKAGE_PATH"
    )


def _places(name: str, file: Path) -> Iterator[Path]:
    for folder in file.parents:
        yield folder
        yield folder / name
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        yield Path(prefix) / "share" / name
    for workspace in filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)):
        yield from (Path(workspace), Path(workspace) / name)


def _named(folder: Path) -> str | None:
    """The name in a folder's package.xml."""
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return None
    found = re.search(r"<name>\s*([\w-]+)\s*</name>", manifest.read_text(encoding="utf-8", errors="replace"))
    return found[1] if found else None
