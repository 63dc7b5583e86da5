# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Models and checks of arms over time, out of a folder; several arms are a fleet.

The folder is the history: each check and each model is a file of its own, which nothing rewrites, so that none can be
lost or half written. An arm is a serial number; without one, the folder that its files are in, or its name.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fastcal.display import late
from fastcal.display.shown import Shown
from fastcal.errors import FastcalError, InvalidInput
from fastcal.monitoring.control import Chart, misfit_chart, number_chart
from fastcal.monitoring.events import Event, check_event, is_number, model_event

WATCHED = ("zero", "tool", "effect")  # kinds of numbers that are charted
_MOST_FILES = 20_000
_OWN = ("history.json",)


@dataclass(frozen=True)
class Alarm:
    """What a chart or a check finds beyond chance: by "check", "ewma" or "cusum"; of a check its event."""

    arm: str
    date: str
    by: str
    what: str
    event: Event | None = None


@dataclass(frozen=True, eq=False)
class ArmHistory:
    """One arm.

    Attributes:
        name: Serial number, folder or name.
        robot: The name of its robot file.
        events: In the order of time.
        checks: Those that are checks of the newest model that was checked, which the charts are of.
        charts: The misfit first, then numbers, those nearest to their limit first.
        alarms: In the order of time.
    """

    name: str
    robot: str
    events: list[Event]
    checks: list[Event]
    charts: list[Chart]
    alarms: list[Alarm]

    @property
    def state(self) -> str:
        """The verdict of the last check, "alarm" where it holds and a chart alarms at it; "unchecked" without one."""
        if not self.checks:
            return "unchecked"
        last = self.checks[-1]
        if last.verdict == "holds" and any(a.date == last.date for a in self.alarms):
            return "alarm"
        return str(last.verdict)


@dataclass(frozen=True, eq=False, repr=False)
class History(Shown):
    """What `history` found: arms by name, and notes on files that could not be read."""

    folder: str
    arms: list[ArmHistory]
    notes: list[str] = field(default_factory=list)

    @property
    def alarms(self) -> list[Alarm]:
        """Of all arms."""
        return [alarm for arm in self.arms for alarm in arm.alarms]

    def to_json_dict(self) -> dict[str, Any]:
        """The content of history.json."""
        return {
            "arms": [
                {
                    "arm": arm.name,
                    "robot": arm.robot,
                    "state": arm.state,
                    "events": [
                        {"kind": e.kind, "date": e.date, "dated_by": e.dated_by, "file": e.file, "verdict": e.verdict}
                        for e in arm.events
                    ],
                    "charts": [
                        {
                            "name": c.name,
                            "value": c.value.tolist(),
                            "low": None if c.low is None else c.low.tolist(),
                            "limit": c.limit.tolist(),
                            "dates": [e.date for e in arm.checks],
                        }
                        for c in arm.charts
                    ],
                    "alarms": [{"date": a.date, "by": a.by, "what": a.what} for a in arm.alarms],
                }
                for arm in self.arms
            ],
            "notes": self.notes,
        }

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes history.json and report.html into a folder, both or none."""
        late.call("write_history", self, folder)


def history(folder: str | os.PathLike[str]) -> History:
    """Reads all checks (JSON) and models (YAML) in a folder and those below it.

    Raises:
        InvalidInput: There is no such folder, or neither a check nor a model in it.
    """
    root = Path(folder)
    if not root.is_dir():
        raise InvalidInput(f"{folder}: expected a folder with checks and models")
    events: list[Event] = []
    notes: list[str] = []
    files = sorted(p for p in root.rglob("*") if p.suffix in (".json", ".yaml", ".yml") and p.is_file())
    if len(files) > _MOST_FILES:
        raise InvalidInput(f"{folder}: more than {_MOST_FILES} files; name the folder of the arms themselves")
    for path in files:
        if path.name in _OWN or any(part.startswith(".") for part in path.relative_to(root).parts):
            continue
        try:
            event = check_event(path, root) if path.suffix == ".json" else model_event(path, root)
        except FastcalError as error:
            notes.append(f"left out: {error}")
            continue
        if event is not None:
            events.append(event)
    if not events:
        raise InvalidInput(f"{folder}: neither a check.json nor a calibrated model in it")
    undated = sum(event.dated_by == "file" for event in events)
    if undated:
        notes.append(f"{undated} of {len(events)} files have no date (--date): the file's own time is used")
    names = dict.fromkeys(event.arm for event in events)
    return History(str(folder), [_arm(name, [e for e in events if e.arm == name]) for name in sorted(names)], notes)


def _arm(name: str, events: list[Event]) -> ArmHistory:
    events = sorted(events, key=lambda e: (e.date, e.kind == "check", e.file))
    checks = [e for e in events if e.kind == "check"]
    current = [e for e in checks if e.model == checks[-1].model] if checks else []
    charts = _charts(current)
    alarms = [
        Alarm(name, e.date, "check", str(e.content.get("sentence") or "changed"), e)
        for e in checks
        if e.verdict == "changed"
    ]
    alarms += [Alarm(name, current[k].date, by, chart.name) for k, by, chart in _chart_alarms(charts)]
    robot = next((str(e.content.get("robot")) for e in reversed(events) if e.content.get("robot")), "")
    return ArmHistory(name, robot, events, current, charts, sorted(alarms, key=lambda a: (a.date, a.by, a.what)))


def _chart_alarms(charts: list[Chart]) -> list[tuple[int, str, Chart]]:
    """(check, "ewma" or "cusum", chart) where a chart passes its limit; one event moves many numbers: the farthest."""
    out = [(k, "ewma", c) for c in charts if c.low is None for k in c.alarms if k - 1 not in c.alarms]
    first: dict[int, list[Chart]] = {}
    for chart in (c for c in charts if c.low is not None):
        for k in chart.alarms:
            if k - 1 not in chart.alarms:
                first.setdefault(k, []).append(chart)
    for k, several in first.items():
        out.append((k, "cusum", max(several, key=lambda c: max(c.value[k], -(c.low[k] if c.low is not None else 0.0)))))
    return out


def _charts(checks: list[Event]) -> list[Chart]:
    """The misfit, and every watched number that all checks show."""
    if not checks:
        return []
    series: dict[str, list[Mapping[str, Any]]] = {}
    for event in checks:
        for test in event.content["tests"]:
            if isinstance(test, dict) and test.get("kind") in WATCHED:
                name = str(test.get("name")).removesuffix(f"_{test.get('unit')}")
                series.setdefault(f"{test.get('owner')} {name}", []).append(test)
    numbers = [
        number_chart(name, *([float(t[key]) for t in tests] for key in ("value", "std", "std_noise")))
        for name, tests in series.items()
        if len(tests) == len(checks) and all(_is_whole(t) for t in tests)
    ]
    numbers.sort(key=lambda c: -max(c.value.max(), -c.low.min() if c.low is not None else 0.0))
    return [misfit_chart([float(e.content["misfit_p_value"]) for e in checks]), *numbers]


def _is_whole(test: Mapping[str, Any]) -> bool:
    return all(is_number(test.get(key)) for key in ("value", "std", "std_noise"))
