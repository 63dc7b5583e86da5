# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal.update` and `fastcal.compare`."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest

import fastcal
from fastcal.cli import main
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.common_gauge import held_inverse
from fastcal.report.update_report import update_page
from fastcal.robot.robot import Robot

NOISE = 3e-5
EFFECTS = ["geometry", "joint_compliance@joint2", "joint_compliance@joint3"]


def away(model: Robot, true: Robot) -> float:
    """RMS distance [m] over unseen poses, the base laid on."""
    q = fastcal.random_poses(model, 200, seed=77)
    load = np.where(np.arange(200) % 2 == 0, 0.0, 14.0)
    p, x = (robot.forward(q, payload=load)[:, :3, 3] for robot in (model, true))
    U, _, Vt = np.linalg.svd((x - x.mean(axis=0)).T @ (p - p.mean(axis=0)))
    return float(np.sqrt(np.mean(np.sum(((p - p.mean(axis=0)) @ (U @ Vt).T - x + x.mean(axis=0)) ** 2, axis=1))))


def fresh(calibrated, spec: dict, seed: int) -> Robot:
    """A new calibration of the same arm from sixty poses."""
    random = np.random.default_rng(seed)
    q = fastcal.random_poses(calibrated.model, 60, seed=seed)
    sent = Dataset.from_arrays(q, payload=random.choice([0.0, 14.0], 60), robot=calibrated.model)
    nominal = fastcal.load_robot("staubli_rx160l")
    return fastcal.calibrate(
        nominal, fastcal.simulate(Robot(spec), sent, noise=NOISE, seed=seed), effects=EFFECTS
    ).model


def test_twelve_poses_bring_a_model_up_to_date(calibrated, tmp_path) -> None:
    spec = calibrated.spec()
    spec["joints"][2]["theta_deg"] += 0.02
    found = fastcal.update(calibrated.model, calibrated.measured(spec, 12), who={"date": "2026-11-01"})
    new = np.mean([away(fresh(calibrated, spec, seed), Robot(spec)) ** 2 for seed in (11, 12, 13)]) ** 0.5
    assert away(calibrated.model, Robot(spec)) > 10 * new
    assert away(found.model, Robot(spec)) < 1.4 * new  # one arm; the mean of two hundred is in docs/monitoring.md
    assert fastcal.check(found.model, calibrated.measured(spec, seed=9)).verdict == "holds"
    found.save(tmp_path / "out")
    again = fastcal.load_robot(tmp_path / "out" / "model.yaml")
    q = fastcal.random_poses(again, 20, seed=1)
    np.testing.assert_array_equal(again.forward(q), found.model.forward(q))
    assert again.record.degrees_of_freedom == found.degrees_of_freedom > calibrated.model.record.degrees_of_freedom
    origin = again.spec["made_by"]
    assert origin["serial"] == "RX-0042"
    assert len(origin["updated_from"]) == 64
    assert json.loads((tmp_path / "out" / "result.json").read_text())["check"]["verdict"] == "changed"


def test_stated_deviations_of_an_update_are_honest(calibrated) -> None:
    """Errors of the points over their stated deviations, over draws of new rows; the model is one draw for all."""
    spec = calibrated.spec()
    spec["tool"]["xyz_mm"][0] += 0.2
    true = Robot(spec)
    q = fastcal.random_poses(calibrated.model, 100, seed=3)
    ratio = []
    for seed in range(6):
        model = fastcal.update(calibrated.model, calibrated.measured(spec, 12, seed=seed)).model
        error = model.forward(q)[:, :3, 3] - true.forward(q)[:, :3, 3]
        ratio.append(np.mean((error / model.position_deviation(q)) ** 2))
    assert 0.3 < np.mean(ratio) < 2.0


def test_a_wrong_row_is_left_out_of_an_update(calibrated) -> None:
    data = calibrated.measured(calibrated.spec(), 12)
    data.position[4] += [1e-3, 0, 5e-4]
    found = fastcal.update(calibrated.model, data)
    assert found.left_out == [4]
    assert away(found.model, Robot(calibrated.spec())) < 5e-5


