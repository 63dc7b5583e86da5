# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pose of a tool, a base or a part from a few touches, with the arm's geometry held fixed.

The answer is the fit of all readings by their noise, a robust one where they are many, from the starts of
`touch_starts`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.kind_noise import noise_by_kind, scaled
from fastcal.calibration.rarest_labels import with_rarest
from fastcal.calibration.touch_columns import another_radius
from fastcal.calibration.touch_starts import LOST, What, starts
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import KindNoise
from fastcal.robot.calibration_record import lower_root
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import frame_spec
from fastcal.robot.se3 import inverse
from fastcal.said import joined, said
from fastcal.units import from_si, to_si

FloatArray = NDArray[np.float64]

MANY = 20  # readings from which on a few gross ones can be told from the others
_TURNED = to_si(5.0, "deg")  # of postures that are not of one orientation
_FAR = 1e3  # plausible sizes: a deviation above shows nothing of a place
_HALF = 0.975  # of an interval that holds 95 %
_STEP = 1e-6  # [m, rad] of a difference
_MISSED = 0.25  # of how far points lie about their middle: a place that misses half of them by more is none
_FEWEST_POINTS = 3
_FIND = said("--find-radius (in Python find_radius=True) finds the radius")
_ROUNDS = 30  # of the radius of a sphere
_AT_REST = 1e-8  # [m] less of a step of it is none


@dataclass(frozen=True, eq=False)
class FoundPlace:
    """A frame and how surely it is known.

    Attributes:
        T: (4, 4) of the tool in the last frame, of the base or the part in the measuring frame.
        covariance: (6, 6) of its place [m] and its turn [rad], along and about the axes of the frame it is given in; 0
            of what was not asked, NaN of what no reading shows.
        parameters, root: Names of the model's parameters that were found, and the root of their covariance, SI.
        radius: Of the touched sphere, and its standard deviation [m]; None where it was not asked for.
    """

    what: What
    T: FloatArray
    covariance: FloatArray
    parameters: list[str]
    root: FloatArray
    noise: dict[str, KindNoise]
    count: int
    degrees_of_freedom: int
    outliers: list[int]
    radius: tuple[float, float] | None = None

    @property
    def place(self) -> dict[str, Any]:
        """{xyz_mm, rpy_deg}."""
        return frame_spec(self.T)

    @property
    def std(self) -> tuple[list[float | None], list[float | None]]:
        """Standard deviations along x, y, z [mm] and about them [deg]; None of what was not asked."""
        deviation = np.sqrt(np.diag(self.covariance)).tolist()
        along, about = (
            [from_si(v, u) if v else None for v in part]
            for part, u in zip((deviation[:3], deviation[3:]), ("mm", "deg"), strict=True)
        )
        return along, about

    def to_json_dict(self) -> dict[str, Any]:
        """What `fastcal place` prints."""
        std_mm, std_deg = self.std
        return {
            "what": self.what,
            **self.place,
            "std_mm": std_mm,
            "std_deg": std_deg,
            "count": self.count,
            "degrees_of_freedom": self.degrees_of_freedom,
            "noise": {name: of.to_json_dict() for name, of in self.noise.items()},
            "outliers": self.outliers,
            "radius_mm": None if self.radius is None else [from_si(value, "mm") for value in self.radius],
        }


