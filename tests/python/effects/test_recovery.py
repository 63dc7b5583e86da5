# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Each effect is found again in what it made: truth within the stated deviations, on fastcal's own simulation."""

from typing import Any

import numpy as np
import pytest

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import to_si

NOISE = to_si(0.03, "mm")
FAR = 3.5  # standard deviations: of 5000 honest estimates two lie farther

# As on the command line: (what the true arm has beside its parameters, its parameters).
CASES: dict[str, tuple[dict[str, Any], dict[str, float]]] = {
    "reduction_ratio@joint2": ({}, {"error": 8e-4}),
    "coupling_ratio@joint6<-joint5": ({}, {"ratio": -2.5e-3}),
    "gear_harmonic@joint2:order=2": ({"order": 2}, {"amplitude_rad": 4e-4, "phase_rad": 2.5}),
    "gear_harmonic@joint4:order=3.5": ({"order": 3.5}, {"amplitude_rad": 6e-4, "phase_rad": -0.7}),
    "gear_harmonic@joint3:order=2:side=motor": (
        {"order": 2, "side": "motor"},
        {"amplitude_rad": 2e-4, "phase_rad": 0.4},
    ),
    "backlash@joint3": ({}, {"gap_rad": 4e-4}),
    "backlash@joint2:side=load:width_nm=5": ({"side": "load", "width_nm": 5.0}, {"load_gap_rad": 5e-4}),
    "joint_compliance@joint2:sign=against": ({"sign": "against"}, {"excess_compliance_rad_nm": 4e-7}),
    "link_bending@link2:sign=against": ({"sign": "against"}, {"excess_inverse_ei_1_nm2": 4e-7}),
    "posture_backlash@joint1<-joint2": ({"at_deg": -72.0}, {"gap_rad": 6e-4}),
    "posture_backlash@joint5<-joint3": ({"at_deg": -25.0}, {"gap_rad": -8e-4}),
    "encoder_jump@joint3": ({"at_deg": -25.0}, {"jump_rad": 6e-4}),
    "thermal_expansion@robot": ({"t0_c": 25.0}, {"coefficient_1_k": 1.7e-5}),
    "thermal_expansion@link2": ({"t0_c": 25.0}, {"coefficient_1_k": 2.3e-5}),
    "thermal_offset@joint3": ({"t0_c": 25.0}, {"rad_k": 1.5e-5}),
    "base_drift@base": (
        {"t0_s": 7000.0},
        {"rate_x_mm_s": 8e-6, "rate_z_mm_s": -2e-5, "rate_rx_rad_s": 1e-8, "rate_rz_rad_s": -2e-8},
    ),
    "base_step@base": (
        {"at_s": 6543.0},
        {"step_x_mm": 0.2, "step_y_mm": -0.15, "step_z_mm": 0.1, "step_ry_rad": 1e-4},
    ),
    "tool_step@tool": ({"at_s": 6543.0}, {"step_x_mm": 0.2, "step_z_mm": -0.15}),
    "zero_step@joint3": ({"at_s": 6543.0}, {"step_rad": 6e-4}),
    "range_step@instrument": ({"at_s": 6543.0}, {"step_mm": 0.15}),
    "range_wave@instrument:period_mm=310": ({"period_mm": 310.0}, {"sine_mm": 0.1, "cosine_mm": -0.05}),
    "thermal_spring@joint2": (
        {"t0_c": 25.0},
        {"offset_rad_k": 1e-5, "sine_rad_k": 2e-5, "cosine_rad_k": -1e-5},
    ),
    "thermal_bending@link2": ({"t0_c": 25.0}, {"turn_rz_rad_k": 2e-5}),
    "thermal_base@base": ({"t0_c": 25.0}, {"rate_x_m_k": 1e-5, "rate_z_m_k": -2e-5, "rate_ry_rad_k": 6e-6}),
    "base_settling@base:tau_s=2000": ({"tau_s": 2000.0}, {"way_x_mm": 0.2, "way_z_mm": -0.15}),
    "station_offset@base": (
        {"stations": ["hall", "door", "desk"]},
        {"station2_x_mm": 0.1, "station2_rz_rad": 8e-5, "station3_y_mm": -0.2, "station3_rx_rad": 5e-5},
    ),
    "tool_shift@tool": ({"mounts": ["1", "2"]}, {"mount2_x_mm": 0.05, "mount2_z_mm": -0.08}),
    "regressor@base:column=tilt:axis=rx": ({"column": "tilt", "axis": "rx"}, {"tilt_rx_rad": 1e-4}),
    "regressor@link3:column=level:axis=z": ({"column": "level", "axis": "z"}, {"level_z_mm": 0.06}),
}


