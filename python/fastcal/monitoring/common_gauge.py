# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One model written in another one's parameters: those with which the other predicts what the one does.

Over postures of the joint ranges that both were fitted on, base and tool free: what the two gauges hold differently,
where the instrument stood and which target was on is then no difference. What the postures hardly show stays as it is:
each step costs its size in plausible sizes, so that a direction moves only as far as it moves the tool beyond noise
(A. Tikhonov 1963, iterated). Alone, least squares would turn what the models lack into hundreds of metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fastcal.arrays import FloatArray, thin_svd
from fastcal.effects.entries import full_name, identity, traits_of
from fastcal.errors import InvalidInput
from fastcal.monitoring.setups import rigid, with_base
from fastcal.place import joint_column, joint_name
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.identified_spec import Values, identified_spec
from fastcal.robot.robot import Robot
from fastcal.units import to_si

POSTURES = 512
_FEWEST = 64  # in which closed loops of both models close
_MARGIN = 1.05  # of the way from the start posture
_ROUNDS = 4
_LOST = 1e-7  # least singular value, of columns of length 1: below, the postures don't tell the parameters apart
_WITHIN = 1e-6  # of its length: a column beyond the span of others by less lies in it
_APART = 1e-3  # least length, of 1, that the columns before leave of one: else they do what it does
_LEAST_NOISE = 1e-5  # [m] of models that know none
_ANYWHERE = 1.0  # [m, rad] plausible size of where the base stands and the target sits
_SEED = 0
_AT_REST = 1e6  # [s] between two postures


def bare(robot: Robot) -> Robot:
    """Without what belongs to the measurement."""
    effects = [e for e in robot.entries if not traits_of(e["effect"]).of_the_measurement]
    return robot.with_(effects=effects, correction=None)


def union_of(a: Robot, b: Robot) -> Robot:
    """The first model with the second one's further effects at 0."""
    there = {identity(entry) for entry in a.entries}
    more = [{**entry, "parameters": {}} for entry in b.entries if identity(entry) not in there]
    return a.with_(effects=[*a.entries, *more])


def postures(a: Robot, b: Robot, threads: int) -> Postures:
    """Even over the joint ranges, and with the loads, that both were fitted on."""
    from scipy.stats import qmc

    low, high = np.array(a.limits.T)
    for robot in (a, b):
        record = robot.record
        for i, joint in enumerate(robot.joints):
            known = (record.covered if record else {}).get(joint_column(i, joint.unit))
            span = robot.limits[i] if known is None else to_si(np.array(known), joint.unit)
            low[i], high[i] = max(low[i], span[0]), min(high[i], span[1])
    low, high = np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
    if not (low <= high).all():
        number = int(np.argmin(low <= high)) + 1
        raise InvalidInput(f"the ranges of joint {number} on which the two models were fitted do not meet")
    draws = int(np.log2(POSTURES)) + (3 if a.passive or b.passive else 0)
    unit_cube = qmc.Sobol(len(low), rng=np.random.default_rng(_SEED)).random_base2(draws)
    q = low + unit_cube * (high - low)
    for robot in (a, b):
        if robot.passive:
            q = q[_closes(robot, q, threads)]
    if len(q) < _FEWEST:
        raise InvalidInput(f"the loops of both models close in {len(q)} of {1 << draws} postures; expected one robot")
    records = [r.record for r in (a, b) if r.record]
    return Postures(np.resize(q, (POSTURES, len(low))), _conditions(records, len(low)), threads)


def _closes(robot: Robot, q: FloatArray, threads: int) -> NDArray[np.bool_]:
    """(N,) do the loops close at q (N, n), and a little farther from the start posture, as with other lengths?"""
    home = np.asarray(robot.core.home)
    there = [np.array(robot.assemble(home + by * (q - home), threads=threads).status) for by in (1.0, _MARGIN)]
    return np.asarray((there[0] == "closed") & (there[1] == "closed"))


