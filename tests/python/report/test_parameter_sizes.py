# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

import fastcal
from fastcal.report.parameter_sizes import MOST, moved_at_tool, sizes_figure

UR10 = fastcal.load_robot("ur10")


@pytest.fixture(scope="module")
def result() -> fastcal.CalibrationResult:
    """An arm with a wave of joint 2 and a wrong length of link 2, measured in 80 poses."""
    wave = {"effect": "gear_harmonic", "owner": "joint2", "order": 2,
            "parameters": {"amplitude_rad": 1e-3, "phase_rad": 0.7}}  # fmt: skip
    joints = [dict(each) for each in UR10.spec["joints"]]
    joints[1]["a_mm"] += 0.6
    true = fastcal.Robot({**UR10.spec, "joints": joints, "effects": [wave]})
    q = np.random.default_rng(1).uniform(-2, 2, (80, 6))
    data = fastcal.simulate(true, q, noise=2e-5, seed=1)
    return fastcal.calibrate(UR10, data, effects="geometry,gear_harmonic@joint2:order=2")


def test_a_size_is_how_far_the_tool_moves_by_the_change(result: fastcal.CalibrationResult) -> None:
    sizes = {(m.parameter.owner, m.parameter.name): m for m in moved_at_tool(result)}
    q = result.train.data.q
    for owner, name in (("joint2", "a_mm"), ("joint4", "d_mm"), ("joint3", "alpha_deg")):
        found = sizes[owner, name]
        joints = [dict(each) for each in result.model.spec["joints"]]
        step = 1e-3
        joints[int(owner[-1]) - 1][name] += step
        far = fastcal.Robot({**result.model.spec, "joints": joints}).forward(q) - result.model.forward(q)
        per_unit = 1e3 * np.sqrt(np.mean(np.sum(far[:, :3, 3] ** 2, axis=1))) / step
        assert found.size == pytest.approx((found.parameter.value - found.parameter.nominal) * per_unit, rel=1e-4)
        assert found.std == pytest.approx(found.parameter.std * per_unit, rel=1e-4)


def test_a_wave_is_one_dot_by_its_amplitude(result: fastcal.CalibrationResult) -> None:
    waves = [m for m in moved_at_tool(result) if "amplitude" in m.parameter.name or "phase" in m.parameter.name]
    (wave,) = waves
    entry = next(e for e in result.model.spec["effects"] if e["effect"] == "gear_harmonic")
    bare = fastcal.Robot({**result.model.spec, "effects": []})
    far = result.model.forward(result.train.data.q) - bare.forward(result.train.data.q)
    assert entry["parameters"]["amplitude_rad"]["value"] == pytest.approx(1e-3, rel=0.1)
    assert wave.size == pytest.approx(1e3 * np.sqrt(np.mean(np.sum(far[:, :3, 3] ** 2, axis=1))), rel=2e-3)


def test_significant_ones_come_first_and_base_and_tool_are_not_among_them(result: fastcal.CalibrationResult) -> None:
    moved = moved_at_tool(result)
    assert [m.is_significant for m in moved] == sorted((m.is_significant for m in moved), reverse=True)
    assert {"joint2 a_mm", "joint2 amplitude_2x_rad"} <= {
        f"{m.parameter.owner} {m.parameter.name}" for m in moved if m.is_significant
    }
    assert not {m.parameter.owner for m in moved} & {"base", "tool"}


def test_the_figure_has_a_dot_a_parameter_with_its_interval(result: fastcal.CalibrationResult) -> None:
    moved = moved_at_tool(result)
    figure = sizes_figure(moved)
    assert figure is not None
    drawn = {name: (x, half) for trace in figure.traces
             for name, x, half in zip(trace["y"], trace["x"], trace["error_x"]["array"], strict=True)}  # fmt: skip
    assert drawn == {m.name: (m.size, 1.96 * m.std) for m in moved[:MOST]}
    assert sizes_figure([]) is None
