# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arrays as MATLAB, Octave (.mat) and NumPy (.npy, .npz) save them: those of as many rows side by side are a table.

A column of an array `q` is titled q1, q2 ...; of points, as their name says, "p x", "p y", "p z"; transforms (4, 4, N)
or (N, 4, 4) are a row each, r11 r12 r13 x r21 ... z. Fields of a MATLAB structure are arrays of their own, "session.q".
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.errors import ParseError, TooLarge
from fastcal.io.table import unreadable

MAX_BYTES = 100_000_000  # of all arrays, unpacked
_MATLAB_HEADER = 128
_COMPRESSED = 15  # miCOMPRESSED, MAT-file format, table 1-1
_OF_POINTS = frozenset(
    ("p", "xyz", "pos", "position", "positions", "point", "points", "tip", "measured", "measurement", "tracker")
)
_OF_A_TRANSFORM = ("r11", "r12", "r13", "x", "r21", "r22", "r23", "y", "r31", "r32", "r33", "z")


def is_matlab(content: bytes) -> bool:
    """Does a file say that it is MATLAB's, or Octave's in MATLAB's format?"""
    return content.startswith(b"MATLAB ")


def is_numpy(content: bytes) -> bool:
    """Is a file one array of NumPy's, or an archive of some?"""
    if content.startswith(b"\x93NUMPY"):
        return True
    if not content.startswith(b"PK\x03\x04"):
        return False
    try:
        names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    except (zipfile.BadZipFile, ValueError, OSError):
        return False
    return bool(names) and all(name.endswith(".npy") for name in names)


def array_tables(content: bytes, path: str) -> list[tuple[str, list[str], list[list[float]]]]:
    """(names, titles, rows) of each table: the arrays with that many rows, the longest table first.

    Raises:
        TooLarge: It holds more than MAX_BYTES.
        ParseError: It can't be read, or holds no numbers.
    """
    arrays = _matlab(content, path) if is_matlab(content) else _numpy(content, path)
    tables: dict[int, list[tuple[str, list[str], NDArray[np.float64]]]] = {}
    for given, values in arrays.items():
        name = "".join(letter if letter.isprintable() else "?" for letter in given)
        titles, rows = _columns(name, values)
        tables.setdefault(len(rows), []).append((name, titles, rows))
    found = [
        (
            ", ".join(name for name, _, _ in parts),
            [title for _, titles, _ in parts for title in titles],
            np.hstack([rows for _, _, rows in parts]).tolist(),
        )
        for count, parts in sorted(tables.items(), reverse=True)
        if count > 1
    ]
    if not found:
        raise ParseError("holds no array of numbers with two rows or more", path)
    return found


def _columns(name: str, values: NDArray[Any]) -> tuple[list[str], NDArray[np.float64]]:
    """Titles and rows of an array."""
    if values.ndim == 3 and values.shape[1:] != (4, 4) and values.shape[:2] == (4, 4):
        values = np.moveaxis(values, 2, 0)
    if values.ndim == 3 and values.shape[1:] == (4, 4):
        return list(_OF_A_TRANSFORM), np.asarray(values[:, :3].reshape(len(values), 12), dtype=float)
    if values.ndim == 2 and values.shape[0] == 1:
        values = values.T  # a row vector
    rows = np.asarray(values.reshape(len(values), -1), dtype=float)
    width = rows.shape[1]
    if width == 3 and name.rpartition(".")[2].lower() in _OF_POINTS:
        return [f"{name} {axis}" for axis in "xyz"], rows
    return [name] if width == 1 else [f"{name}{k}" for k in range(1, width + 1)], rows


def _numpy(content: bytes, path: str) -> dict[str, NDArray[Any]]:
    if content.startswith(b"PK"):
        size = sum(member.file_size for member in zipfile.ZipFile(io.BytesIO(content)).infolist())
        _check_size(size, path)
    try:
        found = np.load(io.BytesIO(content), allow_pickle=False)
        arrays = {name: found[name] for name in found.files} if hasattr(found, "files") else {"column": found}
    except Exception as error:  # noqa: BLE001 - a damaged file makes the decoder raise what it happens to meet
        raise unreadable("NumPy", error, path) from None
    return {name: values for name, values in arrays.items() if _is_of_numbers(values)}


def _matlab(content: bytes, path: str) -> dict[str, NDArray[Any]]:
    if content.startswith(b"MATLAB 7.3"):
        raise ParseError("is a MATLAB 7.3 file; save it with save(..., '-v7'), or as CSV with writematrix", path)
    _check_size(_unpacked(content), path)
    import scipy.io  # takes longer to import than a CSV to read

    try:
        found = scipy.io.loadmat(io.BytesIO(content), simplify_cells=True)
    except Exception as error:  # noqa: BLE001 - a damaged file makes the decoder raise what it happens to meet
        raise unreadable("MATLAB", error, path) from None
    arrays = dict(_named(found))
    if not arrays and "MatlabOpaque" in {type(value).__name__ for value in found.values()}:
        raise ParseError("holds a table or an object of MATLAB's; save a table with writetable(T, 'file.csv')", path)
    return arrays


def _named(found: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    """Arrays of numbers by name, those in structures behind the structure's."""
    for name, value in found.items():
        if above == "" and name.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _named(value, f"{above}{name}.")
        elif isinstance(value, np.ndarray) and _is_of_numbers(value):
            yield f"{above}{name}", value


def _is_of_numbers(values: NDArray[Any]) -> bool:
    return values.dtype.kind in "fiub" and values.dtype.names is None and 1 <= values.ndim <= 3 and values.size > 0


def _unpacked(content: bytes) -> int:
    """Bytes of a MATLAB 5 file's elements when unpacked; it stops beyond MAX_BYTES."""
    order = ">" if content[126:128] == b"MI" else "<"
    at, total = _MATLAB_HEADER, 0
    while at + 8 <= len(content) and total <= MAX_BYTES:
        kind, size = struct.unpack_from(order + "II", content, at)
        at += 8
        if kind == _COMPRESSED:
            total += _inflated(content[at : at + size])
        else:
            total += size
        at += size
    return total


def _inflated(packed: bytes) -> int:
    """Bytes that a stream holds; it stops beyond MAX_BYTES."""
    stream, total = zlib.decompressobj(), 0
    try:
        while packed and total <= MAX_BYTES:
            total += len(stream.decompress(packed, 1 << 20))
            packed = stream.unconsumed_tail
    except zlib.error:
        return total  # the decoder says what is wrong with it
    return total


def _check_size(size: int, path: str) -> None:
    if size > MAX_BYTES:
        raise TooLarge(f"expected arrays of at most {MAX_BYTES // 1_000_000} MB, got more", path)
