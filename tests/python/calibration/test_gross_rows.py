# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Beyond what a robust fit bears: gross rows that agree with one another, and more of them than sound ones."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.consensus import Rows, agreeing_rows, leave_freedom
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.row_words import row_ranges
from fastcal.report.language import _, in_language
from fastcal.report.next_step import step

Array = NDArray[np.float64]

BENCH = Path(__file__).parents[3] / "bench" / "python"
ROWS = 100
OFFSET = np.array([3e-3, -2e-3, 3e-3])


def _bench() -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(BENCH)
        return runpy.run_path(str(BENCH / "bench_honest.py"))


Case, Simulator = (_bench()[name] for name in ("Case", "Simulator"))


class Spoilt:
    """A set of ROWS rows, a share of them gross in one way, and what becomes of it."""

    def __init__(self, seed: int, share: float, way: str) -> None:
        self.simulator = Simulator(seed, Case(poses=ROWS))
        data = self.simulator.measured()
        rng = np.random.default_rng([seed, 1])
        bad = rng.permutation(ROWS)[: round(share * ROWS)]
        if way == "one posture":
            bad = np.argsort(data.q[:, 1])[: len(bad)]
        direction = rng.normal(size=(len(bad), 3))
        scattered = (
            rng.uniform(1e-3, 2e-2, (len(bad), 1)) * direction / np.linalg.norm(direction, axis=1, keepdims=True)
        )
        position = np.array(data.position)
        position[bad] += {
            "scattered": scattered,
            "one posture": scattered,
            "small": 0.4 * scattered,
            "elsewhere": OFFSET,
            "elsewhere, scattered": 2 * OFFSET + rng.normal(0, 1e-3, (len(bad), 3)),
        }[way]
        self.data = Dataset.from_arrays(data.q, position=position)
        self.bad = sorted(bad.tolist())
        self.good = np.setdiff1d(np.arange(ROWS), bad)

    def error(self, result: CalibrationResult) -> float:
        """[m] RMS at new poses."""
        q = self.simulator.postures(100)
        return float(np.sqrt(np.mean((result.model.forward(q)[:, :3, 3] - self.simulator.points(q)) ** 2)))

    def calibrated(self) -> CalibrationResult:
        return calibrate(load_robot("staubli_rx160l"), self.data)

    def least(self) -> CalibrationResult:
        """The same without the gross rows."""
        return calibrate(load_robot("staubli_rx160l"), self.data.select(self.good), loss="none", checks=False)


WAYS = ["scattered", "one posture", "small", "elsewhere", "elsewhere, scattered"]


# Seven tenths that agree on another place are a majority that anyone would believe.
CASES = [(share, way) for share in (0.3, 0.4, 0.5, 0.6, 0.7) for way in WAYS if share < 0.7 or "elsewhere" not in way]


@pytest.mark.parametrize(("share", "way"), CASES)
def test_the_answer_is_right_or_refused(share: float, way: str) -> None:
    spoilt = Spoilt(0, share, way)
    result = spoilt.calibrated()
    right = spoilt.error(result) < 1.5 * spoilt.error(spoilt.least())
    assert right or result.status == "not_converged"
    if share == 0.3:
        assert result.status == "converged"
    if result.status == "converged":
        assert set(spoilt.bad) <= set(result.outliers)
        assert result.weights[spoilt.bad].max() < 0.05
        assert result.sigma_mm == pytest.approx(0.05, rel=0.3)


def test_where_fewer_than_half_agree_the_refusal_counts_them() -> None:
    result = Spoilt(1, 0.6, "scattered").calibrated()
    assert result.status == "not_converged"
    assert result.message.startswith("only 40 of 100 rows agree with one another, to 0.0")
    good = np.setdiff1d(np.arange(100), Spoilt(1, 0.6, "scattered").bad)
    assert f" mm (rows {row_ranges(good)}); where fewer" in result.message
    assert step(result) == "measure again, or leave the bad rows out"


def test_two_places_of_the_tracker_are_refused_where_neither_is_the_rule() -> None:
    result = Spoilt(2, 0.4, "elsewhere").calibrated()
    assert result.status == "not_converged"
    assert result.message.startswith("60 rows agree with one another to 0.0")
    assert " and 40 others to 0.0" in result.message
    assert step(result) == "give the two parts different `station` or `mount` labels"


def test_a_few_rows_from_another_place_are_left_out_with_a_word() -> None:
    spoilt = Spoilt(3, 0.3, "elsewhere")
    result = spoilt.calibrated()
    assert result.status == "converged"
    assert result.outliers == spoilt.bad
    (note,) = (note for note in result.notes if note.endswith("only the 70 are used"))
    assert "30 others to 0.0" in note
    assert f" on another fit (rows {row_ranges(spoilt.bad)}): " in note
    with in_language("de"):
        assert f" (Zeilen {_(row_ranges(spoilt.bad))}): " in _(note)


def test_a_missing_effect_makes_no_gross_rows() -> None:
    """Half of the rows bear a load under which the arm sags by far more than the noise: all are used."""
    simulator = Simulator(4, Case(poses=ROWS))
    q = simulator.postures(ROWS)
    load = np.where(np.arange(ROWS) % 2 == 0, 0.0, 30.0)
    bent = q.copy()
    bent[:, 1] += 1e-4 * load * np.sin(q[:, 1])
    data = Dataset.from_arrays(q, position=simulator.points(bent) + simulator.noise(ROWS), payload=load)
    result = calibrate(load_robot("staubli_rx160l"), data)
    assert result.status == "converged"
    assert len(result.outliers) < ROWS / 10
    assert any("an effect is missing" in note for note in result.notes)


