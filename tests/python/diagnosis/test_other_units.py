# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is measured decides, not the unit that it is written in nor the size of the arm."""

import copy
import csv
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import (
    CalibrationResult,
    Robot,
    calibrate,
    diagnose,
    load_measurements,
    load_robot,
    perturbed,
    random_poses,
    simulate,
)
from fastcal.diagnosis import Diagnosis
from fastcal.io.measurements_out import write_measurements
from fastcal.measurements.dataset import Dataset
from fastcal.units import from_si, to_si

SIGMA = 4e-5  # [m]
ROWS = 100
COMPLIANT = "geometry,joint_compliance,link_mass"
MASSES = 100.0
SHRUNK = 0.3


@cache
def arm() -> Robot:
    return load_robot("kuka_kr500_3")


def soft(robot: Robot, compliance: float) -> Robot:
    """As a workshop builds it, joint 2 giving under load."""
    yields = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": compliance}}
    return Robot(dict(perturbed(robot, seed=3).spec) | {"effects": [yields]})


@cache
def rows() -> Dataset:
    payload = np.random.default_rng(3).choice([0.0, 250.0, 500.0], ROWS)
    poses = Dataset.from_arrays(random_poses(arm(), ROWS, seed=4), robot=arm(), payload=payload)
    return simulate(soft(arm(), 3e-8), poses, noise=SIGMA, seed=5)


@cache
def as_it_is() -> Diagnosis:
    return diagnose(arm(), rows(), sigma=SIGMA)


def same_answer(found: Diagnosis, other: Diagnosis, accuracy: float, without: str = "") -> None:
    """Names, grades, noise and signals, whatever the units of the sizes; `without` what is promised of one effect."""
    assert [(f.grade, f.label, f.equivalents) for f in found.effects] == [
        (f.grade, f.label, f.equivalents) for f in other.effects
    ]
    assert found.verdict == other.verdict
    assert [r.label for r in found.ranking] == [r.label for r in other.ranking]
    assert [f.snr for f in found.effects] == pytest.approx([f.snr for f in other.effects], rel=accuracy)
    promised = [{(s.effect, s.owner) for s in of.smallest if s.effect != without} for of in (found, other)]
    assert promised[0] == promised[1]
    assert [u.owner for u in found.untestable] == [u.owner for u in other.untestable]


def rewritten(path: Path, units: dict[str, tuple[str, str]]) -> None:
    """A file of rows with its columns in other units: {ending: (unit that is read, unit that is written)}."""
    with path.open(newline="") as file:
        head, *lines = list(csv.reader(file))
    for k, name in enumerate(head):
        for ending, (old, new) in units.items():
            if name.endswith(f"_{ending}"):
                head[k] = f"{name.removesuffix(ending)}{new}"
                for line in lines:
                    line[k] = repr(from_si(to_si(float(line[k]), old), new)) if line[k] else ""
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([head, *lines])


