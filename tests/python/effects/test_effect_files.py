# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects in files: amplitude and phase, units of options, origins that stay, one entry a cause."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import _core
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import simulate
from fastcal.effects.entries import build_effects, core_options, effect_names, effect_owners, parse_effects
from fastcal.effects.values import edge_values, parameter_values, polar_pairs, written_parameters
from fastcal.errors import InvalidInput
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import UNITS

HARMONIC: dict[str, Any] = {"effect": "gear_harmonic", "owner": "joint2", "order": 2.0}


def test_every_effect_has_units_that_are_known(arm: Robot) -> None:
    needs: dict[str, dict[str, Any]] = {
        "regressor": {"column": "tilt"},
        "base_settling": {"tau_s": 600.0},
        "range_wave": {"period_mm": 310.0},
    }
    for name in effect_names():
        for owner in effect_owners(name, arm.core):
            (effect,) = build_effects([{"effect": name, "owner": owner, **needs.get(name, {})}], arm.core)
            assert all(parameter.unit in UNITS for parameter in effect.parameters), (name, owner)


def test_a_harmonic_is_written_as_amplitude_and_phase(arm: Robot) -> None:
    (effect,) = build_effects([HARMONIC], arm.core)
    values = np.array([3e-4, -4e-4])  # a = 5e-4, tan phase = -4 / 3
    amplitude, phase = edge_values(HARMONIC, effect, values)
    assert amplitude.value == pytest.approx(5e-4, rel=1e-15)
    assert phase.value == pytest.approx(math.atan2(-4, 3), rel=1e-15)
    entry = HARMONIC | {"parameters": {"amplitude_rad": amplitude.value, "phase_rad": phase.value}}
    assert parameter_values(entry, effect) == pytest.approx(values, rel=1e-14)


def test_its_deviations_are_those_of_the_linear_ones(arm: Robot) -> None:
    (effect,) = build_effects([HARMONIC], arm.core)
    values = np.array([3e-4, 4e-4])
    spread = np.array([[4e-12, 1e-12], [1e-12, 2e-12]])
    random = np.random.default_rng(0).multivariate_normal(values, spread, 200_000)
    written = written_parameters(HARMONIC, effect, values, spread)
    assert written["amplitude_rad"]["std"] == pytest.approx(np.hypot(*random.T).std(), rel=0.01)
    assert written["phase_rad"]["std"] == pytest.approx(np.arctan2(random[:, 1], random[:, 0]).std(), rel=0.01)
    assert written["order"] == {"value": 2.0, "std": 0.0}
    (pair,) = polar_pairs([HARMONIC], [effect], 3, np.concatenate([np.zeros(3), values]))
    assert pair.indices == [3, 4]
    assert pair.names == ["amplitude_2x_rad", "phase_2x_rad"]


def test_a_harmonic_of_no_size_has_no_phase(arm: Robot) -> None:
    (effect,) = build_effects([HARMONIC], arm.core)
    written = written_parameters(HARMONIC, effect, np.zeros(2), np.eye(2))
    assert written["amplitude_rad"] == {"value": 0.0, "std": None}
    assert polar_pairs([HARMONIC], [effect], 0, np.zeros(2)) == []


def test_options_reach_the_core_in_si() -> None:
    entry = {"effect": "thermal_expansion", "owner": "robot", "t0_c": 20.0}
    assert core_options(entry) == {"t0": pytest.approx(293.15)}
    entry = {"effect": "joint_profile", "owner": "joint1", "low_deg": -90, "high_rad": 1.0, "curvature": 0.01}
    assert core_options(entry) == {"low": pytest.approx(-math.pi / 2), "high": 1.0}
    entry = {"effect": "station_offset", "owner": "base", "stations": ["a", "b", "c"]}
    assert core_options(entry) == {"count": 3.0}
    entry = {"effect": "base_step", "owner": "base", "parameters": {"at_s": {"value": 12.0}}}
    assert core_options(entry) == {"at": 12.0}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("gear_harmonic@joint2:order=0.5", "order must be at least 1"),
        ("gear_harmonic@joint9", "no owner 'joint9'"),
        ("gear_harmonic@joint2:colour=3", "no option 'colour'"),
        ("gear_harmonic@joint2:order", "name=value"),
        ("rust", "no effect is called 'rust'"),
        ("backlash,,", "empty name"),
        ("regressor@base", "needs the option column"),
    ],
)
def test_invalid_input_is_refused(text: str, sentence: str, arm: Robot) -> None:
    with pytest.raises(InvalidInput, match=sentence):
        parse_effects(text, arm.core)


