# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From a robot and its data to the identified robot: what is told, what is not, and that nothing depends on how."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.conversion import convert
from fastcal.errors import InvalidInput
from fastcal.io.measurements import load_measurements
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import factor

KINDS = ("dh", "mdh", "poe", "urdf")
NOISE = 5e-5

Array = NDArray[np.float64]


def postures(robot: Robot, count: int, seed: int) -> Array:
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.joint_count))


def disturbed(robot: Robot, seed: int, size: float = 5e-4) -> Array:
    """Parameters of the true robot: nominal and errors of 0.5 mm and 0.5 mrad."""
    start = robot.error_model.start
    return np.asarray(start + np.random.default_rng(seed).normal(0, size, len(start)))


def true_poses(robot: Robot, theta: Array, q: Array) -> Array:
    return np.asarray(robot.error_model.predict(_core.Samples(q), theta))


def quaternions(R: Array) -> Array:
    """(N, 4) w x y z of rotations (N, 3, 3)."""
    w = np.array([np.linalg.eigh(_davenport(r))[1][:, -1] for r in R])
    return np.asarray(w[:, [3, 0, 1, 2]])


def _davenport(R: Array) -> Array:
    """The symmetric 4 x 4 whose greatest eigenvector is the quaternion x y z w of R (P. Davenport's q-method)."""
    S = R + R.T
    K = np.zeros((4, 4))
    K[:3, :3] = S - np.trace(R) * np.eye(3)
    K[:3, 3] = K[3, :3] = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    K[3, 3] = np.trace(R)
    return K


def measured(
    robot: Robot, count: int, seed: int, *, poses: bool = False, noise: float = NOISE
) -> tuple[Dataset, Array]:
    """A simulated set, and the parameters of its robot."""
    rng = np.random.default_rng(seed)
    theta = disturbed(robot, seed + 1)
    q = postures(robot, count, seed + 2)
    T = true_poses(robot, theta, q)
    position = T[:, :3, 3] + rng.normal(0, noise, (count, 3))
    rotation = None
    if poses:
        turns = np.array([_core.exp_so3(w) for w in rng.normal(0, noise, (count, 3))])
        rotation = quaternions(T[:, :3, :3] @ turns)
    return Dataset.from_arrays(q, position=position, rotation=rotation), theta


def rms_mm(a: Array, b: Array) -> float:
    return float(1000 * np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))))


def error_mm(result: CalibrationResult, robot: Robot, theta: Array, seed: int = 99) -> float:
    q = postures(robot, 200, seed)
    return rms_mm(result.model.forward(q)[:, :3, 3], true_poses(robot, theta, q)[:, :3, 3])


def assert_finite(result: CalibrationResult) -> None:
    """Nothing is NaN: result.json can be written by the strictest writer."""
    json.dumps(result.to_json_dict(), allow_nan=False)
    assert np.isfinite(result.covariance).all()
    assert np.isfinite(result.weights).all()
    assert np.isfinite(result.model.error_model.start).all()


@pytest.fixture(scope="module")
def staubli() -> Robot:
    return load_robot("staubli_rx160l")


@pytest.fixture(scope="module")
def ur5(shared_data: Path) -> tuple[Robot, Dataset, Dataset]:
    folder = shared_data / "ur5_tracker"
    robot = load_robot(folder / "robot.yaml")
    train, test = (load_measurements(folder / f"{name}.csv", robot) for name in ("measurements", "test"))
    return robot, train, test


@pytest.fixture(scope="module")
def ur5_result(ur5: tuple[Robot, Dataset, Dataset]) -> CalibrationResult:
    robot, train, test = ur5
    return calibrate(robot, train, test=test)


def test_joint_6_of_the_ur5_is_reported_as_unidentifiable(ur5_result: CalibrationResult) -> None:
    said = [u.direction for u in ur5_result.unidentifiable if u.parameters[0] == "joint6 theta"]
    assert said == ["joint6 theta is not observable"]
    assert not any(p.owner == "joint6" for p in ur5_result.parameters)


def test_the_rank_of_the_ur5_is_27(ur5_result: CalibrationResult) -> None:
    assert ur5_result.rank == 27
    assert len(ur5_result.parameters) + len(ur5_result.unidentifiable) == ur5_result.asked_count


