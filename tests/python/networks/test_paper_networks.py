# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The papers' networks: their searches find known optima, their parts do what the papers say, small ones learn."""

import time
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

import joblib  # noqa: E402 - torch first, or the file is skipped

import fastcal  # noqa: E402
from fastcal.errors import InvalidInput  # noqa: E402
from fastcal.measurements.dataset import Dataset  # noqa: E402
from fastcal.networks.device import one_thread  # noqa: E402
from fastcal.networks.fitting import Schedule  # noqa: E402
from fastcal.networks.options import Options  # noqa: E402
from fastcal.networks.population import Architecture  # noqa: E402
from fastcal.networks.problem import Problem, problem_of  # noqa: E402
from fastcal.networks.training import train  # noqa: E402
from fastcal.robot.robot import Robot  # noqa: E402
from fastcal_studies import kernel_networks  # noqa: E402
from fastcal_studies.networks import (  # noqa: E402
    beetles,
    bso_mlp,
    ca_somm,
    ga_dnn,
    plain,
    somm,
)
from fastcal_studies.networks.search import study_of  # noqa: E402

SMALL = tuple(somm.AxisSizes(Architecture.plain((12,), "tanh"), 1e-2) for _ in range(3))


@pytest.fixture(scope="module")
def problem(arm: Robot, data: Dataset) -> Problem:
    return problem_of(arm, data, folds=2)


def share_left(problem: Problem, expert: object) -> float:
    said = expert.displacement(problem.inputs)  # type: ignore[attr-defined]
    return float(np.sum((problem.residuals - said) ** 2) / np.sum(problem.residuals**2))


def test_michalewicz_is_the_papers_function() -> None:
    assert beetles.michalewicz(np.array([[2.2029, 1.5708]]))[0] == pytest.approx(-1.8013, abs=1e-4)
    grid = np.stack(np.meshgrid(*[np.linspace(0, np.pi, 400)] * 2), axis=-1).reshape(-1, 2)
    assert beetles.michalewicz(grid).min() > -1.80131


@pytest.mark.parametrize("seed", range(3))
def test_beetles_find_the_minimum_of_the_papers_function(seed: int) -> None:
    starts = np.random.default_rng(seed).uniform(0, np.pi, (20, 2))
    for found in (
        beetles.antennae_search(beetles.michalewicz, starts, seed=seed),
        beetles.swarm_search(beetles.michalewicz, starts, seed=seed),
    ):
        assert found.value == pytest.approx(-1.8013, abs=3e-4)
        np.testing.assert_allclose(found.x, [2.20, 1.57], atol=0.01)
        assert found.value == beetles.michalewicz(found.x[np.newaxis])[0]


def test_a_beetle_walks_downhill_and_stops_at_its_target() -> None:
    """On a plane every step goes down; ten units of slope along x are reached before the steps die out."""
    seen: list[int] = []

    def plane(x: np.ndarray) -> np.ndarray:
        seen.append(len(x))
        return x[:, 0]

    found = beetles.antennae_search(plane, np.zeros((3, 2)), target=-1.0)
    assert found.value <= -1.0
    assert found.evaluations == sum(seen) < 3 + 3 * 3 * 150
    values = [beetles.antennae_search(plane, np.zeros((1, 2)), iterations=k).value for k in range(5)]
    assert values == sorted(values, reverse=True)


def test_the_swarm_is_evaluated_as_one_batch() -> None:
    calls: list[int] = []

    def sphere(x: np.ndarray) -> np.ndarray:
        calls.append(len(x))
        return np.sum((x - 0.3) ** 2, axis=1)

    starts = np.random.default_rng(0).uniform(-1, 1, (12, 4))
    found = beetles.swarm_search(sphere, starts, beetles.Swarm(iterations=60))
    assert calls == [12] + [24, 12] * 60
    assert found.value < 1e-3 < sphere(starts).min()


def test_the_swarm_gives_a_better_start_than_chance(problem: Problem) -> None:
    own = np.arange(len(problem))
    device = torch.device("cpu")
    with one_thread():
        model_args = (problem, own, bso_mlp.ARCHITECTURE)
        start, first = (
            bso_mlp.searched_start(*model_args, bso_mlp.swarm_of(beetles.Swarm(iterations=steps)), 0, device)
            for steps in (15, 0)
        )
        losses = []
        for theta in (start, first):
            still = Schedule(epochs=0)
            _, value = plain.train_plain(
                problem, [bso_mlp.ARCHITECTURE], [(0, 1, 2)], [own], still, Options(), start=theta[None]
            )
            losses.append(value[0])
    assert losses[0] < 0.95 * losses[1]


