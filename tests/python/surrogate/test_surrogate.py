# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is missing without a name is placed and added, what is not missing is not, and a model keeps it."""

import copy
from dataclasses import replace
from itertools import chain, repeat
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal import _core
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.evaluation import evaluate
from fastcal.calibration.prediction import predict
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.diagnosis.remaining_surrogate import thresholds
from fastcal.effects import registered
from fastcal.effects.registered import States
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.surrogate import AddedSurrogate, add_surrogate, formulas
from fastcal.surrogate.candidates import candidates
from fastcal.units import to_si

NOISE = to_si(0.03, "mm")


def hooked(states: States) -> np.ndarray[Any, Any]:
    """Joint 3 errs by 0.3 mrad times a bent function of its position, to the side that it came from."""
    xi = np.zeros((len(states.q), 6, 1))
    assert states.approach is not None
    xi[:, 5, 0] = 3e-4 * states.approach[:, 2] * np.exp(np.sin(states.q[:, 2]))
    return xi


@pytest.fixture(scope="module")
def arm() -> Robot:
    return load_robot("ur5")


@pytest.fixture(scope="module")
def poses(arm: Robot) -> Dataset:
    random = np.random.default_rng(12)
    return Dataset.from_arrays(
        random.uniform(-2.5, 2.5, (320, arm.joint_count)),
        payload=random.choice([0.0, 3.0], 320),
        time=np.arange(320) * 20.0,
        approach=random.choice([-1.0, 1.0], (320, arm.joint_count)),
    )


@pytest.fixture(scope="module")
def hidden(arm: Robot, poses: Dataset) -> tuple[CalibrationResult, Dataset, Dataset]:
    """A calibrated arm that lacks `hooked`, the rows that it was calibrated on, and others."""
    fastcal.register_effect(
        "hooked", owners=["joint3"], parameters=[("size", "1", 1.0, "share")], basis=hooked, columns=["approach"]
    )
    spec = copy.deepcopy(perturbed(arm, seed=3).spec)
    spec["effects"] = [{"effect": "hooked", "owner": "joint3", "parameters": {"size": 1.0}}]
    measured = simulate(Robot(spec), poses, noise=NOISE, seed=4)
    registered._effects.pop("hooked")
    train, test = measured.select(slice(0, None, 2)), measured.select(slice(1, None, 2))
    return calibrate(arm, train, loss="huber"), train, test


@pytest.fixture(scope="module")
def added(hidden: tuple[CalibrationResult, Dataset, Dataset]) -> AddedSurrogate:
    found, train, _ = hidden
    return add_surrogate(found.model, train, noise=(found.sigma, 1e-4, found.sigma), thresholds=thresholds())


def rms(model: Robot, data: Dataset) -> float:
    after = evaluate(model, data).after
    assert after is not None
    return after.rms


def test_it_is_placed_and_closes_the_gap_on_other_poses(
    hidden: tuple[CalibrationResult, Dataset, Dataset], added: AddedSurrogate
) -> None:
    found, _, test = hidden
    assert added.added[0] == "surrogate@joint3"
    assert added.owner == "joint3"
    assert "approach3" in added.depends_on
    assert added.share > 0.8
    before, after = rms(found.model, test), rms(added.model, test)
    floor = NOISE * 3**0.5
    assert before > 3 * floor
    assert before**2 - after**2 > 0.9 * (before**2 - floor**2)


def test_the_geometry_keeps_its_numbers(
    hidden: tuple[CalibrationResult, Dataset, Dataset], added: AddedSurrogate
) -> None:
    old, new = hidden[0].model.spec, added.model.spec
    assert new["joints"] == old["joints"]
    assert (new["base"], new["tool"]) == (old["base"], old["tool"])


