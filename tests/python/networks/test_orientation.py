# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Networks trained on poses correct the pose: point and turn on poses that they have not seen, and in commands."""

import json
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fastcal
from fastcal.calibration.realign import realign
from fastcal.cli.app import main
from fastcal.compensation import compensate
from fastcal.errors import InvalidInput
from fastcal.io.measurements_out import write_measurements
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

pytest.importorskip("torch")
from fastcal.networks import TrainingResult, train
from fastcal.networks.problem import problem_of, residuals_of

BENCH = runpy.run_path(str(Path(__file__).parents[3] / "bench" / "python" / "bench_orientation.py"))
NOISE, NOISE_TURN = BENCH["NOISE"], BENCH["NOISE_TURN"]
mean_errors = BENCH["on_poses"]


def with_waves(arm: Robot, seed: int) -> Robot:
    """Which the model knows nothing of."""
    return BENCH["with_waves"](arm, np.random.default_rng(seed))


def measured(true: Robot, count: int, seed: int) -> Dataset:
    random = np.random.default_rng(seed)
    q = random.uniform(np.maximum(true.limits[:, 0], -1.5), np.minimum(true.limits[:, 1], 1.5), (count, 6))
    return fastcal.simulate(true, q, noise=NOISE, noise_rotation=NOISE_TURN, seed=seed)


@pytest.fixture(scope="module")
def poses() -> tuple[Robot, Dataset, Dataset, TrainingResult]:
    """A calibrated UR5, the rows, others that nothing was trained on, and what training found."""
    arm = fastcal.load_robot("ur5")
    true = with_waves(arm, 1)
    data, unseen = measured(true, 240, 1), measured(true, 150, 2)
    model = fastcal.calibrate(arm, data).model
    return model, data, unseen, train(model, data, rivals=["knn"], folds=3)


@pytest.mark.parametrize(("name", "seed"), [("ur5", 1), ("staubli_rx160l", 2), ("kuka_kr6_r900", 3)])
def test_on_three_arms_a_network_more_than_halves_both_errors_on_unseen_poses(name: str, seed: int) -> None:
    arm = fastcal.load_robot(name)
    true = with_waves(arm, seed)
    data, unseen = measured(true, 240, 1), measured(true, 150, 2)
    model = fastcal.calibrate(arm, data).model
    found = train(model, data, rivals=[], folds=3)
    assert found.used == "mlp"
    before, after = mean_errors(model, unseen), mean_errors(found.model, unseen)
    assert after[0] < 0.5 * before[0]
    assert after[1] < 0.5 * before[1]
    # Commands for unseen targets land both on the true arm.
    targets = model.forward(unseen.q[:40])
    sent = compensate(found.model, targets, unseen.q[:40], along_path=False)
    plain = compensate(model, targets, unseen.q[:40], along_path=False)
    assert sent.reached.all()
    landed, missed = ([*true_errors(true, each.q, targets)] for each in (sent, plain))
    assert landed[0] < 0.5 * missed[0]
    assert landed[1] < 0.5 * missed[1]


def true_errors(true: Robot, q: np.ndarray, targets: np.ndarray) -> tuple[float, float]:
    """How far the true arm is from its targets at commands q: mean [m] and [rad]."""
    T = true.forward(q)
    turned = (np.trace(T[:, :3, :3].transpose(0, 2, 1) @ targets[:, :3, :3], axis1=1, axis2=2) - 1) / 2
    return (
        float(np.linalg.norm(T[:, :3, 3] - targets[:, :3, 3], axis=1).mean()),
        float(np.arccos(np.clip(turned, -1, 1)).mean()),
    )


@pytest.mark.parametrize("network", ["gp", "bso-mlp", "somm"])
def test_the_other_networks_turn_too(network: str, poses: tuple[Robot, Dataset, Dataset, TrainingResult]) -> None:
    """SOMM and the beetles map joints to coordinates, and learn slower: they only have to gain in both."""
    model, data, unseen, _ = poses
    found = train(model, data.select(slice(150)), network=network, rivals=[], folds=2, trials=0)
    before = {name: score["mean"] for name, score in found.turn_scores.items()}
    assert set(before) == {"model", network}
    if found.used == network:
        assert mean_errors(found.model, unseen)[1] < mean_errors(model, unseen)[1]
    if network == "gp":
        assert found.used == "gp"
        assert before["gp"] < 0.5 * before["model"]


def test_what_is_said_of_both_holds_on_unseen_poses(poses: tuple[Robot, Dataset, Dataset, TrainingResult]) -> None:
    _, _, unseen, found = poses
    assert "mm and " in found.verdict
    assert "deg with mlp" in found.verdict
    figures = found.to_json_dict()
    assert figures["held_out_deg"]["mlp"]["mean"] < 0.5 * figures["held_out_deg"]["model"]["mean"]
    assert figures["limit_deg"] > 0
    said = found.model.correct(unseen.q)
    left = residuals_of(found.model, unseen, found.model.poses(unseen))[:, 3:]
    assert np.mean(np.abs(left) < 1.645 * said.sigma_turn) == pytest.approx(0.9, abs=0.06)
    assert np.linalg.norm(said.turn, axis=1).max() <= found.model.correction.turn_limit  # type: ignore[union-attr]


