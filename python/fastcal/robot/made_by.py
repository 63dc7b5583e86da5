# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a result comes from: the key `made_by` of model.yaml and of the JSON files.

Hashes are of the content, in SI, and not of files: the same rows from a CSV and from a workbook have the same one.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import fields
from datetime import date
from pathlib import PurePath
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LABELLED, ColumnOnDisk, LongDataset
from fastcal.robot.robot import Robot

WHO = ("serial", "instrument", "operator", "customer", "date")  # what only a person knows
_MOST_TEXT = 200
# Nothing fits them.
_NOT_MEASURED = (
    *(
        "notes",
        "source",
        "joint_types",
        "move",
        "direction_before",
        "observed_label_names",
        "q_read",
        "rotation_angles",
    ),
)
_MEASURED = sorted(field.name for field in fields(Dataset) if field.name not in _NOT_MEASURED)


def made_by(robot: Robot, data: Dataset | LongDataset, who: Mapping[str, str | None] | None = None) -> dict[str, Any]:
    """Version, hashes of robot and data, the data's files without their folders, and what is known of WHO.

    The serial number is the robot's own where `who` has none.

    Raises:
        InvalidInput: A key that is none of WHO, a date that is no YYYY-MM-DD, a text that is too long.
    """
    given = {key: text for key, text in (who or {}).items() if text is not None}
    known = {"serial": robot.made_by.get("serial")} | given
    return {
        "fastcal": _core.__version__,
        "robot_sha256": robot.sha256,
        "data_sha256": data_hash(data),
        "data": [PurePath(name).name for name in data.source.split(", ")],
        "rows": len(data),
    } | {key: checked(key, text) for key, text in known.items() if text}


def checked(key: str, text: str) -> str:
    """The text of one of WHO."""
    if key not in WHO:
        raise InvalidInput(f"expected {', '.join(WHO)}, got '{key}'")
    if not isinstance(text, str) or len(text) > _MOST_TEXT or not text.isprintable():
        raise InvalidInput(f"{key} must be a printable text of at most {_MOST_TEXT} characters, got {text!r:.80}")
    if key == "date":
        try:
            return date.fromisoformat(text).isoformat()
        except ValueError:
            raise InvalidInput(f"date must be YYYY-MM-DD, got '{text}'") from None
    return text


def data_hash(data: Dataset | LongDataset) -> str:
    """SHA-256 of a data set's numbers and labels, but for joints read back, which are never fitted."""
    found = hashlib.sha256()
    for name in _MEASURED:
        _feed(found, name, _of_all_rows(data, name) if isinstance(data, LongDataset) else getattr(data, name))
    return found.hexdigest()


def _of_all_rows(data: LongDataset, name: str) -> Any:
    return data.names(name.removesuffix("_names")) if name.endswith("_names") else data.column(name)


def _feed(found: Any, name: str, value: Any) -> None:
    if value is None or (isinstance(value, Mapping | tuple) and not value):
        return
    found.update(name.encode())
    if isinstance(value, Mapping):
        for key in sorted(value):
            _feed(found, str(key), value[key])
    elif isinstance(value, np.ndarray | ColumnOnDisk):
        if isinstance(value, ColumnOnDisk) and value.names is not None and name not in LABELLED:
            _feed_texts(found, (value.texts(codes) for codes in value.parts()))
            return
        found.update(str(value.shape).encode())
        for part in value.parts() if isinstance(value, ColumnOnDisk) else [value]:
            found.update(np.ascontiguousarray(part, "<f8" if part.dtype.kind == "f" else "<i8").tobytes())
    else:
        _feed_texts(found, [list(value)])


def _feed_texts(found: Any, parts: Iterable[list[str]]) -> None:
    """A list of texts as JSON, from parts of it."""
    mark = "["
    for part in parts:
        found.update(f"{mark}{json.dumps(part)[1:-1]}".encode())
        mark = ", "
    found.update(b"]")