def test_it_fades_where_the_data_end(hidden: tuple[CalibrationResult, Dataset, Dataset], added: AddedSurrogate) -> None:
    q = np.zeros((1, 6))
    q[0, 2] = 6.0
    q = np.vstack([q, 0.2 * np.ones(6)])
    approach = np.ones((2, 6))
    spec = copy.deepcopy(added.model.spec)
    spec["effects"] = [e for e in spec["effects"] if e["owner"] == "joint3" and "q3" in e["inputs"]]
    moved = Robot(spec).forward(q, approach=approach)[:, :3, 3] - hidden[0].model.forward(q)[:, :3, 3]
    assert np.linalg.norm(moved[0]) < 1e-12
    assert np.linalg.norm(moved[1]) > 1e-5


def test_a_saved_model_predicts_the_same_with_its_uncertainty(
    hidden: tuple[CalibrationResult, Dataset, Dataset], added: AddedSurrogate, tmp_path: Any
) -> None:
    found, _, test = hidden
    added.model.save(tmp_path / "model.yaml")
    loaded = load_robot(tmp_path / "model.yaml")
    np.testing.assert_array_equal(loaded.poses(test), added.model.poses(test))
    kept, plain = predict(loaded, test), predict(found.model, test)
    assert (kept.sigma_position >= 0.95 * plain.sigma_position).all()  # the geometry moves a little with it
    own = loaded.surrogate_deviation(loaded.samples(test))
    truth = loaded.poses(test)[:, :3, 3] - np.asarray(test.position)
    assert 0.1 * NOISE < float(np.sqrt((own**2).mean())) < NOISE
    pulls = truth / np.sqrt(kept.sigma_position**2 + NOISE**2)
    # What it explains now was noise of the joints to the calibration: the geometry's deviations still hold that.
    assert 0.75 < float(pulls.std()) < 1.35


def test_nothing_is_added_where_nothing_is_missing(arm: Robot, poses: Dataset) -> None:
    for seed in (1, 2):
        measured = simulate(perturbed(arm, seed=seed), poses.select(slice(0, 200)), noise=NOISE, seed=seed)
        found = calibrate(arm, measured, loss="huber")
        added = add_surrogate(found.model, measured, noise=(found.sigma, 1e-4, found.sigma), thresholds=thresholds())
        assert added.added == ()
        assert added.model is found.model
        assert added.evidence < 30


def test_what_moves_otherwise_is_added_beside_a_motion_in_time(
    hidden: tuple[CalibrationResult, Dataset, Dataset],
) -> None:
    """The base's motion is clearer, and may not go on as it did; the joint's curve is one all the same."""
    found, train, _ = hidden
    assert train.position is not None
    way = np.sin(np.linspace(0, 3 * np.pi, len(train)))[:, np.newaxis]
    data = replace(train, time=np.arange(len(train)) * 10.0, position=train.position + 3e-4 * way)
    noise = (found.sigma, 1e-4, found.sigma)
    first, other = (
        add_surrogate(found.model, data, noise=noise, thresholds=replace(thresholds(), later=later))
        for later in (-np.inf, 1e9)
    )
    assert (first.owner, first.depends_on) == ("base", ("time",))
    assert other.owner == "joint3"
    assert other.added
    assert not any("time" in entry.get("inputs", "") for entry in other.model.entries)


def test_a_motion_in_time_leads_in_the_last_rows_beside_what_is_found_before(
    hidden: tuple[CalibrationResult, Dataset, Dataset],
) -> None:
    """A base that sways by .2 mm: what it did tells nothing of the rows measured later; the joint's curve does."""
    found, data, _ = hidden
    assert data.position is not None
    way = np.sin(np.linspace(0, 3 * np.pi, len(data)))[:, np.newaxis]
    data = replace(data, position=data.position + 1.2e-4 * way)
    noise = (found.sigma, 1e-4, found.sigma)
    either, moved = (
        add_surrogate(found.model, data, noise=noise, thresholds=replace(thresholds(), later=later))
        for later in (-np.inf, 2.0)
    )
    assert set(either.added) >= {"surrogate@joint3", "surrogate@base"}
    assert "surrogate@base" not in moved.added
    assert "surrogate@joint3" in moved.added


