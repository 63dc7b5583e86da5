# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What would tell names apart, what poses will show before they are measured, many waves, curves without a name."""

import json
from pathlib import Path

import numpy as np
import pytest

import fastcal
from fastcal import Dataset, Robot
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.diagnosis.unexplained import main_orders, profile_curve
from fastcal.io.measurements import load_measurements

NOISE = 4e-5


def arm_with(name: str, effects: list[dict[str, object]], rows: int, seed: int = 1) -> tuple[Robot, Dataset]:
    """A shipped arm and measurements of one as a workshop built it, with effects."""
    robot = fastcal.load_robot(name)
    true = fastcal.perturbed(robot, seed=seed)
    true = Robot(dict(true.spec) | {"effects": effects})
    random = np.random.default_rng(seed)
    q = fastcal.random_poses(robot, rows, seed=seed + 1)
    payload = random.choice([0.0, 5.0, 10.0], rows)
    return robot, fastcal.simulate(true, q, noise=NOISE, seed=seed + 2, payload=payload)


def test_names_that_look_alike_are_a_set_with_poses_that_tell_them_apart(tmp_path: Path) -> None:
    compliance = {"compliance_rad_nm": 1.2e-7}
    effect = {"effect": "joint_compliance", "owner": "joint2", "parameters": compliance}
    robot, data = arm_with("staubli_rx160l", [effect], 100)
    found = fastcal.diagnose(robot, data)
    assert found.verdict == "one_of"
    (finding,) = found.effects
    assert ("joint_compliance", "joint2") in {(finding.effect, finding.owner), *finding.equivalents}
    assert finding.grade == "B"
    plan = found.plan
    assert plan is not None
    assert plan.power_after > plan.power_before
    assert (plan.poses.q >= data.q.min(axis=0)).all()
    assert (plan.poses.q <= data.q.max(axis=0)).all()

    found.save(tmp_path / "out")
    planned = load_measurements(tmp_path / "out" / plan.file, robot, require_measured=False)
    assert planned.q == pytest.approx(plan.poses.q, abs=1e-7)
    told = json.loads((tmp_path / "out" / "diagnosis.json").read_text())["next_measurement"]
    assert told["poses"] == len(plan.poses)


def test_what_is_foreseen_is_what_the_measured_poses_then_show() -> None:
    robot, data = arm_with("staubli_rx160l", [], 80)
    foreseen = fastcal.foresee(robot, data, NOISE)
    found = fastcal.diagnose(robot, data, sigma=NOISE)
    assert found.verdict == "none"
    said = {(s.effect, s.owner, s.parameter): s.value for s in found.smallest}
    for size in foreseen.smallest:  # the geometry that is fitted is 0.5 mm and 0.5 mrad from the planned one
        assert said[size.effect, size.owner, size.parameter] == pytest.approx(size.value, rel=0.1)
    by_columns = {"thermal_expansion", "thermal_offset", "backlash", "base_drift", "station_offset"}
    for untestable in (foreseen.untestable, found.untestable):
        assert {u.effect for u in untestable} >= by_columns
        assert "base_step" not in {u.effect for u in untestable}  # by the order of the rows
    assert any(u.effect == "thermal_expansion" and "temperature" in u.needs for u in foreseen.untestable)
    assert all(0.95 < r <= 1 for _, _, r in foreseen.confused)


@pytest.mark.parametrize("sigma", [0.0, -1e-5, np.nan])
def test_a_plan_needs_a_noise(sigma: float) -> None:
    robot = fastcal.load_robot("ur5")
    poses = Dataset.from_arrays(fastcal.random_poses(robot, 20), robot=robot)
    with pytest.raises(fastcal.InvalidInput, match="sigma"):
        fastcal.foresee(robot, poses, sigma)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_a_fit_ends_where_it_ends_whatever_it_starts_from(order: tuple[int, int]) -> None:
    """Of a wrist whose axes meet one direction is hardly told: a step far along it must not shorten the others."""
    slack = {"effect": "backlash", "owner": "joint2", "parameters": {"gap_rad": 5e-5}}
    tilt = {"effect": "bearing_tilt", "owner": "joint6", "parameters": {"rad_nm": 1e-7}}
    robot, poses = arm_with("kuka_kr500_3", [], 150)
    true = Robot(dict(fastcal.perturbed(robot, seed=4).spec) | {"effects": [slack, tilt]})
    random = np.random.default_rng(5)
    payload, approach = random.choice([0.0, 250.0, 500.0], 150), random.choice([-1.0, 1.0], (150, 6))
    data = fastcal.simulate(true, Dataset.from_arrays(poses.q, payload=payload, approach=approach), noise=NOISE, seed=6)
    names = [Hypothesis({"effect": e["effect"], "owner": e["owner"]}) for e in (slack, tilt)]
    problem = prepared_problem(robot, data, names, Noise((NOISE, 1e-4, NOISE)), 1)
    first, second = (names[k] for k in order)
    whole = fit(problem, names)
    grown = fit(problem, [first, second], fit(problem, [first]))
    assert grown.remaining == pytest.approx(whole.remaining, abs=0.2)
    assert abs(whole.remaining - 450) < 5 * np.sqrt(2 * 450)
    assert [grown.value(name)[0] for name in names] == pytest.approx([5e-5, 1e-7], rel=0.3)


