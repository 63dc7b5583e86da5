# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The text in the bytes of a file: in the encoding that is asked for, marked or declared, else in the likeliest one.

Numbers are the same in all of these but UTF-16 and UTF-32; titles and labels are not. So what is neither UTF-8 nor says
what it is may be read by a guess, which is always told.
"""

from __future__ import annotations

import codecs
import re

from fastcal.errors import InvalidInput, ParseError

# Python's codecs that compress, execute, escape or belong to host names: what a file names must not reach these.
_NO_TEXT = frozenset({"idna", "mbcs", "oem", "punycode", "raw-unicode-escape", "undefined", "unicode-escape", "utf-7"})
# Names that others use and Python does not know.
_ALIASES = {
    "x-sjis": "cp932",
    "windows-31j": "cp932",
    "windows-932": "cp932",
    "windows-936": "gbk",
    "windows-949": "cp949",
    "windows-950": "cp950",
    "ansi": "cp1252",
}
_MARKS = (  # the longer ones first: that of UTF-16 begins that of UTF-32
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_DECLARED = re.compile(rb"(?i)(?:coding|charset)\s*[:=]\s*[\"']?([a-z][\w.-]{2,30})")
_DECLARED_WITHIN = 400  # bytes
_SAMPLE = 20_000  # bytes of lines that are not ASCII
_HIGH = re.compile(rb"[\x80-\xff]+")
_WESTERN = "cp1252"
_TYPOGRAPHIC = frozenset(mark.encode(_WESTERN) for mark in "€„…‘’“”–—™")


def _words(text: str) -> list[str]:
    return text.split()


# What stands in the headers of lists of points, by the encodings of its script.
_GUESSES = {
    **dict.fromkeys(
        ("cp932", "euc_jp"),
        _words("名前 名称 番号 点名 測定 計測 座標 軸 関節 角度 位置 時刻 日時 温度 点 姿勢 備考 ポイント ターゲット"),
    ),
    "gb18030": _words("名称 编号 序号 点名 点号 测量 测点 坐标 轴 关节 角度 位置 时间 温度 目标 备注 姿态 名字"),
    "big5": _words("名稱 編號 序號 點名 點號 測量 測點 座標 軸 關節 角度 位置 時間 溫度 目標 備註 姿態"),
    "cp949": _words("이름 번호 측정 좌표 축 관절 각도 위치 시간 온도 점 자세 비고"),
    **dict.fromkeys(
        ("cp1251", "koi8_r"), _words("имя точка точки номер ось координата измер угол сустав время название")
    ),
    "cp1250": _words("měření číslo název nazwa oś położenie współrzędne mérés név szám točka ime"),
}


def codec_of(name: str) -> str | None:
    """Python's name of an encoding of text; None where there is none of that name."""
    plain = name.strip().lower()
    try:
        found = codecs.lookup(_ALIASES.get(plain, plain))
    except (LookupError, ValueError, UnicodeError):
        return None
    is_text = getattr(found, "_is_text_encoding", True) and found.name.replace("_", "-") not in _NO_TEXT
    return found.name if is_text else None


def asked_codec(name: str) -> str:
    """Python's name of an encoding that a user asks for.

    Raises:
        InvalidInput: There is none of that name.
    """
    found = codec_of(name)
    if found is None:
        raise InvalidInput(f"expected an encoding such as utf-8, cp932, gbk, cp1252 or utf-16, got {name[:40]!r}")
    return "utf-8-sig" if found == "utf-8" else found


def marked_encoding(content: bytes) -> str | None:
    """The encoding that a byte order mark at the beginning of a text names."""
    return next((name for mark, name in _MARKS if content.startswith(mark)), None)