@pytest.mark.parametrize("units", [{"deg": "rad", "mm": "m", "kg": "g"}, {"deg": "mrad", "mm": "in"}])
def test_the_file_in_other_units_gives_the_same_model(units: dict[str, str], tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    write_measurements(path, rows())
    first = calibrate(arm(), load_measurements(path, arm()), effects=COMPLIANT)
    rewritten(path, {old: (old, new) for old, new in units.items()})
    data = load_measurements(path, arm())
    second = calibrate(arm(), data, effects=COMPLIANT)
    assert first.rank == second.rank
    for one, other in zip(first.parameters, second.parameters, strict=True):
        assert (one.name, one.owner) == (other.name, other.owner)
        assert one.value == pytest.approx(other.value, abs=1e-6 * (one.std or 0.0), rel=1e-9)
        assert one.std == (None if other.std is None else pytest.approx(other.std, rel=1e-6))
    found = diagnose(arm(), data, sigma=SIGMA)
    same_answer(found, as_it_is(), 1e-6)
    error = found.model.poses(rows())[:, :3, 3] - as_it_is().model.poses(rows())[:, :3, 3]
    assert np.abs(error).max() < 1e-6 * SIGMA


@cache
def leaning(scale: float) -> tuple[CalibrationResult, Diagnosis]:
    """A base that leans by a column of another instrument, in rad times `scale`."""
    tilt = np.random.default_rng(0).normal(0.0, 1e-3, ROWS)
    x, y, z = np.asarray(rows().position).T
    data = replace(rows(), position=np.column_stack([x + tilt * z, y, z - tilt * x]), extra={"tilt": scale * tilt})
    follows = {"effect": "regressor", "owner": "base", "column": "tilt"}
    robot = Robot(dict(arm().spec) | {"effects": [follows]})
    return (
        calibrate(arm(), data, effects=f"{COMPLIANT},regressor@base:column=tilt"),
        diagnose(robot, data, sigma=SIGMA),
    )


@pytest.mark.parametrize("scale", [1e3, 1e-3])
def test_a_column_in_other_units_gives_the_same_model(scale: float) -> None:
    """Findings R1: a tilt in rad left 3.40 mm, the same in mrad 0.975."""
    (first, found), (second, again) = leaning(1.0), leaning(scale)
    assert first.rank == second.rank
    for one, other in zip(first.parameters, second.parameters, strict=True):
        factor = scale if one.name.startswith("tilt_") else 1.0
        assert one.value == pytest.approx(factor * other.value, abs=1e-6 * (one.std or 0.0), rel=1e-9)
        assert one.std == (None if other.std is None else pytest.approx(factor * other.std, rel=1e-6))
    same_answer(again, found, 1e-6)
    told, before = (f.model.poses(f.train.data)[:, :3, 3] for f in (again, found))
    assert np.abs(told - before).max() < 1e-6 * SIGMA


def heavier(robot: Robot) -> Robot:
    """Each link as many times as heavy."""
    spec = copy.deepcopy(robot.spec)
    for joint in spec["joints"]:
        joint["link"]["mass_kg"] *= MASSES
    return Robot(spec)


def scale_of(name: str) -> float:
    """By how much a parameter becomes larger with all masses MASSES times what they are."""
    return 1 / MASSES if name == "compliance_rad_nm" else MASSES if name == "extra_kg" else 1.0


def test_masses_times_100_give_the_same_model() -> None:
    """And compliances a hundredth (findings R1: what held what the data show was the size of a 200 kg arm)."""
    data = replace(rows(), payload=MASSES * rows().payload)
    first = calibrate(arm(), rows(), effects=COMPLIANT)
    second = calibrate(heavier(arm()), data, effects=COMPLIANT)
    assert first.rank == second.rank
    assert [u.direction for u in first.unidentifiable] == [u.direction for u in second.unidentifiable]
    for one, other in zip(first.parameters, second.parameters, strict=True):
        value, factor = other.value / scale_of(one.name), 1 / scale_of(one.name)
        assert one.value == pytest.approx(value, abs=1e-6 * (one.std or 0.0), rel=1e-9)
        assert one.std == (None if other.std is None else pytest.approx(other.std * factor, rel=1e-6))
    found = diagnose(heavier(arm()), data, sigma=SIGMA)
    same_answer(found, as_it_is(), 1e-6)
    error = found.model.poses(data)[:, :3, 3] - as_it_is().model.poses(rows())[:, :3, 3]
    assert np.abs(error).max() < 1e-6 * SIGMA


def shrunk(robot: Robot) -> Robot:
    """The same arm in other proportions to the metre: lengths times SHRUNK, masses by its cube."""

    def resized(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: _shrunk_number(key, resized(entry)) for key, entry in value.items()}
        return [resized(entry) for entry in value] if isinstance(value, list) else value

    return Robot(resized(copy.deepcopy(robot.spec)))


def _shrunk_number(key: str, value: Any) -> Any:
    power = {"mm": 1, "kg": 3, "m2": 5}.get(key.rpartition("_")[2], 0)
    times: Callable[[Any], Any] = lambda x: x * SHRUNK**power if isinstance(x, int | float) else x  # noqa: E731
    return [times(x) for x in value] if isinstance(value, list) else times(value)


@pytest.mark.parametrize("sigma", [SIGMA, None])
def test_an_arm_of_another_size_gets_the_same_answer(sigma: float | None) -> None:
    """A KR 500 as large as a cobot: its sag in rad, its payload and its noise shrink with it."""
    small = shrunk(arm())
    points = rows().position
    assert points is not None
    payload = SHRUNK**3 * rows().payload
    data = Dataset.from_arrays(rows().q, robot=small, payload=payload, position=SHRUNK * points)
    given = None if sigma is None else SHRUNK * sigma
    found, whole = diagnose(small, data, sigma=given), as_it_is() if sigma else diagnose(arm(), rows())
    accuracy = 1e-3 if sigma else 3e-3  # the first guess of the noise is a length, and weighs the geometry's prior
    # 300 mm, the largest plausible shift of a payload, are more for a cobot than for a KR 500, which shows 314 here.
    same_answer(found, whole, accuracy, without="payload_com")
    assert found.sigma_mm == pytest.approx(SHRUNK * whole.sigma_mm, rel=accuracy)
