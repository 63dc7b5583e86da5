# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks and models of arms as files of a folder: which arm, when, what was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from fastcal.display import late
from fastcal.monitoring.result import VERDICTS

_LARGEST = 1e100


@dataclass(frozen=True)
class Event:
    """A file of the history.

    Attributes:
        arm: Serial number, folder or name.
        kind: "check" or "model".
        date: YYYY-MM-DD; dated_by: "made_by", or "file" where only the file's own time says.
        file: Relative to the folder.
        verdict: Of a check.
        content: check.json; of a model its key made_by and what it keeps of its noise.
    """

    arm: str
    kind: str
    date: str
    dated_by: str
    file: str
    verdict: str | None
    content: Mapping[str, Any]
    model: str | None = None


def check_event(path: Path, root: Path) -> Event | None:
    """A check; None for another JSON file."""
    content: dict[str, Any] = late.call("read_json", path)
    if content.get("verdict") not in VERDICTS or not isinstance(content.get("tests"), list):
        return None
    if not all(is_number(content.get(key)) for key in ("p_value", "misfit_p_value")) or misfit_of(content) is None:
        return None
    origin = content.get("made_by")
    origin = origin if isinstance(origin, Mapping) else {}
    return Event(
        _name(origin, content.get("robot"), path, root),
        "check",
        *_date(origin, path),
        str(path.relative_to(root)),
        content["verdict"],
        content,
        origin.get("robot_sha256"),
    )


def is_number(value: Any) -> bool:
    """Whether a value of a file is a number whose square is one as well."""
    return isinstance(value, int | float) and abs(value) < _LARGEST


def misfit_of(content: Mapping[str, Any]) -> tuple[float, float, str] | None:
    """RMS error found and expected of a check.json, and their unit; of points where they were measured."""
    kinds = content.get("kinds")
    found, expected, unit = content.get("rms_mm"), content.get("expected_rms_mm"), "mm"
    if found is None and isinstance(kinds, Mapping) and kinds:
        of = next(iter(kinds.values()))
        if not isinstance(of, Mapping) or not isinstance(of.get("after"), Mapping):
            return None
        found, expected, unit = of["after"].get("rms"), of.get("expected_rms"), str(of.get("unit"))
    if not is_number(found) or not is_number(expected):
        return None
    return float(found), float(expected), unit  # type: ignore[arg-type]


def model_event(path: Path, root: Path) -> Event | None:
    """A calibrated model; None for another robot file."""
    if "covariance_root" not in path.read_text(encoding="utf-8", errors="replace"):
        return None
    robot = late.call("load_robot", path)
    if robot.record is None:
        return None
    origin = robot.made_by
    noise = {kind: {"value": value, "unit": unit} for kind, (value, unit) in robot.record.noise.items()}
    content = {"noise": noise, "sigma_mm": robot.record.sigma_mm, "made_by": origin, "robot": robot.name}
    return Event(
        _name(origin, robot.name, path, root),
        "model",
        *_date(origin, path),
        str(path.relative_to(root)),
        None,
        content,
        robot.sha256,
    )


def _name(origin: Mapping[str, Any], robot: Any, path: Path, root: Path) -> str:
    if origin.get("serial"):
        return str(origin["serial"])
    inside = path.relative_to(root).parts
    return inside[0] if len(inside) > 1 else str(robot or "arm")


def _date(origin: Mapping[str, Any], path: Path) -> tuple[str, str]:
    if origin.get("date"):
        return str(origin["date"]), "made_by"
    return datetime.fromtimestamp(path.stat().st_mtime, timezone.utc).date().isoformat(), "file"
