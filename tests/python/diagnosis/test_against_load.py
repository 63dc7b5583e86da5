# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A controller that compensates for more deflection than there is: by virtual work of a cobot in numpy."""

import numpy as np
import pytest

from fastcal import Dataset, Robot, diagnose
from fastcal.diagnosis.reasons import Reason

from .plain_cobot import SIGMA, TOOL, points, postures, robot

ROWS = 90
KG = np.random.default_rng(5).choice([0.0, 10.0], ROWS)
SOFT = 4e-6  # [rad/(N m)] of joint 2


def arm() -> Robot:
    """Without masses, with its payload in the target."""
    spec = robot().spec
    joints = [{key: value for key, value in joint.items() if key != "link"} for joint in spec["joints"]]
    return Robot(spec | {"joints": joints, "payload": {"com_mm": (1e3 * TOOL).tolist()}})


def measured(compliance: float, seed: int) -> Dataset:
    """Rows of an arm whose joint 2 turns by `compliance` times its load, -dV/dq2 of V = m g z."""
    q, step = postures(ROWS, seed), np.array([0, 1e-6, 0, 0, 0, 0])
    rises = (points(q + step, seed)[:, 2] - points(q - step, seed)[:, 2]) / 2e-6
    turned = q.copy()
    turned[:, 1] += compliance * -9.80665 * KG * rises
    noise = SIGMA * np.random.default_rng(seed + 100).standard_normal((ROWS, 3))
    return Dataset.from_arrays(q, position=points(turned, seed) + noise, payload=KG, robot=arm())


@pytest.mark.parametrize(("seed", "times"), [(1, 1), (2, 1), (3, 20)])  # however clear it is
def test_too_much_compensation_is_found_and_never_sure(seed: int, times: float) -> None:
    found = diagnose(arm(), measured(-times * SOFT, seed))
    (name,) = found.effects
    assert (name.effect, name.owner, name.grade) == ("joint_compliance", "joint2", "C")
    assert name.limits[0].reason is Reason.AGAINST_LOAD
    assert found.unexplained is None
    assert "deflection under load), against its load: a controller that compensates for more" in found.sentence
    value = name.parameters["excess_compliance_rad_nm"]
    assert value.std is not None
    assert abs(value.value - times * SOFT) < 4 * value.std < 0.2 * times * SOFT
    assert found.model.spec["effects"][-1]["sign"] == "against"


def test_a_joint_that_yields_is_named_as_before() -> None:
    (name,) = diagnose(arm(), measured(SOFT, 1)).effects
    assert (name.effect, name.owner) == ("joint_compliance", "joint2")
    assert "compliance_rad_nm" in name.parameters
    assert name.grade != "C"
