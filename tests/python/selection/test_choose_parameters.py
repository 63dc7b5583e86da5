# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The choice of parameters: folds, errors against fits of every fold, planted errors, the RX160L study in short."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest

from fastcal import Dataset, InvalidInput, Robot, calibrate, choose_parameters, load_robot, random_poses, simulate
from fastcal.calibration.problem import prepare
from fastcal.calibration.simulation import perturbed
from fastcal.selection.cross_validation import CrossValidation, fold_of_rows
from fastcal.selection.set_search import Searched, shortlist, stepwise
from fastcal_studies.staubli_rx160l import ALWAYS, OPTIONAL

ALIASES = {"joint1 theta", "joint1 d", "joint6 theta", "joint6 d", "joint6 a", "joint6 alpha"}  # of base and tool


@pytest.fixture(scope="module")
def rx160l() -> Robot:
    return load_robot("staubli_rx160l")


def planted(robot: Robot, errors: dict[str, float]) -> Robot:
    """The arm with errors such as {"joint2 a_mm": 0.3}."""
    spec = copy.deepcopy(robot.spec)
    for name, error in errors.items():
        joint, key = name.split(" ")
        spec["joints"][int(joint.removeprefix("joint")) - 1][key] += error
    return Robot(spec)


# What the RX160L study holds in every set, off by sizes that nobody would miss, and three more.
ERRORS = {f"{name}_deg": 0.05 for name in ALWAYS if name.endswith("theta")}
ERRORS |= {f"{name}_mm": 0.7 for name in ALWAYS if not name.endswith("theta")}
RATIO = "joint2 error"  # of reduction_ratio
MORE = {"joint4 a_mm": 0.4, "joint2 beta_deg": 0.04, "joint5 d_mm": -0.5}


def test_poses_that_repeat_stay_in_one_fold(rx160l: Robot) -> None:
    q = random_poses(rx160l, 23, seed=1)
    data = simulate(rx160l, np.vstack([q, q, q[:5]]))
    used = np.ones(51, dtype=bool)
    used[[3, 26, 49, 46]] = False  # all visits of pose 3, one of three of pose 0
    fold = fold_of_rows(data, used, 4, np.random.default_rng(0))
    assert (fold[~used] == -1).all()
    assert (fold[:23] == fold[23:46])[np.arange(23) != 3].all()
    assert (fold[[1, 2, 4]] == fold[[47, 48, 50]]).all()
    counts = np.bincount(fold[:23][used[:23]], minlength=4)
    assert sorted(counts) == [5, 5, 6, 6]
    np.testing.assert_array_equal(fold, fold_of_rows(data, used, 4, np.random.default_rng(0)))
    assert (fold != fold_of_rows(data, used, 4, np.random.default_rng(1))).any()
    with pytest.raises(InvalidInput, match="at most one a pose, 22; got 23"):
        fold_of_rows(data, used, 23, np.random.default_rng(0))
    with pytest.raises(InvalidInput, match="at least 2 folds"):
        fold_of_rows(data, used, 1, np.random.default_rng(0))


def fold_errors(robot: Robot, data: Dataset, parameters: list[str], effects: str, fold: np.ndarray) -> float:
    """EV_K [m^2 a coordinate] by a nonlinear fit without each fold."""
    errors = []
    for k in range(fold.max() + 1):
        model = calibrate(robot, data.select(fold != k), parameters=parameters, effects=effects, loss="none").model
        held_out = data.select(fold == k)
        assert held_out.position is not None
        errors.append(np.mean((model.forward(held_out.q)[:, :3, 3] - held_out.position) ** 2))
    return float(np.mean(errors))


@pytest.mark.parametrize(
    ("name", "effects", "chosen"),
    [
        ("staubli_rx160l", "geometry", ["joint2 theta", "joint3 theta", "joint2 beta", "joint4 a"]),
        (
            "staubli_rx160l",
            "geometry,reduction_ratio@joint2",
            ["joint2 theta", "joint3 a", RATIO],
        ),
        ("siasun_sr210d", "geometry", ["joint2 theta", "joint3 x", "joint3 ry", "joint5 rx"]),
    ],
)
def test_the_error_of_a_set_is_that_of_a_nonlinear_fit_without_each_fold(
    name: str, effects: str, chosen: list[str]
) -> None:
    """Linear in what the folds change, which is of the noise's size."""
    robot = load_robot(name)
    data = simulate(perturbed(robot, seed=1), random_poses(robot, 60, seed=2), noise=1e-4, seed=3)
    start = prepare(robot, data, effects=effects)
    judge = CrossValidation(start, data, [], folds=5, deals=1, seed=4, loss="none", threads=1)
    fold = fold_of_rows(data, np.ones(60, dtype=bool), 5, np.random.default_rng(4))
    assert set(chosen) <= set(judge.names), judge.names
    error, _ = judge.refitted([judge.names.index(each) for each in chosen])
    assert judge.sigma is not None
    assert judge.sigma == pytest.approx(calibrate(robot, data, effects=effects, loss="none").sigma)
    assert error * judge.sigma**2 == pytest.approx(fold_errors(robot, data, chosen, effects, fold), rel=1e-4)


