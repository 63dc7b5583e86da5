# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a tool, a base or a part is, from a few touches by an arm whose geometry is trusted.

With the pose (R_i, f_i) of the last frame and the point t on it, p_i = f_i + R_i t. One of the frames is asked for and
all else is held:
    tool    R_i t - s = -f_i of one point s, the same in all touches (a socket, nearly the centre of a sphere), linear
            in t and s;  n . (f_i + R_i t) = d of a plane, linear in t and d for each normal n
    base    x_i = T p_i with points x_i that an instrument measured, by the singular vectors of their moments
    part    x_i = T^-1 p_i with x_i as the part's drawing has them
These are starts; the answer is the fit of all readings by their noise, a robust one where they are many.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.kind_noise import noise_by_kind, scaled
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import KindNoise, in_order, of_observation
from fastcal.robot.calibration_record import lower_root
from fastcal.robot.identified_spec import frame_spec
from fastcal.robot.robot import Robot
from fastcal.robot.se3 import inverse, pose
from fastcal.units import from_si, to_si

FloatArray = NDArray[np.float64]
What = Literal["tool", "base", "part"]

MANY = 20  # readings from which on a few gross ones can be told from the others
_NORMALS = 400  # directions on the half sphere that a plane's normal is looked for among
_TURNED = to_si(5.0, "deg")  # of postures that are not of one orientation
_FAR = 1e3  # plausible sizes: a deviation above shows nothing of a place
_LOST = 1e-6  # of the largest singular value of a start
_HALF = 0.975  # of an interval that holds 95 %
_STEP = 1e-6  # [m, rad] of a difference
_POINT_LIKE = ("socket", "anchor")  # labels of rows about one point


@dataclass(frozen=True, eq=False)
class FoundPlace:
    """A frame and how surely it is known.

    Attributes:
        T: (4, 4) of the tool in the last frame, of the base or the part in the measuring frame.
        covariance: (6, 6) of its place [m] and its turn [rad], along and about the axes of the frame it is given in; 0
            of what was not asked, NaN of what no reading shows.
        parameters, root: Names of the model's parameters that were found, and the root of their covariance, SI.
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
        }


def find_place(robot: Robot, data: Dataset, what: What, *, threads: int = 1) -> FoundPlace:
    """The tool, the base or a part from touches; the arm's geometry and effects stay as they are.

    Args:
        robot: Its base and tool, but the one that is asked for, are taken to be right.
        data: `socket`, `plane`, or `anchor` and `distance_mm` (the radius of a sphere) for a tool; measured points for
            the base; the touched points as the part's drawing has them for a part, of which the first may be empty in
            their x (a point on the x axis) and in x and y (a point in the plane of x and y).
        what: Is asked for.
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
    for start in _starts(robot, data, what, measured):
        core = start.error_model
        found = _core.identify(
            core,
            samples,
            measured,
            asked=asked,
            unknowns=_unknowns(core, samples, measured),
            loss=loss,
            practical_limit=_FAR,
            threads=threads,
        )
        fits.append((float(np.nansum(np.abs(_left(core, samples, measured, found.theta)))), found))
    found = min(fits, key=lambda fit: fit[0])[1]
    _check(found, data, robot, what, asked)
    own = [k for k, i in enumerate(found.free) if i in asked]
    scale = few_readings(found, measured)
    covariance = scale**2 * np.asarray(found.covariance)[np.ix_(own, own)]
    T, spread = _frame(core, np.asarray(found.theta), [found.free[k] for k in own], covariance, robot, what)
    names, noise = robot.parameter_names, noise_by_kind(measured, found)
    return FoundPlace(
        what,
        T,
        spread,
        [names[found.free[k]] for k in own],
        lower_root(covariance),
        noise if not is_stated(found, measured) else scaled(noise, scale),
        count,
        int(found.degrees_of_freedom),
        list(found.outliers),
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


def few_readings(found: _core.Identification, measured: _core.Measurements) -> float:
    """By what the deviations of a fit of a few readings are multiplied, so that twice them hold 95 %.

    Where the residuals alone say what the noise is: t_0.975 of Student's distribution with the fit's degrees of freedom
    over that of the normal one. Where columns say it, they are believed, though a few residuals are smaller.
    """
    if is_stated(found, measured):
        return float(1.0 / np.sqrt(found.variance_factor))
    return float(student.ppf(_HALF, max(found.degrees_of_freedom, 1)) / norm.ppf(_HALF))


def is_stated(found: _core.Identification, measured: _core.Measurements) -> bool:
    """Do columns say what the noise is, and enough?"""
    return all(of.claims_sigma for of in measured.observations) and not any(found.common_noise)


def _left(
    core: _core.ErrorModel, samples: _core.Samples, measured: _core.Measurements, theta: FloatArray
) -> FloatArray:
    """(N, m) what a model leaves of the readings; unknowns that theta does not hold are 0."""
    missing = len(core.start) + len(measured.parameters) - len(theta)
    return np.asarray(_core.residuals(core, samples, measured, np.append(np.asarray(theta), np.zeros(missing))))


def _unknowns(core: _core.ErrorModel, samples: _core.Samples, measured: _core.Measurements) -> FloatArray:
    """Sockets, planes and spheres of an arm that is where it starts."""
    if not measured.parameters:
        return np.zeros(0)
    try:
        return np.asarray(_core.start_unknowns(core, samples, measured))
    except InvalidInput as error:
        raise Undetermined(str(error)) from None


def _starts(robot: Robot, data: Dataset, what: What, measured: _core.Measurements) -> list[Robot]:
    """The robot with the frame that is asked for about where the readings put it; on a sphere one of several is."""
    flange = robot.poses(data) @ inverse(robot.T_flange_tool)
    if what != "tool":
        base = inverse(robot.T_world_base)
        return [robot.with_(base=frame_spec(_rigid((base @ robot.poses(data))[:, :3, 3], data)))]
    tools = _by_points(flange, data)
    if not len(tools):
        tools = _by_plane(flange, data)
    if not len(tools):
        if not measured.shows_tool:
            kinds = ", ".join(kind.plural for kind in in_order({of_observation(of) for of in measured.observations}))
            raise InvalidInput(f"{data.source}: {kinds} do not show a tool")
        return [robot]
    return [robot.with_(tool=frame_spec(pose(robot.T_flange_tool[:3, :3], tool))) for tool in tools]


def _by_points(flange: FloatArray, data: Dataset) -> FloatArray:
    """(k, 3) tools from rows that are, nearly, at one point of each label, and from measured points.

    Touches of a sphere are at its centre but for its radius r: the tool is within r of what they say.
    """
    groups = [rows for label in _POINT_LIKE for rows in _labelled(data, label)]
    size = 3 + 3 * len(groups)
    rows, right = [], []
    for k, group in enumerate(groups):
        part = np.zeros((len(group), 3, size))
        part[:, :, :3] = flange[group, :3, :3]
        part[:, :, 3 + 3 * k : 6 + 3 * k] = -np.eye(3)
        rows.append(part.reshape(-1, size))
        right.append(-flange[group, :3, 3].ravel())
    if data.position is not None:
        whole = ~np.isnan(data.position).any(axis=1)
        part = np.zeros((int(whole.sum()), 3, size))
        part[:, :, :3] = flange[whole, :3, :3]
        rows.append(part.reshape(-1, size))
        right.append((data.position[whole] - flange[whole, :3, 3]).ravel())
    if not rows:
        return np.zeros((0, 3))
    found, _, _, _ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=_LOST)
    radius = 0.0 if data.distance is None else float(np.nanmedian(data.distance))
    around = np.array(list(product((-1, 0, 1), repeat=3))) if radius else np.zeros((1, 3))
    return np.asarray(found[:3] + radius * around)


