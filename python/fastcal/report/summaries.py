# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots, data and results in a line and in a few lines: what commands print and notebooks show."""

from __future__ import annotations

import importlib
from functools import singledispatch
from pathlib import PurePath
from typing import Any

import numpy as np

from fastcal.calibration.evaluation import Evaluation
from fastcal.calibration.repeatability import Repeatability
from fastcal.calibration.result import CalibrationResult
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, POSE
from fastcal.measurements.observations import plurals
from fastcal.report.formatting import plural
from fastcal.report.words import listed
from fastcal.robot.robot import Robot
from fastcal.units import from_si

_CONDITIONS = ("temperature", "time", "current", "wrench", "approach", "q_read")
_FITTED = "what it hangs on is fitted to these rows"
_MOST_ROWS = 20  # outliers that are listed
# Room of a type: the module that registers what is said of it; that of the other rooms is `use_summary`.
_ELSEWHERE = {"diagnosis": "diagnosis_summary", "monitoring": "monitoring_summary"}


@singledispatch
def headline(shown: Any) -> str:
    """What `repr` shows between the brackets."""
    return str(_registered(headline, shown)(shown))


@singledispatch
def summary(shown: Any) -> list[str]:
    """The lines of `summary()`."""
    return list(_registered(summary, shown)(shown))


def _registered(shows: Any, shown: Any) -> Any:
    """The function for a diagnosis, a check or a command, whose rooms are entered only where there is one."""
    room = type(shown).__module__.removeprefix("fastcal.").partition(".")[0]
    importlib.import_module(f"fastcal.report.{_ELSEWHERE.get(room, 'use_summary')}")
    found = shows.dispatch(type(shown))
    if found is shows.dispatch(object):
        raise TypeError(f"nothing is known of {type(shown).__name__}")
    return found


@headline.register
def _(robot: Robot) -> str:
    effects = [f"{entry['effect']}@{entry['owner']}" for entry in robot.entries]
    identified = "" if robot.record is None else ", identified"
    with_effects = f", {', '.join(effects)}" if effects else ""
    return f"{robot.name}, {robot.joint_count} joints ({robot.kinematics}){identified}{with_effects}"


@summary.register
def _(robot: Robot) -> list[str]:
    masses = [None if joint.link is None else joint.link.mass_kg for joint in robot.joints]
    known = [mass for mass in masses if mass is not None]
    lines = [
        headline(robot),
        f"reach: at most {robot.reach:.3f} m from base to tool",
        f"link masses: {sum(known):.1f} kg in {len(known)} of {len(masses)} links" if known else "link masses: none",
    ]
    if robot.record is not None:
        record = robot.record
        noise = ", ".join(
            f"noise of {'a coordinate' if kind == POINTS else kind} {value:.4f} {unit}"
            for kind, (value, unit) in record.noise.items()
        )
        lines.append(f"identified: {len(record.parameters)} parameters, {noise}")
    return lines


@headline.register
def _(data: Dataset) -> str:
    sizes = f"{plural(len(data), 'pose')} of {plural(data.q.shape[1], 'joint')}"
    return f"{PurePath(data.source).name}, {sizes}; {listed(_measured(data))}"


@summary.register
def _(data: Dataset) -> list[str]:
    lines = [headline(data)]
    conditions = [name for name in _CONDITIONS if getattr(data, name) is not None]
    if data.payload.any():
        low, high = data.payload.min(), data.payload.max()
        lines.append(f"payload: {low:g} to {high:g} kg" if high > low else f"payload: {low:g} kg")
    if conditions:
        lines.append(f"recorded with it: {listed([name.replace('q_read', 'joint read-back') for name in conditions])}")
    for name, labels in (("stations", data.station_names), ("mounts", data.mount_names)):
        if labels:
            lines.append(f"{name}: {listed(list(labels))}")
    if data.position is not None:
        low, high = (from_si(edge(data.position, axis=0), "mm") for edge in (np.nanmin, np.nanmax))
        box = " x ".join(f"{side:.0f}" for side in high - low)
        lines.append(f"the measured points span {box} mm")
    if data.extra or data.extra_labels:
        lines.append(f"other columns: {listed([*data.extra, *data.extra_labels])}")
    return lines


@headline.register
def _(found: Evaluation) -> str:
    main = found.main
    after = None if main is None else main.statistics[1]
    rms = "nothing judged" if main is None or after is None else f"RMS {main.kind.text(after.rms)}"
    return f"{PurePath(found.data.source).name}, {plural(len(found.data), 'pose')}, {rms}"


@summary.register
def _(found: Evaluation) -> list[str]:
    return evaluation_lines(found, PurePath(found.data.source).name)


