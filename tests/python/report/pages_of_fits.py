# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pages of calibrations and diagnoses with every verdict, of simulated arms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import fastcal
from fastcal.cli import main as command
from fastcal.io.results import read_json
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

NOISE = 3e-5  # of a measured coordinate [m]

CASES: dict[str, Callable[[Path], Path]] = {}


def case(make: Callable[[Path], Path]) -> Callable[[Path], Path]:
    """Keeps what makes a page in a folder under its name."""
    CASES[make.__name__] = make
    return make


def run(*arguments: str | Path) -> int:
    """The exit code of a command, which says nothing."""
    return command([str(argument) for argument in (*arguments, "--quiet")])


def entry(effect: str, owner: str, **parameters: float) -> dict[str, Any]:
    """An effect as a robot file has it."""
    return {"effect": effect, "owner": owner, "parameters": parameters}


YIELDS = entry("joint_compliance", "joint2", compliance_rad_nm=6e-6)
WAVE = entry("gear_harmonic", "joint3", amplitude_rad=3e-4, phase_rad=0.7) | {"order": 2}
RATIO = entry("reduction_ratio", "joint1", error=4e-4)


def written(
    folder: Path,
    *effects: dict[str, Any],
    arm: str = "ur5e",
    rows: int = 100,
    test: int = 40,
    seed: int = 1,
    bent: Callable[[Dataset], Dataset] = lambda data: data,
    **columns: Any,
) -> Robot:
    """fit.csv and test.csv of an arm that is built as no two are, with effects that its file does not know.

    Args:
        folder: Where to.
        effects: What the file does not know.
        arm: Its name.
        rows: Of fit.csv.
        test: Of test.csv; 0: none.
        seed: Of all that is drawn.
        bent: What else becomes of measured rows.
        columns: Of both files, a function of the number of rows each.
    """
    nominal = fastcal.load_robot(arm)
    real = fastcal.perturbed(nominal.with_(effects=list(effects)), seed=seed)
    for name, count in (("fit", rows), ("test", test)):
        if count:
            q = fastcal.random_poses(nominal, count, seed=seed + len(name))
            own = {key: make(count) for key, make in columns.items()}
            data = bent(fastcal.simulate(real, Dataset.from_arrays(q, **own), noise=NOISE, seed=seed + len(name)))
            fastcal.write_measurements(folder / f"{name}.csv", data, nominal.joint_types)
    return nominal


def calibrated(folder: Path, *options: str) -> Path:
    """The page of a calibration of fit.csv."""
    tested = ["--test", folder / "test.csv"] if (folder / "test.csv").exists() else []
    run("calibrate", "ur5e", folder / "fit.csv", *tested, *options, "-o", folder / "out")
    return folder / "out" / "report.html"


def diagnosed(folder: Path, *options: str, arm: str = "ur5e") -> Path:
    """The page of a diagnosis of fit.csv."""
    tested = ["--test", folder / "test.csv"] if (folder / "test.csv").exists() else []
    run("diagnose", arm, folder / "fit.csv", *tested, *options, "-o", folder / "out")
    return folder / "out" / "report.html"


def payloads(count: int) -> Any:
    """Two payloads, row by row [kg]."""
    return np.where(np.arange(count) % 2, 4.0, 0.0)


def outlying(data: Dataset) -> Dataset:
    """Every fifteenth row a beam that was lost."""
    assert data.position is not None
    position = data.position.copy()
    position[7::15] += 0.004
    return replace(data, position=position)