def test_models_of_an_unchanged_arm_are_alike_whatever_gauge_and_set_up(calibrated) -> None:
    spec = calibrated.spec()
    spec["tool"]["xyz_mm"] = [90.0, 30.0, 100.0]  # another target
    found = fastcal.compare(calibrated.model, fresh(calibrated, spec, 21))
    assert found.significant == []
    assert found.at_tool.rms < 5e-5
    assert found.unexplained < 1e-9
    assert not {d.owner for d in found.parameters} & {"base", "tool"}
    same = fastcal.compare(calibrated.model, calibrated.model)
    assert same.at_tool.max < 1e-9
    assert max(abs(d.difference) for d in same.parameters) < 1e-6


def test_a_gauge_motion_is_no_difference(calibrated) -> None:
    """Joint 1's zero against the base, and joint 6's against the tool, move no point."""
    spec = copy.deepcopy(calibrated.model.spec)
    spec["joints"][0]["theta_deg"] += 5.0
    spec["joints"][0]["d_mm"] += 20.0
    found = fastcal.compare(calibrated.model, Robot(spec))
    assert found.significant == []
    assert found.at_tool.max < 1e-9


def test_what_differs_is_found_with_its_size(calibrated) -> None:
    spec = calibrated.spec()
    spec["joints"][2]["theta_deg"] += 0.03
    found = fastcal.compare(calibrated.model, fresh(calibrated, spec, 22))
    (difference,) = found.significant
    assert (difference.owner, difference.name) == ("joint3", "theta_deg")
    assert difference.difference == pytest.approx(0.03, abs=4 * difference.std)
    assert found.at_tool.mean > 2e-4
    content = found.to_json_dict()
    assert set(content["at_tool_mm"]) == {"mean", "rms", "max"}
    assert {"name", "owner", "a", "b", "difference", "std", "unit", "significant"} <= set(content["parameters"][0])


def test_an_effect_that_one_model_lacks_is_a_difference(calibrated) -> None:
    stiff = copy.deepcopy(calibrated.model.spec) | {"effects": []}
    found = fastcal.compare(Robot(stiff), calibrated.model)
    by_owner = {d.owner: d for d in found.parameters if d.name == "compliance_rad_nm"}
    assert by_owner["joint2"].a is None
    assert by_owner["joint2"].b == pytest.approx(
        calibrated.model.spec["effects"][0]["parameters"]["compliance_rad_nm"]["value"], rel=1e-3
    )


def test_what_update_and_compare_refuse(calibrated) -> None:
    with pytest.raises(InvalidInput, match="keeps no covariance"):
        fastcal.update("staubli_rx160l", calibrated.measured(calibrated.spec()))
    with pytest.raises(InvalidInput, match="expected the model and then"):
        fastcal.update(calibrated.model)
    with pytest.raises(InvalidInput, match="expected two models of one arm"):
        fastcal.compare(calibrated.model, "kuka_kr500_3")
    with pytest.raises(InvalidInput, match="twentieth of their reach"):
        fastcal.compare("ur10", "ur3e")
    nominal = fastcal.compare("staubli_rx160l", calibrated.model)
    assert nominal.parameters[0].significant is None
    assert nominal.notes


@pytest.mark.parametrize(
    "offsets",
    [{"joint2 theta": 0.6, "joint3 theta": -0.8}, {"joint3 theta": 1.5, "joint4 theta": 1.0, "joint5 theta": 1.5}],
)
def test_what_a_model_hardly_knows_is_found_however_far_it_is(offsets: dict[str, float]) -> None:
    """Zeros that the model knows to 2 rad: far off nothing is linear, and every step must lead down."""
    nominal = fastcal.load_robot("staubli_rx160l")
    data = fastcal.simulate(
        fastcal.perturbed(nominal, seed=2), fastcal.random_poses(nominal, 80, seed=2), noise=5e-5, seed=3
    )
    known = fastcal.calibrate(nominal, data, checks=False).model
    record = known.record
    assert record is not None
    root, spec = record.root.copy(), copy.deepcopy(known.spec)
    for name, offset in offsets.items():
        i = record.parameters.index(name)
        root[i, :], root[i, i] = 0.0, 2.0
        spec["joints"][int(name[5]) - 1]["theta_deg"] += float(np.degrees(offset))
    model = Robot(known.spec | {"calibration": replace(record, root=root).to_spec()})
    del spec["calibration"]
    new = fastcal.simulate(Robot(spec), fastcal.random_poses(nominal, 20, seed=5), noise=5e-5, seed=6)
    found = fastcal.update(model, new, as_read=True)
    assert found.status == "converged"
    assert found.train.after is not None
    assert found.train.after.rms < 2 * np.sqrt(3) * 5e-5


