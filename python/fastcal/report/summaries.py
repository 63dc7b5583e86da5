# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots, data and results in a line and in a few lines: what commands print and notebooks show."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from functools import singledispatch
from pathlib import PurePath
from typing import Any

import numpy as np

from fastcal.calibration.evaluation import Evaluation
from fastcal.calibration.extrapolation_notes import still_joints
from fastcal.calibration.repeatability import Repeatability
from fastcal.calibration.result import CalibrationResult
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, POSE, KindNoise
from fastcal.measurements.observations import plurals
from fastcal.report.formatting import plural, sized
from fastcal.report.language import _ as translated
from fastcal.report.language import decimal_sign, language
from fastcal.report.tables import in_words
from fastcal.report.words import listed
from fastcal.robot.robot import Robot
from fastcal.said import said
from fastcal.units import from_si

_CONDITIONS = ("temperature", "time", "current", "wrench", "approach", "q_read")
_FITTED = said("what it is mounted on is fitted to these rows")
_KEYS = {"mean": said("mean")}
_STATES = {
    "converged": said("converged"),
    "not_converged": said("not converged"),
    "too_few_equations": said("too few equations"),
}
_MOST_ROWS = 20  # outliers that are listed
_FEW = 3  # combinations of joints that stood still that are listed
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
    lines = [f"{title}: {plural(figures['count'], 'row')}"]
    if found.after is not None:
        points = found.after.to_mm()
        lines.append(
            translated(
                "position error: mean {mean:.4f} mm, std {std:.4f} mm, rms {rms:.4f} mm, max {max:.4f} mm",
                **{name: float(points[name]) for name in ("mean", "std", "rms", "max")},
            )
        )
    for name, of in found.kinds.items():
        if name not in POSE and (after := of.statistics[1]) is not None:
            sizes = ", ".join(
                translated("{key} {value:.4f} {unit}", key=_KEYS.get(key, key), value=float(value), unit=of.kind.unit)
                for key, value in after.to_unit(of.kind.unit).items()
            )
            where = said("cameras and boards are where the model places them") if name == CORNERS else _FITTED
            what = translated(of.kind.plural)
            lines.append(translated("error of {what}: {sizes}; {where}", what=what, sizes=sizes, where=where))
    unjudged = [name for name, left in found.others_after.items() if np.isnan(left).all()]
    if unjudged:
        names = listed(unjudged)
        lines.append(translated("not judged: {names}; too few readings locate what they are mounted on", names=names))
    if (turn := figures.get("after_rotation_deg")) is not None:
        lines.append(
            translated(
                "orientation error: mean {mean:.4f} deg, rms {rms:.4f} deg, max {max:.4f} deg",
                **{name: float(turn[name]) for name in ("mean", "rms", "max")},
            )
        )
    if found.repeatability is not None:
        lines += _repeatability_lines(found.repeatability)
    for name, repeats in found.repeats.items():
        if name != POINTS:
            kind = repeats.kind
            noise = {"what": translated(kind.plural), "size": sized(kind, repeats.sigma)}
            lines.append(translated("postures read more than once: noise of {what} {size}", **noise))
    return lines + _elsewhere_lines(figures)


def _elsewhere_lines(figures: Mapping[str, Any]) -> list[str]:
    """Where else the instrument, the base or the target may be, if the rows then fit far better."""
    lines = []
    if (aligned := figures.get("aligned")) is not None:
        between = "; " if decimal_sign() == "," else ", "
        lines.append(
            translated(
                "if the tracker or the base has moved, by xyz {xyz} mm and rpy {rpy} deg, the same rows fit with rms "
                "{rms:.4f} mm",
                xyz=between.join(f"{v:.3f}".replace(".", decimal_sign()) for v in aligned["xyz_mm"]),
                rpy=between.join(f"{v:.4f}".replace(".", decimal_sign()) for v in aligned["rpy_deg"]),
                rms=float(aligned["after_mm"]["rms"]),
            )
        )
    if (seat := figures.get("remounted")) is not None:
        between = "; " if decimal_sign() == "," else ", "
        lines.append(
            translated(
                "if the target sits elsewhere on the tool, by xyz {xyz} mm, the same rows fit with rms {rms:.4f} mm",
                xyz=between.join(f"{v:.3f}".replace(".", decimal_sign()) for v in seat["xyz_mm"]),
                rms=float(seat["after_mm"]["rms"]),
            )
        )
    return lines