@pytest.mark.parametrize("asked", CASES)
def test_the_truth_is_found_within_its_deviations(asked: str, arm: Robot, poses: Dataset, with_effects: Any) -> None:
    options, values = CASES[asked]
    name, _, owner = asked.partition(":")[0].partition("@")
    truth = with_effects(perturbed(arm, seed=8), {"effect": name, "owner": owner, "parameters": values, **options})
    measured = simulate(truth, poses, noise=NOISE, seed=21)
    found = calibrate(arm, measured, effects=["geometry", asked])
    assert found.status == "converged"
    assert found.sigma == pytest.approx(NOISE, rel=0.1)
    (entry,) = found.model.spec["effects"]
    for key in dict.fromkeys([*entry["parameters"], *values]):
        if key in ("order", "at_s", "at_deg", "period_mm", "tau_s"):
            continue
        got = entry["parameters"][key]
        if got["std"] is None:  # points show no turn of the tool
            assert key not in values
            continue
        miss = got["value"] - values.get(key, 0.0)
        if key == "phase_rad":
            miss = (miss + np.pi) % (2 * np.pi) - np.pi
        assert abs(miss) < FAR * got["std"], (key, got, values.get(key, 0.0))
    assert any(abs(entry["parameters"][key]["value"]) > 8 * entry["parameters"][key]["std"] for key in values)
    if name in ("base_step", "tool_step", "zero_step", "range_step"):
        at = entry["parameters"]["at_s"]
        before, after = poses.time[poses.time < 6543.0].max(), poses.time[poses.time >= 6543.0].min()
        assert at["value"] == pytest.approx((before + after) / 2)
        assert at["std"] == pytest.approx((after - before) / 12**0.5)
    if name in ("posture_backlash", "encoder_jump"):
        at, q = entry["parameters"]["at_deg"], np.degrees(poses.q[:, int(owner[-1]) - 1])
        before, after = q[q <= options["at_deg"]].max(), q[q > options["at_deg"]].min()
        assert at["value"] == pytest.approx((before + after) / 2)
        assert at["std"] == pytest.approx((after - before) / 12**0.5)


def test_three_effects_at_once(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    truth = with_effects(
        perturbed(arm, seed=2),
        {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 1.4e-6}},
        {"effect": "base_step", "owner": "base", "at_s": 9000.0, "parameters": {"step_x_mm": 0.15}},
        {
            "effect": "gear_harmonic",
            "owner": "joint3",
            "order": 2,
            "parameters": {"amplitude_rad": 3e-4, "phase_rad": 1.0},
        },
    )
    measured = simulate(truth, poses, noise=NOISE, seed=1)
    asked = "geometry,joint_compliance@joint2,base_step,gear_harmonic@joint3:order=2"
    found = {e["effect"]: e["parameters"] for e in calibrate(arm, measured, effects=asked).model.spec["effects"]}
    for effect, key, true in (
        ("joint_compliance", "compliance_rad_nm", 1.4e-6),
        ("base_step", "step_x_mm", 0.15),
        ("gear_harmonic", "amplitude_rad", 3e-4),
        ("gear_harmonic", "phase_rad", 1.0),
    ):
        got = found[effect][key]
        assert abs(got["value"] - true) < FAR * got["std"], key


def test_two_orders_of_one_joint_are_two_effects(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    orders = {1.0: (3e-4, 0.5), 2.0: (2e-4, -1.5)}
    truth = with_effects(
        perturbed(arm, seed=3),
        *(
            {
                "effect": "gear_harmonic",
                "owner": "joint4",
                "order": n,
                "parameters": {"amplitude_rad": a, "phase_rad": p},
            }
            for n, (a, p) in orders.items()
        ),
    )
    found = calibrate(
        arm,
        simulate(truth, poses, noise=NOISE, seed=5),
        effects="geometry,gear_harmonic@joint4,gear_harmonic@joint4:order=2",
    )
    for entry in found.model.spec["effects"]:
        amplitude, phase = orders[entry["parameters"]["order"]["value"]]
        got = entry["parameters"]
        assert abs(got["amplitude_rad"]["value"] - amplitude) < FAR * got["amplitude_rad"]["std"]
        assert abs(got["phase_rad"]["value"] - phase) < FAR * got["phase_rad"]["std"]
    names = [p.name for p in found.parameters if p.owner == "joint4"]
    assert {"amplitude_1x_rad", "phase_1x_rad", "amplitude_2x_rad", "phase_2x_rad"} <= set(names)


def test_an_unobservable_scale_is_held_and_reported(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    measured = simulate(perturbed(arm, seed=3), poses, noise=NOISE, seed=5)
    found = calibrate(arm, measured, effects="geometry,measurement_scale")
    told = [u for u in found.unidentifiable if "instrument error" in u.parameters]
    assert told
    assert found.train.after is not None
    assert found.train.after.rms < 2 * NOISE


def test_lengths_that_are_known_show_the_scale(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    truth = with_effects(arm, {"effect": "measurement_scale", "owner": "instrument", "parameters": {"error": 2e-5}})
    measured = simulate(truth, poses, noise=NOISE, seed=5)
    (entry,) = calibrate(arm, measured, effects="measurement_scale").model.spec["effects"]
    got = entry["parameters"]["error"]
    assert abs(got["value"] - 2e-5) < FAR * got["std"]
    assert got["std"] < 5e-6
