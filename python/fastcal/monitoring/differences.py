# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which parameters of two models differ beyond noise: cov d = C_a + M C_b M^T + H H^T.

M is the common gauge's least squares and H what its postures leave open, so that nothing they hardly show is beyond
noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.effects.entries import edge_name, edge_unit, full_name
from fastcal.monitoring.common_gauge import Postures, ends, held_inverse, noise_of, sizes
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.robot import Robot
from fastcal.units import factor

LEVEL = 0.01  # of all parameters together


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


def differences(
    union: Robot, a: Robot, b: Robot, change: FloatArray, free: list[int], at: Postures
) -> list[Difference]:
    """All free parameters but base and tool, the most significant first."""
    model = union.error_model
    left_out = set(ends(union))
    shown = [i for i in free if i not in left_out]
    start = np.asarray(model.start)
    now = start + change
    deviation = _deviation(union, a, b, free, shown, at)
    freedom = min((r.record.degrees_of_freedom for r in (a, b) if r.record), default=1)
    known = set(a.parameter_names), set(b.parameter_names)
    lacks = [[full_name(model.parameters[i]) not in of for i in shown] for of in known]
    parts = [(model.parameters[i], i < len(union.core.parameters)) for i in shown]
    return judged(parts, start[shown], now[shown], deviation, freedom, lacks)


def judged(
    parameters: Sequence[tuple[_core.Parameter, bool]],
    a: FloatArray,
    b: FloatArray,
    deviation: FloatArray | None,
    freedom: int,
    lacks: Sequence[Sequence[bool]] = ((), ()),
) -> list[Difference]:
    """Which of (s,) numbers differ beyond noise, the most significant first.

    Args:
        parameters: What they are, and whether each belongs to a geometry or place.
        a: (s,) of the first model, SI.
        b: (s,) of the second one, in the first one's gauge.
        deviation: (s,) of the differences; None where a model keeps no covariance.
        freedom: Degrees of freedom of the noise behind it.
        lacks: Which of them the first and the second model do not have; none where empty.
    """
    p = np.ones(len(a))
    if deviation is not None:
        t = np.abs(b - a) / np.maximum(deviation, 1e-300)
        p = 2 * special.stdtr(max(freedom, 1), -t)
    verdicts = _holm(p)
    out = []
    for k, (parameter, geometry) in enumerate(parameters):
        unit = edge_unit(parameter, geometry=geometry)
        f = factor(unit)
        out.append(
            Difference(
                edge_name(parameter, geometry=geometry),
                parameter.owner,
                None if lacks[0] and lacks[0][k] else float(a[k]) / f,
                None if lacks[1] and lacks[1][k] else float(b[k]) / f,
                float(b[k] - a[k]) / f,
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
    M, unseen = held_inverse(J_union[:, :, free].reshape(-1, len(free)), sizes(union, free), noise_of(a, b))
    rows = [free.index(i) for i in shown]
    root_b = (M @ _moved(J_b, b, b.record))[rows]
    root_a = (M @ _moved(J_union[:, :, : len(a.parameter_names)], a, a.record))[rows]
    return np.asarray(np.sqrt(sum(np.sum(root**2, axis=1) for root in (root_a, root_b, unseen[rows]))))


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