def find_place(robot: Robot, data: Dataset, what: What, *, find_radius: bool = False, threads: int = 1) -> FoundPlace:
    """The tool, the base or a part from touches; the arm's geometry and effects stay as they are.

    Args:
        robot: Its base and tool, but the one that is asked for, are taken to be right.
        data: `socket`, `plane`, or `anchor` and `distance_mm` (the radius of a sphere) for a tool; measured points for
            the base; the touched points as the part's drawing has them for a part, of which the first may be empty in
            their x (a point on the x axis) and in x and y (a point in the plane of x and y).
        what: Is asked for.
        find_radius: The sphere's radius is found too, from what `distance_mm` says on.
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: The columns are of something else.
        Undetermined: The readings do not show what is asked; says what they lack.
    """
    if robot.correction is not None:
        raise InvalidInput("the model has a trained correction, which touches do not show; drop it first")
    owner = "tool" if what == "tool" else "base"
    measured = measurements(data, robot)
    if owner == "base" and data.position is None:
        raise InvalidInput(f"{data.source}: holds no points; a {what} is found from columns x_mm y_mm z_mm")
    samples = robot.samples(data)
    core = robot.error_model
    turned = measured.shows_tool_turn or owner == "base"
    asked = [i for i, p in enumerate(core.parameters) if p.owner == owner and (turned or not p.name.startswith("r"))]
    count = int((~np.isnan(_left(core, samples, measured, core.start))).any(axis=1).sum())
    loss = "huber" if count >= MANY else "none"
    fits = []
    for start in starts(robot, data, what, measured):
        found = _identified(start, data, asked, loss, threads)
        fits.append((float(np.nansum(np.abs(_left(start.error_model, samples, measured, found.theta)))), start, found))
    _, start, found = min(fits, key=lambda fit: fit[0])
    _check(found, data, robot, what, asked)
    if owner == "base":
        _check_points(data, _left(start.error_model, samples, measured, found.theta), what)
    elif not find_radius:
        _check_radius(start, data, found, asked, loss, threads)
    radius, spread_of_radius = None, np.zeros((len(found.free),) * 2)
    if find_radius:
        radius, spread_of_radius, found = _with_radius(start, data, found, asked, loss, threads)
    own = [k for k, i in enumerate(found.free) if i in asked]
    scale = few_readings(found, measured, also=int(find_radius))
    covariance = scale**2 * (np.asarray(found.covariance) + spread_of_radius)[np.ix_(own, own)]
    T, spread = _frame(
        start.error_model, np.asarray(found.theta), [found.free[k] for k in own], covariance, robot, what
    )
    names, noise = robot.parameter_names, noise_by_kind(measured, found)
    return FoundPlace(
        what,
        T,
        spread,
        [names[found.free[k]] for k in own],
        lower_root(covariance),
        noise if not is_stated(found, measured) else scaled(noise, scale),
        count,
        int(found.degrees_of_freedom) - find_radius,
        list(found.outliers),
        None if radius is None else (radius[0], scale * radius[1]),
    )


def with_place(robot: Robot, found: FoundPlace) -> Robot:
    """The robot with the tool or base that was found, and, where it was calibrated, how surely that is known.

    Its parameters of that frame are then independent of the others: they come from other readings.
    """
    frame = {"tool" if found.what == "tool" else "base": found.place}
    record = robot.record
    if record is None:
        return robot.with_(**frame)
    owner = next(iter(frame))
    kept = [name for name in record.parameters if name.partition(" ")[0] != owner]
    roots = record.roots
    rows = np.array([roots[name] for name in [*kept, *record.unknowns]]).reshape(-1, len(roots))
    first, last = len(kept), len(kept) + len(found.parameters)
    covariance = np.zeros((last + len(record.unknowns),) * 2)
    of_others = [*range(first), *range(last, len(covariance))]
    covariance[np.ix_(of_others, of_others)] = rows @ rows.T
    covariance[first:last, first:last] = found.root @ found.root.T
    root = lower_root(covariance)
    stays = [i for i, name in enumerate(record.moved) if name.partition(" ")[0] != owner]
    changed = replace(
        record,
        parameters=[*kept, *found.parameters],
        root=root[:last, :last],
        moved=[record.moved[i] for i in stays],
        directions=record.directions[stays],
        unknown_root=root[last:],
    )
    nominal = {key: value for key, value in robot.description.calibration.items() if key == "nominal"}
    return robot.with_(**frame, calibration=changed.to_spec() | nominal)


def few_readings(found: _core.Identification, measured: _core.Measurements, also: int = 0) -> float:
    """By what the deviations of a fit of a few readings are multiplied, so that twice them hold 95 %.

    Where the residuals alone say what the noise is: t_0.975 of Student's distribution with the fit's degrees of freedom
    over that of the normal one. Where columns say it, they are believed, though a few residuals are smaller.
    `also`: unknowns beside those of the fit.
    """
    if is_stated(found, measured):
        return float(1.0 / np.sqrt(found.variance_factor))
    freedom = max(found.degrees_of_freedom - also, 1)
    wider = np.sqrt(max(found.degrees_of_freedom, 1) / freedom)
    return float(wider * student.ppf(_HALF, freedom) / norm.ppf(_HALF))