def test_commands_say_mm_and_degrees(
    poses: tuple[Robot, Dataset, Dataset, TrainingResult], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, data, unseen, _ = poses
    model.save(tmp_path / "plain.yaml")
    write_measurements(tmp_path / "data.csv", data.select(slice(120)))
    write_measurements(tmp_path / "unseen.csv", unseen)
    line = ["train", f"{tmp_path}/plain.yaml", f"{tmp_path}/data.csv", "--rivals", "none", "--folds", "2"]
    assert main([*line, "-o", f"{tmp_path}/out"]) == 0
    assert "deg, rms" in capsys.readouterr().out
    trained = f"{tmp_path}/out/model.yaml"
    assert main(["predict", trained, f"{tmp_path}/unseen.csv", "-o", f"{tmp_path}/said.csv"]) == 0
    assert "of a turn" in capsys.readouterr().out
    header = (tmp_path / "said.csv").read_text().splitlines()[0].split(",")
    assert header[-4:] == ["sigma_rx_deg", "sigma_ry_deg", "sigma_rz_deg", "correction_weight"]
    assert main(["evaluate", trained, f"{tmp_path}/unseen.csv", "-o", f"{tmp_path}/figures.json"]) == 0
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert figures["kinds"]["orientation"]["after"]["mean"] < 0.5 * mean_errors(model, unseen)[1]
    targets = tmp_path / "targets.csv"
    T = model.forward(unseen.q[:3])
    rows = [[*(1e3 * pose[:3, 3]), *fastcal.predict(model, unseen).rotation[k]] for k, pose in enumerate(T)]
    targets.write_text("\n".join(["x_mm,y_mm,z_mm,qw,qx,qy,qz", *(",".join(map(repr, map(float, r))) for r in rows)]))
    capsys.readouterr()
    assert main(["compensate", trained, str(targets), "--single", "-o", f"{tmp_path}/commands.csv"]) == 0
    assert " mm and " in capsys.readouterr().out


def test_rows_without_an_orientation_teach_their_points(
    poses: tuple[Robot, Dataset, Dataset, TrainingResult],
) -> None:
    model, data, unseen, _ = poses
    rotation = np.array(data.rotation)
    rotation[::2] = np.nan
    found = train(model, replace(data, rotation=rotation), rivals=[], folds=3)
    before, after = mean_errors(model, unseen), mean_errors(found.model, unseen)
    assert found.rows == len(data)
    assert after[0] < 0.5 * before[0]
    assert after[1] < 0.5 * before[1]
    gp = train(model, replace(data, rotation=rotation).select(slice(100)), network="gp", rivals=[], folds=2)
    assert gp.turn_scores["gp"]["mean"] < gp.turn_scores["model"]["mean"]


def test_points_alone_turn_nothing(poses: tuple[Robot, Dataset, Dataset, TrainingResult]) -> None:
    model, data, unseen, _ = poses
    found = train(model, replace(data, rotation=None), rivals=[], folds=3)
    assert found.used == "mlp"
    assert found.turn_scores == {}
    assert not found.model.correct(unseen.q).turn.any()
    assert fastcal.predict(found.model, unseen).sigma_rotation is None


def test_another_set_up_keeps_the_turn(poses: tuple[Robot, Dataset, Dataset, TrainingResult]) -> None:
    """The tracker was turned by a quarter: base and tool refitted on twenty poses give both errors back."""
    _, _, unseen, found = poses
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    half = np.sqrt(0.5)
    w, x, y, z = np.array(unseen.rotation).T
    turned = np.column_stack([half * (w - z), half * (x - y), half * (y + x), half * (z + w)])
    moved = replace(unseen, position=np.array(unseen.position) @ turn.T + [1.0, -2.0, 0.3], rotation=turned)
    here, there = mean_errors(found.model, unseen), realign(found.model, moved.select(slice(20)))
    for now, then in zip(mean_errors(there, moved), here, strict=True):
        assert now < 1.5 * then


def test_a_tool_that_the_model_does_not_know_is_refused(
    poses: tuple[Robot, Dataset, Dataset, TrainingResult],
) -> None:
    """Orientations of a target that is mounted a half turn round: no error of joints, and nothing to be learnt."""
    model, data, _, _ = poses
    w, x, y, z = np.array(data.rotation).T
    with pytest.raises(InvalidInput, match=r"with the tool turned by 180\.0. deg: calibrate on these files first"):
        problem_of(model, replace(data, rotation=np.column_stack([-z, y, -x, w])))
