# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The text of an XML file in the encoding that it declares, and back (XML 1.0, section 4.3.3)."""

from __future__ import annotations

import codecs
import os
import re

from fastcal.errors import ParseError
from fastcal.io.regular_file import read_bytes
from fastcal.io.yaml_file import MAX_BYTES

# The encodings besides UTF-8 that files declare. Python has codecs that decompress or execute; those are never asked.
_READ = re.compile(
    r"us-ascii|ascii|iso-?8859-\d{1,2}|latin-?\d|windows-125\d|cp125\d|koi8-[ru]|gb2312|gbk|gb18030|big5|shift_jis|"
    r"euc-jp|euc-kr",
    re.IGNORECASE,
)
_DECLARED = re.compile(r"""(<\?xml\s[^>]{0,200}?\bencoding\s*=\s*["'])([\w.:-]{1,40})(?=["'])""", re.ASCII)
_HEAD = 400  # characters in which the declaration lies


def read_xml(path: str | os.PathLike[str]) -> str:
    """The text of an XML file: by its byte order mark, else in the encoding that it declares, else UTF-8.

    Raises:
        ParseError: There is no such file, it is too large, or it is no text in that encoding.
    """
    content = read_bytes(path, MAX_BYTES)
    encoding = _encoding(content[:_HEAD].decode("latin-1"))
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        expected = "UTF-8" if encoding == "utf-8-sig" else encoding
        hint = "" if expected != "UTF-8" else "; text in another encoding begins like <?xml encoding='ISO-8859-1'?>"
        raise ParseError(f"expected {expected} text, got the byte 0x{content[error.start]:02x}{hint}", path) from None


def xml_bytes(text: str) -> bytes:
    """The content of a file with this text in the encoding that it declares; what that lacks as references."""
    return text.encode(_encoding(text[:_HEAD]).removesuffix("-sig"), "xmlcharrefreplace")


def declared_as_utf8(text: str) -> str:
    """The text with UTF-8 in its declaration, if there is one, for parsers that are given the text as UTF-8."""
    return _DECLARED.sub(r"\g<1>UTF-8", text[:_HEAD], count=1) + text[_HEAD:]


def _encoding(head: str) -> str:
    """The codec for the encoding that the declaration at the beginning of a text names; UTF-8 for any other."""
    declared = _DECLARED.match(head)
    if declared is not None and _READ.fullmatch(declared[2]):
        try:
            return codecs.lookup(declared[2]).name
        except LookupError:  # iso-8859-99
            pass
    return "utf-8-sig"
