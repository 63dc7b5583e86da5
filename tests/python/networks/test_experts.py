# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Each kind of residual model beside an independent implementation, and packed and unpacked without a change."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF
from sklearn.neighbors import KNeighborsRegressor

from fastcal.correction import Inputs
from fastcal.correction.applicability import Guard, coordinates, fade, margins
from fastcal.correction.correction import limited, spread
from fastcal.correction.dense import DenseNet
from fastcal.correction.experts import AxisNetworks, BoostedTrees, ClassifiedNetworks, Expert, Neighbours
from fastcal.correction.inputs import Scaling
from fastcal.correction.joints import GaussianProcess, JointNetwork, Phases
from fastcal.correction.packing import Tensors
from fastcal.correction.serialize import _KINDS
from fastcal.correction.trees import Trees
from fastcal.correction.uncertainty import Uncertainty
from fastcal.errors import InvalidInput

torch = pytest.importorskip("torch")
from fastcal.networks.device import one_thread  # noqa: E402 - needs what was asked for above
from fastcal.networks.rivals import trees_of  # noqa: E402 - needs what was asked for above

FloatArray = NDArray[np.float64]
N, JOINTS = 40, 3


def random_inputs(seed: int = 0) -> Inputs:
    random = np.random.default_rng(seed)
    return Inputs(
        random.uniform(-1, 1, (N, JOINTS)), random.choice([0.0, 5.0], N), random.standard_normal((N, 6, JOINTS))
    )


def net(inputs: int, outputs: int, seed: int, activation: str = "tanh") -> DenseNet:
    random = np.random.default_rng(seed)
    sizes = [inputs, 5, 4, outputs]
    weights = tuple(random.standard_normal(pair) for pair in pairwise(sizes))
    biases = tuple(random.standard_normal(size) for size in sizes[1:])
    return DenseNet(weights, biases, (activation, activation, "linear"), (0.2, 0.3, 0.0))


def axes(seed: int, inputs: Inputs) -> AxisNetworks:
    return AxisNetworks(Scaling.of(inputs), tuple(net(JOINTS + 1, 1, seed + k) for k in range(3)), 2e-4)


def experts(inputs: Inputs) -> list[Expert]:
    scaling = Scaling.of(inputs)
    phases = Phases(np.ones(JOINTS), np.zeros(JOINTS), 2.5, 0.4)
    random = np.random.default_rng(5)
    target = np.sin(inputs.q.sum(axis=1))
    with one_thread():
        boosted = HistGradientBoostingRegressor(max_iter=5, min_samples_leaf=3).fit(scaling(inputs), target)
        classifier = HistGradientBoostingClassifier(max_iter=5, min_samples_leaf=3).fit(scaling(inputs), target > 0)
    trees = trees_of(boosted)
    rows = np.hstack([phases(inputs), phases.load(inputs)])
    weights = random.standard_normal((N, JOINTS)), random.standard_normal((N, 3))
    return [
        axes(0, inputs),
        ClassifiedNetworks(trees_of(classifier), axes(0, inputs), axes(10, inputs)),
        BoostedTrees(scaling, (trees, trees, trees), 3e-4),
        Neighbours(scaling, scaling(inputs), random.standard_normal((N, 3)), 4),
        JointNetwork(phases, random.standard_normal((JOINTS, 8)), 10.0, net(2 * JOINTS + 1, JOINTS + 3, 3), 1e-4),
        GaussianProcess(phases, rows, *weights, (1.0, 0.5, 0.2), (0.3, 1.2)),
    ]


def test_every_kind_survives_packing() -> None:
    inputs = random_inputs()
    found = experts(inputs)
    assert {expert.kind for expert in found} == set(_KINDS)
    for expert in found:
        settings, tensors = expert.pack()
        reader = Tensors(tensors)
        again = _KINDS[expert.kind].unpack(settings, reader)
        reader.done()
        other = random_inputs(1)
        assert np.array_equal(again.displacement(other), expert.displacement(other))


@pytest.mark.parametrize("activation", ["tanh", "relu", "sigmoid", "prelu"])
def test_a_network_predicts_what_torch_predicts(activation: str) -> None:
    ours = net(4, 2, 7, activation)
    layers: list[torch.nn.Module] = []
    makers: dict[str, Callable[[float], torch.nn.Module]] = {
        "tanh": lambda slope: torch.nn.Tanh(),
        "relu": lambda slope: torch.nn.ReLU(),
        "sigmoid": lambda slope: torch.nn.Sigmoid(),
        "prelu": lambda slope: torch.nn.PReLU(init=slope, dtype=torch.float64),
    }
    for W, b, name, slope in zip(ours.weights, ours.biases, ours.activations, ours.slopes, strict=True):
        linear = torch.nn.Linear(*W.shape, dtype=torch.float64)
        linear.weight.data, linear.bias.data = torch.tensor(W.T.copy()), torch.tensor(b)
        layers += [linear] if name == "linear" else [linear, makers[name](slope)]
    x = np.random.default_rng(8).standard_normal((9, 4))
    with torch.no_grad():
        theirs = torch.nn.Sequential(*layers)(torch.tensor(x)).numpy()
    np.testing.assert_allclose(ours(x), theirs, rtol=1e-12, atol=1e-14)


