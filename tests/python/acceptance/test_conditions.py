# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arms with play or a temperature are judged with what their rows say of it."""

from dataclasses import replace

import numpy as np
import pytest

import fastcal
from fastcal.acceptance import accept, plan_acceptance
from fastcal.acceptance.visits import TARGET_COLUMNS
from fastcal.budget import Budget, Input
from fastcal.errors import InvalidInput
from fastcal.measurements.rotations import quaternions
from fastcal.robot.controller_robot import nominal_record
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

EFFECTS = [
    {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": {"value": 1e-6}}},
    {"effect": "backlash", "owner": "joint3", "parameters": {"gap_rad": {"value": 4e-4}}},
    {"effect": "thermal_expansion", "owner": "robot", "t0_c": 20.0, "parameters": {"coefficient_1_k": {"value": 4e-5}}},
]
BUDGET = Budget((Input("load", "payload", "mass", 0.2),))


@pytest.fixture(scope="module")
def model() -> Robot:
    """Of a robot file with a calibration whose gap is known to 1e-5 rad."""
    nominal = fastcal.load_robot("ur10")
    record = {
        "nominal": nominal_record(nominal.spec),
        "parameters": ["joint3 gap"],
        "covariance_root": [[1e-5]],
        "sigma_mm": 0.02,
        "degrees_of_freedom": 100,
        "covered": {"temperature_c": [18.0, 30.0]},
    }
    return Robot(nominal.spec | {"effects": EFFECTS, "calibration": record})


@pytest.mark.parametrize("by_column", [True, False])
def test_a_model_with_play_and_a_temperature_is_judged(model, by_column: bool) -> None:
    """It ended: 'needs the column approach3, which the data do not have', though they had it."""
    options = {"compensate": True, "payload": 3.0, "cycles": 4, "temperature": to_si(25.0, "c")}
    plan = plan_acceptance(model, language="urscript", program="iso.script", **options)
    sent = fastcal.Dataset.from_arrays(
        plan.q, payload=3.0, approach=plan.approach, temperature=to_si(25.0, "c"), time=np.arange(20.0), robot=model
    )
    data = fastcal.simulate(model, sent, noise=1e-5, seed=1)
    if not by_column:
        data = replace(data, approach=None)
    found = accept(model, data, limits={"ap_mm": 0.3}, budget=BUDGET, draws=0)
    assert found.verdict == "pass"
    assert found.predicted is not None
    # The poses are where the commands bring them; half a gap unsure of 1e-5 rad turns the arm beyond joint 3.
    points = dict(zip(found.predicted.names, found.predicted.points, strict=True))
    for station in found.campaign.stations:
        np.testing.assert_allclose(points[station.pose], station.commanded[:3, 3], atol=1e-6)
    own = np.array([worst.observed for worst in found.predicted.worst])
    assert (own > 1e-6).all()
    assert (own < 5e-6 * model.reach).all()
    assert all(dict(worst.parts)["load"] > 0 for worst in found.predicted.worst)


def test_a_plan_with_a_visit_twice_is_refused() -> None:
    """Also where it has lost the letters of its poses: numbers name them then."""
    robot = fastcal.load_robot("ur10")
    plan = plan_acceptance(robot, language="urscript", program="test.script", cycles=2)
    target = np.column_stack([from_si(plan.commanded[:, :3, 3], "mm"), quaternions(plan.commanded[:, :3, :3])])
    extra = dict(zip(TARGET_COLUMNS, target.T, strict=True)) | {"cycle": [visit.cycle for visit in plan.visits]}
    visits = replace(
        fastcal.Dataset.from_arrays(plan.q), extra={name: np.array(each, dtype=float) for name, each in extra.items()}
    )
    data = fastcal.simulate(robot, plan.q, noise=1e-5, seed=2)
    assert accept(robot, data, plan=visits, draws=0).figures
    twice = visits.select(np.concatenate([np.arange(len(visits)), [3]]))
    with pytest.raises(InvalidInput, match=f"data row {len(visits)} is the same visit as row 3; expected each"):
        accept(robot, data, plan=twice, draws=0)