def test_nothing_of_the_ur5_is_nan_and_its_tracker_is_met(ur5_result: CalibrationResult) -> None:
    assert ur5_result.status == "converged"
    assert_finite(ur5_result)
    assert ur5_result.test is not None
    assert ur5_result.test.to_json_dict()["after_mm"]["rms"] < 0.116  # what is known to be in reach


def test_the_test_set_is_only_reported_on(ur5: tuple[Robot, Dataset, Dataset], ur5_result: CalibrationResult) -> None:
    assert calibrate(ur5[0], ur5[1]).model.spec == ur5_result.model.spec


@pytest.mark.parametrize("loss", ["none", "tukey", "huber", "cauchy"])
def test_every_kind_of_file_identifies_the_same_robot(staubli: Robot, loss: str) -> None:
    data, theta = measured(staubli, 80, 1)
    q = postures(staubli, 300, 2)
    points = {}
    for kind in KINDS:
        robot = Robot(convert(staubli, kind).spec)
        result = calibrate(robot, data, loss=loss)
        assert result.status == "converged"
        assert result.rank == 27
        assert_finite(result)
        points[kind] = result.model.forward(q)[:, :3, 3]
    for kind in KINDS:
        assert np.abs(points[kind] - points["dh"]).max() < (1e-9 if loss == "none" else 1e-8), kind
    assert rms_mm(points["dh"], true_poses(staubli, theta, q)[:, :3, 3]) < 0.06


def test_full_poses_show_the_tools_turn(staubli: Robot) -> None:
    data, theta = measured(staubli, 60, 3, poses=True)
    result = calibrate(staubli, data)
    assert result.rank == 30
    assert_finite(result)
    q = postures(staubli, 100, 4)
    T, wanted = result.model.forward(q), true_poses(staubli, theta, q)
    turns = [np.linalg.norm(_core.log_so3(a[:3, :3].T @ b[:3, :3])) for a, b in zip(T, wanted, strict=True)]
    assert np.sqrt(np.mean(np.square(turns))) < NOISE
    assert rms_mm(T[:, :3, 3], wanted[:, :3, 3]) < 0.06


def test_orientations_alone_identify_the_turns_and_hold_the_lengths(staubli: Robot) -> None:
    data, _ = measured(staubli, 60, 5, poses=True)
    result = calibrate(staubli, Dataset.from_arrays(data.q, rotation=data.rotation))
    assert result.status == "converged"
    assert_finite(result)
    assert {p.unit for p in result.parameters} == {"deg"}


def test_lengths_to_unknown_anchors_identify_the_arm(staubli: Robot) -> None:
    rng = np.random.default_rng(6)
    theta = disturbed(staubli, 7)
    theta[:6] = staubli.error_model.start[:6]  # nothing of the base is in a length
    anchors = np.array([[2.0, 0.3, -0.5], [-1.5, 1.5, 0.2], [0.1, -2.2, 0.8]])
    q = postures(staubli, 400, 8)
    anchor = [f"wire {i % 3}" for i in range(400)]
    wires = true_poses(staubli, theta, q)[:, :3, 3] - anchors[np.arange(400) % 3]
    distance = np.linalg.norm(wires, axis=1) + rng.normal(0, NOISE, 400)
    result = calibrate(staubli, Dataset.from_arrays(q, distance=distance, anchor=anchor))
    assert result.status == "converged"
    assert_finite(result)
    assert result.noise["length"].value == pytest.approx(NOISE, rel=0.15)
    after = result.train.kinds["length"].statistics[1]
    assert after is not None
    assert after.rms == pytest.approx(NOISE, rel=0.15)
    places = {(p.owner, p.name): p.value for p in result.parameters if p.owner.startswith("anchor")}
    for i, place in enumerate(anchors):
        for axis, value in zip("xyz", place, strict=True):
            # Where base and first joint are nominal's by gauge, the anchors take up the true ones' errors.
            assert places[f"anchor wire {i}", f"{axis}_mm"] == pytest.approx(1000 * value, abs=8)


