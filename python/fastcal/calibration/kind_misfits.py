# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Kinds of reading that contradict the others: as the noise of each is estimated, they would merely seem noisy.

Held against what would be if the readings were of other poses (their joints spread as they do), against the kind by
itself in a frame of its own, against before the fit, and against what the kind claims of itself. All by medians: where
fewer than half of the readings are bad, they are outliers, and said so by their rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.evaluation import Evaluation, compared, judged
from fastcal.calibration.kind_errors import KindErrors, sizes_of
from fastcal.calibration.levers import levers
from fastcal.calibration.nominal_arm import nominal_arm
from fastcal.calibration.problem import prepare
from fastcal.errors import FastcalError
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, Kind, KindMisfit, of_observation
from fastcal.measurements.observations import sigma_field, without_kinds
from fastcal.robot.identified_spec import moved
from fastcal.robot.robot import Robot

FEWEST = 12  # readings: fewer fit anything
UNRELATED = 0.1  # of what readings of other poses would be off
_APART = 3.0  # times better by itself
NO_BETTER = 0.9  # of the error before
BURIED = 10.0  # times what an arm is off
CLAIMED = 5.0  # times what the sigma column says
_PLAUSIBLE = 5e-4  # [rad, m] error of a joint of an arm that is not calibrated
_MOVES = 0.02  # [m, rad] that postures must move a reading by to speak of other poses
_MEDIAN_LENGTH = {1: 0.6745, 2: 1.1774, 3: 1.5382}  # of as many normal numbers


def kind_misfits(
    model: Robot,
    data: Dataset,
    found: Evaluation,
    unknowns: Mapping[str, FloatArray],
    threads: int = 1,
    *,
    lacks_effect: bool = False,
) -> list[KindMisfit]:
    """Kinds of an evaluation of a fitted model that do not belong to the arm, or to the other kinds.

    Points alone are judged by `check_fit`. Of very many rows those that are shown are looked at. That a model which
    `lacks_effect` misses them by more than their noise tells nothing of the kind.
    """
    if list(found.kinds) in ([], [POINTS]):
        return []
    scales = _scales(model, data, unknowns, threads)
    out = []
    for of in found.kinds.values():
        if np.sum(~np.isnan(of.after)) < FEWEST or of.kind not in scales:
            continue
        text = _misfit(model, data, found, of, *scales[of.kind], threads)
        text = text or (None if lacks_effect else _beyond_claim(data, found, of))
        if text is not None:
            out.append(KindMisfit(of.kind, text))
    return out


def gross_misfits(robot: Robot, data: Dataset, threads: int = 1) -> list[KindMisfit]:
    """Kinds beside the first that no calibration can bring to the others: far beyond what any arm is off."""
    if len(data.kinds) < 2:
        return []
    arm = nominal_arm(prepare(robot, data, effects="geometry", threads=threads))
    found = judged(arm.robot, data, None, arm.unknowns, threads=threads)
    scales = _scales(arm.robot, data, arm.unknowns, threads)
    _first, *others = found.kinds.values()
    far = [of for of in others if np.nanmedian(of.after) > BURIED * scales[of.kind][1]]
    misfits = kind_misfits(arm.robot, data, found, arm.unknowns, threads)
    return [
        replace(misfit, text=f"{misfit.text}; they are left out")
        for misfit in misfits
        if misfit.kind in [of.kind for of in far]
    ]


def _misfit(
    model: Robot, data: Dataset, found: Evaluation, of: KindErrors, unrelated: float, arm: float, threads: int
) -> str | None:
    """The sentence about one kind; None where it fits.

    `unrelated` is the error of readings of other poses, `arm` that of an arm that is not calibrated [m or rad].
    """
    kind, after = of.kind, float(np.nanmedian(of.after))
    before = None if of.before is None or np.isnan(of.before).all() else float(np.nanmedian(of.before))
    was = "" if before is None else f" ({kind.text(before, 3)} before the fit)"
    others, what = _others(found, kind)
    if kind.name != POINTS and others and (apart := _apart(model, data, of, threads)) is not None:
        alone, turn = apart
        if alone * _APART < after:
            frame = f", turned by {kind.text(turn, 3)}" if turn > 0 else ""
            return (
                f"{what} {kind.text(after, 3)} and by {kind.text(alone)} by themselves: they are in "
                f"another frame{frame}, or follow another convention"
            )
    if unrelated > _MOVES and after > UNRELATED * unrelated:
        return f"{what} {kind.text(after, 3)}{was}, as readings of other poses would"
    claimed = _claimed(data, kind, of.width)
    is_buried = before is not None and after >= NO_BETTER * before and after > BURIED * max(arm, _gained(of))
    if is_buried and claimed is None:
        return f"{what} {kind.text(after, 3)}, and the fit makes them no better{was}"
    return None


