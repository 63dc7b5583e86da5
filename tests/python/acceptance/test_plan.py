# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The cube lies in the workspace, its poses as the standard has them, and a compensated arm goes where it should."""

import numpy as np
import pytest

import fastcal
from fastcal.acceptance import plan_acceptance
from fastcal.acceptance.cube import Cube, largest_cube
from fastcal.errors import InvalidInput
from fastcal.robot.controller_robot import nominal_record
from fastcal.units import to_si


def test_the_poses_lie_on_the_diagonals_of_one_plane_a_tenth_from_its_ends() -> None:
    cube = Cube(np.array([1.0, 2, 3]), 0.5, np.eye(3))
    P, C = cube.points, cube.corners
    np.testing.assert_allclose(P[0], [1, 2, 3])
    for pose, corner in zip(P[1:], C[[0, 1, 6, 7]], strict=True):
        assert np.linalg.norm(pose - corner) == pytest.approx(0.1 * 0.5 * np.sqrt(3))
    assert np.linalg.norm(P[1] - P[3]) == pytest.approx(0.8 * 0.5 * np.sqrt(3))  # P2 and P4 on one diagonal
    normal = np.cross(C[1] - C[0], C[7] - C[0])
    np.testing.assert_allclose((P - P[0]) @ normal, 0, atol=1e-12)


def test_the_largest_cube_is_reached_and_above_the_floor() -> None:
    robot = fastcal.load_robot("ur10")
    cube, q = largest_cube(robot)
    assert cube.edge == 0.63
    assert cube.corners[:, 2].min() >= 0
    np.testing.assert_allclose(robot.forward(q), cube.poses(cube.points), atol=1e-8)
    assert (q > robot.limits[:, 0]).all()
    assert (q < robot.limits[:, 1]).all()


def test_a_cube_out_of_reach_is_refused() -> None:
    with pytest.raises(InvalidInput, match="reaches no test cube of any size at 9000, 0, 0 mm"):
        largest_cube(fastcal.load_robot("ur10"), centre=np.array([9.0, 0, 0]))
    with pytest.raises(InvalidInput, match="edge of 5000 mm"):
        largest_cube(fastcal.load_robot("ur10"), edge=5.0)


def test_compensated_commands_bring_the_real_arm_to_the_poses() -> None:
    """A real UR10 with geometry, two soft joints and backlash: its model as MODEL, its poses judged in its own base."""
    nominal = fastcal.load_robot("ur10")
    entries = [
        {"effect": "joint_compliance", "owner": f"joint{j}", "parameters": {"compliance_rad_nm": {"value": 4e-7}}}
        for j in (2, 3)
    ] + [{"effect": "backlash", "owner": "joint2", "parameters": {"gap_rad": {"value": 4e-4}}}]
    real = fastcal.perturbed(fastcal.Robot(nominal.spec | {"effects": entries}), seed=3)
    spec = real.spec | {"base": {"xyz_mm": [900.0, -300.0, 500.0], "rpy_deg": [1.0, -2.0, 130.0]}}
    real = fastcal.Robot(spec)
    plan = plan_acceptance(
        real, language="urscript", program="iso.script", compensate=True, directions=True, payload=3.0
    )
    T = real.core.base_and_tool(real.core.nominal)[0]
    got = real.forward(plan.q, payload=3.0, approach=plan.approach)
    wanted = T @ plan.commanded
    cycle = [i for i, visit in enumerate(plan.visits) if not visit.direction]
    sides = [i for i, visit in enumerate(plan.visits) if visit.direction]
    assert (len(cycle), len(sides)) == (150, 270)
    off = np.linalg.norm(got[:, :3, 3] - wanted[:, :3, 3], axis=1)
    assert off[cycle].max() < 1e-6  # seven decimals of a radian
    assert off[sides].max() > 1e-4  # from other sides the gap lies on the other flank: that is what vAP shows
    plain = plan_acceptance(real, language="urscript", program="iso.script")
    missed = real.forward(plain.q, payload=3.0, approach=plain.approach)[:, :3, 3] - (T @ plain.commanded)[:, :3, 3]
    assert np.linalg.norm(missed, axis=1).max() > 1e-5


def test_each_pose_is_always_approached_from_the_same_side() -> None:
    plan = plan_acceptance(fastcal.load_robot("ur10"), language="rapid", program="iso.mod", directions=True)
    for key in {(visit.pose, visit.direction) for visit in plan.visits}:
        rows = [i for i, visit in enumerate(plan.visits) if (visit.pose, visit.direction) == key]
        assert len(rows) == 30
        assert len(np.unique(plan.approach[rows], axis=0)) == 1
        assert len(np.unique(plan.q[rows], axis=0)) == 1


def _warm() -> fastcal.Robot:
    """An UR10 that grows with a temperature which lags, whose joint 2 settles; calibrated from 18 to 30 degC."""
    entries = [
        {"effect": "settling", "owner": "joint2", "parameters": {"rad_rad": {"value": 2e-3}}},
        {
            "effect": "thermal_expansion",
            "owner": "robot",
            "t0_c": 20.0,
            "parameters": {"coefficient_1_k": {"value": 1e-4}, "lag_s": {"value": 1800.0}},
        },
    ]
    nominal = fastcal.load_robot("ur10")
    record = {
        "nominal": nominal_record(nominal.spec),
        "parameters": [],
        "covariance_root": [],
        "sigma_mm": 0.02,
        "degrees_of_freedom": 100,
        "covered": {"temperature_c": [18.0, 30.0]},
    }
    return fastcal.Robot(nominal.spec | {"effects": entries, "calibration": record})


@pytest.mark.parametrize("celsius", [None, 35.0])
def test_commands_are_for_a_temperature(celsius: float | None) -> None:
    """It ended: 'needs the column temperature_c, which the data do not have', and there was no way to give it."""
    real = _warm()
    given = None if celsius is None else to_si(celsius, "c")
    plan = plan_acceptance(real, language="urscript", program="iso.script", compensate=True, temperature=given)
    assert plan.temperature == pytest.approx(to_si(24.0 if celsius is None else celsius, "c"))
    assert any("the commands are for 24 degC, the middle of what" in note for note in plan.notes) == (celsius is None)
    data = fastcal.Dataset.from_arrays(plan.q, temperature=plan.temperature, time=np.arange(len(plan.q)))
    off = np.linalg.norm(fastcal.predict(real, data).position - plan.commanded[:, :3, 3], axis=1)
    assert off[1:].max() < 2e-5  # of 0.6 mm that settle; the first is reached from nowhere
    bare = fastcal.Robot({key: value for key, value in real.spec.items() if key != "calibration"})
    with pytest.raises(InvalidInput, match="thermal_expansion@robot needs the temperature of the test"):
        plan_acceptance(bare, language="urscript", program="iso.script", compensate=True)


def test_without_compensation_no_temperature_is_asked_for() -> None:
    plan = plan_acceptance(_warm(), language="urscript", program="iso.script")
    assert plan.temperature is None
    assert plan.notes == ()
