# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Residuals that speak against a fit: a part that moved, noise with memory, an effect that is missing."""

import json
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import fft, special
from scipy.spatial.transform import Rotation

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.lack_of_fit import posture_p_value
from fastcal.calibration.serial_correlation import _fast_length, serial_correlation
from fastcal.calibration.shifted_rows import find_shift
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset

Array = NDArray[np.float64]

BENCH = Path(__file__).parents[3] / "bench" / "python"


def _bench() -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(BENCH)
        return runpy.run_path(str(BENCH / "bench_honest.py"))


Case, Simulator, run, table, CASES = (_bench()[name] for name in ("Case", "Simulator", "run", "table", "CASES"))


def calibrated(data: Dataset, loss: str = "tukey") -> CalibrationResult:
    return calibrate(load_robot("staubli_rx160l"), data, loss=loss)


@pytest.mark.parametrize("first", [60, 72])
def test_a_tracker_that_was_bumped_is_found_at_its_row_and_does_no_harm(first: int) -> None:
    simulator = Simulator(3, Case(poses=120))
    data = simulator.measured()
    moved = np.array(data.position)
    moved[first:] += [3e-3, -2e-3, 3e-3]
    result = calibrated(Dataset.from_arrays(data.q, position=moved))
    assert any(f"from row {first} on the points lie elsewhere, by 4.7 mm" in note for note in result.notes)
    assert result.outliers == list(range(first, 120))
    clean = calibrated(data.select(slice(0, first)), "none")
    q = simulator.postures(100)
    error, least = (np.linalg.norm(r.model.forward(q)[:, :3, 3] - simulator.points(q)) for r in (result, clean))
    assert error < 1.5 * least
    plain = calibrated(Dataset.from_arrays(data.q, position=moved), "none")
    assert any(f"from row {first} on" in note for note in plain.notes)  # told, and all rows used as asked
    assert len(plain.train.data) == 120


@pytest.mark.parametrize("firsts", [(50, 90), (30, 60, 90)])
def test_several_bumps_are_found_at_their_rows(firsts: tuple[int, ...]) -> None:
    data = Simulator(3, Case(poses=140)).measured()
    points = np.array(data.position)
    for k, first in enumerate(firsts):
        points[first:] += (-1) ** k * np.array([2e-3, -3e-3, 1e-3 * (k + 1)])
    result = calibrated(Dataset.from_arrays(data.q, position=points))
    *most, last = map(str, firsts)
    where = f"from rows {', '.join(most)} and {last} on, each time again, the points lie elsewhere, by "
    (said,) = [note for note in result.notes if where in note]
    longest = max(np.split(np.arange(140), firsts), key=len)
    assert f"Only rows {longest[0]} to {longest[-1]} are used; give the parts different" in said
    assert result.outliers == np.setdiff1d(np.arange(140), longest).tolist()


def test_a_drift_is_no_bump() -> None:
    data = Simulator(4, Case(poses=120)).measured()
    drifting = np.array(data.position) + np.linspace(0, 1e-3, 120)[:, np.newaxis]
    result = calibrated(Dataset.from_arrays(data.q, position=drifting))
    assert not any("lie elsewhere" in note for note in result.notes)


def test_clean_data_bear_no_sentence() -> None:
    for seed in range(12):
        assert calibrated(Simulator(seed, Case(poses=80)).measured()).notes == []


def test_a_missing_effect_is_reported_to_spoil_the_intervals() -> None:
    found = run("missing effect", 8)
    assert found["said_that_intervals_do_not_hold"] == 1.0
    assert found["covered"] < 0.8  # so it is true


@pytest.mark.parametrize("name", ["white", "N = 10", "N = 13", "40 % gross", "AR(1) 0.8"])
def test_intervals_cover_where_data_are_thin_spoilt_or_remembering(name: str) -> None:
    """A few of the sets of bench_honest.py, whose table is in docs/noise-and-outliers.md."""
    found = run(name, 12)
    assert found["covered"] > 0.88 - 2 * found["standard_error"]


@pytest.mark.parametrize("seed", range(12))
def test_nearly_half_the_rows_may_be_gross(seed: int) -> None:
    """Some hide in the noise of the first fits, which the others spoil, until the refits have brought it down."""
    simulator = Simulator(seed, Case(poses=100, gross=0.45))
    data = simulator.measured()
    found = calibrated(data, "tukey")
    good = np.linalg.norm(simulator.points(data.q) - np.asarray(data.position), axis=1) < 5e-4
    least = calibrated(data.select(good), "none")
    q = simulator.postures(100)
    error = [np.linalg.norm(r.model.forward(q)[:, :3, 3] - simulator.points(q)) for r in (found, least)]
    assert error[0] < 1.5 * error[1]
    assert set(np.flatnonzero(~good)) <= set(found.outliers)
    assert found.sigma_mm == pytest.approx(0.05, rel=0.3)