def test_what_is_planted_is_chosen_and_no_copy_of_base_or_tool(rx160l: Robot) -> None:
    true = planted(rx160l, ERRORS | MORE)
    data = simulate(true, random_poses(rx160l, 90, seed=5), noise=2e-5, seed=6)
    test = simulate(true, random_poses(rx160l, 40, seed=7))
    choice = choose_parameters(rx160l, data, OPTIONAL, always=ALWAYS, folds=3, test=test)
    assert choice.search == "exhaustive"
    assert choice.evaluated == 2**15
    assert {"joint4 a", "joint2 beta", "joint5 d", *ALWAYS} <= set(choice.parameters)
    assert not ALIASES & set(choice.parameters)
    assert len(choice.table) == 20
    assert [c.error for c in choice.table] == sorted(c.error for c in choice.table)
    assert choice.table[0].error < choice.full.error
    assert choice.result.test is not None
    assert choice.result.test.after is not None
    assert choice.result.test.after.rms < 2e-5
    again = choose_parameters(rx160l, data, OPTIONAL, always=ALWAYS, folds=3)
    assert json.dumps(again.to_json_dict()) == json.dumps(choice.to_json_dict())
    assert choice.rms_mm(choice.table[0]) == pytest.approx(0.02, rel=0.15)


def test_by_default_all_that_the_data_determine_is_optional(rx160l: Robot) -> None:
    """Rank 27 from points: 9 of base and tool, 18 of the joints, so all 2^18 sets."""
    data = simulate(planted(rx160l, ERRORS | MORE), random_poses(rx160l, 60, seed=8), noise=2e-5, seed=9)
    choice = choose_parameters(rx160l, data, deals=1, refits=3)
    assert choice.evaluated == 2**18
    assert len(choice.full.parameters) == 18
    names = {f"{name.rsplit('_', 1)[0]}" for name in MORE | ERRORS}
    assert names <= set(choice.parameters)
    step = choose_parameters(rx160l, data, deals=1, refits=3, search="stepwise")
    assert step.search == "stepwise"
    assert step.evaluated < 2000
    assert names <= set(step.parameters)
    assert step.table[0].searched_error == pytest.approx(choice.table[0].searched_error, rel=0.01)


def test_stepwise_ends_where_no_single_step_helps(rx160l: Robot) -> None:
    data = simulate(perturbed(rx160l, seed=3), random_poses(rx160l, 40, seed=10), noise=2e-4, seed=11)
    start = prepare(rx160l, data, effects="geometry")
    judge = CrossValidation(start, data, [], folds=4, deals=2, seed=0, loss="tukey", threads=1)
    sets = judge.linearized(judge.identifiable)
    found = stepwise(sets)
    best = found.members[shortlist(found, 1)[0]]
    beside = sets.of(best ^ np.eye(len(best), dtype=bool)).error
    assert (beside > found.error.min()).all()
    np.testing.assert_allclose(sets.of(found.members).error, found.error, rtol=1e-12)


def test_one_standard_error_takes_the_smallest_set_within_it(rx160l: Robot) -> None:
    data = simulate(planted(rx160l, ERRORS | MORE), random_poses(rx160l, 60, seed=12), noise=1e-4, seed=13)
    least = choose_parameters(rx160l, data, OPTIONAL, always=ALWAYS, folds=5)
    small = choose_parameters(rx160l, data, OPTIONAL, always=ALWAYS, folds=5, rule="one_standard_error")
    assert len(small.parameters) < len(least.parameters)
    best = small.table[0]
    taken = next(c for c in small.table if c.parameters == small.parameters)
    assert best.error == pytest.approx(least.table[0].error, rel=1e-12)
    assert taken.error <= best.error + best.standard_error


def test_of_sets_that_tie_the_smallest_is_listed() -> None:
    members = np.array([[1, 1, 1], [1, 0, 0], [0, 1, 1], [0, 0, 1], [1, 1, 0]], dtype=bool)
    error = np.array([2.0, 2.0 * (1 + 1e-13), 1.0, 3.0, 2.0])
    searched = Searched(members, error, np.full(5, 1.0))
    assert shortlist(searched, 9) == [2, 1, 3]
    assert shortlist(searched, 2) == [2, 1]
    assert shortlist(searched, 9, one_standard_error=True) == [2, 1, 4, 0]
    assert shortlist(searched, 2, one_standard_error=True) == [2, 1]


