# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Corrections in and out, as safetensors: arrays and a line of JSON, so that reading one runs no code."""

from __future__ import annotations

import hashlib
import json
import os
import struct
from pathlib import Path
from typing import Any

from fastcal.correction.correction import Correction
from fastcal.correction.serialize import from_plain, to_plain
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.atomic import write_bytes
from fastcal.io.regular_file import read_bytes

MAX_BYTES = 256_000_000
DIGITS = 16
_KEY = "fastcal"


def write_correction(correction: Correction, model: Path) -> tuple[Path, str]:
    """Writes a correction beside the model file that will refer to it; returns its file and its SHA-256.

    The name is the model's with the first digits of the SHA-256, so that the file of an older model is never changed.

    Raises:
        InvalidInput: The file cannot be written, or another content has its name.
    """
    from safetensors.numpy import save

    settings, tensors = to_plain(correction)
    arrays = {name: value.copy(order="C") for name, value in tensors.items()}
    content = save(arrays, metadata={_KEY: json.dumps(settings, allow_nan=False)})
    sha256 = hashlib.sha256(content).hexdigest()
    path = model.with_name(f"{model.stem}-{sha256[:DIGITS]}.safetensors")
    if not os.path.lexists(path):
        write_bytes(path, content)
    elif read_bytes(path, MAX_BYTES) != content:
        raise InvalidInput(f"{path}: cannot be written: another file has this name")
    return path, sha256


def read_correction(path: str | os.PathLike[str], sha256: str | None = None) -> Correction:
    """Reads a file.

    Args:
        path: The file.
        sha256: What it must be, as the model that refers to it says; None: not checked.

    Raises:
        ParseError: It is not there, is cut off, was changed, or holds something else.
    """
    from safetensors.numpy import load

    content = read_bytes(path, MAX_BYTES)
    if sha256 is not None and hashlib.sha256(content).hexdigest() != sha256:
        raise ParseError(
            "expected the correction that the model was saved with (its sha256), got another content", path
        )
    try:
        tensors = load(content)
        settings = _settings(content)
    except Exception as error:  # noqa: BLE001 - a damaged header makes the decoder raise what it happens to meet
        raise ParseError(f"expected a correction as safetensors: {str(error)[:100]}", path) from None
    try:
        return from_plain(settings, tensors)
    except InvalidInput as error:
        raise ParseError(str(error), path) from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ParseError(
            f"expected the settings of a correction, and they are none: {str(error)[:100]}", path
        ) from None


def _settings(content: bytes) -> Any:
    """The JSON line in the header, whose length is in the first eight bytes; `load` has checked both."""
    (size,) = struct.unpack("<Q", content[:8])
    header = json.loads(content[8 : 8 + size])
    return json.loads(header["__metadata__"][_KEY])