@pytest.mark.parametrize(("poses", "seed"), [(18, 4), (20, 3), (25, 2)])
def test_few_rows_lose_their_gross_one_and_no_other(poses: int, seed: int) -> None:
    """Few degrees of freedom are left: a noise that does not count them makes outliers of sound rows."""
    data = Simulator(seed, Case(poses=poses)).measured()
    position = np.array(data.position)
    position[0] += 2e-3
    assert calibrated(Dataset.from_arrays(data.q, position=position)).outliers == [0]


@pytest.mark.parametrize("joint", range(6))
def test_one_joint_alone_does_not_determine_the_tool(joint: int) -> None:
    """Points on a circle: a turned tool and a turned base make the same ones. The tool stays near the robot file's."""
    simulator = Simulator(joint, Case())
    q = np.tile(simulator.postures(1), (60, 1))
    q[:, joint] = simulator.postures(60)[:, joint]
    result = calibrated(Dataset.from_arrays(q, position=simulator.points(q) + simulator.noise(60)))
    at = simulator.postures(100)
    error = np.abs(result.model.forward(at)[:, :3, 3] - simulator.points(at))
    assert np.linalg.norm(error, axis=1).max() < 0.1
    assert np.mean(error < 1.96 * result.model.position_deviation(at)) >= 0.9


def test_the_table_of_the_page_is_that_of_the_committed_figures() -> None:
    found = json.loads((BENCH / "bench_honest.json").read_text())
    assert table(found) in (BENCH.parents[1] / "docs" / "noise-and-outliers.md").read_text()
    assert list(found) == [name for name in CASES if name in found]
    assert all(row["sets"] >= 300 for row in found.values())
    assert all(row["covered"] >= 0.9 for name, row in found.items() if name != "missing effect")


def test_memory_of_the_noise_is_found_and_its_share_of_a_mean() -> None:
    """Of the mean of N rows AR(1) leaves the variance (1 + rho) / (1 - rho) / N, for long rows."""
    rng = np.random.default_rng(1)
    count, rho = 4000, 0.8
    e = rng.normal(size=count)
    for k in range(1, count):
        e[k] = rho * e[k - 1] + (1 - rho**2) ** 0.5 * e[k]
    found = serial_correlation(np.ones((count, 1)), e - e.mean(), np.arange(count), count)
    assert found is not None
    assert found.rho == pytest.approx(rho, abs=0.03)
    assert found.covariance[0, 0] == pytest.approx((1 + rho) / (1 - rho) / count, rel=0.2)
    assert found.freedom == pytest.approx(count * (1 - rho**2) / (1 + rho**2), rel=0.2)
    white = rng.normal(size=count)
    assert serial_correlation(np.ones((count, 1)), white - white.mean(), np.arange(count), count) is None


def test_the_memory_is_the_one_that_leaves_neighbours_as_alike_as_they_are() -> None:
    """By whole matrices: the expected product of neighbouring residuals over that of their squares is the one found.

    Rows without a number lie between the others, which hold two numbers each.
    """
    rng = np.random.default_rng(6)
    count, width = 80, 2
    rows = np.sort(rng.choice(count, 70, replace=False))
    e = rng.normal(size=(count, width))
    for k in range(1, count):
        e[k] += 0.7 * e[k - 1]
    J = rng.normal(size=(width * len(rows), 9))
    M = np.eye(len(J)) - J @ np.linalg.pinv(J)
    left = M @ e[rows].ravel()
    found = serial_correlation(J, left, np.repeat(rows, width), count)
    assert found is not None
    apart = np.abs(np.subtract.outer(rows, rows))
    covariance = M @ np.kron(found.rho**apart, np.eye(width)) @ M
    neighbours = np.kron(np.triu(apart == 1), np.eye(width))
    of_noise = np.sum(neighbours * covariance) / np.trace(covariance)
    assert of_noise == pytest.approx(left @ neighbours @ left / (left @ left), abs=1e-5)


def test_spectra_are_as_long_as_scipy_would_make_them() -> None:
    for least in (*range(1, 2000), 600_001, 6_000_123):
        assert _fast_length(least) == fft.next_fast_len(least, real=True)


