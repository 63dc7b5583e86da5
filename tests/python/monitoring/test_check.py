# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal.check`: what holds, what changed and by how much, and what can't be told."""

import importlib
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import fastcal
from fastcal.errors import InvalidInput, Undetermined
from fastcal.monitoring.evidence import Evidence
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot

check_module = importlib.import_module("fastcal.monitoring.check")
NOISE = 3e-5  # as conftest.py has it


def test_an_unchanged_arm_holds_before_an_instrument_that_stands_elsewhere(calibrated) -> None:
    found = fastcal.check(calibrated.model, calibrated.measured(calibrated.spec()))
    assert found.verdict == "holds"
    assert found.causes == []
    assert found.p_value > 0.003
    motion = found.places[0].motion @ pose(calibrated.model.spec["base"])
    expected = Robot(calibrated.spec())
    # the base is where it was put, as far as eight points with this noise can place the arm's own frame
    there = motion @ np.linalg.inv(pose(calibrated.model.spec["base"])) @ calibrated.model.forward(np.zeros(6))[0]
    np.testing.assert_allclose(there[:3, 3], expected.forward(np.zeros(6))[0, :3, 3], atol=3e-4)
    assert "joint1 zero" in found.blind


def test_expected_misfit_is_that_of_noise_and_model(calibrated) -> None:
    found = [fastcal.check(calibrated.model, calibrated.measured(calibrated.spec(), seed=s)) for s in range(12)]
    square = np.mean([each.rms**2 for each in found])
    # the model is one draw for all of them: noise makes most of the misfit, so a few per cent are left to it
    assert square**0.5 == pytest.approx(found[0].expected_rms, rel=0.2)


def test_a_zero_that_moved_is_named_with_its_size(calibrated) -> None:
    for joint in (2, 3, 5):
        spec = calibrated.spec()
        spec["joints"][joint - 1]["theta_deg"] += 0.02
        found = fastcal.check(calibrated.model, calibrated.measured(spec))
        assert found.verdict == "changed"
        assert found.causes[0].label == f"joint{joint} zero"
        (change,) = found.causes[0].changes
        assert (change.name, change.owner, change.unit) == ("theta_deg", f"joint{joint}", "deg")
        assert change.change == pytest.approx(0.02, abs=4 * change.std)
        assert change.was == calibrated.model.spec["joints"][joint - 1]["theta_deg"]


def test_a_check_says_what_to_do(calibrated) -> None:
    """The act is that of the cause; where nothing changed and no tolerance is missed, there is none."""
    assert fastcal.check(calibrated.model, calibrated.measured(calibrated.spec())).next_act == ""
    spec = calibrated.spec()
    spec["joints"][2]["theta_deg"] += 0.02
    found = fastcal.check(calibrated.model, calibrated.measured(spec))
    act = r"Next: re-master joint 3, whose zero moved by \+0\.0(19|20|21)\d* .*; or bring .* `fastcal update`\."
    assert re.match(act, found.next_act)
    assert found.to_json_dict()["next_act"] == found.next_act
    assert found.next_act in found.summary()
    spec = calibrated.spec()
    spec["tool"]["xyz_mm"][0] += 0.2
    assert "check whether the tool is bent" in fastcal.check(calibrated.model, calibrated.measured(spec)).next_act
    few = fastcal.check(calibrated.model, calibrated.measured(calibrated.spec()), tolerance=1e-6)
    assert few.next_act.startswith("Next: the model is as good as it was, but that does not meet the tolerance")