def test_trees_predict_what_scikit_learn_predicts() -> None:
    random = np.random.default_rng(0)
    x = random.standard_normal((300, 4))
    y = np.sin(x[:, 0]) + x[:, 1] ** 2
    with one_thread():
        regressor = HistGradientBoostingRegressor(max_iter=40, max_depth=4).fit(x, y)
        classifier = HistGradientBoostingClassifier(max_iter=20).fit(x, y > 1)
        np.testing.assert_allclose(trees_of(regressor)(x), regressor.predict(x), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(trees_of(classifier)(x), classifier.decision_function(x), rtol=1e-12, atol=1e-12)


def test_trees_whose_indices_point_nowhere_or_in_a_circle_do_no_harm() -> None:
    nodes = np.array([[0, 0, 1, 1, 0], [0, 0, 0, 0, 5.0]])
    circle = Trees.unpack(Tensors({"nodes": nodes, "roots": np.zeros(1), "baseline": np.zeros(1)}), 2)
    assert np.isfinite(circle(np.ones((3, 2)))).all()
    for place, value in (((0, 0), 2.0), ((0, 2), 9.0), ((1, 3), 0.5), ((0, 0), -1.0)):
        bad = nodes.copy()
        bad[place] = value
        with pytest.raises(InvalidInput, match="points nowhere"):
            Trees.unpack(Tensors({"nodes": bad, "roots": np.zeros(1), "baseline": np.zeros(1)}), 2)


def test_neighbours_are_those_of_scikit_learn() -> None:
    inputs, other = random_inputs(), random_inputs(1)
    scaling = Scaling.of(inputs)
    residuals = np.random.default_rng(2).standard_normal((N, 3))
    ours = Neighbours(scaling, scaling(inputs), residuals, 5).displacement(other)
    theirs = KNeighborsRegressor(5, weights="distance").fit(scaling(inputs), residuals).predict(scaling(other))
    np.testing.assert_allclose(ours, theirs, rtol=1e-10)


def test_the_gaussian_process_is_that_of_scikit_learn_where_it_has_no_joints_of_its_own() -> None:
    """With a = b = 0 it is an ordinary process over sines and cosines: 2 sin^2(d/2) sums to half the squared chord."""
    inputs, other = random_inputs(), random_inputs(1)
    phases = Phases(np.ones(JOINTS), np.zeros(JOINTS), 2.5, 0.4)
    y = np.random.default_rng(2).standard_normal((N, 3))
    chords, elsewhere = (phases.features(rows) for rows in (inputs, other))
    length = 0.8
    theirs = GaussianProcessRegressor(RBF(length), alpha=0.01, optimizer=None).fit(chords, y)
    rows = np.hstack([phases(inputs), phases.load(inputs)])
    K = RBF(length)(chords) + 0.01 * np.eye(N)
    weights = np.zeros((N, JOINTS)), np.linalg.solve(K, y)
    ours = GaussianProcess(phases, rows, *weights, (0.0, 0.0, 1.0), (1.0, length))
    np.testing.assert_allclose(ours.displacement(other), theirs.predict(elsewhere), rtol=1e-6, atol=1e-9)


def test_joint_errors_move_the_tool_through_the_jacobian() -> None:
    """A network of zeros and one curve: e_2 = unit a sin(3 q_2) / (1 + (3 / corner)^2)."""
    inputs = random_inputs()
    curves = np.zeros((JOINTS, 8))
    curves[1, 2] = 0.7
    silent = DenseNet((np.zeros((2 * JOINTS + 1, JOINTS + 3)),), (np.zeros(JOINTS + 3),), ("linear",), (0.0,))
    phases = Phases(np.ones(JOINTS), np.zeros(JOINTS), 0.0, 0.0)
    said = JointNetwork(phases, curves, 10.0, silent, 1e-4).displacement(inputs)
    error = 1e-4 * 0.7 * np.sin(3 * inputs.q[:, 1]) / 1.09
    np.testing.assert_allclose(said, error[:, np.newaxis] * inputs.J_tool_q[:, :3, 1], rtol=1e-12)


def test_a_column_that_never_varied_has_no_influence() -> None:
    inputs = random_inputs()
    still = Inputs(inputs.q, np.full(N, 3.0), inputs.J_tool_q)
    scaling = Scaling.of(still)
    heavy = Inputs(inputs.q, np.full(N, 30.0), inputs.J_tool_q)
    assert np.array_equal(scaling(still), scaling(heavy))


def test_the_fade_is_smooth_between_one_and_zero() -> None:
    np.testing.assert_allclose(fade(np.array([-1.0, 0.0, 0.5, 1.0, 3.0])), [1, 1, 0.5, 0, 0], atol=1e-15)


def test_turning_joints_are_near_across_the_half_turn_and_slides_are_not() -> None:
    q = np.array([[np.pi - 0.01, 0.0], [-np.pi + 0.01, 1.0]])
    inputs = Inputs(q, np.zeros(2), np.zeros((2, 6, 2)))
    low, high, turning = np.array([-4.0, 0.0, 0.0]), np.array([4.0, 1.0, 0.0]), np.array([1.0, 0.0])
    first, second = coordinates(inputs, low, high, turning)
    assert np.linalg.norm((first - second)[[0, 2]]) == pytest.approx(0.02, rel=1e-3)
    assert abs(first[1] - second[1]) == 1.0
    assert margins(low, high, turning, 0.1).tolist() == pytest.approx([0.1, 0.02, 0.1])


def test_the_weight_falls_on_both_sides_of_what_was_trained() -> None:
    """One joint from -1 to 1, margins of 0.2: half a margin beyond either end the weight is one half."""
    q = np.array([[-1.2], [-1.1], [-1.0], [0.0], [1.0], [1.1], [1.2]])
    inputs = Inputs(q, np.zeros(7), np.zeros((7, 6, 1)))
    low, high, turning = np.array([-1.0, 0.0]), np.array([1.0, 0.0]), np.ones(1)
    rows = coordinates(inputs, low, high, turning)
    guard = Guard(low, high, np.array([0.2, 0.1]), turning, rows, 50.0, 100.0)
    np.testing.assert_allclose(guard.weight(inputs), [0, 0.5, 1, 1, 1, 0.5, 0], atol=1e-12)


@pytest.mark.parametrize("kind", ["revolute", "across the half turn", "slide"])
def test_between_the_levels_of_a_grid_nothing_is_added(kind: str) -> None:
    """Five levels half a unit apart, 25 rows at each, margins of 0.1: one half at half a margin from a level."""
    first = 2.5 if kind == "across the half turn" else -1.0
    turning = np.zeros(1) if kind == "slide" else np.ones(1)
    levels = first + 0.5 * np.arange(5)
    low, high = np.array([levels[0], 0.0]), np.array([levels[-1], 0.0])

    def at(positions: FloatArray) -> Inputs:
        return Inputs(positions[:, np.newaxis], np.zeros(len(positions)), np.zeros((len(positions), 6, 1)))

    grid = coordinates(at(np.repeat(levels, 25)), low, high, turning)
    guard = Guard(low, high, np.array([0.1, 0.1]), turning, grid, 50.0, 100.0)
    asked = levels[1] + np.array([0.0, 0.05, 0.1, 0.25, 0.45, 0.5])
    np.testing.assert_allclose(guard.weight(at(asked)), [1, 0.5, 0, 0, 0.5, 1], atol=1e-9)
    drawn = np.random.default_rng(2).uniform(low[0], high[0], 125)
    chance = Guard(low, high, np.array([0.1, 0.1]), turning, coordinates(at(drawn), low, high, turning), 50.0, 100.0)
    np.testing.assert_allclose(chance.weight(at(asked)), 1)


def test_outside_the_uncertainty_is_what_the_correction_would_have_taken_away() -> None:
    known = Uncertainty(np.full(3, 3e-5), np.full(3, 2.0), np.full(3, 1e-3))
    apart = np.full((3, 3), 4e-5)
    sigma = known.sigma(apart, np.array([1.0, 0.5, 0.0]))
    np.testing.assert_allclose(sigma[:, 0], [1e-4, 0.5 * 1e-4 + 0.5 * 1e-3, 1e-3], rtol=1e-12)


def test_limit_and_spread() -> None:
    np.testing.assert_allclose(limited(np.array([[3.0, 4.0, 0.0], [0.0, 0.1, 0.0]]), 1.0), [[0.6, 0.8, 0], [0, 0.1, 0]])
    assert spread(np.zeros((1, 4, 3))).tolist() == np.zeros((4, 3)).tolist()
    assert spread(np.array([[[1.0, 0, 0]], [[3.0, 0, 0]]]))[0, 0] == pytest.approx(np.sqrt(2))


def test_the_uncertainty_covers_nine_of_ten_whatever_the_spread_is_worth() -> None:
    random = np.random.default_rng(3)
    errors = random.standard_normal((4000, 3)) * [1e-4, 2e-4, 3e-4]
    for apart in (np.zeros((4000, 6)), np.full((4000, 6), 5e-5), np.abs(random.standard_normal((4000, 6))) * 1e-3):
        found = Uncertainty.fitted(errors, apart, errors)
        inside = np.abs(errors) <= 1.6448536 * found.sigma(apart, np.ones(4000))[:, :3]
        np.testing.assert_allclose(inside.mean(axis=0), 0.9, atol=0.002)