def test_columns_that_change_slowly_hide_no_memory() -> None:
    """They take slow noise away: neighbours that they leave are less alike than those of white noise without them."""
    rng = np.random.default_rng(3)
    count = 90
    J = np.polynomial.legendre.legvander(np.linspace(-1, 1, count), 24)

    def is_seen(rho: float) -> bool:
        e = rng.normal(size=count)
        for k in range(1, count):
            e[k] = rho * e[k - 1] + (1 - rho**2) ** 0.5 * e[k]
        left = e - J @ np.linalg.lstsq(J, e, rcond=None)[0]
        return serial_correlation(J, left, np.arange(count), count, deviations=2.0) is not None

    assert np.mean([is_seen(0.0) for _ in range(1000)]) == pytest.approx(special.ndtr(-2.0), abs=0.012)
    assert np.mean([is_seen(0.7) for _ in range(200)]) > 0.5


def test_p_values_of_white_residuals_are_uniform() -> None:
    rng = np.random.default_rng(2)
    J, lever, features = rng.normal(size=(150, 10)), rng.normal(size=(150, 6)), rng.normal(size=(50, 9))
    p = np.array([posture_p_value(J, rng.normal(size=150), lever, features).alike for _ in range(300)])
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.04)
    assert np.mean(p < 0.5) == pytest.approx(0.5, abs=0.1)
    long = 1 + 3 * (np.arange(50) % 5 == 0)
    uneven = (np.repeat(long, 3) * rng.normal(size=150) for _ in range(300))
    p = np.array([posture_p_value(J, e, lever, features).any_size for e in uneven])
    assert np.mean(p < 0.05) < 0.08  # where some rows are four times as noisy
    dependent = rng.normal(size=150) + 2 * lever[:, 1] * np.repeat(features[:, 3], 3)
    assert posture_p_value(J, dependent, lever, features).any_size < 1e-4


def slow_errors(seed: int, rows: int = 20) -> tuple[Array, list[Array], Array, NDArray[np.intp]]:
    """Corners of a plate along a path of slow turns: motions of base and plate, and errors that are slow."""
    random, t = np.random.default_rng(seed), np.linspace(0, 1, rows)

    def slow() -> Array:
        waves = (np.sin(np.pi * k * t[:, np.newaxis] + random.uniform(0, 6, 3)) / k for k in (1, 2, 3))
        return np.asarray(sum(random.normal(size=3) * wave for wave in waves))

    R, p = Rotation.from_rotvec(0.3 * slow()).as_matrix(), 0.1 * slow()
    plate = np.column_stack([random.uniform(-0.05, 0.05, (8, 2)), np.zeros(8)])
    about = np.einsum("nij,kj->nki", R, plate)
    shift, turn = 1e-4 * slow(), 1e-3 * slow()
    error = shift[:, np.newaxis] + np.cross(turn[:, np.newaxis], about)
    axes = np.eye(3)
    base = [*(np.broadcast_to(e, about.shape) for e in axes), *(np.cross(e, about + p[:, np.newaxis]) for e in axes)]
    own = [*(np.broadcast_to(R[:, np.newaxis, :, k], about.shape) for k in range(3))]
    own += [np.einsum("nij,kj->nki", R, np.cross(e, plate)) for e in axes]
    motions = [np.stack(of, axis=-1).reshape(-1, 6) / 1e-5 for of in (base, own)]
    residual = error.ravel() / 1e-5 + random.normal(size=error.size)
    return np.hstack(motions), motions, residual, np.repeat(np.arange(rows), 24)


def test_errors_that_change_slowly_along_a_path_are_no_move() -> None:
    """Of a public plate before a camera: "from rows 4 and 11 on ... moved. Only rows 11 to 19 are used"."""
    found = [find_shift(*slow_errors(seed), 1e-5) for seed in range(40)]
    assert sum(shift is not None for shift in found) > 5  # by their squares alone they are
    assert not [shift for shift in found if shift is not None and shift.stands_out]


def test_a_move_beside_noise_stands_out_at_its_row() -> None:
    found = []
    for seed in range(10):
        J, motions, residual, row = slow_errors(seed)
        random = np.random.default_rng(seed)
        by = motions[seed % 2] @ (1e-4 * np.r_[random.normal(size=3), 2 * random.normal(size=3)])
        found.append(find_shift(J, motions, random.normal(size=len(residual)) + by * (row >= 9), row, 1e-5))
    there = [shift for shift in found if shift is not None]  # of the others the parameters make up for it
    assert len(there) >= 6
    assert all(shift.stands_out and shift.firsts == (9,) for shift in there)
