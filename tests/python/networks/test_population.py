# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Many networks at once are what each would be alone, and their optimizers are those of torch."""

from collections.abc import Callable

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from fastcal.errors import InvalidInput  # noqa: E402 - torch first, or the file is skipped
from fastcal.networks.device import device_of, one_thread  # noqa: E402
from fastcal.networks.fitting import BySlope, Schedule, fit, loss, slope  # noqa: E402
from fastcal.networks.optimizers import RULES, Optimizer  # noqa: E402
from fastcal.networks.population import Architecture, Population  # noqa: E402

MIXED = [
    Architecture((4,), ("tanh",)),
    Architecture((7, 3, 5), ("prelu", "tanh", "relu")),
    Architecture((2, 6), ("sigmoid", "prelu")),
]


class Squares:
    """Networks that learn y from x."""

    def __init__(self, population: Population, x: torch.Tensor, y: torch.Tensor) -> None:
        self.population, self.x, self.y = population, x, y

    def error(self, theta: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        return self.population(theta, self.x[rows]) - self.y[rows]

    def at(self, theta: torch.Tensor) -> Callable[[torch.Tensor, BySlope], torch.Tensor]:
        steps = self.population.at(theta)
        return lambda rows, by_error: steps.backward(by_error(steps.forward(self.x[rows]) - self.y[rows]))


def example() -> tuple[torch.Tensor, torch.Tensor]:
    x = torch.tensor(np.random.default_rng(0).standard_normal((50, 3)), dtype=torch.float32)
    return x, torch.stack([torch.sin(x[:, 0]), x[:, 1] * x[:, 2]], dim=1)


def test_padded_networks_predict_what_they_would_alone() -> None:
    population = Population(3, 2, MIXED)
    theta = population.start([5, 6, 7])
    x, _ = example()
    together = population(theta, x).numpy()
    for k, (member, ours) in enumerate(zip(MIXED, population.networks(theta), strict=True)):
        alone = Population(3, 2, [member])
        np.testing.assert_allclose(alone(alone.start([5 + k]), x)[0].numpy(), together[k], rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(ours(x.numpy().astype(float)), together[k], rtol=1e-5, atol=1e-6)
        assert ours.hidden == list(member.hidden)


def test_the_gradient_is_that_of_differences_wherever_the_numbers_move() -> None:
    population = Population(3, 2, MIXED)
    theta = population.start([5, 6, 7]).double()
    theta[:, [5, -3, -2, -1]] += 0.3  # padding and slopes that nobody uses have numbers too
    random = np.random.default_rng(1)
    x, d = (torch.tensor(random.standard_normal((3, 4, k))) for k in (3, 2))
    steps = population.at(theta)
    for _ in range(2):
        out = steps.forward(x)
        torch.testing.assert_close(out, population(theta, x), rtol=0, atol=0)
        found = steps.backward(d).clone()
        for k in range(population.size):
            ahead, behind = theta.clone(), theta.clone()
            ahead[:, k] += 1e-6
            behind[:, k] -= 1e-6
            wanted = ((population(ahead, x) - population(behind, x)) * d).sum(dim=(1, 2)) / 2e-6
            torch.testing.assert_close(found[:, k], wanted, rtol=1e-5, atol=1e-8)
        theta -= 0.1 * found  # the same passes follow it


@pytest.mark.parametrize("huber", [0.0, 0.7])
def test_the_slope_by_errors_is_that_of_differences(huber: float) -> None:
    error = torch.tensor(np.random.default_rng(2).standard_normal((2, 5, 3)))
    found = slope(error, huber)
    for place in np.ndindex(error.shape):
        step = torch.zeros_like(error)
        step[place] = 1e-6
        wanted = (loss(error + step, huber) - loss(error - step, huber)).sum() / 2e-6
        assert float(found[place]) == pytest.approx(float(wanted), rel=1e-6, abs=1e-8)


def test_trained_together_they_become_what_they_would_alone() -> None:
    x, y = example()
    rows = [np.arange(50), np.arange(10, 40), np.arange(0, 50, 2)]
    schedule = Schedule(epochs=6, batch=8, rule=["adam", "nag", "rmsprop"], rate=[1e-2, 1e-3, 3e-3], huber=0.5)
    population = Population(3, 2, MIXED)
    with one_thread():
        theta, last = fit(Squares(population, x, y), population.start([1, 2, 3]), rows, schedule, [1, 2, 3])
        for k, member in enumerate(MIXED):
            alone = Population(3, 2, [member])
            own = Schedule(epochs=6, batch=8, rule=schedule.rule[k], rate=[schedule.rate[k]], huber=0.5)
            # An epoch is as long as the longest member's; alone, the rows are given the same number of times.
            full = [np.resize(rows[k], 50)] if len(rows[k]) < 50 else [rows[k]]
            if len(rows[k]) < 50:
                continue
            single, value = fit(Squares(alone, x, y), alone.start([k + 1]), full, own, [k + 1])
            np.testing.assert_allclose(
                alone.networks(single)[0](x.numpy().astype(float)),
                population.networks(theta)[k](x.numpy().astype(float)),
                rtol=1e-3,
                atol=1e-4,
            )
            assert value[0] == pytest.approx(last[k], rel=1e-3)


def test_weights_that_nothing_pulls_at_decay_each_at_its_own_rate() -> None:
    class Still:
        def error(self, theta: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
            return 0 * theta[:, :1, None]

        def at(self, theta: torch.Tensor) -> Callable[[torch.Tensor, BySlope], torch.Tensor]:
            return lambda rows, by_error: torch.zeros_like(theta)

    schedule = Schedule(epochs=3, batch=5, rule="sgd", rate=[0.1, 0.2], decay=[0.0, 0.5], cosine=False)
    theta, _ = fit(Still(), torch.ones(2, 4), [np.arange(10)] * 2, schedule, [1, 2])
    np.testing.assert_allclose(theta.numpy(), np.array([[1.0], [0.9**6]]) * np.ones(4), rtol=1e-6)


def test_a_member_does_not_depend_on_its_company() -> None:
    x, y = example()
    schedule = Schedule(epochs=5, batch=10, rate=1e-2)
    pair = Population(3, 2, MIXED[:2])
    with one_thread():
        both, _ = fit(Squares(pair, x, y), pair.start([1, 2]), [np.arange(50)] * 2, schedule, [1, 2])
        swapped = Population(3, 2, MIXED[1::-1])
        other, _ = fit(Squares(swapped, x, y), swapped.start([2, 1]), [np.arange(50)] * 2, schedule, [2, 1])
    at = x.numpy().astype(float)
    np.testing.assert_allclose(pair.networks(both)[0](at), swapped.networks(other)[1](at), rtol=1e-4, atol=1e-5)


def test_the_best_state_on_validation_rows_is_kept_and_patience_ends_it() -> None:
    x, y = example()
    population = Population(3, 2, [MIXED[1]])
    validation = [np.arange(40, 50)]
    model = Squares(population, x, y)
    wild = Schedule(epochs=60, batch=10, rate=0.3, cosine=False, check=1)
    theta, best = fit(model, population.start([1]), [np.arange(40)], wild, [1], validation=validation)
    with torch.no_grad():
        again = loss(model.error(theta, torch.arange(40, 50)[None]), 0.0)
    assert best[0] == pytest.approx(float(again), rel=1e-5)
    said: list[str] = []
    calm = Schedule(epochs=2000, batch=10, rate=0.3, cosine=False, check=1, patience=3)
    fit(model, population.start([1]), [np.arange(40)], calm, [1], validation=validation, progress=said.append)
    assert len(said) < 100  # a sentence every tenth epoch; without patience it would be 200
    assert said[0] == "training 1 networks, epoch 0 of 2000"


@pytest.mark.parametrize("rule", RULES)
def test_the_rules_are_those_of_torch(rule: str) -> None:
    makers = {
        "sgd": lambda p: torch.optim.SGD([p], lr=0.01),
        "momentum": lambda p: torch.optim.SGD([p], lr=0.01, momentum=0.9),
        "nag": lambda p: torch.optim.SGD([p], lr=0.01, momentum=0.9, nesterov=True),
        "adagrad": lambda p: torch.optim.Adagrad([p], lr=0.01, eps=1e-8),
        "rmsprop": lambda p: torch.optim.RMSprop([p], lr=0.01, alpha=0.9, eps=1e-8),
        "adadelta": lambda p: torch.optim.Adadelta([p], lr=0.01, rho=0.9, eps=1e-6),
        "adam": lambda p: torch.optim.Adam([p], lr=0.01),
    }
    start = torch.linspace(-1, 1, 6)
    theirs = start.clone().requires_grad_(True)
    reference = makers[rule](theirs)
    ours = torch.stack([start, start])
    own = Optimizer([rule, "sgd"], [0.01, 0.5], ours)
    for _ in range(7):
        reference.zero_grad()
        (theirs**4).sum().backward()
        reference.step()
        own.step(ours, 4 * ours**3)
    np.testing.assert_allclose(ours[0].numpy(), theirs.detach().numpy(), rtol=1e-5, atol=1e-6)


def test_an_unknown_rule_or_device_is_refused() -> None:
    with pytest.raises(InvalidInput, match="expected an optimizer of sgd"):
        Optimizer(["luck"], [0.1], torch.zeros(1, 2))
    assert device_of("cpu").type == "cpu"
    if not torch.cuda.is_available():
        with pytest.raises(InvalidInput, match="finds no GPU"):
            device_of("cuda")


def test_the_number_of_threads_is_given_back() -> None:
    before = torch.get_num_threads()
    with one_thread():
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == before