def _repeatability_lines(found: Repeatability) -> list[str]:
    """The figures of poses that repeat, and what they lack of ISO 9283."""
    block = found.to_json_dict()
    names = {"accuracy_mm": "AP", "repeatability_mm": "RP", "vap_mm": "vAP", "ad_mm": "AD", "rd_mm": "RD"}
    names |= {"drift_ap_mm": "dAP", "drift_rp_mm": "dRP"}
    parts = [
        translated("mean {name} {size:.4f} mm", name=name, size=float(block[key]["mean"]))
        for key, name in names.items()
        if key in block
    ]
    line = translated(
        "{title}, {poses} in {visits}: {parts}, noise per coordinate {sigma:.4f} mm",
        title="ISO 9283" if found.is_iso_9283 else translated("repeated poses"),
        poses=plural(found.poses, "pose"),
        visits=plural(found.visits, "visit"),
        parts=", ".join(parts),
        sigma=float(block["sigma_mm"]),
    )
    return [line] if found.note is None else [line, translated(found.note)]


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
    lines = [
        translated(
            "{name}: {state}, {count} parameters identified from {rows} rows",
            name=result.model.name,
            state=_STATES[result.status],
            count=len(result.parameters),
            rows=rows,
        )
    ]
    gross = result.train.places([] if result.loss == "none" else result.outliers)
    for on, part in ((said("training"), result.train), (said("test"), result.test)):
        for of in [] if part is None else part.kinds.values():
            before, after = of.statistics
            if before is None or after is None:
                continue
            sizes = {"before": before.rms, "after": after.rms, "most_before": before.max, "most_after": after.max}
            lines.append(
                translated(
                    "error on {on} poses, {count} {what}: RMS {before} before, {after} after; largest {most_before} "
                    "before, {most_after} after",
                    on=on,
                    count=after.count,
                    what=translated("rows" if of.kind.name == POINTS else of.kind.plural),
                    **{name: sized(of.kind, size) for name, size in sizes.items()},
                )
            )
            left = of.without(gross)[1] if part is result.train and len(gross) else None
            if left is not None:
                lines.append(
                    translated(
                        "  without the rows that are outliers: RMS {after} after, largest {most_after}",
                        after=sized(of.kind, left.rms),
                        most_after=sized(of.kind, left.max),
                    )
                )
    lines += noise_lines(result.noise.values())
    lines += [translated(camera.sentence) for camera in result.cameras]
    if result.held:
        lines.append(translated(result.held))
    robust = "" if result.loss == "none" else translated(" (robust: outliers get less weight)")
    lines.append(translated("loss: {name}", name=result.loss) + robust)
    if result.unidentifiable:
        count = len(result.unidentifiable)
        lines.append(
            translated("1 combination of parameters is not identifiable; its first parameter is held at nominal:")
            if count == 1
            else translated(
                "{count} combinations of parameters are not identifiable; the first parameter of each is held at "
                "nominal:",
                count=count,
            )
        )
        # In English by the parameters' own names, as result.json has them.
        spoken = str if language.get() == "en" else in_words
        still = still_joints(result.model, result.train.data)
        of_still = [of for of in result.unidentifiable if of.parameters and of.parameters[0].split()[0] in still]
        told = [of for of in result.unidentifiable if of not in of_still or len(of_still) <= _FEW]
        lines += [f"  {spoken(direction.direction)}" for direction in told]
        if len(told) < count:
            lines.append(
                translated(
                    "  {count} of {joints}, which stood still in these rows: result.json has them",
                    count=count - len(told),
                    joints=listed([in_words(joint) for joint in still]),
                )
            )
    return lines + outlier_lines(result.outliers)


def noise_lines(noises: Iterable[KindNoise]) -> list[str]:
    """A line for the noise of each kind of reading, and where it is known from."""
    return [
        translated(
            "noise of {what}: {size} ({note})",
            what=translated("a measured coordinate" if noise.kind.name == POINTS else noise.kind.plural),
            size=sized(noise.kind, noise.value),
            note=translated(noise.note),
        )
        for noise in noises
    ]


def outlier_lines(rows: list[int]) -> list[str]:
    """The rows of outliers, cut where they are many; nothing where there are none."""
    if not rows:
        return []
    listed_rows = ", ".join(map(str, rows[:_MOST_ROWS]))
    more = translated(" and {count} more", count=len(rows) - _MOST_ROWS) if len(rows) > _MOST_ROWS else ""
    return [translated("outliers (data rows, counted from 0): {rows}", rows=listed_rows) + more]


def _measured(data: Dataset) -> list[str]:
    return plurals(data) or ["nothing measured"]
