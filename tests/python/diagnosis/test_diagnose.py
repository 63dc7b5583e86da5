# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Small simulated sets: what is hidden is said, what is not is not, and the same data give the same answer."""

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from fastcal import InvalidInput, Robot, calibrate, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.diagnosis.grading import Evidence, grade
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import build_library, parse_exclusions
from fastcal.diagnosis.noise import isolated_rows, repeats
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.diagnosis.reasons import Reason
from fastcal.diagnosis.rivals import Rivals
from fastcal.diagnosis.search import Search
from fastcal.diagnosis.variants import harmonics
from fastcal.effects.entries import build_effects
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import without_measured

SIGMA = 4e-5  # [m]
ROWS = 110
BACKLASH = {"effect": "backlash", "owner": "joint4", "parameters": {"gap_rad": 6e-4}}
RATIO = {"effect": "reduction_ratio", "owner": "joint1", "parameters": {"error": 1e-4}}


@cache
def arm() -> Robot:
    return load_robot("pmc6va030")


def rows(effects: list[dict[str, Any]], seed: int = 1, noise: float = SIGMA, **more: Any) -> Dataset:
    true = perturbed(arm(), seed=seed)
    true = Robot(dict(true.spec) | {"effects": effects})
    random = np.random.default_rng(seed)
    approach = random.choice([-1.0, 1.0], (ROWS, 6))
    poses = Dataset.from_arrays(random_poses(arm(), ROWS, seed=seed), robot=arm(), approach=approach, **more)
    return simulate(true, poses, noise=noise, seed=seed)


@cache
def one() -> Diagnosis:
    return diagnose(arm(), rows([BACKLASH]), sigma=SIGMA)


def test_where_nothing_is_missing_nothing_is_reported() -> None:
    found = diagnose(arm(), rows([]), sigma=SIGMA)
    assert (found.verdict, found.effects, found.unexplained, found.outliers) == ("none", [], None, [])
    assert found.sigma_source == "option"
    assert found.sigma_mm == pytest.approx(0.04)
    assert [step.added for step in found.gap] == [None]
    smallest = {(s.effect, s.owner): s.value for s in found.smallest}
    assert 0 < smallest["backlash", "joint4"] < 6e-4
    assert {u.effect for u in found.untestable} >= {"base_drift", "thermal_expansion", "station_offset"}


def test_one_effect_is_named_with_its_size_and_closes_the_gap() -> None:
    found = one()
    assert (found.verdict, [f.label for f in found.effects]) == ("named", ["backlash@joint4"])
    gap = found.effects[0].parameters["gap_rad"]
    assert gap.std is not None
    assert abs(gap.value - 6e-4) < 4 * gap.std
    assert found.effects[0].grade == "A"
    assert [step.added for step in found.gap] == [None, "backlash@joint4"]
    # What remains is noise: of 3 ROWS numbers, about 30 fitted, to 5 standard errors.
    left = found.gap[-1].train_rms_mm ** 2 / (3 * 0.04**2)
    assert left == pytest.approx(1 - 30 / (3 * ROWS), abs=5 * np.sqrt(2 / (3 * ROWS)))
    assert found.ranking[0].name == "backlash@joint4"
    assert found.ranking[0].reason == "given"
    names, correlation = found.confusion
    np.testing.assert_allclose(np.diag(correlation), np.ones(len(names)), atol=1e-9)


def test_copies_of_rows_are_no_evidence() -> None:
    """A row that stands twice in a file was measured once: the answer is that without the copies."""
    data = rows([{"effect": "backlash", "owner": "joint4", "parameters": {"gap_rad": 1e-4}}])
    twice = data.select(np.append(np.arange(ROWS), np.arange(0, ROWS, 2)))
    once, found = diagnose(arm(), data), diagnose(arm(), twice)
    assert (found.verdict, found.sentence) == (once.verdict, once.sentence)
    assert found.sigma_mm == pytest.approx(once.sigma_mm, rel=1e-9)
    assert found.outliers == once.outliers
    assert [f.snr for f in found.effects] == pytest.approx([f.snr for f in once.effects], rel=1e-6)
    assert f"{ROWS // 2} rows are exact copies of others; each counts once" in found.notes


def test_a_name_that_a_set_can_do_without_is_dropped() -> None:
    found = one()
    assert found.search is not None
    assert found.state is not None
    spare = next(n for n in found.search.problem.names if n.key == ("coupling_ratio", "joint6<-joint5"))
    more = found.search.state((*found.state.names, spare), found.state)
    assert found.search.pruned(more).key == found.state.key
    assert found.search.pruned(found.state) is found.state