@pytest.mark.parametrize(
    ("entry", "name"),
    [
        ({"effect": "backlash", "owner": "joint3", "parameters": {"gap_rad": 4e-4}}, "backlash@joint3"),
        ({"effect": "thermal_expansion", "owner": "robot", "parameters": {}}, "thermal_expansion@robot"),
    ],
)
def test_models_that_need_more_than_postures_are_compared(entry: dict, name: str) -> None:
    """Directions of approach and temperatures are those that both were fitted on: no one is asked for them."""
    nominal = fastcal.load_robot("staubli_rx160l")
    true = fastcal.perturbed(Robot(nominal.spec | {"effects": [entry]}), seed=1)

    def model(seed: int) -> Robot:
        random = np.random.default_rng(seed)
        sent = {
            "temperature": 293 + 10 * random.random(120),
            "time": 30.0 * np.arange(120),
            "approach": random.choice([-1.0, 1.0], (120, 6)),
        }
        data = fastcal.simulate(true, fastcal.random_poses(nominal, 120, seed=seed), noise=5e-5, seed=seed, **sent)
        return fastcal.calibrate(nominal, data, effects=["geometry", name], checks=False).model

    found = fastcal.compare(model(1), model(2))
    assert 0 < found.at_tool.rms < 1e-4  # two calibrations of one arm by noise of 0.05 mm
    assert found.significant == []


def test_what_common_postures_hardly_show_is_no_difference(calibrated) -> None:
    """Joint 1's length, where the ranges of the curves share little of joints 1 and 5."""
    nominal = fastcal.load_robot("staubli_rx160l")
    curves = [f"joint_profile@joint{joint}" for joint in range(1, 7)]
    away = 0.68 * nominal.limits[:, 1] * np.array([1.0, 0.3, 0.3, 0.3, 0.95, 0.3])

    def model(seed: int, middle: float) -> Robot:
        q = middle * away + 0.35 * fastcal.random_poses(nominal, 260, seed=seed)
        data = fastcal.simulate(calibrated.true, q, noise=NOISE, seed=seed)
        return fastcal.calibrate(nominal, data, effects=["geometry", *curves], checks=False).model

    found = fastcal.compare(model(1, 0.0), model(2, 1.0))
    assert found.at_tool.rms < 5e-4
    assert found.unexplained < 5e-5
    assert ("joint1", "a_mm") not in [(d.owner, d.name) for d in found.significant]
    assert max(abs(d.difference) for d in found.parameters if d.unit == "mm") < 1.5


def test_least_squares_of_what_the_rows_hardly_show_stay_small() -> None:
    """Two columns that differ by a millionth: what a third direction of noise would put into their difference."""
    J = np.array([[1.0, 1.0], [0.0, 1e-6], [1.0, 1.0]])
    size, noise = np.array([1e-3, 1e-3]), 3e-5
    inverse, unseen = held_inverse(J, size, noise)
    rows = np.array([1e-3, 1e-5, 1e-3])
    assert np.abs(np.linalg.pinv(J) @ rows).max() > 1.0
    np.testing.assert_allclose(inverse @ rows, [5e-4, 5e-4], rtol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(unseen, axis=1), 1e-3 / np.sqrt(2), rtol=1e-3)
    shown, unseen = held_inverse(np.eye(2), np.ones(2), 1e-5)
    np.testing.assert_allclose(shown, np.eye(2), rtol=1e-15)
    assert np.abs(unseen).max() < 1e-30


def test_an_update_that_has_not_come_to_rest_says_so(calibrated, monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setattr("fastcal.monitoring.refit._ROUNDS", 1)
    spec = calibrated.spec()
    spec["joints"][2]["theta_deg"] += 0.5
    data = calibrated.measured(spec, 12)
    found = fastcal.update(calibrated.model, data)
    assert found.status == "not_converged"
    assert repr(found).endswith("not converged>")
    assert "up to date" not in found.summary()
    assert "Not converged" in update_page(found)
    calibrated.model.save(tmp_path / "model.yaml")
    fastcal.write_measurements(tmp_path / "new.csv", data)
    arguments = ["update", tmp_path / "model.yaml", tmp_path / "new.csv", "-o", tmp_path / "out"]
    assert main([str(argument) for argument in arguments]) == 3
    said = capsys.readouterr()
    assert "not converged on 12 poses" in said.out
    assert "fastcal: error: the update has not converged" in said.err