def test_many_waves_are_listed_by_joint_and_order() -> None:
    waves = [(1, 2.0), (1, 9.0), (2, 3.0), (3, 5.0), (4, 2.0), (5, 4.0)]
    effects: list[dict[str, object]] = [
        {
            "effect": "gear_harmonic",
            "owner": f"joint{joint}",
            "parameters": {"order": order, "amplitude_rad": 4e-4, "phase_rad": float(joint)},
        }
        for joint, order in waves
    ]
    robot, data = arm_with("ur5", effects, 250)
    found = fastcal.diagnose(robot, data)
    said = {(f.owner, f.parameters["order"].value) for f in found.effects if f.effect == "gear_harmonic"}
    assert said >= {(f"joint{joint}", order) for joint, order in waves}
    assert not any(f.grade == "A" for f in found.effects if f.effect != "gear_harmonic")
    assert "periodic" in found.sentence
    assert found.gap[-1].train_rms_mm == pytest.approx(np.sqrt(3) * 0.04, rel=0.05)


def test_the_curve_of_one_joint_casts_no_shadow_on_the_others() -> None:
    wave = {"order": 2.0, "amplitude_rad": 8e-4, "phase_rad": 0.4}
    robot, data = arm_with("ur5", [{"effect": "gear_harmonic", "owner": "joint2", "parameters": wave}], 200)
    found = fastcal.diagnose(robot, data, exclude=["gear_harmonic"])
    assert [(f.label, f.grade) for f in found.effects] == [("joint_profile@joint2", "C")]


def test_the_curve_of_a_profile_and_its_main_waves() -> None:
    wave = {"order": 2.0, "amplitude_rad": 5e-4, "phase_rad": 0.4}
    robot, data = arm_with("ur5", [{"effect": "gear_harmonic", "owner": "joint2", "parameters": wave}], 200)
    model = fastcal.calibrate(robot, data, effects="geometry,joint_profile@joint2").model
    (entry,) = model.spec["effects"]
    ((order, amplitude),) = main_orders(model, entry)
    assert order == 2
    assert amplitude == pytest.approx(5e-4, rel=0.15)
    q = np.linspace(entry["low_rad"], entry["high_rad"], 40)
    curve = profile_curve(model, "joint2", q)
    wanted = 5e-4 * np.sin(2 * q + 0.4)
    # The straight line and the constant are the geometry's to share.
    line = np.column_stack([np.ones(40), q])
    left = curve - wanted - line @ np.linalg.lstsq(line, curve - wanted, rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.1 * 5e-4


def test_lengths_from_an_unknown_anchor_show_a_missing_effect_too() -> None:
    ratio = {"effect": "reduction_ratio", "owner": "joint2", "parameters": {"error": 1e-3}}
    robot, points = arm_with("staubli_rx160l", [ratio], 150)
    random = np.random.default_rng(4)
    anchor = np.array([2.5, 1.0, 0.3])
    assert points.position is not None
    length = np.linalg.norm(points.position - anchor, axis=1) + NOISE * random.standard_normal(150)
    data = Dataset.from_arrays(points.q, distance=length, payload=points.payload, robot=robot)
    found = fastcal.diagnose(robot, data)
    assert [f.label for f in found.effects] == ["reduction_ratio@joint2"]
    assert found.effects[0].parameters["error"].value == pytest.approx(1e-3, rel=0.05)
    noise = 1e3 * found.noise["length"].value  # of the point and of the length
    assert noise == pytest.approx(np.sqrt(2) * 0.04, rel=0.15)


@pytest.mark.parametrize("height", [2e-4, 8e-4])
def test_a_curve_without_a_name_is_placed_and_not_named(height: float) -> None:
    """A bump over the range of one joint, which no effect of the library is; two waves would do for a low one."""
    robot, plain = arm_with("pmc6va030", [], 200)
    q = plain.q.copy()
    middle = np.median(q[:, 1])
    q[:, 1] += height * np.exp(-(((q[:, 1] - middle) / 0.35) ** 2))
    true = fastcal.perturbed(robot, seed=1)
    moved = Dataset.from_arrays(q, payload=plain.payload)
    data = fastcal.simulate(true, moved, noise=NOISE, seed=9)
    data = Dataset.from_arrays(plain.q, position=data.position, payload=plain.payload, robot=robot)
    found = fastcal.diagnose(robot, data)
    assert {f.owner for f in found.effects} <= {"joint2"}
    assert all(f.grade == "C" for f in found.effects)
    if found.unexplained is not None:
        assert (found.unexplained.owner, found.unexplained.depends_on) == ("joint2", ("q2",))
    else:
        assert found.effects
        assert found.gap[-1].train_rms_mm < 1.05e3 * NOISE * np.sqrt(3) < found.gap[0].train_rms_mm
