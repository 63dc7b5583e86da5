# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an effect needs of the data, and the sentence where it is not there."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.evaluation import evaluate
from fastcal.calibration.simulation import simulate
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

MISSING = [
    ("thermal_expansion@robot", "temperature", "thermal_expansion@robot needs the column temperature_c"),
    ("thermal_offset@joint1", "temperature", "thermal_offset@joint1 needs the column temperature_c"),
    ("base_drift", "time", "base_drift@base needs the column time_s"),
    ("base_step", "time", "base_step@base needs the column time_s"),
    ("station_offset", "station", "station_offset@base needs the column station"),
    ("tool_shift", "mount", "tool_shift@tool needs the column mount"),
    ("current_compliance@joint2", "current", "current_compliance@joint2 needs the column current2_a"),
]


@pytest.mark.parametrize(("effect", "field", "sentence"), MISSING)
def test_a_missing_column_is_named_with_its_effect(
    effect: str, field: str, sentence: str, arm: Robot, poses: Dataset
) -> None:
    measured = replace(simulate(arm, poses, noise=1e-5), **{field: None})
    with pytest.raises(InvalidInput, match=sentence):
        calibrate(arm, measured, effects=f"geometry,{effect}")


def test_a_column_of_ones_own_is_needed_in_every_row(arm: Robot, poses: Dataset) -> None:
    measured = simulate(arm, poses, noise=1e-5)
    with pytest.raises(InvalidInput, match="regressor@base needs the column wind with numbers"):
        calibrate(arm, measured, effects="geometry,regressor@base:column=wind")
    tilt = measured.extra["tilt"].copy()
    tilt[7] = np.nan
    with pytest.raises(InvalidInput, match="holds no number in row 7"):
        calibrate(arm, replace(measured, extra={"tilt": tilt}), effects="geometry,regressor@base:column=tilt")


def test_the_unit_of_a_column_of_ones_own_does_not_matter(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    """A tilt in rad is a millionth of one in microrad, and its coefficient a million times as large."""
    tilt = np.random.default_rng(3).normal(0, 2.0, len(poses))
    true = with_effects(
        arm,
        {"effect": "regressor", "owner": "base", "column": "tilt", "parameters": {"tilt_ry_rad": 1e-3}},
    )
    measured = simulate(true, replace(poses, extra={"tilt": tilt}), noise=1e-5)
    found = []
    for scale in (1.0, 1e-6):
        data = replace(measured, extra={"tilt": scale * tilt})
        result = calibrate(arm, data, effects="geometry,regressor@base:column=tilt")
        found.append(result)
    assert found[1].rank == found[0].rank
    assert found[1].train.after.rms == pytest.approx(found[0].train.after.rms, rel=1e-4)
    values = [next(p.value for p in r.parameters if p.name == "tilt_ry_rad") for r in found]
    assert values[1] == pytest.approx(1e6 * values[0], rel=1e-3)
    assert values[0] == pytest.approx(1e-3, rel=0.05)


def test_one_station_shows_no_offset(arm: Robot, poses: Dataset) -> None:
    measured = simulate(arm, poses, noise=1e-5)
    with pytest.raises(InvalidInput, match="at least two labels in the column station"):
        calibrate(arm, measured.select(measured.station == 0), effects="geometry,station_offset")


def test_labels_mean_the_same_in_every_file(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    model = with_effects(
        arm,
        {"effect": "tool_shift", "owner": "tool", "mounts": ["old", "new"], "parameters": {"mount2_z_mm": 1.0}},
    )
    q = poses.q[:3]
    old, new = model.forward(q, mount="old"), model.forward(q, mount=["new"] * 3)
    moved = np.einsum("nij,nj->ni", old[:, :3, :3].transpose(0, 2, 1), new[:, :3, 3] - old[:, :3, 3])
    assert moved == pytest.approx(np.tile([0.0, 0.0, 1e-3], (3, 1)), abs=1e-12)
    with pytest.raises(InvalidInput, match="mount 'third' in row 0 is not one tool_shift@tool was fitted with"):
        model.forward(q, mount="third")
    with pytest.raises(InvalidInput, match="needs the column mount"):
        model.forward(q)


def test_an_unknown_condition_is_refused(arm: Robot) -> None:
    with pytest.raises(InvalidInput, match="no condition is called 'weather'"):
        arm.forward(np.zeros(6), weather=1.0)


def test_several_columns_keep_their_places(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    level = {"effect": "regressor", "owner": "base", "column": "level", "axis": "z", "parameters": {"level_z_mm": 1.0}}
    tilt = {"effect": "regressor", "owner": "base", "column": "tilt", "axis": "z", "parameters": {"tilt_z_mm": 10.0}}
    q = np.zeros((1, 6))
    extra = {"tilt": np.array([3.0]), "level": np.array([2.0])}
    nominal = arm.forward(q)
    for entries, size in (((level, tilt), 32e-3), ((tilt, level), 32e-3), ((tilt,), 30e-3)):
        moved = with_effects(arm, *entries).forward(q, extra=extra) - nominal
        assert np.linalg.norm(moved[0, :3, 3]) == pytest.approx(size, rel=1e-12)


def test_a_missing_column_of_labels_names_those_the_model_knows(arm: Robot, poses: Dataset) -> None:
    measured = simulate(arm, poses, noise=1e-5)
    names = tuple(f"cell {letter}" for letter in "ABC"[: len(measured.station_names)])
    model = calibrate(arm, replace(measured, station_names=names), effects="geometry,station_offset").model
    listed = re.escape(f"(station: one of {', '.join(names)})")
    with pytest.raises(InvalidInput, match=f"needs the column station {listed}, which the data do not have"):
        evaluate(model, replace(measured, station=None, station_names=()))