def evaluation_lines(found: Evaluation, title: str) -> list[str]:
    """What `fastcal evaluate` prints."""
    figures = found.to_json_dict()
    lines = [f"{title}: {figures['count']} rows"]
    if found.after is not None:
        points = found.after.to_mm()
        sizes = ", ".join(f"{name} {points[name]:.4f} mm" for name in ("mean", "std", "rms", "max"))
        lines.append(f"position error: {sizes}")
    for name, of in found.kinds.items():
        if name not in POSE and (after := of.statistics[1]) is not None:
            sizes = ", ".join(f"{key} {value:.4f} {of.kind.unit}" for key, value in after.to_unit(of.kind.unit).items())
            where = "cameras and boards are where the model has them" if name == CORNERS else _FITTED
            lines.append(f"{name} error: {sizes}; {where}")
    unjudged = [name for name, left in found.others_after.items() if np.isnan(left).all()]
    if unjudged:
        names = " and ".join(unjudged)
        lines.append(f"not judged: {names}; too few readings place what they hang on")
    if (turn := figures.get("after_rotation_deg")) is not None:
        sizes = ", ".join(f"{name} {turn[name]:.4f} deg" for name in ("mean", "rms", "max"))
        lines.append(f"orientation error: {sizes}")
    if found.repeatability is not None:
        lines += _repeatability_lines(found.repeatability)
    for name, repeats in found.repeats.items():
        if name != POINTS:
            kind = repeats.kind
            lines.append(f"postures read more than once: noise of {kind.plural} {kind.text(repeats.sigma)}")
    if (aligned := figures.get("aligned")) is not None:
        xyz = ", ".join(f"{v:.3f}" for v in aligned["xyz_mm"])
        rpy = ", ".join(f"{v:.4f}" for v in aligned["rpy_deg"])
        lines.append(
            f"if the tracker or the base has moved, by xyz {xyz} mm and rpy {rpy} deg, the same rows fit with rms "
            f"{aligned['after_mm']['rms']:.4f} mm"
        )
    return lines


def _repeatability_lines(found: Repeatability) -> list[str]:
    """The figures of poses that repeat, and what they lack of ISO 9283."""
    block = found.to_json_dict()
    names = {"accuracy_mm": "AP", "repeatability_mm": "RP", "vap_mm": "vAP", "ad_mm": "AD", "rd_mm": "RD"}
    names |= {"drift_ap_mm": "dAP", "drift_rp_mm": "dRP"}
    parts = [f"mean {name} {block[key]['mean']:.4f} mm" for key, name in names.items() if key in block]
    title = "ISO 9283" if found.is_iso_9283 else "repeated poses"
    size = f"{plural(found.poses, 'pose')} in {plural(found.visits, 'visit')}"
    line = f"{title}, {size}: {', '.join(parts)}, noise of a coordinate {block['sigma_mm']:.4f} mm"
    return [line] if found.note is None else [line, found.note]


@headline.register
def _(result: CalibrationResult) -> str:
    state = result.status.replace("_", " ")
    judged = result.test or result.train
    on = "test" if result.test is not None else "training"
    main = judged.main
    after = None if main is None else main.statistics[1]
    rms = "" if main is None or after is None else f", RMS {main.kind.text(after.rms)} on {on} poses"
    return f"{result.model.name}, {state}, {len(result.parameters)} parameters{rms}"


@summary.register
def _(result: CalibrationResult) -> list[str]:
    rows = result.train.row_count
    state = result.status.replace("_", " ")
    lines = [f"{result.model.name}: {state}, {len(result.parameters)} parameters identified from {rows} rows"]
    for name, part in (("training", result.train), ("test", result.test)):
        for of in [] if part is None else part.kinds.values():
            before, after = of.statistics
            if before is None or after is None:
                continue
            text, is_point = of.kind.text, of.kind.name == POINTS
            what = f", {after.count} rows" if is_point else f", {after.count} {of.kind.plural}"
            lines.append(
                f"error on {name} poses{what}: RMS {text(before.rms)} before, "
                f"{text(after.rms)} after; largest {text(before.max)} before, {text(after.max)} after"
            )
    for noise in result.noise.values():
        what = "a measured coordinate" if noise.kind.name == POINTS else noise.kind.plural
        lines.append(f"noise of {what}: {noise} ({noise.note})")
    lines += [camera.sentence for camera in result.cameras]
    if result.held:
        lines.append(result.held)
    lines.append(f"loss: {result.loss}" + ("" if result.loss == "none" else " (robust: outliers get less weight)"))
    if result.unidentifiable:
        count = len(result.unidentifiable)
        some = "1 combination of parameters is" if count == 1 else f"{count} combinations of parameters are"
        lines.append(f"{some} not identifiable; the first parameter of each is held at nominal:")
        lines += [f"  {direction.direction}" for direction in result.unidentifiable]
    return lines + outlier_lines(result.outliers)


def outlier_lines(rows: list[int]) -> list[str]:
    """The rows of outliers, cut where they are many; nothing where there are none."""
    if not rows:
        return []
    listed_rows = ", ".join(map(str, rows[:_MOST_ROWS]))
    more = f" and {len(rows) - _MOST_ROWS} more" if len(rows) > _MOST_ROWS else ""
    return [f"outliers (data rows, counted from 0): {listed_rows}{more}"]


def _measured(data: Dataset) -> list[str]:
    return plurals(data) or ["nothing measured"]
