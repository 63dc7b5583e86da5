# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Work on a file that may be made to never end: in a process of its own, within limits of time, memory and disk."""

from __future__ import annotations

import contextlib
import importlib
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fastcal.errors import FastcalError, ParseError

# Nothing is imported from the working directory, where the file may have come with others.
_START = "import sys; sys.path[0] = sys.argv.pop(1); from fastcal.io.bounded import main; main()"
_KILLED = [int(getattr(signal, name)) for name in ("SIGXCPU", "SIGKILL") if hasattr(signal, name)]


@dataclass(frozen=True)
class Limits:
    """What the work may take.

    Attributes:
        memory: Bytes.
        seconds: Of processor time; six times as many by the clock.
        file: Bytes of one file that it writes, such as an unpacked one.
        what: How the sentence about work that takes more begins, such as "its macros take".
    """

    memory: int
    seconds: int
    file: int
    what: str

    def __str__(self) -> str:
        """The limits in words."""
        return f"{self.what} more than {self.seconds} s or {self.memory / 1e9:.0f} GB"


def call(function: str, arguments: Sequence[Any], path: str | os.PathLike[str], limits: Limits) -> Any:
    """What a function returns when it is called in another process.

    Args:
        function: MODULE:NAME.
        arguments: Its arguments, which pickle carries over.
        path: The file that it reads, for messages.
        limits: What it may take.

    Raises:
        ParseError: It takes more, or ends without an answer.
        FastcalError: As the function raises it.
    """
    request = pickle.dumps((function, tuple(arguments), limits))
    command = [sys.executable, "-c", _START, str(Path(__file__).parents[2])]
    one_thread = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # each reserves memory
    try:
        child = subprocess.run(  # noqa: S603 - this interpreter and our own module
            command, input=request, capture_output=True, env=one_thread, timeout=6 * limits.seconds, check=False
        )
    except subprocess.TimeoutExpired:
        raise ParseError(str(limits), path) from None
    if child.returncode:
        lines = child.stderr.decode("utf-8", "replace").split("\n")
        last = next((line for line in reversed(lines) if line), f"exit status {child.returncode}")
        ended = -child.returncode in _KILLED or last.startswith("MemoryError")
        raise ParseError(str(limits) if ended else f"can't be read: {last:.300}", path)
    answer = pickle.loads(child.stdout)  # noqa: S301 - of our own process
    if isinstance(answer, FastcalError):
        raise answer
    return answer


def main() -> None:
    """Answers the request on standard input with what the function returns, or the FastcalError that it raises."""
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is none of the answer
    function, arguments, limits = pickle.load(sys.stdin.buffer)  # noqa: S301 - of the process that started this one
    module, _, name = function.partition(":")
    work = getattr(importlib.import_module(module), name)
    _limit(limits)
    try:
        found = work(*arguments)
    except FastcalError as error:
        found = error
    with answer:
        pickle.dump(found, answer)


def _limit(limits: Limits) -> None:
    """Sets the limits, where the system has them; elsewhere the caller's clock alone ends the work."""
    with contextlib.suppress(ImportError):
        import resource

        pairs = (
            (resource.RLIMIT_AS, limits.memory),
            (resource.RLIMIT_CPU, limits.seconds),
            (resource.RLIMIT_FSIZE, limits.file),
        )
        for kind, most in pairs:
            with contextlib.suppress(ValueError, OSError):  # a lower limit is there already, or none can be set
                resource.setrlimit(kind, (most, most))
