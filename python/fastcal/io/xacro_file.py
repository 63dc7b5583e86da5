# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""xacro in: macros expanded to a URDF by the `xacro` package, with ROS packages found without ROS.

A xacro file is a program. It runs in a process of its own with limits of time and memory, and its expressions are
computed by `xacro_expressions`, which knows numbers, text, lists and mappings and nothing of Python beyond them.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from fastcal.errors import ParseError
from fastcal.io.bounded import Limits, call
from fastcal.io.yaml_file import MAX_BYTES, read_text

LIMITS = Limits(memory=1_000_000_000, seconds=10, file=0, what="its macros take")  # the largest public robots: a second


def expanded(path: str | os.PathLike[str], arguments: Mapping[str, str] | None = None) -> str:
    """The URDF text of a xacro file.

    Args:
        path: The file.
        arguments: Values of its <xacro:arg>, as `name:=value` gives them on the command line of xacro.

    Raises:
        ParseError: xacro is not installed, a package or argument is missing, the file can't be expanded, or not within
            the limits of time and memory.
    """
    read_text(path)  # refuses what is no text, before macros run
    given = (os.fspath(path), dict(arguments or {}))
    text: str = call("fastcal.io.xacro_macros:expand", given, path, LIMITS)
    if len(text) > MAX_BYTES:
        raise ParseError(f"its macros make more than {MAX_BYTES / 1e6:.0f} MB of text, which no robot needs", path)
    return text
