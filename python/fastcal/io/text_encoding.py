# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Encodings of text by the names that files and people give them."""

from __future__ import annotations

import codecs

# Python's codecs that compress, execute, escape or belong to host names: what a file names must not reach these.
_NO_TEXT = frozenset({"idna", "mbcs", "oem", "punycode", "raw-unicode-escape", "undefined", "unicode-escape", "utf-7"})
# Names that others use and Python does not know.
_ALIASES = {
    **dict.fromkeys(("x-sjis", "windows-31j", "windows-932"), "cp932"),
    "windows-936": "gbk", "windows-949": "cp949", "windows-950": "cp950", "ansi": "cp1252",
}
BYTE_ORDER_MARKS = (  # the longer ones first: that of UTF-16 begins that of UTF-32
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def codec_of(name: str) -> str | None:
    """Python's name of an encoding of text; None where there is none of that name."""
    plain = name.strip().lower()
    try:
        found = codecs.lookup(_ALIASES.get(plain, plain))
    except (LookupError, ValueError, UnicodeError):
        return None
    is_text = getattr(found, "_is_text_encoding", True) and found.name.replace("_", "-") not in _NO_TEXT
    return found.name if is_text else None


def marked_encoding(content: bytes) -> str | None:
    """The encoding that a byte order mark at the beginning of a text names."""
    return next((name for mark, name in BYTE_ORDER_MARKS if content.startswith(mark)), None)
