# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal compliance`: a corner where there is one, none where there is none, and the fit of `payload_pairs`."""

from __future__ import annotations

import copy
import json
import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import fastcal
from fastcal.calibration.compliance import curve, identify_compliance, torques_of
from fastcal.calibration.corner_test import Corner, corner_test
from fastcal.calibration.critical_loads import open_corners
from fastcal.calibration.payload_pairs import differences, from_payload_pairs, profile, rows_in_pairs, solve
from fastcal.cli import main
from fastcal.report.compliance_report import compliance_page
from fastcal.robot.robot import Robot

ROOT = Path(__file__).parents[3]
JOINTS = (2, 3, 4, 5)
STRAIGHT = {2: 1 / 2.34e6, 3: 1 / 9.73e5, 4: 1 / 8.52e4, 5: 1 / 8.07e3}
BENT = {"low_rad_nm": 1 / 8.07e3, "high_rad_nm": 1 / 9.73e3, "critical_nm": 8.0}  # of joint 5
PAYLOADS = (0.4, 1.95, 3.95, 5.95, 7.95, 9.95)


def nominal() -> Robot:
    spec = copy.deepcopy(dict(fastcal.load_robot("staubli_rx160l").spec))
    for joint in spec["joints"]:
        joint.pop("link")
    return Robot(spec | {"payload": {"com_mm": [30.0, 10.0, 120.0]}})


def true_arm(bends: bool) -> Robot:
    spec = copy.deepcopy(dict(fastcal.perturbed(nominal(), seed=3).spec))
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": f"joint{j}", "parameters": {"compliance_rad_nm": STRAIGHT[j]}}
        for j in JOINTS
        if not (bends and j == 5)
    ]
    if bends:
        kind = {"effect": "joint_compliance_nonlinear", "owner": "joint5", "torque": "payload"}
        spec["effects"].append(kind | {"parameters": BENT})
    return Robot(spec)


def measured(bends: bool, seed: int) -> fastcal.Dataset:
    arm = true_arm(bends)
    q = np.repeat(fastcal.random_poses(arm, 40, seed=seed), len(PAYLOADS), axis=0)
    return fastcal.simulate(arm, q, payload=np.tile(PAYLOADS, 40), noise=5e-6, seed=seed)


def test_the_chance_of_a_corner_is_uniform_where_there_is_none() -> None:
    """A line through noise, its corner searched for: the plain F test of the best place finds one far too often."""
    x = np.linspace(0, 1, 60)
    A = x[:, np.newaxis]
    B = np.maximum(x[:, np.newaxis] - np.linspace(0.05, 0.95, 19), 0)
    random = np.random.default_rng(3)
    found, plain = [], []
    for _ in range(400):
        r = random.standard_normal(60)
        r -= A[:, 0] * (A[:, 0] @ r) / (A[:, 0] @ A[:, 0])
        found.append(corner_test(r, A, B, 59).p)
        behind = B - A * (A.T @ B) / (A.T @ A)
        z = (behind.T @ r) ** 2 / np.sum(behind**2, axis=0)
        plain.append(stats.f.sf(z.max() / ((r @ r - z.max()) / 58), 1, 58))
    assert stats.kstest(found, "uniform").pvalue > 0.01
    assert np.mean(np.array(found) < 0.05) == pytest.approx(0.05, abs=0.03)
    assert np.mean(np.array(plain) < 0.05) > 0.09
    assert corner_test(np.zeros(3) + 1.0, np.eye(3), np.ones((3, 2)), 5) == Corner(1.0, 0.0)


def test_no_joint_is_given_a_corner_that_is_not_there() -> None:
    """Of 32 straight joints at a level of 0.01, more than two with a corner would be a chance of 0.4 %."""
    found = [
        identify_compliance(nominal(), measured(False, seed), joints=JOINTS, torque="payload") for seed in range(8)
    ]
    curves = [own for one in found for own in one.curves]
    assert sum(own.bent for own in curves) <= 2
    assert stats.kstest([own.p for own in curves], "uniform").pvalue > 0.01
    assert "No joint has a corner" in compliance_page(found[0], "arm")


def test_the_corner_that_is_there_is_found_and_the_fit_is_that_of_payload_pairs() -> None:
    data = measured(True, 1)
    found = identify_compliance(nominal(), data, joints=JOINTS, torque="payload")
    assert [own.owner for own in found.curves if own.bent] == ["joint5"]
    entries = {p.name: p for p in found.pairs.parameters if p.owner == "joint5"}
    for name, value in BENT.items():
        assert entries[name].value == pytest.approx(value, abs=3.5 * entries[name].std)
    effects = [f"joint_compliance@joint{j}" for j in (2, 3, 4)]
    same = from_payload_pairs(nominal(), data, effects=[*effects, "joint_compliance_nonlinear@joint5:torque=payload"])
    assert np.array_equal(found.pairs.after, same.after)
    assert np.array_equal(found.pairs.before, same.before)
    # Each row's angle is that of the law but for the noise, 5 um at the lever of joint 5 or less.
    own = found.curves[-1]
    rows = rows_in_pairs(data)[0]
    assert own.torque == pytest.approx(torques_of(found.pairs.model, rows, "payload")[:, 4])
    off = np.degrees(own.angle) - curve(found, "joint5", own.torque)
    assert 0 < np.sqrt(np.mean(off**2)) < np.degrees(5e-6 / 0.1)