def moved(data: Dataset) -> Dataset:
    """The tracker moved after three quarters of the rows."""
    assert data.position is not None
    position = data.position.copy()
    position[3 * len(data) // 4 :] += [0.003, -0.002, 0.001]
    return replace(data, position=position)


def humming(data: Dataset) -> Dataset:
    """A field in the room that no cause has, and an instrument whose noise is known."""
    assert data.position is not None
    field = np.exp(-np.sum((data.position - [0.4, 0.2, 0.5]) ** 2, axis=1) / 0.35**2)
    position = data.position + 1.2e-3 * np.outer(field, [1.0, 0.3, -0.6])
    return replace(data, position=position, sigma_position=np.full(position.shape, NOISE))


@case
def calibrate_good(folder: Path) -> Path:
    written(folder)
    return calibrated(folder, "--serial", "2024-0117", "--instrument", "Leica AT960", "--operator", "M. Huber")


@case
def calibrate_limit_missed(folder: Path) -> Path:
    written(folder, YIELDS)
    return calibrated(folder, "--limit-mm", "0.1")


@case
def calibrate_limit_cannot_tell(folder: Path) -> Path:
    written(folder)
    return calibrated(folder, "--limit-mm", "0.3")


@case
def calibrate_limit_met(folder: Path) -> Path:
    written(folder, test=70)
    return calibrated(folder, "--limit-mm", "0.3")


@case
def calibrate_outliers(folder: Path) -> Path:
    written(folder, rows=60, test=0, bent=outlying)
    return calibrated(folder)


@case
def calibrate_moved(folder: Path) -> Path:
    written(folder, rows=80, test=0, bent=moved)
    return calibrated(folder)


@case
def calibrate_effects(folder: Path) -> Path:
    written(folder, YIELDS, payload=payloads)
    return calibrated(folder, "--effects", "geometry,joint_compliance")


@case
def calibrate_not_observable(folder: Path) -> Path:
    nominal = written(folder, rows=40, test=0)
    data = fastcal.load_measurements(folder / "fit.csv", nominal)
    q = data.q.copy()
    q[:, 3:] = q[0, 3:]
    real = fastcal.perturbed(nominal, seed=1)
    fastcal.write_measurements(folder / "fit.csv", fastcal.simulate(real, q, noise=NOISE, seed=3), nominal.joint_types)
    return calibrated(folder)


@case
def calibrate_few(folder: Path) -> Path:
    written(folder, rows=9, test=0)
    return calibrated(folder)


@case
def calibrate_wrong_rows(folder: Path) -> Path:
    """Joints and points do not belong together: nothing converges to sense."""
    nominal = written(folder, rows=40, test=0)
    data = fastcal.load_measurements(folder / "fit.csv", nominal)
    assert data.position is not None
    shuffled = data.position[np.random.default_rng(3).permutation(len(data))]
    fastcal.write_measurements(folder / "fit.csv", replace(data, position=shuffled), nominal.joint_types)
    return calibrated(folder, "--as-read")


def scattered(data: Dataset) -> Dataset:
    """Six rows of ten are of nothing."""
    assert data.position is not None
    wrong = np.arange(len(data)) % 10 < 6
    far = np.random.default_rng(1).normal(scale=0.008, size=data.position.shape)
    return replace(data, position=data.position + np.where(wrong[:, None], far, 0.0))


@case
def calibrate_not_converged(folder: Path) -> Path:
    """Fewer than half of the rows agree with one another."""
    written(folder, rows=100, test=0, bent=scattered)
    page = calibrated(folder)
    assert read_json(folder / "out" / "result.json")["status"] == "not_converged"
    return page


@case
def diagnose_nothing(folder: Path) -> Path:
    written(folder)
    return diagnosed(folder)


@case
def diagnose_one(folder: Path) -> Path:
    written(folder, YIELDS, payload=payloads)
    return diagnosed(folder)


@case
def diagnose_several(folder: Path) -> Path:
    written(folder, YIELDS, WAVE, RATIO, rows=160, payload=payloads)
    return diagnosed(folder)


@case
def diagnose_one_of(folder: Path) -> Path:
    written(folder, entry("joint_compliance", "joint2", compliance_rad_nm=2e-6), rows=40, test=12)
    return diagnosed(folder)


@case
def diagnose_unnamed(folder: Path) -> Path:
    written(folder, rows=160, bent=humming)
    return diagnosed(folder)


@case
def diagnose_without_test(folder: Path) -> Path:
    written(folder, WAVE, rows=60, test=0, bent=outlying)
    return diagnosed(folder)


@case
def diagnose_few(folder: Path) -> Path:
    written(folder, YIELDS, rows=25, test=0)
    return diagnosed(folder)


@case
def diagnose_too_few(folder: Path) -> Path:
    written(folder, YIELDS, rows=6, test=20)
    return diagnosed(folder)


@case
def diagnose_suspects(folder: Path) -> Path:
    """The payload column is ten times too large, as grams of ten would be."""
    nominal = written(folder, YIELDS, payload=payloads)
    for name in ("fit", "test"):
        data = fastcal.load_measurements(folder / f"{name}.csv", nominal)
        assert data.payload is not None
        wrong = np.where(np.arange(len(data)) % 3 == 0, 4.0 - data.payload, data.payload)
        fastcal.write_measurements(folder / f"{name}.csv", replace(data, payload=wrong), nominal.joint_types)
    return diagnosed(folder)


@case
def diagnose_excluded(folder: Path) -> Path:
    written(folder, WAVE)
    return diagnosed(folder, "--exclude", "gear_harmonic", "--exclude", "joint_profile")


@case
def diagnose_drift(folder: Path) -> Path:
    def drifting(data: Dataset) -> Dataset:
        assert data.position is not None
        assert data.time is not None
        return replace(data, position=data.position + 4e-4 * np.outer(data.time / 3600, [1.0, 0.5, 0.2]))

    written(folder, bent=drifting, time=lambda count: np.linspace(0.0, 3600.0, count))
    return diagnosed(folder)
