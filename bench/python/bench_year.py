# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A year of 200 arms: calibrated from 60 poses, checked every month by eight, the tracker set up anew each time.

At some month a joint's zero moves by 0.02 deg, a joint softens by a tenth, the tool is bent by 0.2 mm, or nothing
happens. Counted: alarms within two checks of the event, the cause that the first alarm names, false alarms, and how far
a model updated from twelve poses is from the arm, beside a new calibration from sixty.

The arms are year_arm.py's, which shares no code with fastcal: geometry off by 0.5 mm and 0.5 mrad, masses by 6 %,
centres by 10 mm, compliances by a third; noise 0.03 mm a coordinate. Zeros of joints 2 to 5: joint 1's is the base's
turn, which nobody knows anew, and joint 6's moves this tool by half the noise. Arms 0 to 199 are reported; what was
chosen was chosen on others.

    python bench/python/bench_year.py [--arms 200] [--first 0] [--jobs N] [--out FILE] [--merge FILE ...] [--control]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from numpy.typing import NDArray
from year_arm import Arm, shift, turn

import fastcal
from fastcal.io.atomic import write_text
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.control import misfit_chart, number_chart
from fastcal.monitoring.history import WATCHED
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

ARM = "staubli_rx160l"
POSES, MONTHLY, UPDATE, UNSEEN = 60, 8, 12, 300
MONTHS = 12
NOISE = 3e-5
LOADS = (0.0, 14.0)
COMPLIANCE = {2: 2e-6, 3: 5e-6}  # joint: [rad/Nm]; an arm that sags by some 4 mm at full reach
EFFECTS = ["geometry", *(f"joint_compliance@joint{joint}" for joint in COMPLIANCE)]
EVENTS = ("zero", "softer", "tool", "nothing")
ZEROS = (2, 3, 4, 5)
GOALS = {"alarm": 0.95, "cause": 0.90, "false": 0.01, "update": 1.3}


def nominal() -> Robot:
    """The robot file."""
    return fastcal.load_robot(ARM)


def bodies() -> tuple[FloatArray, FloatArray]:
    """Masses (n,) [kg] and centres (n, 3) [m] of the links by the robot file."""
    links = [joint["link"] for joint in nominal().spec["joints"]]
    return np.array([link["mass_kg"] for link in links]), np.array([link["com_mm"] for link in links]) / 1e3


def built(random: np.random.Generator) -> Arm:
    """An arm as it left the factory, and its compliances."""
    spec = nominal().spec
    rows = np.array(
        [
            [np.radians(j["theta_deg"]), j["d_mm"] / 1e3, j["a_mm"] / 1e3, np.radians(j["alpha_deg"]), 0.0]
            for j in spec["joints"]
        ]
    )
    masses, centres = bodies()
    compliance = np.zeros(len(rows))
    for joint, size in COMPLIANCE.items():
        compliance[joint - 1] = size * random.uniform(0.7, 1.4)
    return Arm(
        rows=rows + 5e-4 * random.standard_normal(rows.shape),
        masses=masses * (1 + 0.06 * random.standard_normal(len(rows))),
        centres=centres + 0.01 * random.standard_normal(centres.shape),
        compliance=compliance,
        payload_centre=np.array(spec["payload"]["com_mm"]) / 1e3,
        tool=np.array(spec["tool"]["xyz_mm"]) / 1e3 + 5e-4 * random.standard_normal(3),
        base=set_up(random),
    )


def set_up(random: np.random.Generator) -> FloatArray:
    """The base before a tracker that was put down somewhere."""
    x, y, z = random.uniform([-3, -3, -1], [3, 3, 0.5])
    return np.asarray(
        shift(x, y, z)
        @ turn(2, random.uniform(-3, 3))[0]
        @ turn(1, random.normal(0, 0.02))[0]
        @ turn(0, random.normal(0, 0.02))[0]
    )


def measured(arm: Arm, q: FloatArray, payload: FloatArray, random: np.random.Generator) -> Dataset:
    """Points with noise."""
    points = arm.points(q, payload) + NOISE * random.standard_normal((len(q), 3))
    return Dataset.from_arrays(q, payload=payload, position=points, robot=nominal())


