# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Damage to the bytes of a file: numbers, pieces, lines, words, cells of a workbook, values of a tree."""

from __future__ import annotations

import io
import json
import random
import re
import struct
import zipfile
from typing import Any

NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
VALUES = [
    *(b"1e308", b"-1e308", b"5e-324", b"1e-300", b"1e999", b"nan", b"inf", b"-inf", b"0", b"-0", b"1e100", b"-1", b"2"),
    *(b"9" * 30, b"9" * 400, b"0x10", b"1_000", b"true", b"null", b"''", b"[]", b"{}", b"1,5", b"1e", b"\xd9\xa3"),
]
PIECES = [
    *(b",", b";", b"\n", b"\t", b'"', b"'", b".", b"-", b" ", b"\xff", b"\0", b"{", b"}", b"[", b"]", b":", b"<", b">"),
    *(b"/>", b"&a", b"*a", b"!!", b"(", b")", b"_cm", b"deg", b"\r", b"\xef\xbb\xbf", b"\xe2\x80\xae", b"\x1b[2J"),
]


def number_damage(rng: random.Random, content: bytes) -> bytes:
    """One number becomes another, or what is none."""
    found = list(NUMBER.finditer(content))
    if not found:
        return content
    chosen = rng.choice(found)
    return content[: chosen.start()] + rng.choice(VALUES) + content[chosen.end() :]


def splice(rng: random.Random, content: bytes) -> bytes:
    """Bytes go, come, or change."""
    start = rng.randrange(len(content) + 1)
    piece = rng.choice([rng.choice(PIECES), rng.randbytes(rng.randrange(4)), b""])
    return content[:start] + piece + content[start + rng.choice([0, 1, 1, 4, 40]) :]


def lines(rng: random.Random, content: bytes) -> bytes:
    """Lines double, vanish or change places."""
    parts = content.split(b"\n")
    i, j = rng.randrange(len(parts)), rng.randrange(len(parts))
    match rng.randrange(3):
        case 0:
            parts.insert(i, parts[j])
        case 1:
            del parts[i]
        case _:
            parts[i], parts[j] = parts[j], parts[i]
    return b"\n".join(parts)


def words(rng: random.Random, content: bytes) -> bytes:
    """Two words change places."""
    found = list(re.finditer(rb"\w+", content))
    if len(found) < 2:
        return content
    a, b = sorted(rng.sample(found, 2), key=lambda match: match.start())
    return content[: a.start()] + b[0] + content[a.end() : b.start()] + a[0] + content[b.end() :]


def damaged(rng: random.Random, content: bytes) -> bytes:
    """One to four changes of any kind."""
    for _ in range(rng.choice([1, 1, 2, 4])):
        content = rng.choice([number_damage, number_damage, splice, lines, words])(rng, content)
    return content[: rng.randrange(len(content) + 1)] if rng.random() < 0.03 else content


def damaged_workbook(rng: random.Random, content: bytes) -> bytes:
    """Mostly a part of the archive, else its bytes."""
    if rng.random() < 0.2:
        return splice(rng, content)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        chosen = rng.choice([name for name in names if "sheet1" in name] * 4 + names)
        for name in names:
            part = old.read(name)
            new.writestr(name, damaged(rng, part) if name == chosen else part)
    return out.getvalue()


def damaged_correction(rng: random.Random, content: bytes) -> bytes:
    """Mostly the header, its length kept true, else the bytes."""
    if rng.random() < 0.3:
        return splice(rng, content)
    (size,) = struct.unpack("<Q", content[:8])
    header = json.loads(content[8 : 8 + size])
    settings = json.loads(header["__metadata__"]["fastcal"])
    if rng.random() < 0.8:
        replace_value(rng, settings)
        header["__metadata__"]["fastcal"] = json.dumps(settings)
    else:
        replace_value(rng, header)
    text = json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + content[8 + size :]


def replace_value(rng: random.Random, tree: Any) -> None:
    """One value of a JSON tree becomes one of another type or size."""
    places: list[tuple[Any, Any]] = []
    todo = [tree]
    while todo:
        node = todo.pop()
        inside = list(node.items() if isinstance(node, dict) else enumerate(node))
        places += [(node, key) for key, _ in inside]
        todo += [value for _, value in inside if isinstance(value, dict | list)]
    node, key = rng.choice(places)
    node[key] = rng.choice([None, True, -1, 0, 3, 1e308, 10**30, "x", "", [], [[1]], {}, {"a": 1}, 1.5, float("nan")])
