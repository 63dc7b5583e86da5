# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""xacro in: macros expanded to a URDF by the `xacro` package, with ROS packages found without ROS.

A xacro file is a program. It runs in a process of its own with limits of time and memory, and its expressions are
computed by `xacro_expressions`, which knows numbers, text, lists and mappings and nothing of Python beyond them.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from fastcal.errors import ParseError
from fastcal.io.xacro_child import BYTES, SECONDS
from fastcal.io.yaml_file import MAX_BYTES, read_text

# Nothing is imported from the working directory, where the file may have come with others.
_START = "import sys; sys.path[0] = sys.argv.pop(1); from fastcal.io.xacro_child import main; main()"
_LIMITS = [int(getattr(signal, name)) for name in ("SIGXCPU", "SIGKILL") if hasattr(signal, name)]
_PATIENCE = 6 * SECONDS  # of wall time, on a machine that is busy or has no limits of processor time


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
    request = json.dumps({"path": os.fspath(path), "arguments": dict(arguments or {})})
    command = [sys.executable, "-c", _START, str(Path(__file__).parents[2])]
    too_much = f"its macros take more than {SECONDS} s or {BYTES / 1e9:.0f} GB, which no robot needs"
    try:
        child = subprocess.run(  # noqa: S603 - this interpreter and our own module
            command, input=request, capture_output=True, encoding="utf-8", timeout=_PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        raise ParseError(too_much, path) from None
    if child.returncode:
        ended = -child.returncode in _LIMITS or "MemoryError" in child.stderr
        lines = child.stderr.split("\n")
        last = next((line for line in reversed(lines) if line), "no word")
        raise ParseError(too_much if ended else f"xacro can't expand it: {last:.300}", path)
    answer = json.loads(child.stdout)
    if "error" in answer:
        raise ParseError(too_much if "MemoryError" in answer["error"] else answer["error"], path)
    if len(answer["text"]) > MAX_BYTES:
        raise ParseError(too_much, path)
    return str(answer["text"])