def postures(count: int, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Joint positions within the limits, and loads."""
    low, high = nominal().limits.T
    return random.uniform(low, high, (count, len(low))), random.choice(LOADS, count)


def happened(arm: Arm, event: str, random: np.random.Generator) -> tuple[Arm, str]:
    """The arm after an event, and the label of its cause."""
    if event == "zero":
        joint = int(random.choice(ZEROS))
        rows = arm.rows.copy()
        rows[joint - 1, 0] += np.radians(0.02) * random.choice([-1, 1])
        return arm.with_(rows=rows), f"joint{joint} zero"
    if event == "softer":
        joint = int(random.choice(list(COMPLIANCE)))
        compliance = arm.compliance.copy()
        compliance[joint - 1] *= 1.1
        return arm.with_(compliance=compliance), f"joint_compliance@joint{joint}"
    if event == "tool":
        way = random.standard_normal(3)
        return arm.with_(tool=arm.tool + 2e-4 * way / np.linalg.norm(way)), "tool"
    return arm, ""


def away(model: Robot, arm: Arm, random: np.random.Generator) -> float:
    """RMS distance [m] of model and arm over unseen poses, the base laid on: where the tracker stands is no error."""
    q, payload = postures(UNSEEN, random)
    p, x = model.forward(q, payload=payload)[:, :3, 3], arm.points(q, payload)
    U, _, Vt = np.linalg.svd((x - x.mean(axis=0)).T @ (p - p.mean(axis=0)))
    left = (p - p.mean(axis=0)) @ (U @ Vt).T - (x - x.mean(axis=0))
    return float(np.sqrt(np.mean(np.sum(left**2, axis=1))))


@dataclass(frozen=True)
class Year:
    """What a year of one arm came to."""

    event: str
    label: str
    quiet_checks: int
    false_alarms: int
    undecided: int
    delay: int | None  # checks from the event to the alarm, 1 the first; None: none within the year
    named: str
    rivals: int
    chart_alarms: int = 0  # of the control charts, over the quiet checks
    update: float | None = None
    stale: float | None = None
    calibration: float | None = None


def year(index: int, update: bool = True, control: bool = False) -> Year:
    """One arm; a control has the masses of its robot file, and nothing happens to it."""
    random = np.random.default_rng([2026, index])
    event = "nothing" if control else EVENTS[index % len(EVENTS)]
    arm = built(random)
    if control:
        masses, centres = bodies()
        arm = arm.with_(masses=masses, centres=centres)
    result = fastcal.calibrate(nominal(), measured(arm, *postures(POSES, random), random), effects=EFFECTS)
    model = result.model
    poses = fastcal.check_poses(model, MONTHLY)
    month = int(random.integers(3, MONTHS - 1))
    after, label = happened(arm, event, random)
    quiet = false = undecided = 0
    delay, named, rivals = None, "", 0
    kept: list[dict[str, Any]] = []
    for k in range(MONTHS):
        moved = event != "nothing" and k >= month
        today = (after if moved else arm).with_(base=set_up(random))
        found = fastcal.check(model, measured(today, poses.q, poses.payload, random))
        if not moved:
            quiet += 1
            false += found.verdict == "changed"
            undecided += found.verdict == "cannot_tell"
            kept.append(found.to_json_dict())
        elif found.verdict == "changed":
            delay = k - month + 1
            named, rivals = found.causes[0].label, len(found.causes[0].equivalents)
            break
    alarms = charted(kept)
    if not update:
        return Year(event, label, quiet, false, undecided, delay, named, rivals, alarms)
    few = fastcal.check_poses(model, UPDATE)
    today = after.with_(base=set_up(random))
    updated = fastcal.update(model, measured(today, few.q, few.payload, random)).model
    fresh = fastcal.calibrate(nominal(), measured(today, *postures(POSES, random), random), effects=EFFECTS).model
    seed = int(random.integers(2**31))
    errors = [away(m, today, np.random.default_rng(seed)) for m in (updated, model, fresh)]
    return Year(event, label, quiet, false, undecided, delay, named, rivals, alarms, *errors)


def charted(checks: list[dict[str, Any]]) -> int:
    """How many of these checks, of an arm to which nothing has happened, a control chart alarms at anew."""
    charts = [misfit_chart([c["misfit_p_value"] for c in checks])]
    series: dict[str, list[dict[str, Any]]] = {}
    for check in checks:
        for test in check["tests"]:
            if test["kind"] in WATCHED:
                series.setdefault(f"{test['owner']} {test['name']}", []).append(test)
    for name, tests in series.items():
        if len(tests) == len(checks):
            charts.append(number_chart(name, *([t[key] for t in tests] for key in ("value", "std", "std_noise"))))
    return len({k for chart in charts for k in chart.alarms if k - 1 not in chart.alarms})


def table(years: list[Year]) -> dict[str, Any]:
    """The figures of all arms."""
    quiet = sum(y.quiet_checks for y in years)
    out: dict[str, Any] = {
        "arms": len(years),
        "quiet_checks": quiet,
        "false_alarms": sum(y.false_alarms for y in years),
        "false_rate": sum(y.false_alarms for y in years) / quiet,
        "undecided": sum(y.undecided for y in years),
        "chart_alarms": sum(y.chart_alarms for y in years),
        "events": {},
    }
    for event in [e for e in EVENTS if e != "nothing" and any(y.event == e for y in years)]:
        some = [y for y in years if y.event == event]
        out["events"][event] = _row(some)
        for label in sorted({y.label for y in some}):
            if len({y.label for y in some}) > 1:
                out["events"][f"{event}, {label}"] = _row([y for y in some if y.label == label])
    if any(y.event != "nothing" for y in years):
        out["all"] = _row([y for y in years if y.event != "nothing"])
    if all(y.update is not None for y in years):
        for name, group in [
            ("all", years),
            *((e, [y for y in years if y.event == e]) for e in {y.event: 0 for y in years}),
        ]:
            mean = {
                each: float(np.sqrt(np.mean([getattr(y, each) ** 2 for y in group])))
                for each in ("stale", "update", "calibration")
            }
            ratio = [y.update / y.calibration for y in group if y.update and y.calibration]
            out.setdefault("update", {})[name] = {f"{k}_mm": v * 1e3 for k, v in mean.items()} | {
                "ratio": mean["update"] / mean["calibration"],
                "ratio_median": float(np.median(ratio)),
                "ratio_90": float(np.quantile(ratio, 0.9)),
            }
    return out


def markdown(found: dict[str, Any]) -> str:
    """The tables of docs/monitoring.md."""
    names = {"zero": "zero moved by 0.02 deg", "softer": "joint softened by a tenth", "tool": "tool bent by 0.2 mm"}
    lines = ["| event | arms | alarm at the first check | within two | right cause | rivals listed |"]
    lines.append("|---|---|---|---|---|---|")
    for event, row in [*found["events"].items(), ("all", found["all"])]:
        kind, _, label = event.partition(", ")
        name = f"{label.replace('joint_compliance@', '')}" if label else names.get(kind, kind)
        shares = " | ".join(
            f"{100 * row[key]:.0f} %" for key in ("within_one", "within_two", "right_cause", "with_rivals")
        )
        lines.append(f"| {'... ' if label else ''}{name} | {row['arms']} | {shares} |")
    lines += ["", "| model, RMS mm on unseen poses | old | updated from 12 | calibrated from 60 | ratio |"]
    lines.append("|---|---|---|---|---|")
    for event, row in found["update"].items():
        sizes = " | ".join(f"{row[key]:.3f}" for key in ("stale_mm", "update_mm", "calibration_mm"))
        lines.append(f"| {names.get(event, event)} | {sizes} | {row['ratio']:.2f} |")
    return "\n".join(lines)


def _row(years: list[Year]) -> dict[str, Any]:
    within = [y for y in years if y.delay is not None and y.delay <= 2]
    alarmed = [y for y in years if y.delay is not None]
    return {
        "arms": len(years),
        "within_one": sum(y.delay == 1 for y in years) / len(years),
        "within_two": len(within) / len(years),
        "right_cause": sum(y.named == y.label for y in alarmed) / max(len(alarmed), 1),
        "with_rivals": sum(y.rivals > 0 for y in alarmed) / max(len(alarmed), 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--no-update", action="store_true")
    parser.add_argument("--control", action="store_true", help="arms to which nothing happens, masses as in their file")
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--merge", type=Path, nargs="+", help="tables of other runs, in place of a run")
    options = parser.parse_args()
    arms = range(options.first, options.first + options.arms)
    if options.merge:
        years = [Year(**row) for file in options.merge for row in json.loads(file.read_text("utf-8"))["years"]]
    else:
        years = joblib.Parallel(options.jobs)(
            joblib.delayed(year)(i, not options.no_update, options.control) for i in arms
        )
    if options.verbose:
        for i, y in enumerate(years, options.first):
            print(i, y)
    found = table(years) | {"noise_mm": NOISE * 1e3, "poses": POSES, "monthly": MONTHLY, "update_poses": UPDATE}
    found["years"] = [asdict(y) for y in years]
    text = json.dumps(found, indent=1) + "\n"
    if options.out:
        write_text(options.out, text)
    print(json.dumps({key: value for key, value in found.items() if key != "years"}, indent=1))


if __name__ == "__main__":
    main()