def _conditions(records: list[CalibrationRecord], joint_count: int) -> dict[str, FloatArray]:
    """What effects may ask of the postures: loads and temperatures that both were fitted on, by turns at their ends.

    Every joint comes from either side as often; nothing pushes, and what lags has come to rest.
    """

    def by_turns(quantity: str, size: int) -> FloatArray | None:
        ranges = [record.covered[quantity] for record in records if quantity in record.covered]
        if not ranges:
            return None
        ends = max(low for low, _ in ranges), min(high for _, high in ranges)
        return np.where(np.arange(POSTURES) // size % 2 == 0, min(ends), max(ends))

    payload, temperature = by_turns("payload_kg", 1), by_turns("temperature_c", 2)
    signs = np.random.default_rng(_SEED).choice([-1.0, 1.0], (POSTURES, joint_count))
    out = {
        "payload": np.zeros(POSTURES) if payload is None else payload,
        "time": _AT_REST * np.arange(POSTURES),
        "approach": signs,
        "wrench": np.zeros((POSTURES, 6)),
        "current": np.zeros((POSTURES, joint_count)),
    }
    return out if temperature is None else {**out, "temperature": to_si(temperature, "c")}


@dataclass(frozen=True, eq=False)
class Postures:
    """Where two models are compared: q (N, n) [rad or m], under conditions as `Robot.forward` takes them."""

    q: FloatArray
    conditions: dict[str, Any]
    threads: int = 1

    @property
    def payload(self) -> FloatArray:
        """(N,) [kg]."""
        return np.asarray(self.conditions["payload"])

    def points(self, robot: Robot) -> FloatArray:
        """(N, 3) of the tool [m]."""
        return np.asarray(robot.forward(self.q, threads=self.threads, **self.conditions)[:, :3, 3])

    def jacobian(self, robot: Robot) -> FloatArray:
        """(N, 3, P)."""
        return np.asarray(robot.parameter_jacobian(self.q, threads=self.threads, **self.conditions))


def base_of(robot: Robot) -> FloatArray:
    """(4, 4) of the base in the measuring frame."""
    return np.asarray(robot.core.base_and_tool(robot.core.nominal)[0])


def ends(robot: Robot) -> list[int]:
    """Indices of the base's parameters and of the tool's point."""
    own = len(robot.core.parameters)
    return [
        i
        for i, p in enumerate(robot.error_model.parameters[:own])
        if p.owner == "base" or (p.owner == "tool" and not p.name.startswith("r"))
    ]


def identified(union: Robot, a: Robot, b: Robot) -> list[int]:
    """Indices in the union of what the first model identified, and of the second one's further effects."""
    names = [full_name(p) for p in union.error_model.parameters]
    known = set(a.record.parameters if a.record else a.parameter_names)
    others = set(b.record.parameters if b.record else b.parameter_names) - set(a.parameter_names)
    return [i for i, name in enumerate(names) if name in known | others]


def readable(union: Robot, at: Postures, free: list[int]) -> list[int]:
    """Parameters that move the points as `free` do, zeros of joints among them wherever they can be.

    What a calibration holds is its own choice, and may leave a zero that moved to be taken up by three other numbers.
    """
    J = at.jacobian(union).reshape(3 * len(at.q), -1)
    return columns_that_read(J, free, ends(union), _zeros(union))


def columns_that_read(J: FloatArray, free: list[int], places: list[int], wanted: list[int]) -> list[int]:
    """Columns of J (m, P) that span what `free` do: places first, then those that are wanted, wherever they can be."""
    size = np.linalg.norm(J, axis=0)
    J = J / np.where(size > 0, size, 1.0)
    U, length, _ = thin_svd(J[:, free])
    span = U[:, length > _LOST]
    inside = [i for i in wanted if np.linalg.norm(J[:, i] - span @ (span.T @ J[:, i])) < _WITHIN]
    chosen: list[int] = []
    Q = np.zeros((len(J), 0))
    for i in [*places, *inside]:
        own = J[:, i] - Q @ (Q.T @ J[:, i])
        if np.linalg.norm(own) > _APART:
            chosen.append(i)
            Q = np.linalg.qr(J[:, chosen])[0]
    others = [i for i in free if i not in chosen]
    left = J[:, others] - Q @ (Q.T @ J[:, others])
    order = linalg.qr(left, mode="r", pivoting=True)[1][: span.shape[1] - len(chosen)]
    return sorted([*chosen, *(others[k] for k in order)])


def _zeros(robot: Robot) -> list[int]:
    """Indices of the joints' zeros."""
    known, own = zero_names(robot), len(robot.core.parameters)
    return [i for i, p in enumerate(robot.error_model.parameters[:own]) if (p.owner, p.name) in known]


def zero_names(robot: Robot) -> set[tuple[str, str]]:
    """Owner and name of the joints' zeros; of a URDF's joint only where its axis is x, y or z of its frame."""
    names = []
    for joint in robot.joints:
        turns = joint.turns
        if robot.kinematics != "urdf":
            names.append("theta" if turns else "d")
            continue
        axis = np.abs(np.asarray(joint.axis, dtype=float))
        k = int(np.argmax(axis))
        along = ("rx", "ry", "rz")[k] if turns else "xyz"[k]
        names.append(along if np.count_nonzero(axis) == 1 else "")
    return {(joint_name(j), name) for j, name in enumerate(names)}


def fitted_to(
    start: Robot, at: Postures, points: FloatArray, free: list[int], noise: float
) -> tuple[Robot, FloatArray]:
    """The robot with `free` parameters such that it predicts the points of x (N, 4, 4), and their changes (P,).

    Gauss and Newton's iteration, each step held by the sizes, after the base in closed form.
    """
    robot = with_base(start, rigid(at.points(start), points, start.name) @ base_of(start))
    change = np.zeros(len(start.error_model.parameters))
    size = sizes(start, free)
    for _ in range(_ROUNDS):
        model = robot.error_model
        J = at.jacobian(robot)[:, :, free].reshape(-1, len(free))
        r = (points - at.points(robot)).ravel()
        step = np.zeros(len(change))
        step[free] = held_inverse(J, size, noise, rounds=1)[0] @ r
        change += step
        robot = Robot(identified_spec(robot, model, Values(np.asarray(model.start) + step)))
    return robot, change


def noise_of(a: Robot, b: Robot) -> float:
    """[m] of a coordinate, of what the two models were fitted to."""
    each = [(robot.record.length_sigma if robot.record else None) or 0.0 for robot in (a, b)]
    return max(_LEAST_NOISE, float(np.linalg.norm(each)))


def sizes(robot: Robot, free: list[int]) -> FloatArray:
    """(p,) plausible sizes of the free parameters; base and tool may be anywhere."""
    parameters, placed = robot.error_model.parameters, set(ends(robot))
    return np.array([_ANYWHERE if i in placed else parameters[i].sigma for i in free])


def held_inverse(J: FloatArray, size: FloatArray, noise: float, rounds: int = _ROUNDS) -> tuple[FloatArray, FloatArray]:
    """What `rounds` steps of least squares make of the rows, each of them held by the sizes, and what they leave.

    With J S = U s V^T and h = n^2 / (s^2 + n^2), of noise n: (p, m) S V (1 - h^k) / s U^T, the pseudo-inverse where s
    is far above n; and (p, p) S V h^k, how far plausible changes that the rows do not show move each parameter.
    """
    U, s, Vt = thin_svd(J * size)
    left = (noise**2 / (s**2 + noise**2)) ** rounds
    gain = np.where(s > 0, 1 - left, 0.0) / np.where(s > 0, s, 1.0)
    V = size[:, None] * Vt.T
    return np.asarray((V * gain) @ U.T), np.asarray(V * left)
