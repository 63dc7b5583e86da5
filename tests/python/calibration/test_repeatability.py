# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""ISO 9283 by hand: visits whose figures can be worked out on paper."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal import calibrate, load_robot, perturbed, random_poses, simulate
from fastcal.calibration.evaluation import realigned, remounted
from fastcal.calibration.repeatability import numbered, repeatability, repeated_rows, spread
from fastcal.measurements.dataset import Dataset

Array = NDArray[np.float64]

FIVE = 1e-3 * np.array([[1.0, 0, 0], [-1, 0, 0], [0, 2, 0], [0, -2, 0], [0, 0, 0]])  # mean 0, l = 1 1 2 2 0
RP_FIVE = 1e-3 * (1.2 + 3 * np.sqrt(((0.2**2) * 2 + (0.8**2) * 2 + 1.2**2) / 4))


def visits(
    *groups: tuple[float, Array], time: Array | None = None, approach: list[int] | None = None
) -> tuple[Dataset, Array]:
    """A data set of one joint whose pose number g is at q = g, with the given errors, and the errors."""
    q = np.concatenate([np.full((len(e), 1), angle) for angle, e in groups])
    error = np.concatenate([e for _, e in groups])
    point = np.column_stack([1 + q[:, 0], q[:, 0], 0 * q[:, 0]])
    sides = None if approach is None else np.array(approach, dtype=float)[:, np.newaxis]
    return Dataset.from_arrays(q, position=point - error, time=time, approach=sides), error


def test_rp_of_five_visits_is_what_paper_gives() -> None:
    assert spread(FIVE + np.array([0.5, -0.3, 0.1])) == pytest.approx(RP_FIVE, rel=1e-12)
    data, error = visits((0.3, FIVE + 1e-3 * np.array([3.0, 4, 0])))
    found = repeatability(data, error)
    assert found is not None
    np.testing.assert_allclose(found.accuracy, [5e-3], rtol=1e-12)
    np.testing.assert_allclose(found.repeatability, [RP_FIVE], rtol=1e-12)
    assert found.sigma == pytest.approx(1e-3 * np.sqrt(10 / 12))
    assert (found.rp_visits, found.is_iso_9283) == (5, False)
    assert found.note is not None
    assert "30 visits" in found.note


@pytest.mark.parametrize("spread_of_keys", [2, 9, 10**13])
def test_rows_are_numbered_as_numpy_numbers_them(spread_of_keys: int) -> None:
    keys = np.random.default_rng(0).integers(-spread_of_keys, spread_of_keys, size=(300, 5))
    keys = np.vstack([keys, keys[::7]])
    np.testing.assert_array_equal(numbered(keys), np.unique(keys, axis=0, return_inverse=True)[1].ravel())
    assert len(numbered(keys[:0])) == 0


def test_both_sides_of_a_joint_are_two_poses_and_their_distance_is_vap() -> None:
    away = 1e-3 * np.array([0.0, 3, 4])
    data, error = visits((0.3, np.vstack([FIVE, FIVE + away])), approach=[1] * 5 + [-1] * 5)
    found = repeatability(data, error)
    assert found is not None
    assert found.poses == 2
    np.testing.assert_allclose(found.repeatability, [RP_FIVE, RP_FIVE], rtol=1e-12)
    np.testing.assert_allclose(found.direction_variation, [5e-3], rtol=1e-12)
    mixed, _ = visits((0.3, np.vstack([FIVE, FIVE + away])))
    assert repeatability(mixed, error).repeatability[0] > 1.1 * RP_FIVE  # type: ignore[union-attr]


def test_distances_between_poses_have_their_own_accuracy_and_repeatability() -> None:
    """Predicted apart by (0.4, 0.4, 0); the second pose's visits off along that line by 0, 1, 2, 3, 4 mm."""
    along = np.array([1.0, 1, 0]) / np.sqrt(2)
    off = -1e-3 * np.arange(5.0)[:, np.newaxis] * along  # predicted less measured
    data, error = visits((0.2, np.zeros((5, 3))), (0.6, off))
    found = repeatability(data, error)
    assert found is not None
    np.testing.assert_allclose(found.distance_accuracy, [2e-3], rtol=1e-9)
    np.testing.assert_allclose(found.distance_repeatability, [3e-3 * np.sqrt(2.5)], rtol=1e-9)


