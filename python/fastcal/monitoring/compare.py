# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Two calibrated models of one arm: which parameters differ, and by how much at the tool.

The second model is written in the first one's parameters: those that make the first predict what the second does, over
postures of the joint ranges that both were fitted on, base and tool free. So what the two gauges hold differently,
where the instrument stood and which target was on is no difference. With d = M theta_b - theta_a, M the least squares:
cov d = C_a + M C_b M^T.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from fastcal.calibration.evaluation import ErrorStatistics
from fastcal.display import late
from fastcal.display.shown import Shown
from fastcal.effects.entries import edge_name, edge_unit, full_name, identity, traits_of
from fastcal.errors import InvalidInput
from fastcal.monitoring.setups import rigid, with_base
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.given import RobotLike, as_robot
from fastcal.robot.identified_spec import identified_spec
from fastcal.robot.robot import Robot, length_or_angle_unit
from fastcal.units import factor, to_si

FloatArray = NDArray[np.float64]

POSTURES = 512
OTHER_ARM = 0.05  # of the reach: RMS distance between models of different arms
LEVEL = 0.01  # of all parameters together
_ROUNDS = 4
_LOST = 1e-7  # least singular value, of columns of length 1: below, the postures don't tell the parameters apart
_SEED = 0


@dataclass(frozen=True)
class Difference:
    """One parameter in both models, in the unit of its name; a or b is None where a model lacks the effect.

    Attributes:
        b: In the first model's gauge.
        std: Of the difference; None where a model keeps no covariance.
        significant: Beyond noise, all parameters considered (Holm 1979); None without a standard deviation.
    """

    name: str
    owner: str
    a: float | None
    b: float | None
    difference: float
    std: float | None
    unit: str
    p_value: float | None
    significant: bool | None


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown):
    """What `compare` found.

    Attributes:
        first, second: The models.
        at_tool: Distances [m] between them over the postures, bases and tools aligned.
        q: (N, n) the postures; payload (N,) [kg]; distance (N,) [m]; points (N, 3) of the first model in its base [m].
        parameters: Those of the first model and of the second one's further effects, base and tool left out.
        unexplained: RMS distance [m] that no change of the parameters explains.
    """

    first: Robot
    second: Robot
    at_tool: ErrorStatistics
    q: FloatArray
    payload: FloatArray
    distance: FloatArray
    points: FloatArray
    parameters: list[Difference]
    unexplained: float
    notes: list[str] = field(default_factory=list)

    @property
    def significant(self) -> list[Difference]:
        """The parameters that differ beyond noise."""
        return [d for d in self.parameters if d.significant]

    def to_json_dict(self) -> dict[str, Any]:
        """The content of compare.json."""
        sizes = self.at_tool.to_mm()
        return {
            "at_tool_mm": {name: sizes[name] for name in ("mean", "rms", "max")},
            "parameters": [vars(d) for d in self.parameters],
            "unexplained_mm": self.unexplained / factor("mm"),
            "postures": len(self.q),
            "models": [
                {"robot": model.name, "made_by": model.spec.get("made_by") or {}} for model in (self.first, self.second)
            ],
            "notes": self.notes,
        }

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes compare.json and report.html into a folder, both or none."""
        late.call("write_comparison", self, folder)


def compare(first: RobotLike, second: RobotLike, *, threads: int = 1) -> Comparison:
    """Compares two models of one arm; paths are read.

    Raises:
        InvalidInput: They have other joints, another kind of kinematics, or ranges that do not meet.
    """
    a, b = as_robot(first), as_robot(second)
    if a.kinematics != b.kinematics or a.joint_types != b.joint_types:
        raise InvalidInput(
            f"expected two models of one arm, got {a.name} ({a.kinematics}, {a.joint_count} joints) and {b.name} "
            f"({b.kinematics}, {b.joint_count} joints); `fastcal convert` brings kinematics of two kinds together"
        )
    a, b = _bare(a), _bare(b)
    at = _postures(a, b, threads)
    x = at.points(b)
    union = _union(a, b)
    alone, _ = _fitted(union, at, x, _ends(union))
    distance = np.linalg.norm(at.points(alone) - x, axis=1)
    statistics = ErrorStatistics.of(distance)
    if statistics is None or statistics.rms > OTHER_ARM * a.reach:
        raise InvalidInput(f"{a.name} and {b.name} differ by more than a twentieth of their reach; expected one arm")
    free = sorted({*_ends(union), *_identified(union, a, b)})
    fitted, change = _fitted(union, at, x, free)
    left = at.points(fitted) - x
    inside = np.asarray(np.linalg.inv(_base(a)) @ np.vstack([at.points(a).T, np.ones(len(x))]), dtype=np.float64)
    notes = [] if a.record and b.record else ["a model without covariance has no standard deviations to judge by"]
    return Comparison(
        first=as_robot(first),
        second=as_robot(second),
        at_tool=statistics,
        q=at.q,
        payload=at.payload,
        distance=distance,
        points=inside.T[:, :3],
        parameters=_differences(union, a, b, change, free, at),
        unexplained=float(np.sqrt(np.mean(np.sum(left**2, axis=1)))),
        notes=notes,
    )


def _bare(robot: Robot) -> Robot:
    """Without what belongs to the measurement."""
    effects = [e for e in robot.spec.get("effects") or [] if not traits_of(e["effect"]).of_the_measurement]
    return Robot({**robot.spec, "effects": effects, "correction": None})


def _union(a: Robot, b: Robot) -> Robot:
    """The first model with the second one's further effects at 0."""
    there = {identity(entry) for entry in a.spec["effects"]}
    more = [{**entry, "parameters": {}} for entry in b.spec["effects"] if identity(entry) not in there]
    return Robot({**a.spec, "effects": [*a.spec["effects"], *more]})


