# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The text of an XML file in the encoding that it declares, and back (XML 1.0, section 4.3.3)."""

from __future__ import annotations

import os
import re

from fastcal.errors import ParseError
from fastcal.io.regular_file import read_bytes
from fastcal.io.text_encoding import codec_of, marked_encoding
from fastcal.io.yaml_file import MAX_BYTES

_DECLARED = re.compile(r"""(<\?xml\s[^>]{0,200}?\bencoding\s*=\s*["'])([\w.:-]{1,40})(?=["'])""", re.ASCII)
_HEAD = 400  # characters in which the declaration lies
_WIDE = ((b"<\0", "utf-16-le"), (b"\0<", "utf-16-be"))  # how UTF-16 without its mark begins


def read_xml(path: str | os.PathLike[str]) -> str:
    """The text of an XML file: by its byte order mark, else in the encoding that it declares, else UTF-8.

    A text of two or four bytes a character comes back declared as UTF-8, in which it will be written.

    Raises:
        ParseError: There is no such file, it is too large, or it is no text in that encoding.
    """
    content = read_bytes(path, MAX_BYTES)
    wide = marked_encoding(content) or next((name for start, name in _WIDE if content.startswith(start)), None)
    head = content[:_HEAD].decode("latin-1")
    encoding = wide or _encoding(head)
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        expected = "UTF-8" if encoding == "utf-8-sig" else encoding
        declared = _DECLARED.match(head)
        hint = ""
        if declared is not None and codec_of(declared[2]) is None:
            hint = f"; the encoding '{declared[2]}' that it declares is not known here"
        elif declared is None and expected == "UTF-8":
            hint = "; text in another encoding begins like <?xml encoding='ISO-8859-1'?>"
        raise ParseError(f"expected {expected} text, got the byte 0x{content[error.start]:02x}{hint}", path) from None
    return declared_as_utf8(text) if encoding.startswith(("utf-16", "utf-32")) else text


def xml_bytes(text: str) -> bytes:
    """The content of a file with this text in the encoding that it declares; what that lacks as references."""
    return text.encode(_encoding(text[:_HEAD]).removesuffix("-sig"), "xmlcharrefreplace")


def declared_as_utf8(text: str) -> str:
    """The text with UTF-8 in its declaration, if there is one, for parsers that are given the text as UTF-8."""
    return _DECLARED.sub(r"\g<1>UTF-8", text[:_HEAD], count=1) + text[_HEAD:]


def _encoding(head: str) -> str:
    """The codec for the encoding that the declaration at the beginning of a text names; UTF-8 for any other."""
    declared = _DECLARED.match(head)
    found = None if declared is None else codec_of(declared[2])
    # A declaration that can be read byte by byte is not of two or four bytes a character, whatever it says.
    return "utf-8-sig" if found is None or found.startswith(("utf-16", "utf-32", "utf-8")) else found