def test_drift_is_between_blocks_of_visits() -> None:
    time = np.concatenate([np.arange(5.0), 3600 + np.arange(5.0)])
    data, error = visits((0.3, np.vstack([FIVE, 2 * FIVE + [0, 0, 2e-3]])), time=time)
    found = repeatability(data, error)
    assert found is not None
    np.testing.assert_allclose(found.accuracy_drift, [2e-3], rtol=1e-9)
    np.testing.assert_allclose(found.repeatability_drift, [RP_FIVE], rtol=1e-9)


def test_turns_are_judged_about_the_tools_axes() -> None:
    """Turns about z of -2, -1, 0, 1, 2 mrad beside a predicted identity: mean 0, S^2 = 10 / 4."""
    half = 1e-3 * np.array([-2.0, -1, 0, 1, 2]) / 2
    turned = np.column_stack([np.cos(half), 0 * half, 0 * half, np.sin(half)])
    data = Dataset.from_arrays(np.full((5, 1), 0.3), position=np.zeros((5, 3)), rotation=turned)
    found = repeatability(data, FIVE, np.broadcast_to(np.eye(3), (5, 3, 3)))
    assert found is not None
    assert found.turn_accuracy is not None
    assert found.turn_repeatability is not None
    np.testing.assert_allclose(found.turn_accuracy, np.zeros((1, 3)), atol=1e-12)
    np.testing.assert_allclose(found.turn_repeatability, [[0, 0, 3e-3 * np.sqrt(2.5)]], atol=1e-9)


def test_thirty_visits_of_five_poses_are_iso_9283() -> None:
    rng = np.random.default_rng(1)
    groups = [(0.1 * k, rng.normal(0, 1e-4, (30, 3))) for k in range(5)]
    found = repeatability(*visits(*groups))
    assert found is not None
    assert found.is_iso_9283
    assert found.note is None
    assert found.to_json_dict()["iso_9283"] is True


def test_points_of_a_moved_tracker_are_reported_with_the_motion() -> None:
    rng = np.random.default_rng(2)
    predicted = rng.uniform(-1, 1, (30, 3))
    c, s = np.cos(0.4), np.sin(0.4)
    R, p = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([0.3, -2.0, 0.1])
    measured = predicted @ R.T + p + rng.normal(0, 1e-4, (30, 3))
    found = realigned(predicted, predicted - measured)
    assert found is not None
    np.testing.assert_allclose(found.motion[:3, :3], R, atol=2e-4)
    np.testing.assert_allclose(found.motion[:3, 3], p, atol=2e-4)
    assert found.to_json_dict()["rpy_deg"][2] == pytest.approx(np.degrees(0.4), abs=0.02)
    assert found.after.rms < 3e-4
    assert realigned(predicted, rng.normal(0, 1e-4, (30, 3))) is None


def test_a_target_that_sits_elsewhere_is_reported_with_its_shift() -> None:
    rng = np.random.default_rng(3)
    R = Rotation.random(30, random_state=4).as_matrix()
    shift = np.array([1.2e-3, -0.3e-3, 0.5e-3])
    found = remounted(R, rng.normal(0, 1e-4, (30, 3)) - R @ shift)
    assert found is not None
    np.testing.assert_allclose(found.shift, shift, atol=6e-5)
    assert found.after.rms < 3e-4
    assert found.to_json_dict()["xyz_mm"] == pytest.approx(1e3 * found.shift)
    assert remounted(R, rng.normal(0, 1e-4, (30, 3))) is None
    assert remounted(R, np.tile([1e-3, 0.0, 0.0], (30, 1))) is None  # the base stands elsewhere