def test_two_effects_are_named_together() -> None:
    found = diagnose(arm(), rows([BACKLASH, RATIO]), sigma=SIGMA)
    assert found.verdict == "several"
    assert {f.label for f in found.effects} == {"backlash@joint4", "reduction_ratio@joint1"}


def test_the_same_rows_give_the_same_answer_on_two_threads() -> None:
    again = diagnose(arm(), rows([BACKLASH]), sigma=SIGMA, threads=2)
    assert json.dumps(one().to_json_dict()) == json.dumps(again.to_json_dict())


def test_test_poses_are_only_reported_on() -> None:
    other = diagnose(arm(), rows([BACKLASH]), sigma=SIGMA, test=rows([BACKLASH], seed=2).select(np.arange(ROWS) < 30))
    without, told = one().to_json_dict(), other.to_json_dict()
    for key in ("verdict", "effects", "ranking", "smallest", "sigma_mm"):
        assert told[key] == without[key]
    assert told["gap"][1]["test_rms_mm"] is not None


@pytest.mark.parametrize("gap", [0.0, 1.4e-4])
def test_a_richer_cause_that_fits_no_worse_stays_in_the_set(gap: float) -> None:
    """A base that turns about the vertical with time is joint 1 turning with a temperature that rises with time.

    Of the six parameters of a drift one is needed: that alone makes the simpler name no truer. A backlash too small to
    be given remains beside each of them, and refuses neither.
    """
    time = np.linspace(0.0, 3600.0, ROWS)
    drift = {"effect": "base_drift", "owner": "base", "parameters": {"rate_rz_rad_s": 2e-4 / 3600.0}}
    slack = {**BACKLASH, "parameters": {"gap_rad": gap}}
    data = rows([drift, slack], time=time, temperature=290.0 + 10.0 * time / 3600.0)
    found = diagnose(arm(), data, sigma=SIGMA)
    assert found.verdict == "one_of"
    assert found.state is not None
    assert bool(found.state.significant()) == (gap > 0)
    names = {(found.effects[0].effect, found.effects[0].owner), *found.effects[0].equivalents}
    assert {("thermal_offset", "joint1"), ("base_drift", "base")} <= names
    assert found.effects[0].grade == "B"


def test_of_what_follows_a_load_only_a_loud_name_is_sure() -> None:
    """Compliance, bending, torsion and tilt of neighbours look alike to 0.99: what is not known must show itself."""

    def proof(snr: float, effect: str) -> Evidence:
        (core,) = build_effects([{"effect": effect, "owner": "joint3"}], arm().core)
        plain = {"is_richer_needed": True, "is_plausible": True, "follows_loads": core.follows_loads}
        return Evidence(snr**2, 1, (0.5, 0.01), 1.0, (), **plain)

    def graded(effect: str, snr: float) -> str:
        return grade(
            proof(snr, effect), Hypothesis({"effect": effect, "owner": "joint3"}), (), something_remains=False
        )[0]

    assert [graded("backlash", snr) for snr in (12.0, 30.0)] == ["B", "A"]
    assert [graded("joint_compliance", snr) for snr in (12.0, 30.0, 60.0)] == ["B", "B", "A"]


def test_the_moment_of_a_step_and_the_order_of_a_wave_that_was_scanned_are_counted() -> None:
    library = build_library(arm(), rows([], time=np.arange(float(ROWS)))).names
    assert {name.effect for name in library if name.searched == 1} == {"base_step"}
    assert {"base_drift", "gear_harmonic", "backlash"} <= {name.effect for name in library if name.searched == 0}
    (wave,) = harmonics({"effect": "gear_harmonic", "owner": "joint2"}, arm(), rows([]), [11.5])
    assert wave.searched == 1


def test_an_excluded_name_is_not_given() -> None:
    found = diagnose(arm(), rows([BACKLASH]), sigma=SIGMA, exclude=["backlash@joint4"])
    assert not [f for f in found.effects if f.label == "backlash@joint4" or f.grade == "A"]
    assert not [r for r in found.ranking if r.name.startswith("backlash@joint4")]


def test_nothing_is_sure_where_a_name_was_excluded() -> None:
    """What was left out was not tried, and may be the cause."""
    data = rows([BACKLASH])
    sure, unsure = (diagnose(arm(), data, sigma=SIGMA, exclude=names).effects for names in ([], ["base_drift"]))
    assert [(f.label, f.grade) for f in sure] == [("backlash@joint4", "A")]
    assert [(f.label, f.grade) for f in unsure] == [("backlash@joint4", "B")]
    assert [because.reason for because in unsure[0].limits] == [Reason.NAMES_EXCLUDED]