def _beyond_claim(data: Dataset, found: Evaluation, of: KindErrors) -> str | None:
    """The sentence about a kind that misses by far more than its sigma column says; None where it does not."""
    claimed, after = _claimed(data, of.kind, of.width), float(np.nanmedian(of.after))
    if claimed is None or after <= CLAIMED * claimed:
        return None
    what = _others(found, of.kind)[1]
    return f"{what} {of.kind.text(after, 3)}, {after / claimed:.0f} times more than their sigma says"


def _others(found: Evaluation, kind: Kind) -> tuple[list[Kind], str]:
    """The other kinds, and how a sentence about one begins that does not fit them."""
    others = [each.kind for each in found.kinds.values() if each.kind != kind]
    beside = " and ".join(each.plural for each in others) if others else "this robot"
    return others, f"the {kind.plural} do not fit {'the ' if others else ''}{beside}: half of them miss by more than"


def _scales(
    model: Robot, data: Dataset, unknowns: Mapping[str, FloatArray], threads: int
) -> dict[Kind, tuple[float, float]]:
    """Of each kind the median error of readings of other poses, and of an arm with plausible errors of its joints."""
    measured = measurements(data, model)
    own = {owner: iter(values) for owner, values in unknowns.items()}
    values = np.array([float(next(own[p.owner])) if p.owner in own else np.nan for p in measured.parameters])
    by_joint = levers(model.core, data, measured, values, threads)
    spread = np.std(data.q, axis=0)
    out: dict[Kind, list[FloatArray]] = {}
    for of in measured.observations:
        part = by_joint[:, of.first_number : of.first_number + len(of.components)]
        out.setdefault(of_observation(of), []).append(part)
    return {
        kind: (_median(np.concatenate(parts), spread), _median(np.concatenate(parts), np.full(len(spread), _PLAUSIBLE)))
        for kind, parts in out.items()
        if not np.isnan(np.concatenate(parts)).all()
    }


def _median(by_joint: FloatArray, size: FloatArray) -> float:
    """Median length of a reading (M, c, n) whose joints are off by `size` (n,)."""
    return float(np.nanmedian(sizes_of((by_joint * size).reshape(len(by_joint), -1))))


def _gained(of: KindErrors) -> float:
    """Median of what the fit has moved the readings by."""
    if of.numbers_before is None:
        return 0.0
    apart = sizes_of(of.numbers_before - of.numbers)
    return 0.0 if np.isnan(apart).all() else float(np.nanmedian(apart))


def _apart(model: Robot, data: Dataset, of: KindErrors, threads: int) -> tuple[float, float] | None:
    """Median error of the kind before a base and a tool of its own, and the turn of this base [rad]; None: not found.

    What has unknowns of its own stands in a frame of its own already.
    """
    alone = without_kinds(data, set(data.kinds) - {of.kind.name})
    measured = measurements(alone, model)
    if len(measured.parameters):
        return None
    try:
        aligned = _core.align(model.error_model, model.samples(alone), measured, threads)
    except FastcalError:
        return None
    if not aligned.found:
        return None
    there = moved(model, aligned.T_world_base, aligned.T_flange_tool)
    numbers = compared(there, alone, {}, threads).numbers[of.kind]
    base, _ = model.core.base_and_tool(model.core.nominal)
    turn = _core.log_so3(np.ascontiguousarray(aligned.T_world_base[:3, :3] @ np.asarray(base)[:3, :3].T))
    return float(np.nanmedian(sizes_of(numbers))), float(np.linalg.norm(turn))


def _claimed(data: Dataset, kind: Kind, width: int) -> float | None:
    """Median length of the error of a reading that the sigma column claims; None where there is none."""
    claims = data.table(sigma_field(kind.name))
    if claims is None or np.isnan(claims).all():
        return None
    one = float(np.sqrt(np.nanmean(claims**2)))
    return one * _MEDIAN_LENGTH[width]