def test_rows_use_what_they_have(staubli: Robot) -> None:
    data, theta = measured(staubli, 120, 9, poses=True)
    assert data.position is not None
    assert data.rotation is not None
    position, rotation = data.position.copy(), data.rotation.copy()
    position[::3, 1] = np.nan
    position[1::3] = np.nan
    rotation[2::3] = np.nan
    result = calibrate(staubli, Dataset.from_arrays(data.q, position=position, rotation=rotation))
    assert result.status == "converged"
    assert result.rank == 30
    assert_finite(result)
    assert error_mm(result, staubli, theta) < 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_a_saved_model_loads_to_the_same_predictions_bit_for_bit(staubli: Robot, kind: str, tmp_path: Path) -> None:
    spec = convert(staubli, kind).spec
    spec["base"]["rpy_deg"] = [180.0, 0.0, 0.0]  # hanging: axes point down
    robot = Robot(spec)
    data, _ = measured(robot, 60, 10)
    model = calibrate(robot, data).model
    model.save(tmp_path / "model.yaml")
    loaded = load_robot(tmp_path / "model.yaml")
    q = postures(robot, 1000, 11)
    np.testing.assert_array_equal(loaded.forward(q), model.forward(q))
    np.testing.assert_array_equal(loaded.position_deviation(q), model.position_deviation(q))


def test_deviations_of_an_arm_with_downward_axes_do_not_depend_on_its_kind_of_file() -> None:
    # Joint 1 of this arm points down; its identified axis leans a little, which must not turn its frame about it.
    arm = load_robot("pmc6va030")
    data, theta = measured(arm, 80, 12)
    q = postures(arm, 100, 13)
    found = {kind: calibrate(Robot(convert(arm, kind).spec), data) for kind in ("mdh", "poe")}
    assert any(joint["omega"][2] < -0.99 for joint in found["poe"].model.spec["joints"])
    deviations = {kind: result.model.position_deviation(q) for kind, result in found.items()}
    # What is all but unseen and held has plausible sizes of its own in each form.
    np.testing.assert_allclose(deviations["poe"], deviations["mdh"], rtol=0.05)
    z = (found["poe"].model.forward(q)[:, :3, 3] - true_poses(arm, theta, q)[:, :3, 3]) / deviations["poe"]
    assert 0.5 < np.sqrt(np.mean(z**2)) < 1.6


def test_threads_change_no_bit(staubli: Robot) -> None:
    data, _ = measured(staubli, 700, 14)
    one = calibrate(staubli, data, threads=1)
    for threads in (2, 5):
        other = calibrate(staubli, data, threads=threads)
        assert other.to_json_dict() == one.to_json_dict()
        assert other.model.spec == one.model.spec
        np.testing.assert_array_equal(other.covariance, one.covariance)


def test_exact_data_give_the_exact_robot(staubli: Robot) -> None:
    for poses in (False, True):
        data, theta = measured(staubli, 60, 15, noise=0.0, poses=poses)
        result = calibrate(staubli, data)
        assert result.status == "converged"
        assert_finite(result)
        assert error_mm(result, staubli, theta) < 1e-5


def test_bfgs_is_the_same_as_least_squares(staubli: Robot) -> None:
    data, _ = measured(staubli, 60, 16)
    nls, bfgs = (calibrate(staubli, data, loss="none", method=method, max_iterations=500) for method in ("nls", "bfgs"))
    assert bfgs.status == "converged"
    a, b = ([p.value for p in result.parameters] for result in (bfgs, nls))
    std = np.array([p.std for p in nls.parameters])
    assert np.max(np.abs(np.subtract(a, b)) / std) < 2e-3  # both stop where less than this is left
    mean = calibrate(staubli, data, loss="none", method="bfgs_mean_distance", max_iterations=500)
    assert mean.status == "converged"
    assert mean.train.after.mean < nls.train.after.mean
    assert mean.train.after.rms > nls.train.after.rms


def test_a_calibrated_model_is_the_start_of_the_next_calibration(staubli: Robot) -> None:
    data, _ = measured(staubli, 80, 17)
    first = calibrate(staubli, data, loss="none")
    second = calibrate(first.model, data, loss="none")
    q = postures(staubli, 100, 18)
    assert np.abs(second.model.forward(q) - first.model.forward(q)).max() < 1e-9


def test_priors_hold_what_few_poses_cannot_tell(staubli: Robot) -> None:
    data, theta = measured(staubli, 14, 19)
    held = calibrate(staubli, data, priors=True)
    assert held.status == "converged"
    assert_finite(held)
    assert held.unidentifiable == []
    assert error_mm(held, staubli, theta) < error_mm(calibrate(staubli, data), staubli, theta)