def test_bso_mlp_and_somm_learn(problem: Problem) -> None:
    own = [np.arange(len(problem))]
    with one_thread():
        (first,) = bso_mlp.fit_bso_mlp(problem, own, Options(), swarm=beetles.Swarm(iterations=5))
        (second,) = somm.fit_somm(problem, own, Options(), sizes=SMALL)
    assert share_left(problem, first) < 0.6
    assert share_left(problem, second) < 0.6
    assert [net.outputs for net in second.nets] == [1, 1, 1]


def test_the_preset_is_the_papers_tables(problem: Problem) -> None:
    x, y, z = somm.sizes_of(problem, Options(trials=0))
    assert (x.architecture.hidden, x.rate) == ((20, 20, 20, 20, 10, 20), 0.0008)
    assert (y.architecture.activations, y.rate) == (("relu", "relu"), 0.0005)
    assert (z.architecture.hidden, z.architecture.activations[0]) == ((50, 50, 40, 30), "tanh")


def test_a_search_that_was_stopped_goes_on_to_the_same_end(problem: Problem, tmp_path: Path) -> None:
    with one_thread():
        straight = somm._searched(problem, 0, Options(trials=4), asked=2, epochs=2)
        storage = tmp_path / "trials.log"
        somm._searched(problem, 0, Options(trials=2, storage=storage), asked=2, epochs=2)
        said: list[str] = []
        later = somm._searched(problem, 0, Options(trials=4, storage=storage, progress=said.append), asked=2, epochs=2)
    assert later == straight
    assert said == ["searching the network of axis x, trial 2 of 4"]


def test_a_search_whose_time_is_up_ends_with_what_it_has(problem: Problem) -> None:
    late = Options(trials=4, deadline=0.0)
    with one_thread():
        found = somm._searched(problem, 0, late, asked=2, epochs=2)
        assert found == somm._searched(problem, 0, Options(trials=2), asked=2, epochs=2)
    assert late.notes == ["the search for axis x ended after 2 of 4 trials: time is up"]
    budget = ga_dnn.Budget(population=24, generations=3, rungs=(1,))
    assert ga_dnn.search(problem, late, budget) == ga_dnn.search(
        problem, Options(), ga_dnn.Budget(population=24, generations=1, rungs=(1,))
    )
    assert late.notes[1:] == ["the search ended after 1 of 3 generations: time is up"]
    assert not Options(deadline=time.monotonic() + 100).is_over


def test_minutes_are_above_zero(problem: Problem) -> None:
    with pytest.raises(InvalidInput, match="minutes must be above 0, got 0"):
        train(problem.robot, problem.data, network="somm", minutes=0)


def test_a_file_that_holds_no_trials_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "trials.log"
    path.write_text("no journal\n")
    with pytest.raises(InvalidInput, match="cannot be resumed"):
        study_of("somm", path, 0)


def test_two_heaps_of_errors_are_split_where_they_are(arm: Robot, data: Dataset) -> None:
    """x errors at plus or minus 0.4 mm by the sign of joint 1, as in the paper's figure 22."""
    upper = data.q[:, 0] > 0
    assert data.position is not None
    position = arm.forward(data.q, payload=data.payload)[:, :3, 3].copy()
    position[:, 0] += np.where(upper, 4e-4, -4e-4)
    position += 2e-5 * np.random.default_rng(0).standard_normal(position.shape)
    heaps = problem_of(arm, Dataset.from_arrays(data.q, position=position, payload=data.payload), folds=2)
    split = ca_somm.found_split(heaps, np.arange(len(heaps)))
    assert split.axis == 0
    assert np.array_equal(split.classes, heaps.inputs.q[:, 0] > 0)
    own = heaps.training_rows()
    options = Options(trials=0)
    with one_thread():
        experts = ca_somm.fit_ca_somm(heaps, own, options, sizes=SMALL)
    for rows, expert in zip(own, experts, strict=True):
        other = np.setdiff1d(np.arange(len(heaps)), rows)
        said = expert.displacement(heaps.inputs.select(other))
        assert np.abs(said - heaps.residuals[other]).mean() < 1.2e-4
    assert "two classes by the errors in x" in options.notes[0]
    rate = float(options.notes[0].split(": ")[1].split(" %")[0].split("%")[0])
    assert rate > 90