def test_a_bent_tool_and_a_softer_joint_are_named(calibrated) -> None:
    spec = calibrated.spec()
    spec["tool"]["xyz_mm"][0] += 0.2
    found = fastcal.check(calibrated.model, calibrated.measured(spec))
    assert [cause.label for cause in found.causes] == ["tool"]
    assert [change.change for change in found.changed] == pytest.approx(
        [0.2, 0, 0], abs=4 * max(c.std for c in found.changed)
    )
    spec = calibrated.spec()
    spec["effects"][0]["parameters"]["compliance_rad_nm"]["value"] *= 1.1
    found = fastcal.check(calibrated.model, calibrated.measured(spec))
    assert [cause.label for cause in found.causes] == ["joint_compliance@joint2"]
    assert found.changed[0].change == pytest.approx(2e-7, abs=4 * found.changed[0].std)


def test_two_events_are_both_named(calibrated) -> None:
    spec = calibrated.spec()
    spec["joints"][1]["theta_deg"] += 0.02
    spec["tool"]["xyz_mm"] = [a + b for a, b in zip(spec["tool"]["xyz_mm"], (0.3, -0.4, 0.2), strict=True)]
    found = fastcal.check(calibrated.model, calibrated.measured(spec, 10))
    assert {cause.label for cause in found.causes} == {"joint2 zero", "tool"}


def test_one_wrong_row_is_no_change_of_the_arm(calibrated) -> None:
    data = calibrated.measured(calibrated.spec())
    position = data.position.copy()
    position[5] += [4e-4, -3e-4, 2e-4]
    found = fastcal.check(calibrated.model, replace(data, position=position))
    assert found.verdict == "cannot_tell"
    assert [cause.label for cause in found.causes] == ["row 5"]
    assert found.changed[0].p_value < 1e-3
    assert found.to_json_dict()["changed"] == []
    assert found.next_poses[0].q == pytest.approx(np.degrees(data.q[5]), abs=1e-3)
    *_, title, row = found.summary().splitlines()
    assert title == "next poses to measure: 1; payload and joint positions:"
    assert row == f"  {data.payload[5]:g} kg, {' '.join(f'{value:.1f}' for value in found.next_poses[0].q)} deg"


def test_noise_that_has_grown_is_no_change_of_a_parameter(calibrated) -> None:
    named = [
        fastcal.check(calibrated.model, calibrated.measured(calibrated.spec(), 10, seed=s, noise=2e-4)).causes[0].label
        for s in range(4)
    ]
    assert named.count("noise") >= 3


