# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""xacro in: macros expanded to a URDF by the `xacro` package, with ROS packages found without ROS.

A xacro file is a program (its expressions run in xacro's sandbox): expand only what you trust.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from fastcal.errors import ParseError
from fastcal.io.yaml_file import read_text


def expanded(path: str | os.PathLike[str], arguments: Mapping[str, str] | None = None) -> str:
    """The URDF text of a xacro file.

    Args:
        path: The file.
        arguments: Values of its <xacro:arg>, as `name:=value` gives them on the command line of xacro.

    Raises:
        ParseError: xacro is not installed, a package or argument is missing, or the file can't be expanded.
    """
    read_text(path)  # refuses what is no text, before macros run
    from unittest import mock  # imports asyncio

    try:
        import xacro
    except ImportError:
        raise ParseError("reading xacro needs the package xacro: pip install fastcal[ros]", path) from None
    missing: list[ParseError] = []  # xacro wraps what is raised inside it

    def folder_of(package: str) -> str:
        try:
            return _package(package, Path(path))
        except ParseError as error:
            missing.append(error)
            raise

    find = mock.patch("xacro.substitution_args._eval_find", folder_of)
    try:
        with find, contextlib.redirect_stderr(io.StringIO()):  # its warnings about macros
            document = xacro.process_file(os.fspath(path), mappings=dict(arguments or {}))
        return str(document.toprettyxml(indent="  "))
    except Exception as error:  # noqa: BLE001 - a file's expressions raise whatever Python raises
        if missing:
            raise missing[0] from None
        message = " ".join(str(error).split()) or type(error).__name__
        if argument := re.search(r"Undefined substitution argument (\w+)", message):
            message = f"needs the argument {argument[1]}: give it as --xacro {argument[1]}:=VALUE"
        raise ParseError(f"xacro can't expand it: {message:.300}", path) from None


def _package(name: str, file: Path) -> str:
    """The folder of a ROS package: around the file, else where a sourced ROS has it."""
    for folder in _places(name, file.resolve()):
        if folder.is_dir() and (folder.name == name or _named(folder) == name):
            return str(folder)
    raise ParseError(
        f"needs the ROS package '{name}', which is neither in the folders around the file nor in AMENT_PREFIX_PATH or "
        "ROS_PACKAGE_PATH",
        file,
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
