# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The comment by which a program says that it was compensated, for which arm and by what.

    fastcal compensated 5f3a1b2c4d5e; serial K-17; 2026-11-25; version 0.9.0

The number is the beginning of the model's SHA-256. FANUC's comments hold 32 characters, so that each part has its own.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from datetime import date, datetime, timezone

from fastcal.errors import InvalidInput
from fastcal.programs.program import Document, Program

_MARK = "fastcal compensated"
_LINE = re.compile(r"^[^\n]*\bfastcal compensated [0-9a-f]{12}\b[^\n]*\n?", re.M)
_OF_FANUC = re.compile(r"^[ \t]*\d+:[ \t]*!(?:fastcal compensated [0-9a-f]{12}|fastcal: )[^\n]*\n", re.M)
_NUMBERED = re.compile(r"^([ \t]*)(\d+)(?=:)", re.M)
_LINE_HEAD = re.compile(r"^([ \t]*)(?:(\d+)(?=:)|-{3,})", re.M)
_LONGEST = 32  # characters of a comment in LS


def stamped_line(program: Program) -> tuple[str, int] | None:
    """The file and line in which a program says that it was compensated; None where none does."""
    for document in program.documents:
        if match := _LINE.search(document.text):
            return document.name, document.line(match.start() + len(match[0]) - len(match[0].lstrip()))
    return None


def text(model_sha256: str, serial: str | None, version: str) -> str:
    """What a program compensated today, or at SOURCE_DATE_EPOCH, says.

    Raises:
        InvalidInput: SOURCE_DATE_EPOCH is no number of seconds.
    """
    parts = [f"{_MARK} {model_sha256[:12]}", *([f"serial {serial}"] if serial else []), _today().isoformat()]
    return "; ".join([*parts, f"version {version}"])


def _today() -> date:
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if given is None:
        return datetime.now(timezone.utc).date()
    try:
        return datetime.fromtimestamp(int(given), timezone.utc).date()
    except (ValueError, OverflowError, OSError):
        raise InvalidInput(f"SOURCE_DATE_EPOCH: expected seconds since 1970, got '{given:.40}'") from None


def stamped(documents: tuple[Document, ...], language: str, stamp: str | None) -> tuple[Document, ...]:
    """The documents with the stamp in place of an older one; None only takes that away."""
    write = _WRITERS[language]
    return tuple(Document(document.name, write(document.text, stamp)) for document in documents)


def _behind(head: str, mark: str) -> Callable[[str, str | None], str]:
    """Writes a comment below the first line that begins with `head`; at the beginning where there is none."""
    pattern = re.compile(rf"^(?P<space>[ \t]*)(?:{head})\b[^\n]*\n", re.M | re.I)

    def write(content: str, stamp: str | None) -> str:
        content = _LINE.sub("", content)
        if stamp is None:
            return content
        match = pattern.search(content)
        at, space = (match.end(), match["space"] + "  ") if match else (0, "")
        end = "\r\n" if content[:at].endswith("\r\n") or (not at and "\r\n" in content) else "\n"
        return f"{content[:at]}{space}{mark} {_plain(stamp)}{end}{content[at:]}"

    return write


def _fanuc(content: str, stamp: str | None) -> str:
    """Comments as the first lines of /MN; the lines behind are numbered anew, and LINE_COUNT follows.

    Lines of a local condition have numbers of their own, from 1 to the line of dashes that ends it.
    """
    content, removed = _OF_FANUC.subn("", content)
    match = re.search(r"^/MN[^\n]*\n", content, re.M)
    end = re.search(r"^/(?:POS|END)", content, re.M)
    if match is None or end is None or end.start() < match.end():
        return content
    parts = [] if stamp is None else _plain(stamp).split("; ")
    line_end = "\r\n" if match[0].endswith("\r\n") else "\n"
    texts = [part if part.startswith(_MARK) else f"fastcal: {part}" for part in parts]
    head = "".join(f"   0:  !{part[:_LONGEST]} ;{line_end}" for part in texts)
    counts = iter(range(1, 1_000_000))
    old = head + content[match.end() : end.start()]
    own = _own_numbers(old)
    body = _NUMBERED.sub(lambda m: m[0] if m.start() in own else f"{next(counts):{len(m[0])}d}", old)
    before = content[: match.end()]
    if count := re.search(r"^LINE_COUNT\s*=\s*(\d+)", before, re.M):
        lines = int(count[1]) + len(texts) - removed
        before = f"{before[: count.start(1)]}{lines}{before[count.end(1) :]}"
    return f"{before}{body}{content[end.start() :]}"


def _own_numbers(text: str) -> set[int]:
    """Where the numbered lines of local conditions begin."""
    own: set[int] = set()
    open_lines: list[int] = []
    for match in _LINE_HEAD.finditer(text):
        if match[2] is None:
            own.update(open_lines)
            open_lines = []
        elif match[2] == "1":
            open_lines = [match.start()]
        elif open_lines:
            open_lines.append(match.start())
    return own


def _plain(stamp: str) -> str:
    """The stamp in characters that every controller reads."""
    return stamp.encode("ascii", "replace").decode()


_WRITERS: Mapping[str, Callable[[str, str | None], str]] = {
    "RAPID": _behind(r"MODULE", "!"),
    "KRL": _behind(r"(?:GLOBAL[ \t]+)?DEF(?:DAT|FCT)?", ";"),
    "FANUC LS": _fanuc,
    "URScript": _behind(r"def", "#"),
}
