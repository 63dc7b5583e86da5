# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A network of one arm as the prior of few rows of another: used where it gains, never where it does not."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.cli.app import main
from fastcal.correction.experts import Shifted
from fastcal.correction.serialize import from_plain, to_plain
from fastcal.errors import InvalidInput
from fastcal.io.measurements_out import write_measurements
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

pytest.importorskip("torch")
from fastcal.networks import TrainingResult, train

ROOT = Path(__file__).parents[3]
RECORDS = ("bench_transfer.json", "bench_transfer_fresh.json")


def of_the_kind(arm: Robot, seed: int, stranger: bool = False) -> Robot:
    """Waves of a kind in joints 1 to 6, each arm's own within 20 % and 0.2 rad; a stranger's phases are its own."""
    random = np.random.default_rng(seed)
    waves = [
        {
            "effect": "gear_harmonic",
            "owner": f"joint{joint}",
            "order": 2 + joint % 3,
            "parameters": {
                "amplitude_rad": {"value": 4e-4 * (1 + 0.2 * float(random.standard_normal()))},
                "phase_rad": {"value": joint + 0.2 * float(random.standard_normal()) + np.pi * stranger},
            },
        }
        for joint in range(1, 7)
    ]
    return Robot(arm.spec | {"effects": waves})


def measured(true: Robot, count: int, seed: int, turn: float | None = None) -> Dataset:
    q = np.random.default_rng(seed).uniform(-1.2, 1.2, (count, 6))
    return fastcal.simulate(true, q, noise=2e-5, noise_rotation=turn, seed=seed)


def mean_error(model: Robot, data: Dataset) -> float:
    assert data.position is not None
    return float(np.linalg.norm(model.poses(data)[:, :3, 3] - data.position, axis=1).mean())


@pytest.fixture(scope="module")
def prior(arm: Robot) -> Robot:
    first = measured(of_the_kind(arm, 1), 240, 1)
    return train(fastcal.calibrate(arm, first).model, first, rivals=[], folds=3).model


@pytest.fixture(scope="module")
def moved(arm: Robot, prior: Robot) -> tuple[Robot, Dataset, TrainingResult]:
    """Another arm of the kind: its model of 40 rows, the rows, and what training behind the prior found."""
    data = measured(of_the_kind(arm, 2), 40, 2)
    model = fastcal.calibrate(arm, data).model
    return model, data, train(model, data, prior=prior)


def test_few_rows_behind_the_prior_leave_less_than_half(
    arm: Robot, moved: tuple[Robot, Dataset, TrainingResult]
) -> None:
    model, _, found = moved
    unseen = measured(of_the_kind(arm, 2), 150, 3)
    assert found.used == "prior and gp"
    assert mean_error(found.model, unseen) < 0.5 * mean_error(model, unseen)
    assert "what this arm differs by" in found.verdict
    assert set(found.scores) == {"model", "gp", "prior", "prior and gp"}
    said = found.model.correct(unseen.q)
    left = found.model.poses(unseen)[:, :3, 3] - np.asarray(unseen.position)
    assert np.mean(np.abs(left) < 1.645 * said.sigma) > 0.8


def test_it_is_the_same_when_it_was_written_and_read(moved: tuple[Robot, Dataset, TrainingResult]) -> None:
    correction = moved[2].model.correction
    assert correction is not None
    assert isinstance(correction.members[0], Shifted)
    again = moved[2].model.with_(correction=from_plain(*to_plain(correction)))
    assert np.array_equal(again.poses(moved[1]), moved[2].model.poses(moved[1]))
    assert again.correct(moved[1].q).weight.max() == 1.0


def test_a_stranger_s_network_is_not_used(arm: Robot, prior: Robot) -> None:
    data = measured(of_the_kind(arm, 4, stranger=True), 20, 4)
    model = fastcal.calibrate(arm, data).model
    found = train(model, data, prior=prior)
    assert found.used == "model"
    assert found.model.correction is None
    assert "the prior is not used" in found.verdict
    assert "at least 30 rows" in found.verdict
    assert np.array_equal(found.model.poses(data), model.poses(data))
    # With rows enough, training goes on as it would have without.
    data = measured(of_the_kind(arm, 4, stranger=True), 120, 4)
    model = fastcal.calibrate(arm, data).model
    alone = train(model, data, rivals=[], folds=3)
    found = train(model, data, rivals=[], folds=3, prior=prior)
    assert (found.used, found.scores) == (alone.used, alone.scores)
    assert any("the prior does not gain" in note for note in found.notes)