def test_exclusions_are_effects_and_owners_that_there_are() -> None:
    assert parse_exclusions(["backlash", " coupling_ratio@joint5<-joint4"], arm()) == {
        ("backlash", None),
        ("coupling_ratio", "joint5<-joint4"),
    }
    with pytest.raises(InvalidInput, match="joint9"):
        parse_exclusions(["backlash@joint9"], arm())
    with pytest.raises(InvalidInput, match="slack"):
        parse_exclusions(["slack"], arm())


def test_the_library_holds_what_the_columns_can_show() -> None:
    plain = build_library(arm(), rows([]))
    keys = {name.key for name in plain.names}
    assert ("backlash", "joint3") in keys
    assert not {"base_drift", "thermal_offset"} & {effect for effect, _ in keys}
    timed = build_library(arm(), rows([], time=np.arange(float(ROWS))), [("backlash", None)])
    keys = {name.key for name in timed.names}
    assert {("base_drift", "base"), ("base_step", "base")} <= keys
    assert "backlash" not in {effect for effect, _ in keys}
    in_file = Robot(dict(arm().spec) | {"effects": [BACKLASH]})
    assert ("backlash", "joint4") not in {name.key for name in build_library(in_file, rows([])).names}


def test_repeats_show_the_noise_of_a_coordinate() -> None:
    """Pure error: 30 poses thrice are 180 degrees of freedom; 5 standard errors of such a deviation are 26 %."""
    data = rows([]).select(np.repeat(np.arange(30), 3))
    assert data.position is not None
    noisy = replace(data, position=data.position + SIGMA * np.random.default_rng(0).standard_normal((90, 3)))
    found = repeats(noisy)
    assert found is not None
    assert found[0] == pytest.approx(SIGMA, rel=5 / np.sqrt(2 * 180))
    assert found[1] == 180
    assert data.approach is not None
    turned = replace(noisy, approach=np.tile([[1.0], [-1.0], [1.0]], (30, 6)))
    found = repeats(turned)
    assert found is not None
    assert found[1] == 90  # those that came from the other side are no repeats
    assert repeats(rows([])) is None


def test_rows_that_are_off_one_after_the_other_are_no_outliers() -> None:
    wrong = np.array([3, 10, 11, 12, 13, 15, 50, 51, 53, 54])
    assert isolated_rows(wrong, rows([])).tolist() == [3, 50, 51, 53, 54]
    backwards = rows([], time=np.arange(float(ROWS))[::-1].copy())
    assert isolated_rows(wrong, backwards).tolist() == [3, 50, 51, 53, 54]
    assert isolated_rows(wrong[:1], backwards).tolist() == [3]
    shuffled = rows([], time=np.random.default_rng(0).permutation(float(ROWS) * np.arange(ROWS)))
    assert isolated_rows(wrong, shuffled).tolist() == wrong.tolist()


@pytest.mark.parametrize("size_mm", [1.0, 10.0, 1000.0])
def test_gross_rows_one_after_the_other_bend_no_model(size_mm: float) -> None:
    """Five of 110: few enough for outliers, and so many in a row that they were taken for an effect, and fitted."""
    data = rows([])
    assert data.position is not None
    off = np.random.default_rng(7).standard_normal((5, 3))
    position = data.position.copy()
    position[60:65] += 1e-3 * size_mm * off / np.linalg.norm(off, axis=1)[:, np.newaxis]
    found = diagnose(arm(), replace(data, position=position), sigma=SIGMA)
    assert set(found.outliers) >= set(range(60, 65))
    assert len(found.outliers) <= 7
    assert any("rows 60 to 64 were measured one after the other" in note for note in found.notes)
    exact = simulate(perturbed(arm(), seed=1), data, noise=0.0, seed=1)
    assert exact.position is not None
    left = found.model.poses(data)[:, :3, 3] - exact.position
    assert np.sqrt(np.mean(left**2)) < SIGMA


@pytest.mark.parametrize("count", [5, 8])
def test_rows_that_another_pose_was_measured_for_say_nothing_of_the_noise(count: int) -> None:
    """A list that slipped by one: metres, which bend the fit that a model without them is linear at."""
    data = rows([])
    assert data.position is not None
    position = data.position.copy()
    position[60 : 60 + count] = data.position[61 : 61 + count]
    found = diagnose(arm(), replace(data, position=position, sigma_position=None))
    assert found.verdict == "none"
    assert set(found.outliers) >= set(range(60, 60 + count))
    assert found.sigma_mm == pytest.approx(1e3 * SIGMA, rel=0.2)


