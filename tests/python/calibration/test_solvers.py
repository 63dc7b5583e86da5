# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Newton's steps and Ceres' trust region alone come to the same minimum, on every measured set that is there."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.cli.app import main
from fastcal.errors import InvalidInput

BESIDE = Path(__file__).resolve().parents[4] / "shared" / "data"
MEASURED = [path.parent for path in BESIDE.rglob("measurements.csv")]
SETS = sorted(folder.relative_to(BESIDE) for folder in MEASURED if (folder / "robot.yaml").exists())
SAME = 0.01  # standard deviations of a parameter: both stop where far less than this matters


def both(robot: fastcal.Robot, data: fastcal.Dataset, loss: str) -> tuple[CalibrationResult, CalibrationResult]:
    asked: dict[str, Any] = {"loss": loss, "checks": False, "priors": False}
    newton, ceres = (calibrate(robot, data, solver=each, **asked) for each in ("newton", "ceres"))
    return newton, ceres


def apart(newton: CalibrationResult, ceres: CalibrationResult) -> float:
    """The largest difference of a parameter in standard deviations."""
    a, b = ({(p.owner, p.name): p for p in found.parameters} for found in (newton, ceres))
    assert a.keys() == b.keys()
    known = [key for key in a if a[key].std]
    return max((abs(a[key].value - b[key].value) / a[key].std for key in known), default=0.0)


@pytest.mark.parametrize("place", SETS or [Path("ur5_tracker")], ids=str)
def test_both_come_to_the_same_minimum(place: Path, shared_data: Path) -> None:
    folder = shared_data / str(place)
    arm = fastcal.load_robot(folder / "robot.yaml")
    data = fastcal.load_measurements(folder / "measurements.csv", arm)
    newton, ceres = both(arm, data, "none")
    assert ceres.status == newton.status
    assert apart(newton, ceres) < SAME


def test_a_robust_loss_comes_to_the_same_too(shared_data: Path) -> None:
    folder = shared_data / "ur5_tracker"
    arm = fastcal.load_robot(folder / "robot.yaml")
    data = fastcal.load_measurements(folder / "measurements.csv", arm).select(slice(120))
    for loss in ("tukey", "huber"):
        newton, ceres = both(arm, data, loss)
        assert ceres.status == "converged"
        assert apart(newton, ceres) < SAME
    assert (newton.method, ceres.method) == ("nls", "ceres")
    assert ceres.to_json_dict()["method"] == "ceres"


def test_the_command_asks_for_it(shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / "ur5_tracker"
    line = ["calibrate", f"{folder}/robot.yaml", f"{folder}/measurements.csv", "-o", f"{tmp_path}/out"]
    assert main([*line, "--solver", "ceres"]) == 0
    assert "trust region only" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8").replace("&#39;", "'")


def test_other_solvers_are_refused() -> None:
    arm = fastcal.load_robot("ur5")
    data = fastcal.simulate(arm, np.zeros((3, 6)))
    with pytest.raises(InvalidInput, match="solver must be one of newton, ceres, got 'adam'"):
        calibrate(arm, data, solver="adam")
    with pytest.raises(InvalidInput, match="the solver ceres is for the method nls, got 'bfgs'"):
        calibrate(arm, data, solver="ceres", method="bfgs")