def _postures(a: Robot, b: Robot, threads: int) -> Postures:
    """Even over the joint ranges, and with the loads, that both were fitted on."""
    from scipy.stats import qmc

    low, high = np.array(a.limits.T)
    for robot in (a, b):
        record = robot.record
        for i, joint in enumerate(robot.spec["joints"]):
            unit = length_or_angle_unit(joint)
            limits = robot.limits[i]
            known = (record.covered if record else {}).get(f"q{i + 1}_{unit}")
            span = limits if known is None else to_si(np.array(known), unit)
            low[i], high[i] = max(low[i], span[0]), min(high[i], span[1])
    low, high = np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
    if not (low <= high).all():
        joint = int(np.argmin(low <= high)) + 1
        raise InvalidInput(f"the ranges of joint {joint} on which the two models were fitted do not meet")
    unit_cube = qmc.Sobol(len(low), rng=np.random.default_rng(_SEED)).random_base2(int(np.log2(POSTURES)))
    loads = [r.record.covered.get("payload_kg", (0.0, 0.0)) for r in (a, b) if r.record]
    least, most = max((v[0] for v in loads), default=0.0), min((v[1] for v in loads), default=0.0)
    payload = np.where(np.arange(POSTURES) % 2 == 0, min(least, most), max(least, most))
    return Postures(low + unit_cube * (high - low), payload, threads)


@dataclass(frozen=True, eq=False)
class Postures:
    """Where two models are compared: q (N, n) [rad or m], payload (N,) [kg]."""

    q: FloatArray
    payload: FloatArray
    threads: int = 1

    def points(self, robot: Robot) -> FloatArray:
        """(N, 3) of the tool [m]."""
        return robot.forward(self.q, payload=self.payload, threads=self.threads)[:, :3, 3]

    def jacobian(self, robot: Robot) -> FloatArray:
        """(N, 3, P)."""
        return robot.parameter_jacobian(self.q, payload=self.payload, threads=self.threads)


def _base(robot: Robot) -> FloatArray:
    return np.asarray(robot.core.base_and_tool(robot.core.nominal)[0])


def _ends(robot: Robot) -> list[int]:
    """Indices of the base's parameters and of the tool's point."""
    own = len(robot.core.parameters)
    return [
        i
        for i, p in enumerate(robot.error_model.parameters[:own])
        if p.owner == "base" or (p.owner == "tool" and not p.name.startswith("r"))
    ]


def _identified(union: Robot, a: Robot, b: Robot) -> list[int]:
    """Indices in the union of what the first model identified, and of the second one's further effects."""
    names = [full_name(p) for p in union.error_model.parameters]
    known = set(a.record.parameters if a.record else a.parameter_names)
    others = set(b.record.parameters if b.record else b.parameter_names) - set(a.parameter_names)
    return [i for i, name in enumerate(names) if name in known | others]