def is_stated(found: _core.Identification, measured: _core.Measurements) -> bool:
    """Do columns say what the noise is, and enough?"""
    return all(of.claims_sigma for of in measured.observations) and not any(found.common_noise)


def _identified(start: Robot, data: Dataset, asked: list[int], loss: str, threads: int) -> _core.Identification:
    """The frame and what was touched, from a start."""
    core, samples, measured = start.error_model, start.samples(data), measurements(data, start)
    return _core.identify(
        core,
        samples,
        measured,
        asked=asked,
        unknowns=_unknowns(core, samples, measured, data),
        loss=loss,
        practical_limit=_FAR,
        threads=threads,
    )


def _with_radius(
    start: Robot, data: Dataset, found: _core.Identification, asked: list[int], loss: str, threads: int
) -> tuple[tuple[float, float], FloatArray, _core.Identification]:
    """A sphere's radius and its deviation, what it adds to the covariance of the fit's free ones, and the fit with it.

    With the fit's whitened residuals r and derivative J, and c = dr/dradius, the step is -m.r / m.m and the variance
    1 / m.m, m being what J leaves of c; the others go along by -J^+ c.

    Raises:
        InvalidInput: No sphere was touched, or spheres of several radii.
        Undetermined: The touches do not show a radius beside the tool.
    """
    if data.distance is None or len(np.unique(data.distance)) > 1:
        raise InvalidInput(
            f"{data.source}: expected touches of spheres, anchor and one distance_mm, about their radius"
        )
    radius = float(data.distance[0])
    for _ in range(_ROUNDS):
        near, more = (_near(start, data, radius + step, found, threads) for step in (0.0, _STEP))
        r, J = np.asarray(near.r), np.asarray(near.J)[:, list(found.free)]
        c = (np.asarray(more.r) - r) / _STEP
        along, _, rank, _ = np.linalg.lstsq(J / (size := np.linalg.norm(J, axis=0)), c, rcond=None)
        m = c - J @ (along / size)
        if rank < J.shape[1] or not np.linalg.norm(m) > LOST * np.linalg.norm(c) or len(r) <= J.shape[1] + 1:
            raise Undetermined(f"{data.source}: the touches do not show a radius; touch the sphere from more sides")
        # From a diameter on, the first steps may go beyond a point: no sphere is less than half of one that it was.
        step = max(-float(m @ r) / float(m @ m), -radius / 2)
        radius += step
        found = _identified(start, replace(data, distance=np.full(len(data), radius)), asked, loss, threads)
        if abs(step) < _AT_REST:
            break
    others = -along / size
    return (radius, float(1 / np.linalg.norm(m))), np.outer(others, others) / float(m @ m), found


def _near(start: Robot, data: Dataset, radius: float, found: _core.Identification, threads: int) -> _core.Linearization:
    """The touches of spheres of a radius, whitened, where a fit is."""
    measured = measurements(replace(data, distance=np.full(len(data), radius)), start)
    noise = [0.0 if of.claims_sigma else s for of, s in zip(measured.observations, found.sigma, strict=True)]
    return _core.linearize(start.error_model, start.samples(data), measured, found.theta, noise, threads)


def _check_points(data: Dataset, left: FloatArray, what: What) -> None:
    """InvalidInput where half of the points are missed by much of how far they lie apart: another unit or order."""
    p = data.position
    whole = np.zeros(0, dtype=bool) if p is None else ~(np.isnan(p).any(axis=1) | np.isnan(left).any(axis=1))
    if p is None or whole.sum() < _FEWEST_POINTS:
        return
    missed = float(np.median(np.linalg.norm(left[whole], axis=1)))
    apart = float(np.sqrt(np.mean(np.sum((p[whole] - p[whole].mean(axis=0)) ** 2, axis=1))))
    if missed > _MISSED * apart:
        raise InvalidInput(
            f"{data.source}: no {what} fits: half of the points are missed by more than {from_si(missed, 'mm'):.4g} "
            f"mm, and they lie {from_si(apart, 'mm'):.4g} mm about their middle; are they in the unit of their "
            "titles, and each in the row of its posture?"
        )


