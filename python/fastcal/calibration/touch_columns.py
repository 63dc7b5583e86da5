# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Touches with a column that was meant otherwise: a ball's diameter for its radius, a sliding joint in inches.

No point that was measured shows it, and a fit hides it: a ball of another size is met from above to a few millimetres,
and by slides that hardly move, with a tool of no length, exactly. So what else a column may mean is tried.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.evaluation import Evaluation
from fastcal.calibration.inspection import refused
from fastcal.errors import FastcalError, InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_position
from fastcal.robot.robot import Robot
from fastcal.said import Said, said
from fastcal.units import factor, from_si

Refit = Callable[[Dataset], Evaluation]

ANOTHER = 0.1  # of a radius: one that differs by more was misunderstood and not mismeasured
FAR_BETTER = 5.0  # times: so much better another reading of a column has to fit, as `column_check` has it
_MISSED = 0.02  # of how far the tool moved about a sphere, by which a right one is hardly ever missed
_SHARE = 3e-3  # of how far slides moved: the same
_SIZES = np.geomspace(1 / 32, 32, 21)  # times a radius that are tried
_UNITS = {"inches": factor("in") / factor("mm"), "cm": 10.0, "m": 1 / factor("mm")}  # [mm]
_MM = "mm"


def check_touches(robot: Robot, data: Dataset, fit: Evaluation, refit: Refit, *, as_read: bool = False) -> list[str]:
    """Refuses touches of which another reading of a column fits far better; with `as_read`, a note says so instead.

    Args:
        robot: As its file says.
        data: What was read.
        fit: Errors of the calibrated and of the nominal arm.
        refit: The same of other data.
        as_read: Tell instead of refusing.

    Raises:
        InvalidInput: What was read, and what was probably meant.
    """
    if not is_touched(data):
        return []
    message = _slides(robot, data, fit, refit) or _radius(robot, data, fit, refit)
    if message is None:
        return []
    if not as_read:
        raise InvalidInput(refused(data, message))
    return [message]


def is_touched(data: Dataset) -> bool:
    """Are touches or lengths what was read, and no points?"""
    return data.position is None and (data.distance is not None or bool(data.observed_labels))


def another_radius(given: float, missed: float, radius: float, better: float) -> Said | None:
    """A sentence where touches fit a sphere of another radius far better than the given one; None where they do not.

    Args:
        given: Radius [m] that the column says.
        missed: RMS [m] by which the touches miss it.
        radius: Another one.
        better: RMS by which they miss that.
    """
    if abs(radius - given) <= ANOTHER * given or missed <= FAR_BETTER * better:
        return None
    return said(
        "distance_mm is {given:.4g}, which the touches miss by {missed:.4g} mm RMS; a sphere of radius {radius:.4g} mm "
        "they miss by {better:.4g} mm; is it a diameter, without the radius of the tip's ball, or in another unit?",
        given=from_si(given, "mm"),
        missed=from_si(missed, "mm"),
        radius=from_si(radius, "mm"),
        better=from_si(better, "mm"),
    )


def _radius(robot: Robot, data: Dataset, fit: Evaluation, refit: Refit) -> Said | None:
    """Of spheres, one radius each: a length from an anchor that changes is no radius."""
    if data.distance is None or data.anchor is None:
        return None
    read = np.isfinite(data.distance)
    spheres = [np.unique(data.distance[read & (data.anchor == k)]) for k in np.unique(data.anchor[read])]
    if any(len(radii) > 1 for radii in spheres) or not (data.distance[read] > 0).all():
        return None
    given, missed = float(np.median(data.distance[read])), _rms(fit)
    if missed <= _MISSED * _spread(robot, data):
        return None

    distance = data.distance

    def of_size(size: float) -> Dataset:
        return replace(data, distance=distance * size)

    def nominal(log_size: float) -> float:
        """Of the arm as its file says: one that is fitted grows or shrinks with its sphere."""
        return _tried(refit, of_size(float(np.exp(log_size))), nominal=True)

    from scipy import optimize

    tried = np.log(_SIZES)
    near = int(np.argmin([nominal(of) for of in tried]))
    around = (tried[max(near - 1, 0)], tried[min(near + 1, len(tried) - 1)])
    size = float(np.exp(optimize.minimize_scalar(nominal, bounds=around, method="bounded", options={"maxiter": 12}).x))
    return another_radius(given, missed, given * size, _tried(refit, of_size(size)))


def _slides(robot: Robot, data: Dataset, fit: Evaluation, refit: Refit) -> Said | None:
    """Of joints that slide, all or one, in a larger unit than was read.

    The arm of the file must fit far better beside how far they moved, which the unit sets, and it, or the calibrated
    one, no worse in itself. A smaller unit is not tried: where slides stand still, a ball about the middle of the
    wrist fits anything.
    """
    sliding = [k for k, kind in enumerate(robot.joint_types) if kind == "prismatic"]
    missed, moved = _rms(fit, nominal=True), _moved(data.q, sliding)
    if not sliding or not moved > 0 or missed <= _SHARE * moved:
        return None
    best, meant = missed / (FAR_BETTER * moved), None
    for columns in dict.fromkeys([tuple(sliding), *((k,) for k in sliding)]):
        for unit, size in _UNITS.items():
            changed = replace(data, q=_scaled(data.q, columns, size))
            left = _tried(refit, changed, nominal=True)
            share = left / _moved(changed.q, sliding)
            if share < best and (left <= missed or _tried(refit, changed) <= _rms(fit)):
                best, meant = share, (columns, unit)
    if meant is None:
        return None
    return said(
        "the touches do not fit this robot: the arm of its file misses them by {missed:.2g} % of how far its "
        "slides moved, and by {better:.2g} % with {names} in {unit} instead of mm; which unit do the titles say?",
        missed=100 * missed / moved,
        better=100 * best,
        names=", ".join(joint_position(k) for k in meant[0]),
        unit=meant[1],
    )


def _scaled(q: FloatArray, columns: Sequence[int], size: float) -> FloatArray:
    out = q.copy()
    out[:, list(columns)] *= size
    return out


def _moved(q: FloatArray, sliding: Sequence[int]) -> float:
    """RMS by which slides moved about where they were on average, together [m]."""
    own = q[:, list(sliding)]
    return _rms_of(np.linalg.norm(own - own.mean(axis=0), axis=1))


def _spread(robot: Robot, data: Dataset) -> float:
    """RMS by which the tool moved about where it was on average at each anchor [m]."""
    p = robot.forward(data.q)[:, :3, 3]
    anchor = np.zeros(len(data), dtype=np.intp) if data.anchor is None else data.anchor
    for k in np.unique(anchor):
        p[anchor == k] -= p[anchor == k].mean(axis=0)
    return _rms_of(np.linalg.norm(p, axis=1))


def _rms(fit: Evaluation, *, nominal: bool = False) -> float:
    """Of the touches and lengths of a fit [m], or of the nominal arm; infinite where there is none."""
    own = [of.before if nominal else of.after for of in fit.kinds.values() if of.kind.unit == _MM]
    return _rms_of(np.concatenate([of.ravel() for of in own if of is not None] or [np.zeros(0)]))


def _rms_of(errors: FloatArray) -> float:
    known = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.inf


def _tried(refit: Refit, data: Dataset, *, nominal: bool = False) -> float:
    """`_rms` of other data; infinite where they give no fit."""
    try:
        return _rms(refit(data), nominal=nominal)
    except FastcalError:
        return np.inf