def _fitted(start: Robot, at: Postures, points: FloatArray, free: list[int]) -> tuple[Robot, FloatArray]:
    """The robot with `free` parameters such that it predicts the points of x (N, 4, 4), and their changes (P,).

    Gauss and Newton's iteration, after the base in closed form.
    """
    robot = with_base(start, rigid(at.points(start), points, start.name) @ _base(start))
    change = np.zeros(len(start.error_model.parameters))
    for _ in range(_ROUNDS):
        model = robot.error_model
        J = at.jacobian(robot)[:, :, free].reshape(-1, len(free))
        r = (points - at.points(robot)).ravel()
        step = np.zeros(len(change))
        step[free] = _solved(J) @ r
        change += step
        robot = Robot(identified_spec(robot, model, _Values(model.start + step)))
    return robot, change


def _solved(J: FloatArray) -> FloatArray:
    """J^+ (p, m), without directions that the rows don't tell."""
    size = np.linalg.norm(J, axis=0)
    size = np.where(size > 0, size, 1.0)
    return np.asarray(np.linalg.pinv(J / size, rcond=_LOST) / size[:, None])


@dataclass(frozen=True, eq=False)
class _Values:
    """What `identified_spec` asks for, without a covariance."""

    theta: FloatArray

    @property
    def free(self) -> list[int]:
        """None."""
        return []

    @property
    def covariance(self) -> FloatArray:
        """(0, 0)."""
        return np.zeros((0, 0))


def _differences(
    union: Robot, a: Robot, b: Robot, change: FloatArray, free: list[int], at: Postures
) -> list[Difference]:
    """All free parameters but base and tool, the most significant first."""
    model = union.error_model
    ends = set(_ends(union))
    shown = [i for i in free if i not in ends]
    start = np.asarray(model.start)
    now = start + change
    deviation = _deviation(union, a, b, free, shown, at)
    in_b = set(b.parameter_names)
    in_a = set(a.parameter_names)
    p = np.ones(len(shown))
    if deviation is not None:
        freedom = min(r.record.degrees_of_freedom for r in (a, b) if r.record)
        t = np.abs(now[shown] - start[shown]) / np.maximum(deviation, 1e-300)
        p = 2 * special.stdtr(max(freedom, 1), -t)
    verdicts = _holm(p)
    out = []
    for k, i in enumerate(shown):
        parameter, geometry = model.parameters[i], i < len(union.core.parameters)
        unit = edge_unit(parameter, geometry=geometry)
        f, name = factor(unit), full_name(parameter)
        out.append(
            Difference(
                edge_name(parameter, geometry=geometry),
                parameter.owner,
                start[i] / f if name in in_a else None,
                now[i] / f if name in in_b else None,
                (now[i] - start[i]) / f,
                None if deviation is None else float(deviation[k]) / f,
                unit,
                None if deviation is None else float(p[k]),
                None if deviation is None else bool(verdicts[k]),
            )
        )
    return sorted(out, key=lambda d: (d.p_value is None, d.p_value, d.owner, d.name))


def _deviation(union: Robot, a: Robot, b: Robot, free: list[int], shown: list[int], at: Postures) -> FloatArray | None:
    """(s,) of the differences."""
    if a.record is None or b.record is None:
        return None
    J_union, J_b = at.jacobian(union), at.jacobian(b)
    M = _solved(J_union[:, :, free].reshape(-1, len(free)))
    rows = [free.index(i) for i in shown]
    root_b = (M @ _moved(J_b, b, b.record))[rows]
    root_a = (M @ _moved(J_union[:, :, : len(a.parameter_names)], a, a.record))[rows]
    return np.asarray(np.sqrt(np.sum(root_a**2, axis=1) + np.sum(root_b**2, axis=1)))


def _moved(J: FloatArray, robot: Robot, record: CalibrationRecord) -> FloatArray:
    """(3 N, k) how the points move with each standard deviation of the identified parameters."""
    at = {name: i for i, name in enumerate(robot.parameter_names)}
    known = [k for k, name in enumerate(record.parameters) if name in at]
    columns = J[:, :, [at[record.parameters[k]] for k in known]]
    return np.asarray((columns @ record.root[known]).reshape(-1, record.root.shape[1]))


def _holm(p: FloatArray) -> list[bool]:
    """Which hypotheses fall at LEVEL together (S. Holm 1979)."""
    order = np.argsort(p, kind="stable")
    out = [False] * len(p)
    for k, i in enumerate(order):
        if p[i] > LEVEL / (len(p) - k):
            break
        out[i] = True
    return out