def test_genes_mean_networks_within_their_bounds() -> None:
    random = np.random.default_rng(0)
    for genes in (np.zeros(ga_dnn.GENES), np.full(ga_dnn.GENES, 1 - 1e-12), random.random(ga_dnn.GENES)):
        net = ga_dnn.network_of(genes)
        hidden, kinds = net.architecture.hidden, net.architecture.activations
        assert 1 <= len(hidden) == len(kinds) <= ga_dnn.DEEPEST
        assert ga_dnn.NARROWEST <= min(hidden) <= max(hidden) <= ga_dnn.WIDEST
        assert list(kinds) == sorted(kinds)  # prelu before tanh
        assert ga_dnn.RATES[0] <= net.rate <= ga_dnn.RATES[1]
        assert 0 <= net.split < len(ga_dnn.SPLITS)


def test_a_generation_keeps_its_best_and_changes_the_rest() -> None:
    genes = np.random.default_rng(0).random((40, ga_dnn.GENES))
    children = ga_dnn.offspring(genes, np.random.default_rng(1))
    assert np.array_equal(children[:2], genes[:2])
    assert children.shape == genes.shape
    inherited = np.isin(children[2:], genes).mean()
    assert inherited == pytest.approx(1 - ga_dnn.MUTATION, abs=0.03)


def test_the_split_is_of_the_rows_and_the_same_again() -> None:
    own = np.arange(100, 200)
    for split, share in enumerate(ga_dnn.SPLITS):
        learnt, judged = ga_dnn.split_rows(own, split, 3)
        assert len(judged) == round(100 * share)
        assert sorted([*learnt, *judged]) == own.tolist()
        assert np.array_equal(judged, ga_dnn.split_rows(own, split, 3)[1])


def test_the_genetic_search_improves_is_remembered_and_does_not_depend_on_workers(
    problem: Problem, tmp_path: Path
) -> None:
    budget = ga_dnn.Budget(population=24, generations=2, rungs=(1, 2))
    alone = ga_dnn.search(problem, Options(), budget)
    storage = tmp_path / "trials.log"
    with joblib.parallel_backend("threading"):
        together = ga_dnn.search(problem, Options(jobs=2, storage=storage), budget)
    assert together == alone
    study = study_of("ga-dnn 24 1-2", storage, 0)
    values = [[t.value for t in study.trials if t.user_attrs["generation"] == g] for g in range(2)]
    assert min(values[1]) <= min(values[0])
    assert len(values[1]) == 24
    said: list[str] = []
    untrained = Options(storage=storage, progress=said.append)
    assert ga_dnn.search(problem, untrained, budget) == alone
    assert not any("epoch" in text for text in said)


def test_ga_dnn_learns_with_the_network_it_chose(problem: Problem) -> None:
    options = Options()
    own = [np.arange(len(problem))]
    with one_thread():
        budget = ga_dnn.Budget(population=6, generations=1, rungs=(3,))
        (expert,) = ga_dnn.fit_ga_dnn(problem, own, options, budget=budget)
    assert options.notes[0].startswith("the search chose ")
    assert share_left(problem, expert) < 0.9


def test_grnn_and_rbf_learn_and_are_finite_everywhere(problem: Problem) -> None:
    own = [np.arange(len(problem))]
    for fit in (kernel_networks.fit_grnn, kernel_networks.fit_rbf):
        with one_thread():
            (network,) = fit(problem, own, Options())
        assert share_left(problem, network) < 0.9
        far = problem.inputs.select(np.arange(3))
        said = network.displacement(type(far)(far.q + 50.0, far.payload, far.J_tool_q))
        assert np.isfinite(said).all()


def test_global_compensation_keeps_the_network_under_any_load(arm: Robot, data: Dataset) -> None:
    from fastcal.networks import train

    own = data.select(data.payload == 0.0)
    # Each of the four regions by itself: two folds may leave half of a joint's range unseen.
    found = train(arm, own, network="mlp", rivals=[], folds=4, any_load=True)
    assert found.used == "mlp"
    q = own.q[:5]
    light, heavy = (found.model.correct(q, load) for load in (0.0, 40.0))
    assert np.array_equal(light.displacement, heavy.displacement)
    assert heavy.weight.min() > 0.5
    plain_model = train(arm, own, network="mlp", rivals=[], folds=4)
    assert plain_model.model.correct(q, 40.0).weight.max() == 0.0
    assert fastcal.predict(found.model, Dataset.from_arrays(q, payload=40.0)).correction_weight is not None