def test_rows_without_their_measurements_keep_their_place() -> None:
    data = rows([])
    labels = ["low", "high"] * (ROWS // 2)
    touched = replace(data, observed_labels={"plane": labels})
    bare = without_measured(touched, np.array([3, 8]))
    assert np.flatnonzero(~bare.measured).tolist() == [3, 8]
    assert touched.measured.all()
    np.testing.assert_array_equal(bare.q, data.q)
    assert bare.observed_labels["plane"][2:5] == ["low", "", "low"]


def test_the_first_rows_that_are_all_off_hide_no_effect() -> None:
    """Five of 110 rows are few enough to pass for outliers, were they not the first five."""
    moved = {"effect": "base_step", "owner": "base", "parameters": {"at_s": 4.5, "step_x_mm": 0.5, "step_y_mm": -0.4}}
    found = diagnose(arm(), rows([moved], time=np.arange(float(ROWS))), exclude=["base_step"])
    assert found.verdict == "unexplained"
    assert found.unexplained is not None
    assert (found.unexplained.owner, found.unexplained.depends_on) == ("base", ("time_s",))


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_a_wrong_claim_of_the_noise_is_noticed_and_names_nothing(factor: float) -> None:
    found = diagnose(arm(), rows([], seed=3), sigma=factor * SIGMA)
    assert (found.verdict, found.effects) == ("none", [])
    assert found.sigma_source == "residual"
    assert ("too small" if factor < 1 else "too large") in found.sigma_note
    assert found.sigma_mm == pytest.approx(0.04, rel=0.25)


def test_rows_that_are_wrong_are_listed_and_hide_nothing() -> None:
    data = rows([BACKLASH])
    assert data.position is not None
    position = data.position.copy()
    wrong = [5, 40, 77]
    position[wrong] += [[1e-3, 0, 0], [0, -2e-3, 0], [0, 0, 1.5e-3]]
    found = diagnose(arm(), replace(data, position=position), sigma=SIGMA)
    assert found.outliers == wrong
    assert [f.label for f in found.effects] == ["backlash@joint4"]
    assert one().outliers == []


@pytest.mark.parametrize("sigma", [0.0, -1e-5, float("nan")])
def test_an_invalid_sigma_is_refused(sigma: float) -> None:
    with pytest.raises(InvalidInput, match="sigma must be a standard deviation above 0"):
        diagnose(arm(), rows([]), sigma=sigma)


def wavy(count: int, seed: int) -> Dataset:
    """An arm whose joint 2 errs by a wave of an order that the library does not list."""
    nominal = load_robot("staubli_rx160l")
    wave = {"effect": "gear_harmonic", "owner": "joint2", "order": 7}
    wave["parameters"] = {"amplitude_rad": 3e-4, "phase_rad": 0.5}
    true = perturbed(Robot(nominal.spec | {"effects": [wave]}), seed=1)
    return simulate(true, random_poses(nominal, count, seed=seed), noise=5e-5, seed=seed)


@pytest.mark.parametrize("excluded", ["gear_harmonic", "gear_harmonic@joint2"])
def test_what_is_excluded_is_not_found_by_a_scan_either(excluded: str) -> None:
    found = diagnose("staubli_rx160l", wavy(120, 2), exclude=[excluded])
    assert not any(f.effect == "gear_harmonic" and f.owner == "joint2" for f in found.effects)
    assert diagnose("staubli_rx160l", wavy(120, 2)).effects[0].label == "gear_harmonic@joint2"


def test_a_model_with_curves_is_diagnosed_on_other_rows() -> None:
    """Its joints get no second curve, with other knots than the first."""
    known = calibrate("staubli_rx160l", wavy(300, 1), effects=["geometry", "joint_profile@joint1"], checks=False).model
    problem = prepared_problem(known, wavy(120, 2), [], Noise((5e-5, 1e-4, 5e-5)), 1)
    assert [p["owner"] for p in Rivals(Search(problem)).every] == [f"joint{k}" for k in range(2, 7)]
    found = diagnose(known, wavy(120, 2), exclude=["gear_harmonic", "reduction_ratio"])
    curves = [e["owner"] for e in found.model.spec["effects"] if e["effect"] == "joint_profile"]
    assert curves.count("joint1") == 1
    record = found.model.record
    assert record is not None
    assert set(record.covered) >= {"q1_deg", "q6_deg", "payload_kg"}