def test_rows_left_out_are_nearer_by_what_is_told(hidden: tuple[CalibrationResult, Dataset, Dataset]) -> None:
    found, train, _ = hidden
    folds = [np.arange(len(train)) % 5, np.arange(len(train)) * 5 // len(train)]
    noise = (found.sigma, 1e-4, found.sigma)
    both, one = (
        add_surrogate(found.model, train, noise=noise, thresholds=thresholds(), folds=of) for of in (folds, folds[:1])
    )
    assert both.less.shape == (len(train),)
    error = (train.position - found.model.poses(train)[:, :3, 3]) / found.sigma
    before = float(np.mean(np.sum(error**2, axis=1)))
    for added in (both, one):
        assert 0.5 * (1 - added.held_out**2) < added.less.mean() / before < 1.5 * (1 - added.held_out**2)
    assert (both.less != one.less).any()


def test_the_scale_of_the_noise_is_not_believed(hidden: tuple[CalibrationResult, Dataset, Dataset]) -> None:
    found, train, _ = hidden
    third = add_surrogate(found.model, train, noise=(found.sigma / 3, 1e-4, found.sigma), thresholds=thresholds())
    assert third.owner == "joint3"
    assert third.added


def test_few_poses_choose_nothing_by_chance(arm: Robot, poses: Dataset) -> None:
    measured = simulate(perturbed(arm, seed=5), poses.select(slice(0, 30)), noise=NOISE, seed=5)
    found = calibrate(arm, measured, loss="none")
    assert add_surrogate(found.model, measured, noise=(NOISE, 1e-4, NOISE), thresholds=thresholds()).added == ()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_choice_that_saw_the_poses_left_out_is_made_again_without_them(arm: Robot, poses: Dataset, seed: int) -> None:
    """Of hundreds of blocks one always seems to predict noise, if those that are left out took part in its choice."""
    measured = simulate(perturbed(arm, seed=seed), poses.select(slice(0, 110)), noise=NOISE, seed=seed)
    found = calibrate(arm, measured, loss="huber")
    lenient = replace(thresholds(), evidence=0.0, held_out=1.0)
    noise = (found.sigma, 1e-4, found.sigma)
    assert add_surrogate(found.model, measured, noise=noise, thresholds=replace(lenient, lead=-np.inf)).added
    added = add_surrogate(found.model, measured, noise=noise, thresholds=lenient)
    assert added.added == ()
    assert added.held_out == 1.0


@pytest.mark.parametrize("near", [True, False])
def test_lengths_to_an_anchor_get_nearer_or_nothing_is_added(
    hidden: tuple[CalibrationResult, Dataset, Dataset], arm: Robot, near: bool
) -> None:
    """Lengths leave much of the geometry open; the anchor moves with it, and what goes too far is not added."""
    _, train, test = hidden
    anchor = np.array([1.5, 0.8, 0.4]) if near else np.array([40.0, 9.0, 3.0])

    def lengths(points: Dataset) -> Dataset:
        assert points.position is not None
        length = np.linalg.norm(points.position - anchor, axis=1)
        return Dataset.from_arrays(
            points.q, payload=points.payload, time=points.time, approach=points.approach, distance=length, robot=arm
        )

    measured, others = lengths(train), lengths(test)
    found = calibrate(arm, measured)
    assert found.status == "converged"  # a factor of these rows once broke a singular value decomposition
    places = np.concatenate(list(found.unknowns.values()))
    added = add_surrogate(found.model, measured, noise=(NOISE, 1e-4, NOISE), thresholds=thresholds(), unknowns=places)
    before = evaluate(found.model, others, unknowns=found.unknowns).kinds["length"].statistics[1]
    owner = next(iter(found.unknowns))
    after = evaluate(added.model, others, unknowns={owner: added.unknowns}).kinds["length"].statistics[1]
    assert before is not None
    assert after is not None
    assert after.rms <= before.rms
    if added.added:
        stale = evaluate(added.model, others, unknowns=found.unknowns).kinds["length"].statistics[1]
        assert stale is not None
        assert stale.rms > after.rms  # what a caller that keeps the old place would get
    else:
        assert np.array_equal(added.unknowns, places)


def test_a_surrogate_that_leaves_more_is_not_added(
    hidden: tuple[CalibrationResult, Dataset, Dataset], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its shift comes from one linearization; what the whole model leaves decides."""
    found, train, _ = hidden
    sizes = chain([1.0], repeat(2.0))  # without surrogates, and with however many
    monkeypatch.setattr("fastcal.surrogate.adding.misfit", lambda *_: next(sizes))
    added = add_surrogate(found.model, train, noise=(found.sigma, 1e-4, found.sigma), thresholds=thresholds())
    assert added.added == ()
    assert added.owner == "joint3"
    assert added.model is found.model


def test_formulas_name_what_describes_the_curve() -> None:
    random = np.random.default_rng(0)
    side, load, q = random.choice([-1.0, 1.0], 300), random.normal(0, 50, 300), random.uniform(-3, 3, 300)
    (first, *_) = formulas(("approach3", "load3"), np.column_stack([side, load]), (side * np.abs(load))[:, np.newaxis])
    assert (first.text, round(first.share, 6)) == ("approach3 times |load3|", 1)
    (first, *_) = formulas(("q2",), q[:, np.newaxis], np.sin(2.5 * q + 0.4)[:, np.newaxis])
    assert first.text == "sine of 2.5 cycles a turn of q2"
    assert first.share == pytest.approx(1)
    (first, *_) = formulas(("load2",), load[:, np.newaxis], np.tanh(load / 20)[:, np.newaxis])
    assert first.text.startswith("tanh(load2")
    assert formulas(("q2",), np.zeros((0, 1)), np.zeros((0, 1))) == []


def test_a_load_that_is_rounding_is_nothing_to_depend_on(arm: Robot, poses: Dataset) -> None:
    """Joint 1 is upright, joint 6 carries nothing off its axis: their loads, 1e-20 and 1e-15 N m, explained noise."""
    depends_on = {
        name for candidate in candidates(arm, poses.select(slice(0, 50)), threads=2) for name in candidate.inputs
    }
    assert {name for name in depends_on if name.startswith("load")} == {"load2", "load3", "load4", "load5"}


def test_inputs_do_not_depend_on_the_threads(arm: Robot, poses: Dataset) -> None:
    core, names = arm.error_model, "load2 down3_z x range q4"
    alone = _core.surrogate_inputs(core, arm.samples(poses), core.start, names)
    assert alone.shape == (len(poses), 5)
    for threads in (2, 3, 8):
        np.testing.assert_array_equal(
            _core.surrogate_inputs(core, arm.samples(poses), core.start, names, threads), alone
        )


def test_a_target_may_give_by_the_payload_and_how_it_is_held(arm: Robot, poses: Dataset) -> None:
    data = replace(poses.select(slice(0, 50)), payload=np.linspace(0.0, 5.0, 50))
    names = "weight_x weight_y weight_z gravity_x gravity_y gravity_z"
    found = _core.surrogate_inputs(arm.error_model, arm.samples(data), arm.error_model.start, names)
    np.testing.assert_allclose(found[:, :3], data.payload[:, np.newaxis] * found[:, 3:], atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(found[:, :3], axis=1), data.payload, atol=1e-12)
    for rows, tried in ((data, True), (replace(data, payload=np.full(50, 5.0)), False)):
        inputs = {name for candidate in candidates(arm, rows, threads=1) for name in candidate.inputs}
        assert ("weight_x" in inputs) is tried