@pytest.mark.parametrize("rows", [3, 5, 9])
def test_too_few_rows_are_a_status_and_leave_the_robot(staubli: Robot, rows: int) -> None:
    data, _ = measured(staubli, rows, 20)
    result = calibrate(staubli, data)
    assert result.status == "too_few_equations"
    # Three points leave nothing even beside base and tool.
    assert {p.owner for p in result.parameters} == ({"base", "tool"} if rows > 3 else set())
    assert_finite(result)
    assert result.model.spec["joints"] == staubli.spec["joints"]
    assert str(3 * rows) in result.message


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"loss": "l1"}, "loss must be one of tukey, huber, cauchy, none, got 'l1'"),
        ({"method": "newton"}, "method must be one of nls, bfgs, bfgs_mean_distance, got 'newton'"),
    ],
)
def test_unknown_options_are_refused(staubli: Robot, options: dict[str, str], sentence: str) -> None:
    data, _ = measured(staubli, 30, 21)
    with pytest.raises(InvalidInput, match=sentence):
        calibrate(staubli, data, **options)  # type: ignore[arg-type]


def test_data_without_a_measured_column_are_refused(staubli: Robot) -> None:
    with pytest.raises(InvalidInput, match="no measured column"):
        calibrate(staubli, Dataset.from_arrays(postures(staubli, 20, 22)))


@pytest.mark.parametrize("again", [False, True])
@pytest.mark.parametrize("rows", [4, 5, 8])
def test_priors_with_fewer_equations_than_parameters_keep_a_root_of_the_covariance(
    staubli: Robot, rows: int, again: bool
) -> None:
    data, _ = measured(staubli, rows, 31)
    robot = calibrate(staubli, measured(staubli, 60, 32)[0]).model if again else staubli
    result = calibrate(robot, data, priors=True)
    assert result.model.record is not None
    root = result.model.record.root
    assert np.all(np.diag(root) > 0)
    assert not np.triu(root, 1).any()
    columns = [name for name in result.model.parameter_names if name in result.model.record.parameters]
    assert columns == result.model.record.parameters
    deviation = np.sqrt(np.sum(root**2, axis=1))
    table = {f"{p.owner} {p.name.rsplit('_', 1)[0]}": p.std * factor(p.unit) for p in result.parameters}
    for name, value in zip(columns, deviation, strict=True):
        if not name.startswith(("base r", "tool r")):
            assert value == pytest.approx(table[name], rel=1e-9)


def test_a_loaded_fit_with_gross_points_ends_when_its_loads_stand() -> None:
    """The noise without the outliers never was that with them, which was what the rounds waited for: 300 steps."""
    spec = load_robot("ur5").spec | {"payload": {"com_mm": [50, 0, 100]}}
    size = {"compliance_rad_nm": 3e-5}
    compliant = [{"effect": "joint_compliance", "owner": f"joint{j}", "parameters": size} for j in (2, 3, 4)]
    rng = np.random.default_rng(0)
    q, load = rng.uniform(-2, 2, (150, 6)), rng.choice([0.0, 5.0], 150)
    data = simulate(Robot(spec | {"effects": compliant}), q, noise=5e-5, seed=1, payload=load)
    position = np.array(data.position)
    position[::20] += rng.normal(size=(8, 3)) * 5e-3
    rough = Dataset.from_arrays(q, position=position, payload=load)
    result = calibrate(Robot(spec), rough, effects="geometry,joint_compliance", checks=False)
    assert result.status == "converged"
    assert result.iterations < 60
    assert len(result.outliers) >= 8


@pytest.mark.parametrize("seed", range(3))
def test_the_rank_is_the_same_from_the_nominal_arm_and_from_the_identified_one(seed: int) -> None:
    """The first joint's compliance shows by how little the base leans: on the way, and hardly where the fit ends."""
    random, arm = np.random.default_rng(seed), load_robot("ur5")
    poses = Dataset.from_arrays(random.uniform(-2.5, 2.5, (40, 6)), payload=random.uniform(0, 3, 40))
    data = simulate(perturbed(arm, seed=seed), poses, noise=5e-5, noise_rotation=1e-4, seed=seed)
    first = calibrate(arm, data, effects="geometry,joint_compliance", checks=False, priors=False)
    again = calibrate(first.model, data, effects="geometry,joint_compliance", checks=False, priors=False)
    assert first.rank == again.rank == 35
