# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A result is never worse on its own rows than the nominal arm with base and tool fitted, and there always is one."""

import numpy as np
import pytest

from fastcal import Robot, load_robot, simulate
from fastcal.calibration import best_fit as fitting
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.never_worse import Errors
from fastcal.calibration.problem import CalibrationProblem, prepare
from fastcal.calibration.shrinkage import start_of
from fastcal.calibration.simulation import perturbed, random_poses
from fastcal.measurements.dataset import Dataset

ARM = load_robot("kuka_kr500_3")


def along_a_path(wave: float, rows: int = 200, seed: int = 0) -> Dataset:
    """Poses one after the other on a smooth path, of an arm whose second and third joint err by a wave [rad]."""
    rng = np.random.default_rng(seed)
    low, high = ARM.limits.T
    s = np.linspace(0, 2 * np.pi, rows)[:, np.newaxis]
    phase, share = rng.uniform(0, 2 * np.pi, 6), rng.uniform(0.2, 0.4, 6)
    q = (low + high) / 2 + (high - low) * share / 2 * np.sin(s + phase)
    bent = q.copy()
    bent[:, 1:3] += wave * np.sin(3 * q[:, 1:3] + 0.4)
    data = simulate(perturbed(ARM, seed=seed), Dataset.from_arrays(bent), noise=3e-5, seed=seed)
    return Dataset.from_arrays(q, position=data.position, robot=ARM)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("loss", ["tukey", "huber", "none"])
def test_a_path_with_waves_is_never_worse(seed: int, loss: str) -> None:
    result = calibrate(ARM, along_a_path(5e-3, seed=seed), loss=loss)
    assert result.parameters
    assert result.train.before is not None
    assert result.train.after is not None
    assert result.train.after.rms <= result.train.before.rms


@pytest.mark.parametrize(("far", "apart", "seed"), [(1.2, 20, 1), (1.6, 10, 0), (1.6, 20, 0), (1.6, 20, 2)])
def test_a_few_rows_far_from_the_others_are_not_given_up(far: float, apart: int, seed: int) -> None:
    """Joints err by waves that the geometry follows where most rows are: it goes astray where a few others lie.

    Found on an iiwa of others, whose 21 first rows had been measured near its vertical: 1.25 mm before, 1.66 after.
    """
    arm = load_robot("lbr_iiwa7")
    q = np.vstack([random_poses(arm, apart, seed=seed + 100) * 0.15, random_poses(arm, 220, seed=seed) * 0.3])
    q[:apart, 1] += far
    q[:apart, 3] -= far
    bent = q.copy()
    bent[:, 1] += 3e-3 * np.sin(2 * q[:, 1])
    bent[:, 3] += 3e-3 * np.sin(2 * q[:, 3] + 1)
    data = simulate(arm, Dataset.from_arrays(bent), noise=5e-5, seed=seed)
    result = calibrate(arm, Dataset.from_arrays(q, position=data.position, robot=arm))
    assert result.train.before is not None
    assert result.train.after is not None
    assert result.train.after.rms < result.train.before.rms
    assert any("the result is" in note for note in result.notes)


def test_gross_rows_are_no_argument_against_a_robust_fit() -> None:
    """Three rows are off by a metre: least squares bends to them, and misses all rows by less on the whole."""
    true = perturbed(ARM, seed=1)
    q = random_poses(ARM, 80, seed=1)
    position = np.array(simulate(true, q, noise=3e-5, seed=1).position)
    position[[5, 17, 60]] += 1.0
    result = calibrate(ARM, Dataset.from_arrays(q, position=position), as_read=True)
    assert result.outliers == [5, 17, 60]
    new = random_poses(ARM, 50, seed=2)
    assert np.abs(result.model.forward(new)[:, :3, 3] - true.forward(new)[:, :3, 3]).max() < 2e-4
    assert not any("the result is" in note for note in result.notes)