def test_test_rows_of_another_target_are_told() -> None:
    robot = load_robot("ur5")
    data = simulate(perturbed(robot, seed=1), random_poses(robot, 40, seed=2), noise=5e-5, seed=3)
    moved = simulate(perturbed(robot, seed=1), random_poses(robot, 20, seed=4), noise=5e-5, seed=5)
    turned = perturbed(robot, seed=1).forward(moved.q)[:, :3, :3]
    moved = replace(moved, position=moved.position + turned @ [1.2e-3, 0.0, 0.0], source="test.csv")
    (told,) = [str(note) for note in calibrate(robot, data, test=moved).notes if "sits elsewhere" in str(note)]
    assert told.startswith("test.csv: these rows fit with 0.")
    assert "on the tool, by 1.2" in told


def test_rows_that_repeat_are_grouped_in_the_order_they_are_met() -> None:
    random = np.random.default_rng(0)
    group = random.integers(0, 60, 100)
    rows = np.flatnonzero(random.random(100) < 0.8)
    wanted = [rows[group[rows] == g] for g in dict.fromkeys(group[rows].tolist())]
    found = repeated_rows(group, rows)
    assert [part.tolist() for part in found] == [part.tolist() for part in wanted if len(part) > 1]
    assert repeated_rows(group, rows[:0]) == []
    assert repeated_rows(np.arange(5), np.arange(5)) == []


@pytest.mark.parametrize("kind", ["position", "length", "tilt", "orientation"])
def test_pure_noise_of_any_kind_comes_from_postures_that_were_read_again(kind: str) -> None:
    """Numbers by hand: each posture three times, and what a model predicts does not matter."""
    from dataclasses import replace

    from fastcal.calibration.kind_errors import KindErrors
    from fastcal.calibration.kind_repeats import repeats_of
    from fastcal.measurements.kinds import kind_named

    from .kind_sets import read

    data = read((kind,), 20, 3)
    rows = np.repeat(np.arange(20), 3)
    random = np.random.default_rng(4)
    misfit = random.standard_normal((20, 2, 3))[rows]
    noise = 2e-5 * random.standard_normal((60, 2, 3))
    noise[7, 1] = np.nan
    visits = data.select(rows)
    if kind == "length":  # another anchor is another reading
        assert visits.anchor is not None
        visits = replace(visits, anchor=np.where(np.arange(60) == 0, (visits.anchor[0] + 1) % 3, visits.anchor))
    found = repeats_of(visits, KindErrors(kind_named(kind), misfit + noise))
    groups = [list(range(3 * k, 3 * k + 3)) for k in range(20)]
    if kind == "length":
        groups[0] = [1, 2]
    square = freedom = 0.0
    for rows_of_one in groups:
        for i in range(2):
            for c in range(3):
                own = noise[rows_of_one, i, c]
                own = own[~np.isnan(own)]
                square += np.sum((own - own.mean()) ** 2)
                freedom += len(own) - 1
    assert found is not None
    assert found.freedom == freedom
    assert found.sigma == pytest.approx((square / freedom) ** 0.5, rel=1e-9)
    assert repeats_of(data, KindErrors(kind_named(kind), misfit[:20])) is None


def test_lengths_that_were_read_again_say_how_much_of_what_remains_is_noise() -> None:
    from fastcal import calibrate
    from fastcal.report.next_step import known_floor, next_step

    from .bench_arm import postures, robot
    from .kind_sets import NOISE, read

    data = read(("length",), seed=3, q=np.repeat(postures(80, 53), 2, axis=0))
    found = calibrate(robot(), data)
    assert found.train.repeats["length"].sigma == pytest.approx(NOISE["length"], rel=0.4)
    assert known_floor(found) == pytest.approx(1e3 * found.train.repeats["length"].sigma)
    assert "what remains looks like noise" in next_step(found)
    assert found.to_json_dict()["train"]["kinds"]["length"]["repeats"]["freedom"] > 10