def test_rows_that_agree_are_found_in_a_plain_linear_problem() -> None:
    """Independent of any robot: of 60 rows 24 lie on one plane of parameters, the others anywhere."""
    rng = np.random.default_rng(5)
    J, truth = rng.normal(size=(60, 3, 6)), rng.normal(size=6)
    residual = -np.einsum("ncp,p->nc", J, truth) + rng.normal(0, 0.01, (60, 3))
    bad = np.arange(24, 60)
    residual[bad] += rng.normal(0, 5.0, (36, 3))
    every = np.ones(60, dtype=bool)
    found = agreeing_rows(Rows(J, residual, 6), every, 1e-3)
    assert found is not None
    assert np.flatnonzero(found).tolist() == list(range(24))
    noise = -np.einsum("ncp,p->nc", J, truth) + rng.normal(0, 1.0, (60, 3))
    assert agreeing_rows(Rows(J, noise, 6), every, 1e-3) is None


def test_squares_are_those_of_a_least_squares_fit_that_is_held() -> None:
    """Both ways, beside `lstsq` with a row for each parameter; the last column shows nothing that is new."""
    rng = np.random.default_rng(7)
    J, residual = rng.normal(size=(30, 3, 5)), rng.normal(size=(30, 3))
    J = np.concatenate([J, J @ rng.normal(size=(5, 1))], axis=2)
    rows, held = Rows(J, residual, 5), 0.3
    picked = np.array([[0, 7, 19, 28], [3, 4, 5, 29]])
    chosen = np.zeros((2, 30), dtype=bool)
    np.put_along_axis(chosen, picked, True, axis=1)
    for each, squares, few in zip(chosen, rows.squares(chosen, held), rows.squares_of_few(picked, held), strict=True):
        system = np.vstack([J[each].reshape(-1, 6), np.sqrt(held) * np.eye(6)])
        x = np.linalg.lstsq(system, -np.concatenate([residual[each].ravel(), np.zeros(6)]), rcond=None)[0]
        expected = np.sum((residual + J @ x) ** 2, axis=1)
        np.testing.assert_allclose(squares, expected, rtol=1e-9)
        np.testing.assert_allclose(few, expected, rtol=1e-9)


def test_rows_that_are_a_few_times_noisier_are_not_gross() -> None:
    rng = np.random.default_rng(6)
    J = rng.normal(size=(100, 3, 6))
    noise = np.where(np.arange(100) < 60, 0.1, 0.4)[:, np.newaxis]
    residual = -np.einsum("ncp,p->nc", J, rng.normal(size=6)) + noise * rng.normal(size=(100, 3))
    assert agreeing_rows(Rows(J, residual, 6), np.ones(100, dtype=bool), 1e-3) is None


def test_no_set_is_searched_for_where_a_fit_bends_to_any() -> None:
    """With two thirds of the numbers of the rows that are searched in the fit, no set is left a third."""
    rng = np.random.default_rng(8)
    J, residual = rng.normal(size=(30, 3, 70)), rng.normal(size=(30, 3))
    assert agreeing_rows(Rows(J, residual, 70), np.ones(30, dtype=bool), 1e-3) is None
    assert not leave_freedom(30, 70)
    assert leave_freedom(30, 60)
    assert not leave_freedom(100_000, 401)  # 200 of them are searched
    assert leave_freedom(100_000, 400)
    assert not leave_freedom(0, 1)


def test_rows_that_show_one_way_are_solved_whatever_their_noise() -> None:
    # Some rows weigh so much that the pull on what they do not show is lost beside them.
    random = np.random.default_rng(5)
    J = random.standard_normal((40, 3, 4))
    J[:30] = 2.0**30 * random.integers(1, 9, (30, 3, 1)) * np.ones(4)
    residual = J @ np.array([1.0, -2.0, 0.5, 3.0])
    rows, few = Rows(J, residual, 4), np.arange(40) < 10
    for left in (rows.squares(few[np.newaxis], 1e-30), rows.squares_of_few(np.arange(10)[np.newaxis], 1e-30)):
        assert left[0, :30].max() < 1e-9 * np.square(residual[:30]).sum(axis=1).max()
    assert agreeing_rows(rows, np.ones(40, dtype=bool), 1e-12) is None


@pytest.mark.parametrize(("noise", "contradicts"), [(5.0, False), (30.0, True)])
def test_rows_of_one_station_say_nothing_of_where_another_is(noise: float, contradicts: bool) -> None:
    """Two stations, each with an offset of its own: only how the rows of the second err can contradict the first."""
    random = np.random.default_rng(3)
    J = np.zeros((80, 3, 6))
    J[:50, :, :3] = J[50:, :, 3:] = np.eye(3)
    residual = random.normal(0.0, 1.0, (80, 3))
    residual[50:] *= noise
    residual[50:] += [300.0, -500.0, 200.0]
    rows, first = Rows(J, residual, 6), np.arange(80) < 50
    assert rows.are_gross(first[np.newaxis], 1e-9)[0]
    assert rows.contradict(first, 1e-9) == contradicts
    found = agreeing_rows(rows, np.ones(80, dtype=bool), 1e-3)
    assert (found is not None) == contradicts