def test_poses_turn_behind_a_prior_that_was_trained_on_poses(arm: Robot) -> None:
    first = measured(of_the_kind(arm, 1), 200, 1, turn=5e-5)
    prior = train(fastcal.calibrate(arm, first).model, first, rivals=[], folds=3).model
    data, unseen = (measured(of_the_kind(arm, 2), count, seed, turn=5e-5) for count, seed in ((30, 2), (100, 3)))
    model = fastcal.calibrate(arm, data).model
    found = train(model, data, prior=prior)
    assert found.turn_scores[found.used]["mean"] < 0.5 * found.turn_scores["model"]["mean"]
    before, after = (fastcal.evaluate(each, unseen).turn_after for each in (model, found.model))
    assert before is not None
    assert after is not None
    assert after.mean() < 0.5 * before.mean()


def test_the_command_takes_the_prior(
    arm: Robot, prior: Robot, moved: tuple[Robot, Dataset, TrainingResult], tmp_path: Path
) -> None:
    model, data, found = moved
    prior.save(tmp_path / "prior.yaml")
    model.save(tmp_path / "plain.yaml")
    write_measurements(tmp_path / "data.csv", data)
    line = ["train", f"{tmp_path}/plain.yaml", f"{tmp_path}/data.csv", "--from", f"{tmp_path}/prior.yaml"]
    assert main([*line, "-o", f"{tmp_path}/out"]) == 0
    loaded = fastcal.load_robot(tmp_path / "out" / "model.yaml")
    assert np.abs(loaded.poses(data)[:, :3, 3] - found.model.poses(data)[:, :3, 3]).max() < 1e-6


def test_what_is_no_prior_is_refused(arm: Robot, prior: Robot, moved: tuple[Robot, Dataset, TrainingResult]) -> None:
    model, data, _ = moved
    with pytest.raises(InvalidInput, match="expected a model with a network, as fastcal train makes it"):
        train(model, data, prior=arm)
    with pytest.raises(InvalidInput, match="at least 10 rows with a point, got 8"):
        train(model, data.select(slice(8)), prior=prior)
    with pytest.raises(InvalidInput, match="training needs measured points"):
        train(model, replace(data, position=None), prior=prior)
    seven = fastcal.load_robot("spray_7dof")
    q = np.zeros((12, seven.joint_count))
    rows = fastcal.simulate(seven, q, noise=1e-5)
    with pytest.raises(InvalidInput, match="expected a prior of an arm of 7 joints"):
        train(seven, rows, prior=prior)


def recorded(name: str) -> dict[str, list[dict[str, Any]]]:
    found: dict[str, list[dict[str, Any]]] = json.loads((ROOT / "bench" / "python" / name).read_text())["results"]
    return found


@pytest.mark.parametrize("name", RECORDS)
def test_the_page_s_table_is_that_of_the_record_and_no_arm_is_worse(name: str) -> None:
    results = recorded(name)
    page = (ROOT / "docs" / "networks.md").read_text(encoding="utf-8")
    for found in results.values():
        assert len(found) == 30
        assert all(each["prior"] <= each["nothing"] for each in found)
    for rows in (20, 50, 100):
        own = [each for each in results["of the kind"] if each["rows"] == rows]
        medians = [f"{np.median([each[key] for each in own]):.3f}" for key in ("model", "nothing", "prior")]
        worst = max(each["prior"] / each["nothing"] for each in own)
        assert f"| {rows} | {' | '.join(medians)} | {worst:.3f} |" in page
    assert f"seeds {results['strangers'][0]['seed']} to {results['strangers'][-1]['seed']})" in page


def test_how_often_a_stranger_helps_is_counted_in_both_records() -> None:
    strangers = [each for name in RECORDS for each in recorded(name)["strangers"]]
    helped = sum(each["prior"] < each["nothing"] for each in strangers)
    page = " ".join((ROOT / "docs" / "networks.md").read_text(encoding="utf-8").split())
    assert f"({len(strangers)} of {len(strangers)} in both records; in {helped} of them it helped)" in page