def _by_plane(flange: FloatArray, data: Dataset) -> FloatArray:
    """(k, 3) the tool from touches of the plane that has most: least squares for each of many normals."""
    groups = _labelled(data, "plane")
    if not groups:
        return np.zeros((0, 3))
    T = flange[max(groups, key=len)]
    k = np.arange(_NORMALS) + 0.5
    z, turn = 1.0 - k / _NORMALS, np.pi * (1.0 + np.sqrt(5.0)) * k  # a spiral of equal areas
    normals = np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])
    best, tool = np.inf, np.zeros(3)
    for n in normals:
        A = np.column_stack([T[:, :3, :3].transpose(0, 2, 1) @ n, -np.ones(len(T))])
        found, _, _, _ = np.linalg.lstsq(A, -T[:, :3, 3] @ n, rcond=_LOST)
        left = float(np.linalg.norm(A @ found + T[:, :3, 3] @ n))
        if left < best:
            best, tool = left, found[:3]
    return np.array([tool])


def _labelled(data: Dataset, label: str) -> list[NDArray[np.intp]]:
    codes, names = data.label_codes(label)
    return [np.flatnonzero(codes == k) for k in range(len(names))] if len(codes) else []


def _rigid(p: FloatArray, data: Dataset) -> FloatArray:
    """(4, 4) T with x_i = T p_i of points (N, 3) and the measured ones, of which NaN coordinates are not known.

    Three whole points by the singular vectors of their moments (Arun, Huang and Blostein, 1987); else the origin's
    point, one on the x axis and one in the plane of x and y.
    """
    x, source = np.full((len(data), 3), np.nan) if data.position is None else data.position, data.source
    whole = ~np.isnan(x).any(axis=1)
    if whole.sum() >= 3:
        a, b = p[whole], x[whole]
        u, _, vt = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
        R = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
        return pose(R, b.mean(axis=0) - R @ a.mean(axis=0))
    on_axis = np.isnan(x[:, 0]) & ~np.isnan(x[:, 1:]).any(axis=1)
    in_plane = np.isnan(x[:, :2]).all(axis=1) & ~np.isnan(x[:, 2])
    if not (whole.any() and on_axis.any() and in_plane.any()):
        raise Undetermined(
            f"{source}: expected three points with x, y and z, or the origin (0, 0, 0), one on the x axis (x empty) "
            "and one in the plane of x and y (x and y empty)"
        )
    first, second, third = (p[mask][0] for mask in (whole, on_axis, in_plane))
    e_x, across = second - first, third - first
    e_z = np.cross(e_x, across)
    if not np.linalg.norm(e_z) > _LOST * np.linalg.norm(e_x) * np.linalg.norm(across):
        raise Undetermined(f"{source}: the three points lie on one line, about which the frame may turn")
    e_x, e_z = e_x / np.linalg.norm(e_x), e_z / np.linalg.norm(e_z)
    R = np.array([e_x, np.cross(e_z, e_x), e_z])
    return pose(R, x[whole][0] - R @ first)


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
