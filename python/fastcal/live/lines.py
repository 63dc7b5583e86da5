# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The lines of one sender: the header line of a measurement file, then a row a line, each with its answer."""

from __future__ import annotations

from fastcal.errors import FastcalError
from fastcal.live.session import LiveSession


class Lines:
    """Answers a sender's lines.

    Args:
        session: What takes the rows.
    """

    def __init__(self, session: LiveSession) -> None:
        self._session = session
        self.headed = False  # was a header taken?

    def answer(self, line: str) -> str | None:
        """`ok` or what is wrong; None for a line that says nothing."""
        text = line.strip("\r\n\ufeff")
        if not text.strip() or text.lstrip().startswith("#"):
            return None
        try:
            if self.headed:
                return self._session.add(text).text
            self._session.begin(text)
        except FastcalError as error:
            return " ".join(str(error).split())
        self.headed = True
        return "ok"