@pytest.mark.parametrize("effects", ["reduction_ratio@joint2", "joint_compliance@joint2"])
def test_least_squares_with_gross_rows_stays_what_was_asked_for(effects: str) -> None:
    """More parameters cannot fit the same rows worse; judged on all but its outliers, it was refused."""
    true = perturbed(ARM, seed=1)
    q = random_poses(ARM, 80, seed=1)
    position = np.array(simulate(true, q, noise=3e-5, seed=1).position)
    position[[5, 60]] += 0.05
    result = calibrate(ARM, Dataset.from_arrays(q, position=position), effects=effects, loss="none", as_read=True)
    assert result.status == "converged", result.message
    assert any(p.owner == "joint2" for p in result.parameters)


def test_a_fit_that_does_not_converge_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """The robust loss is made to fail: least squares is written, in words; where all fail, base and tool alone."""
    q = random_poses(ARM, 60, seed=3)
    data = simulate(perturbed(ARM, seed=3), q, noise=3e-5, seed=3)
    whole = CalibrationProblem.identify
    failing = {"tukey", "huber"}

    class Failed:
        status = "not_converged"

        def __init__(self, found: object) -> None:
            self._found = found

        def __getattr__(self, name: str) -> object:
            return getattr(self._found, name)

    def identify(problem: CalibrationProblem, **options: object) -> object:
        found = whole(problem, **options)
        is_arm = any(problem.parameters[i].owner not in ("base", "tool") for i in problem.asked)
        return Failed(found) if problem.loss in failing and is_arm else found

    monkeypatch.setattr(CalibrationProblem, "identify", identify)
    result = calibrate(ARM, data)
    assert (result.status, result.loss) == ("converged", "none")
    assert any(
        "the fit with the loss tukey did not converge: the result is that of least squares" in n for n in result.notes
    )
    failing.add("none")
    result = calibrate(ARM, data)
    assert result.status == "not_converged"
    assert result.message.endswith("base and tool alone are fitted")
    assert {p.owner for p in result.parameters} == {"base", "tool"}
    assert result.model.spec["joints"] == ARM.spec["joints"]


def test_errors_are_in_units_of_what_base_and_tool_leave() -> None:
    q = random_poses(ARM, 60, seed=4)
    data = simulate(perturbed(ARM, seed=4), q, noise=3e-5, noise_rotation=1e-4, seed=4)
    problem = prepare(ARM, data, effects="geometry")
    before = Errors(problem).of(start_of(problem))
    T = Robot(problem.robot.spec).core.with_base_and_tool(
        problem.alignment.T_world_base, problem.alignment.T_flange_tool
    )
    assert T is not None
    assert len(before) == 60
    assert np.median(before) == pytest.approx(1.0, rel=0.4)
    assert fitting.Way().checks


def test_rows_of_one_payload_are_no_outliers() -> None:
    """45 of 100 poses, loaded and 1.2 mm lower: a robust fit gave them up, for 0.81 mm where there were 0.60."""
    q, payload = random_poses(ARM, 100, seed=0), np.where(np.random.default_rng(0).permutation(100) < 45, 480.0, 0.0)
    true = perturbed(ARM, seed=0, length=2e-5, angle=1e-5)
    data = simulate(true, Dataset.from_arrays(q, payload=payload), noise=1e-5, seed=0)
    assert data.position is not None
    low = data.position - 1.2e-3 * (payload > 0)[:, np.newaxis] * [0.0, 0.0, 1.0]
    result = calibrate(ARM, Dataset.from_arrays(q, position=low, payload=payload, robot=ARM))
    assert result.outliers == []
    assert result.train.before is not None
    assert result.train.after is not None
    assert result.train.after.rms <= result.train.before.rms


@pytest.mark.parametrize("seed", [4, 5])
def test_base_and_tool_alone_are_not_set_beside_themselves(seed: int) -> None:
    """Their few outliers are farther off by a robust loss than by least squares: that is what it is for."""
    data = simulate(ARM, Dataset.from_arrays(random_poses(ARM, 24, seed=seed)), noise=5e-5, seed=seed)
    position = np.array(data.position)
    position[:2] += 1.5e-4
    result = calibrate(ARM, Dataset.from_arrays(data.q, position=position, robot=ARM), effects=[])
    assert result.loss == "tukey"
    assert not [note for note in result.notes if "nominal arm" in note]