def test_a_corner_without_which_the_others_do_not_fit_stays_as_it_was_taken() -> None:
    """Joint 2 and another are taken; without the other joint 2's corner lies beyond what its loads determine."""
    bench = runpy.run_path(str(ROOT / "bench" / "python" / "bench_compliance.py"))
    _, data, joint, _ = bench["drawn"](1017)
    found = identify_compliance(bench["nominal"](), data, joints=JOINTS, torque="payload")
    assert f"joint{joint}" in [own.owner for own in found.curves if own.bent]


def test_no_test_finds_what_one_that_is_told_the_place_does_not() -> None:
    """Of the record: as many are found as there are for a test that is told the place, but for what the search costs;
    the deviations hold."""
    sets = json.loads((ROOT / "bench" / "python" / "bench_compliance.json").read_text())["sets"]
    assert [each["seed"] for each in sets] == list(range(1000, 1190))
    found = [each for each in sets if each["found"]]
    sure = [each for each in sets if each["told_power"] >= 0.99]
    inside = [each for each in found if abs(each["off_sigma"]) <= 2]
    assert len(found) > sum(each["told_power"] for each in sets) - 8
    assert all(each["found"] for each in sure)
    assert stats.binomtest(len(inside), len(found), 0.9545).pvalue > 0.05
    assert sum(len(each["others"]) for each in sets) <= 12  # of 570 at a level of 0.01; more: a chance of 1 %
    told = sum(each["told_power"] for each in sets)
    both = [each["found"] and abs(each["off_sigma"]) <= 2 for each in sure]
    drawn = sum(len(each["others"]) for each in sets)
    assert sum(both[:100]) >= 95
    pages = ["commands", "papers"]
    commands, papers = (" ".join((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8").split()) for name in pages)
    for line in (
        f"Of {len(sets)} simulated sets",
        f"{len(found)} corners were found; a test that knows the position of the corner would find {told:.1f} on",
        f"Of the {len(sure)} sets in which such a test finds it in 99 % or more all {len(sure)} were found, "
        f"{sum(both)} of these within two standard deviations ({sum(both[:100])} of the first 100); of all "
        f"{len(found)} found {len(inside)}. Of {3 * len(sets)} joints without a corner {drawn} got one.",
    ):
        assert line in commands
    assert (
        f"of 100 corners that the rows show, {sum(both[:100])} within two standard deviations, and {drawn} that"
        in papers
    )


def test_a_weak_corner_is_as_uncertain_as_its_likelihood_says() -> None:
    """Two valleys: the curvature at the bottom of one would claim less than half of the true deviation."""
    arm = true_arm(True)
    q = np.repeat(fastcal.random_poses(arm, 40, seed=4), len(PAYLOADS), axis=0)
    data = fastcal.simulate(arm, q, payload=np.tile(PAYLOADS, 40), noise=6e-5, seed=4)
    effects = ["joint_compliance_nonlinear@joint5:torque=payload"]
    ready, problem = differences(arm.with_(effects=[]), data, effects, 1)
    corners = open_corners(ready.robot, ready.model, ready.samples)
    theta, covariance, sigma = solve(problem, corners)
    (index,) = corners[0].indices
    at, rise = profile(problem, theta, index, corners[0].loads)
    own = len(ready.model.robot.parameters)
    deviation = np.sqrt(covariance[index - own, index - own])
    assert rise.min() > -(sigma**2)  # no other valley is deeper by a deviation
    inside = np.abs(at - theta[index])[rise <= 4 * sigma**2]
    assert deviation >= 0.999 * inside.max() / 2


def test_the_command_writes_model_page_and_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, rows, out = tmp_path / "arm.yaml", tmp_path / "rows.csv", tmp_path / "out"
    nominal().save(robot)
    fastcal.write_measurements(rows, measured(True, 1))
    line = ["compliance", str(robot), str(rows), "--joints", "2,3,4,5", "--torque", "payload", "-o", str(out)]
    assert main(line) == 0
    assert "joint5: a corner (p 5e-05); low_rad_nm" in capsys.readouterr().out
    content = json.loads((out / "compliance.json").read_text())
    assert [joint["corner"] for joint in content["joints"]] == [False, False, False, True]
    assert (out / "report.html").read_text().count("<figure") == 4
    assert [entry["owner"] for entry in fastcal.load_robot(out / "model.yaml").spec["effects"]][-1] == "joint5"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--joints", "two"], "--joints takes numbers of joints such as 2,3,5, got 'two'"),
        (["--joints", "9"], "expected joints that turn, of [1, 2, 3, 4, 5, 6], got [9]"),
    ],
)
def test_joints_that_are_not_there_are_refused(
    options: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, rows = tmp_path / "arm.yaml", tmp_path / "rows.csv"
    nominal().save(robot)
    fastcal.write_measurements(rows, measured(False, 2))
    assert main(["compliance", str(robot), str(rows), *options, "-o", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