def decoded(content: bytes, path: str, encoding: str | None = None) -> tuple[str, tuple[str, ...]]:
    """The text of a file, and a sentence where its encoding was guessed.

    Args:
        content: Its bytes.
        path: For messages.
        encoding: As `asked_codec` gives it; None: by its mark, UTF-8, what it declares, or the likeliest.

    Raises:
        ParseError: It is no text in that encoding, or in none that could be found.
    """
    if encoding is not None:
        return _strictly(content, encoding, path), ()
    wide = marked_encoding(content) or _unmarked_wide(content)
    if wide is not None:
        return _strictly(content, wide, path), ()
    if b"\0" in content:
        line = content.count(b"\n", 0, content.index(b"\0")) + 1
        raise ParseError("holds a NUL character; expected a text file", path, line)
    try:
        return content.decode(), ()
    except UnicodeDecodeError:
        pass
    declared = _DECLARED.search(content[:_DECLARED_WITHIN])
    named = None if declared is None else codec_of(declared[1].decode())
    if named is not None and not named.startswith("utf"):
        return _strictly(content, named, path), ()
    guess = _likeliest(content)
    if guess is None:
        raise ParseError("is neither UTF-8 nor says which encoding it has; name it with --encoding", path)
    shown = {"cp1252": "Windows-1252", "gb18030": "GBK", "cp949": "EUC-KR"}.get(guess, guess.replace("_", "-"))
    note = f"the text is not UTF-8 and is taken as {shown}; fastcal import --encoding NAME reads it otherwise"
    return content.decode(guess), (note,)


def _strictly(content: bytes, encoding: str, path: str) -> str:
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        shown = encoding.removesuffix("-sig").upper() if encoding.startswith("utf") else encoding
        line = content.count(b"\n", 0, error.start) + 1
        raise ParseError(f"is no {shown} text: byte 0x{content[error.start]:02x}", path, line) from None


def _unmarked_wide(content: bytes) -> str | None:
    """UTF-16 without its mark: of a table nearly every second byte is NUL."""
    start = content[: 2 * (min(len(content), _SAMPLE) // 2)]
    zeros = start[::2].count(0), start[1::2].count(0)
    if len(content) % 2 or max(zeros) * 4 < len(start) // 2 or min(zeros) * 20 > max(zeros):
        return None
    return "utf-16-le" if zeros[1] > zeros[0] else "utf-16-be"


def _likeliest(content: bytes) -> str | None:
    """The encoding of a text that says nothing: by words that headers have, by its bytes, by charset-normalizer."""
    lines = dict.fromkeys(line for line in re.split(rb"[\r\n]+", content) if not line.isascii())
    sample = b"\n".join(lines)[:_SAMPLE].rpartition(b"\n")[0] if sum(map(len, lines)) > _SAMPLE else b"\n".join(lines)
    sample = sample or content[:_SAMPLE]
    known = {name: _known_words(sample, name, words) for name, words in _GUESSES.items()}
    best = sorted((name for name in known if known[name]), key=lambda name: -known[name])
    tried = best[:1] if best and (len(best) < 2 or known[best[0]] > known[best[1]]) else []
    if _looks_western(sample):
        tried.append(_WESTERN)
    return next((name for name in [*tried, *_by_statistics(sample), _WESTERN] if _is_text(content, name)), None)


def _known_words(sample: bytes, encoding: str, words: list[str]) -> int:
    """How many characters of the sample are words of its language; 0 where it is no text in that encoding."""
    try:
        text = sample.decode(encoding).lower()
    except UnicodeDecodeError:
        return 0
    return sum(len(word) for word in words if word in text and not word.isascii())


def _looks_western(sample: bytes) -> bool:
    """Single letters with accents, degrees and the like between ASCII, as no other script has them."""
    runs = [found[0] for found in _HIGH.finditer(sample)]
    return all((len(run) <= 2 and min(run) >= 0xA0) or run in _TYPOGRAPHIC for run in runs)


def _by_statistics(sample: bytes) -> list[str]:
    from charset_normalizer import from_bytes  # few files need it

    found = from_bytes(sample, cp_isolation=[_WESTERN, *_GUESSES], preemptive_behaviour=False)
    return [match.encoding for match in found]


def _is_text(content: bytes, encoding: str) -> bool:
    try:
        # Control characters and frames of boxes stand in no table.
        return not any(0x80 <= ord(c) < 0xA0 or 0x2500 <= ord(c) < 0x25A0 for c in set(content.decode(encoding)))
    except UnicodeDecodeError:
        return False