def test_calibrate_identifies_the_named_parameters_alone(rx160l: Robot) -> None:
    data = simulate(perturbed(rx160l, seed=1), random_poses(rx160l, 30, seed=2), noise=5e-5, seed=3)
    result = calibrate(rx160l, data, parameters=["joint3 theta", "joint2 a"])
    joints = [(p.owner, p.name) for p in result.parameters if p.owner not in ("base", "tool")]
    assert joints == [("joint2", "a_mm"), ("joint3", "theta_deg")]
    assert len(result.parameters) == 2 + 6 + 3
    for i, (joint, nominal) in enumerate(zip(result.model.spec["joints"], rx160l.spec["joints"], strict=True), 1):
        for key in ("theta_deg", "d_mm", "a_mm", "alpha_deg", "beta_deg"):
            assert (joint[key] == nominal[key]) == ((i, key) not in {(2, "a_mm"), (3, "theta_deg")})
    with pytest.raises(InvalidInput, match="there is no parameter 'joint9 a' to identify; there are base x, "):
        calibrate(rx160l, data, parameters=["joint9 a"])


def test_a_prior_is_fitted_in_every_fold(rx160l: Robot) -> None:
    """Few and poor points: the prior holds the ratio in every fold; without it the ratio spoils what is held out.

    The noise is claimed, so that all folds weigh the prior alike; too large a claim must not shift the weights.
    """
    data = simulate(planted(rx160l, ERRORS), random_poses(rx160l, 15, seed=15), noise=5e-3, seed=16)
    data = replace(data, sigma_position=np.full((15, 3), 7.5e-3))
    fold = fold_of_rows(data, np.ones(15, dtype=bool), 5, np.random.default_rng(0))
    found = {}
    for end in ("", ":prior=yes"):
        effects = f"geometry,reduction_ratio@joint2{end}"
        start = prepare(rx160l, data, effects=effects, parameters=["joint2 theta", RATIO])
        judge = CrossValidation(start, data, [], folds=5, deals=1, seed=0, loss="none", threads=1)
        theta, ratio = judge.names.index("joint2 theta"), judge.names.index(RATIO)
        found[end] = judge.refitted([theta, ratio])[0] / judge.refitted([theta])[0]
        both, alone = (
            fold_errors(rx160l, data, chosen, effects, fold) for chosen in (["joint2 theta", RATIO], ["joint2 theta"])
        )
        assert found[end] == pytest.approx(both / alone, rel=2e-3)
    assert found[":prior=yes"] < 0.98 * found[""]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"optional": ["joint2 a", "joint7 a"]}, "there is no parameter 'joint7 a'"),
        ({"optional": ["joint2 a"], "always": ["joint2 a"]}, "'joint2 a' is named twice"),
        ({"optional": ["tool x"]}, "base and tool are always identified, got 'tool x'"),
        ({"search": "genetic"}, "search must be one of auto, exhaustive, stepwise, got 'genetic'"),
        ({"rule": "most"}, "rule must be one of least, one_standard_error, got 'most'"),
        ({"refits": 0}, "refits must be at least 1"),
        ({"deals": 0}, "deals must be at least 1"),
        ({"folds": 41}, "at most one a pose, 40; got 41"),
        ({"always": ["joint7 a"]}, "there is no parameter 'joint7 a'"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(rx160l: Robot, given: dict[str, object], message: str) -> None:
    data = simulate(rx160l, random_poses(rx160l, 40, seed=14), noise=5e-5)
    with pytest.raises(InvalidInput, match=message):
        choose_parameters(rx160l, data, **given)  # type: ignore[arg-type]


def test_the_rx160l_study_in_short(rx160l: Robot) -> None:
    """The paper's choice with noise alone, and errors of predictions in place of measured ones."""
    true = planted(rx160l, ERRORS | MORE)
    ratios, counts = [], []
    for seed in range(12):
        q = random_poses(rx160l, 130, seed=seed)
        data, exact = simulate(true, q[:90], noise=1.8e-4, seed=seed), simulate(true, q[90:])
        choice = choose_parameters(rx160l, data, OPTIONAL, always=ALWAYS, folds=3, refits=3, test=exact)
        full = calibrate(rx160l, data, parameters=[*ALWAYS, *OPTIONAL], test=exact)
        assert choice.result.test is not None
        assert full.test is not None
        assert choice.result.test.after is not None
        assert full.test.after is not None
        ratios.append(choice.result.test.after.mean / full.test.after.mean)
        counts.append((len(choice.parameters), len(choice.result.parameters), len(full.parameters)))
    assert np.median(ratios) < 0.99
    assert np.max(counts, axis=0)[0] < 24
    assert np.median([free - full for _, free, full in counts]) <= -3
