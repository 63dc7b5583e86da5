# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Results as JSON: whole or not at all, plain numbers, null for what is not finite."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from fastcal.errors import ParseError
from fastcal.io.atomic import write_text
from fastcal.io.regular_file import read_bytes

MAX_BYTES = 64_000_000


def write_json(path: str | os.PathLike[str], content: Mapping[str, Any]) -> None:
    """Writes plain data, numpy numbers and arrays; NaN and infinite numbers, which JSON does not have, become null.

    Raises:
        InvalidInput: The file cannot be written.
    """
    write_text(path, json_text(content))


def json_text(content: Mapping[str, Any]) -> str:
    """Plain data as JSON; numbers that are not finite become null."""
    return json.dumps(_plain(content), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def read_json(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The content of a result.json.

    Raises:
        ParseError: The file is not there or does not hold a JSON object.
    """
    try:
        content = json.loads(read_bytes(path, MAX_BYTES).decode())
    except ParseError:
        raise
    except (ValueError, RecursionError) as error:
        raise ParseError(f"is not JSON: {error}", path, getattr(error, "lineno", None)) from None
    if not isinstance(content, dict):
        raise ParseError(f"expected a JSON object, got {type(content).__name__}", path)
    return content


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