def test_an_unknown_parameter_is_refused(arm: Robot, with_effects: Any) -> None:
    with pytest.raises(InvalidInput, match="parameter 'sine_rad' is not known; there are amplitude_rad, phase_rad"):
        with_effects(arm, HARMONIC | {"parameters": {"sine_rad": 1.0}})


def test_a_wave_needs_half_a_period_within_reach(arm: Robot, poses: Dataset) -> None:
    # Joint 2 of this arm reaches from -150 to -10 degrees: 140 of the 180 that half a period of order 1 takes.
    measured = simulate(arm, poses, noise=1e-5)
    with pytest.raises(InvalidInput, match="less than half a period fits into the joint's 140 deg"):
        calibrate(arm, measured, effects="geometry,gear_harmonic@joint2")


def test_a_model_keeps_its_origins_and_loads_back(
    arm: Robot, poses: Dataset, with_effects: Any, tmp_path: Path
) -> None:
    truth = with_effects(
        arm,
        {"effect": "thermal_offset", "owner": "joint2", "t0_c": 20.0, "parameters": {"rad_k": 1e-5}},
        {
            "effect": "station_offset",
            "owner": "base",
            "stations": ["hall", "door", "desk"],
            "parameters": {"station3_x_mm": 0.3},
        },
    )
    measured = simulate(truth, poses, noise=1e-5, seed=1)
    asked = "geometry,thermal_offset@joint2,station_offset,joint_profile@joint3:knots=8"
    model = calibrate(arm, measured, effects=asked).model
    thermal, station, profile = model.spec["effects"]
    assert thermal["t0_c"] == pytest.approx(np.mean(measured.temperature) - 273.15, abs=1e-3)
    first = [measured.station_names[i] for i in dict.fromkeys(measured.station)]
    assert station["stations"] == first
    assert profile["low_rad"] == measured.q[:, 2].min()

    model.save(tmp_path / "model.yaml")
    back = load_robot(tmp_path / "model.yaml")
    few = measured.select(np.flatnonzero(measured.station == 1)[:5])  # one station, other temperatures: nothing moves
    assert np.array_equal(
        back.error_model.predict(back.samples(few), back.error_model.start),
        model.error_model.predict(model.samples(measured), model.error_model.start)[
            np.flatnonzero(measured.station == 1)[:5]
        ],
    )
    again = calibrate(back, measured, effects=asked)
    assert [e.get("t0_c") for e in again.model.spec["effects"]] == [thermal["t0_c"], None, None]
    assert len(again.model.spec["effects"]) == 3


def test_repeated_names_are_one_effect(arm: Robot, poses: Dataset) -> None:
    measured = simulate(arm, poses, noise=1e-5)
    found = calibrate(arm, measured, effects="geometry,backlash@joint3,backlash@joint3")
    assert len(found.model.spec["effects"]) == 1


def test_the_core_has_every_name_of_the_contract() -> None:
    assert set(effect_names()) >= {
        "reduction_ratio", "coupling_ratio", "gear_harmonic", "joint_profile", "backlash", "joint_compliance",
        "joint_compliance_nonlinear", "current_compliance", "link_bending", "link_torsion", "bearing_tilt",
        "compensator_spring", "thermal_expansion", "thermal_offset", "base_drift", "base_step", "station_offset",
        "tool_shift", "payload_mass", "payload_com", "measurement_scale",
    }  # fmt: skip
    assert _core.effect_names() == sorted(_core.effect_names())