def test_several_set_ups_each_have_a_base(calibrated) -> None:
    spec = calibrated.spec()
    spec["joints"][2]["theta_deg"] += 0.02
    first = calibrated.measured(spec, seed=1)
    second = calibrated.measured(spec | {"base": {"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 0]}}, seed=2)
    found = fastcal.check(calibrated.model, first, second)
    assert len(found.places) == len(found.to_json_dict()["stations"]) == 2
    assert found.degrees_of_freedom == 3 * 16 - 2 * 6
    alone = fastcal.check(calibrated.model, first)
    assert found.causes[0].label == "joint3 zero"
    assert found.changed[0].std < alone.changed[0].std


def test_a_tolerance_is_judged_with_a_guard_band(calibrated) -> None:
    data = calibrated.measured(calibrated.spec())
    largest = fastcal.check(calibrated.model, data).largest
    within, near = (fastcal.check(calibrated.model, data, tolerance=t) for t in (largest + 3e-4, largest))
    assert (within.verdict, within.within_tolerance) == ("holds", True)
    assert (near.verdict, near.within_tolerance) == ("cannot_tell", None)
    spec = calibrated.spec()
    spec["tool"]["xyz_mm"][0] += 0.5
    beyond = fastcal.check(calibrated.model, calibrated.measured(spec), tolerance=1e-4)
    assert (beyond.verdict, beyond.within_tolerance) == ("changed", False)


def test_too_few_poses_ask_for_more(calibrated) -> None:
    data = calibrated.measured(calibrated.spec())
    found = fastcal.check(calibrated.model, data[:3])
    assert found.verdict == "cannot_tell"
    assert len(found.next_poses) > 0
    with pytest.raises(Undetermined, match="2 whole points fix no base"):
        fastcal.check(calibrated.model, data[:2])


def test_causes_that_look_alike_are_all_listed(calibrated) -> None:
    """With joint 5 at rest, stretched, joints 4 and 6 turn about one axis: their zeros do the same."""
    poses = fastcal.check_poses(calibrated.model, 8)
    q = poses.q.copy()
    q[:, 4] = 0.0
    spec = calibrated.spec()
    spec["joints"][3]["theta_deg"] += 0.3
    sent = fastcal.Dataset.from_arrays(q, payload=poses.payload, robot=calibrated.model)
    found = fastcal.check(calibrated.model, fastcal.simulate(Robot(spec), sent, noise=NOISE, seed=1))
    assert found.verdict == "changed"
    assert {"joint4 zero", "joint6 zero"} <= {found.causes[0].label, *found.causes[0].equivalents}
    # and the poses that are proposed bend joint 5
    assert max(abs(pose.q[4]) for pose in found.next_poses) > 10
    more = fastcal.Dataset.from_arrays(
        np.radians([pose.q for pose in found.next_poses]),
        payload=[pose.payload_kg for pose in found.next_poses],
        robot=calibrated.model,
    )
    first = fastcal.simulate(Robot(spec), sent, noise=NOISE, seed=1)
    second = fastcal.simulate(Robot(spec), more, noise=NOISE, seed=2)
    whole = fastcal.check(calibrated.model, fastcal.Dataset.concatenate([first, second]))
    assert (whole.causes[0].label, whole.causes[0].equivalents) == ("joint4 zero", ())


def test_what_a_check_refuses(calibrated) -> None:
    data = calibrated.measured(calibrated.spec())
    with pytest.raises(InvalidInput, match="keeps no covariance"):
        fastcal.check("staubli_rx160l", data)
    with pytest.raises(InvalidInput, match="expected the model and then"):
        fastcal.check(calibrated.model)
    with pytest.raises(InvalidInput, match="no measured column; expected x_mm"):
        fastcal.check(calibrated.model, replace(data, position=None))
    with pytest.raises(InvalidInput, match="do not fit"):
        fastcal.check(calibrated.model, replace(data, position=data.position[::-1].copy()))
    with pytest.raises(InvalidInput, match="tolerance must be above 0"):
        fastcal.check(calibrated.model, data, tolerance=-1.0)


def test_p_values_follow_their_laws() -> None:
    """Whitened noise with a scale estimated elsewhere: uniform p of the whole, and of the smallest of all tests."""
    random = np.random.default_rng(4)
    B, K = random.standard_normal((24, 6)), [random.standard_normal((24, d)) for d in (1, 1, 2, 3, 1)]
    freedom, whole, smallest = 120, [], []
    for _ in range(150):
        sigma = np.sqrt(random.chisquare(freedom) / freedom)  # of the calibration's estimate
        r = B @ random.standard_normal(6) * 100 + random.standard_normal(24)
        evidence = Evidence(r / sigma, B, K, [np.ones(k.shape[1]) for k in K], freedom)
        whole.append(evidence.p_value)
        smallest.append(evidence.smallest_p)
    assert stats.kstest(whole, "uniform").pvalue > 0.01
    assert stats.kstest(smallest, "uniform").pvalue > 0.01


def test_an_estimate_is_the_least_squares_one() -> None:
    random = np.random.default_rng(5)
    B, K = random.standard_normal((24, 6)), random.standard_normal((24, 2))
    r = K @ [3.0, -2.0] + random.standard_normal(24)
    found = Evidence(r, B, [K], [np.array([0.5, 4.0])], 1e9).tests[0]
    A = np.hstack([B, K])
    np.testing.assert_allclose(found.value, np.linalg.lstsq(A, r)[0][6:], atol=1e-10)
    np.testing.assert_allclose(found.std, np.sqrt(np.diag(np.linalg.inv(A.T @ A))[6:]), atol=1e-10)
    rest = np.linalg.lstsq(A, r)[1][0]
    assert found.statistic == pytest.approx(np.linalg.lstsq(B, r)[1][0] - rest)


def test_results_show_themselves(calibrated) -> None:
    found = fastcal.check(calibrated.model, calibrated.measured(calibrated.spec()))
    assert found.summary().startswith("staubli_rx160l: The model still holds")
    assert repr(found).startswith("<CheckResult: staubli_rx160l, holds")
    assert {"owner", "name", "value", "std", "unit"} <= set(found.to_frame().columns)
    assert "joint2" in found._repr_html_()
    assert found.made_by["serial"] == "RX-0042"
    assert found.made_by["rows"] == 8


def test_a_check_says_what_lies_beyond_the_model() -> None:
    """Rows in kelvin under a heading of deg C, and a joint beyond its profile."""
    robot = fastcal.load_robot("ur5")
    warm = {"effect": "thermal_expansion", "owner": "robot", "parameters": {"coefficient_1_k": 2e-5}}
    curve = {
        "effect": "joint_profile",
        "owner": "joint2",
        "knots": 5,
        "curvature": 1e-3,
        "low_rad": -1.0,
        "high_rad": 1.0,
        "parameters": {"curve2_rad": 1e-4},
    }
    true = Robot(dict(fastcal.perturbed(robot, seed=1).spec) | {"effects": [warm, curve]})
    random = np.random.default_rng(2)

    def measured(count: int, reach: float, warmth: float) -> fastcal.Dataset:
        q = random.uniform(-reach, reach, (count, 6))
        return fastcal.simulate(true, q, noise=3e-5, seed=count, temperature=warmth + random.uniform(0, 10, count))

    start = Robot(robot.spec | {"effects": [warm, {**curve, "parameters": {}}]})
    model = fastcal.calibrate(start, measured(120, 1.0, 293.15)).model
    within = fastcal.check(model, measured(20, 0.9, 293.15)).notes
    assert not any("outside" in note for note in within)
    beyond = fastcal.check(model, measured(30, 1.5, 566.3)).notes
    assert any(note.startswith("joint 2 is outside the -57.3 to 57.3 deg") for note in beyond)
    assert any(note.startswith("the temperature is far outside the 20.") for note in beyond)


def test_blas_has_one_thread_in_a_check(calibrated, monkeypatch) -> None:
    """A product shared among BLAS threads has other last digits, which check.json would show."""
    from threadpoolctl import threadpool_info, threadpool_limits

    seen, prepared = [], check_module.prepared

    def watched(*given, **options):
        seen.extend(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")
        return prepared(*given, **options)

    monkeypatch.setattr(check_module, "prepared", watched)
    with threadpool_limits(2, user_api="blas"):
        fastcal.check(calibrated.model, calibrated.measured(calibrated.spec()))
    assert seen
    assert set(seen) == {1}


def test_what_the_model_lacked_all_along_has_not_changed() -> None:
    """Geometry alone of an arm whose joints yield: its own residuals say that something is missing."""
    nominal = fastcal.load_robot("ur5e")
    yielding = [
        {"effect": "joint_compliance", "owner": f"joint{k}", "parameters": {"compliance_rad_nm": 6e-6}} for k in (2, 3)
    ]
    real = fastcal.perturbed(nominal, seed=3).with_(effects=yielding)
    first, later = (
        fastcal.simulate(real, fastcal.random_poses(nominal, count, seed=count), noise=2e-5, seed=count + 1)
        for count in (200, 150)
    )
    calibrated = fastcal.calibrate(nominal, first)
    assert calibrated.lacks_effect
    found = fastcal.check(calibrated.model, later)
    assert found.p_value < 0.003
    assert found.verdict == "cannot_tell"
    assert "missing since the calibration" in found.sentence
    assert "fastcal diagnose" in found.next_act