def _check_radius(
    start: Robot, data: Dataset, found: _core.Identification, asked: list[int], loss: str, threads: int
) -> None:
    """InvalidInput where another radius fits far better: a diameter was given, or the tip's ball left out."""
    if data.distance is None or len(np.unique(data.distance)) > 1 or float(data.distance[0]) <= 0:
        return
    given = float(data.distance[0])
    try:
        (radius, _), _, better = _with_radius(start, data, found, asked, loss, threads)
    except Undetermined:
        return  # too few touches to judge by
    near = replace(data, distance=np.full(len(data), radius))
    rms = [
        float(np.sqrt(np.nanmean(_left(start.error_model, start.samples(of), measurements(of, start), fit.theta) ** 2)))
        for of, fit in ((data, found), (near, better))
    ]
    if (other := another_radius(given, rms[0], radius, rms[1])) is not None:
        raise InvalidInput(joined("", [f"{data.source}: ", joined("; ", [other, _FIND])]))


def _left(
    core: _core.ErrorModel, samples: _core.Samples, measured: _core.Measurements, theta: FloatArray
) -> FloatArray:
    """(N, m) what a model leaves of the readings; unknowns that theta does not hold are 0."""
    missing = len(core.start) + len(measured.parameters) - len(theta)
    return np.asarray(_core.residuals(core, samples, measured, np.append(np.asarray(theta), np.zeros(missing))))


def _unknowns(
    core: _core.ErrorModel, samples: _core.Samples, measured: _core.Measurements, data: Dataset
) -> FloatArray:
    """Sockets, planes and spheres of an arm that is where it starts."""
    if not measured.parameters:
        return np.zeros(0)
    try:
        return np.asarray(_core.start_unknowns(core, samples, measured))
    except InvalidInput as error:
        raise Undetermined(f"{data.source}: {with_rarest(str(error), data)}") from None


def _check(found: _core.Identification, data: Dataset, robot: Robot, what: What, asked: list[int]) -> None:
    """Undetermined where the readings do not show all that is asked, with what they lack in words."""
    held = sorted(set(asked) - set(found.free))
    is_known = data.table("sigma_position") is not None
    if found.status == "too_few_equations" or (found.degrees_of_freedom < 1 and not held and not is_known):
        more = "touch more" if is_known else "touch more, or give sigma_mm where they are just enough"
        raise Undetermined(f"{data.source}: {len(data)} readings are as many equations as unknowns or fewer; {more}")
    if held:
        raise Undetermined(f"{data.source}: the readings do not show the {what}: {_lack(robot, data, what)}")
    if found.status != "converged":
        raise Undetermined(f"{data.source}: no {what} explains the readings: {found.message}")


def _lack(robot: Robot, data: Dataset, what: What) -> str:
    if what != "tool":
        return "the points lie on one line, about which it may turn; touch a point beside it"
    R = robot.poses(data)[:, :3, :3]
    turns = np.array([_core.log_so3(np.ascontiguousarray(R[0].T @ each)) for each in R])
    angles = np.linalg.svd(turns, compute_uv=False) / np.sqrt(len(turns)) if len(turns) > 2 else np.zeros(3)
    if angles[0] < _TURNED:
        return "all postures have one orientation; turn the tool by 30 degrees or more about two axes between touches"
    if angles[1] < _TURNED:
        return "the tool was turned about one axis only, along which its point may lie anywhere; turn it about another"
    return "touch more points, with the tool turned otherwise"


def _frame(
    core: _core.ErrorModel, theta: FloatArray, free: list[int], covariance: FloatArray, robot: Robot, what: What
) -> tuple[FloatArray, FloatArray]:
    """(4, 4) the frame that was asked for, and (6, 6) its covariance, by differences of the model's own frames."""
    own = len(core.robot.nominal)

    def at(values: FloatArray) -> FloatArray:
        base, tool = (np.asarray(T) for T in core.robot.base_and_tool(values))
        return tool if what == "tool" else base if what == "base" else robot.T_world_base @ inverse(base)

    T = at(theta[:own])
    slope = np.zeros((6, len(free)))
    for k, i in enumerate(free):
        ends = []
        for sign in (1, -1):
            moved = theta[:own].copy()
            moved[i] += sign * _STEP
            there = at(moved)
            ends.append(np.append(there[:3, 3], _core.log_so3(np.ascontiguousarray(there[:3, :3] @ T[:3, :3].T))))
        slope[:, k] = (ends[0] - ends[1]) / (2 * _STEP)
    return T, slope @ covariance @ slope.T
