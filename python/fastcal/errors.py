# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What fastcal raises: one sentence that says what was expected, what came, and where."""

from __future__ import annotations

from os import PathLike


class FastcalError(Exception):
    """Base of every error that fastcal raises on purpose."""


class InvalidInput(FastcalError, ValueError):  # noqa: N818 - the same name on both sides of the bindings
    """An argument or a file holds an invalid value."""


class Undetermined(FastcalError):  # noqa: N818 - a state of the problem, not a fault of the caller
    """The measurements are too few to fix even one of the parameters that were asked for."""


class ParseError(InvalidInput):
    """A file cannot be read; names the file and, where there is one, the line.

    Args:
        message: One sentence: what was expected and what came.
        path: The file.
        line: Line of a text file or row of a sheet, counted from 1.
    """

    def __init__(self, message: str, path: str | PathLike[str] | None = None, line: int | None = None) -> None:
        # All three go to `args`, so that the exception survives pickling between processes.
        super().__init__(message, path, line)
        self.message = message
        self.path = path
        self.line = line

    def __str__(self) -> str:
        where = [str(part) for part in (self.path, self.line) if part is not None]
        return ": ".join([":".join(where), self.message]) if where else self.message


def unloaded(error: Exception) -> ImportError | None:
    """One sentence where an error means that the compiled part does not load; None for any other error."""
    if isinstance(error, ImportError) and str(error).startswith("FASTCAL_ISA"):
        return error  # says itself what it needs
    if not isinstance(error, ImportError) or error.name not in {"_core", "fastcal._core"}:
        return None
    return ImportError(
        f"fastcal's compiled part does not load ({error}); install one of fastcal's wheels, which need no library of "
        "the system, or build it here: pip install .",
        name=error.name,
        path=error.path,
    )


class TooLarge(ParseError):  # noqa: N818 - as its parent's siblings
    """A file holds more than its readers take, whatever is in it, or does not end."""
