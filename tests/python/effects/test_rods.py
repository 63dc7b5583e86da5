# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rods and pins of closed loops that yield, and slack in a rod's balls: by statics, by differences, found and named."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import _core, calibrate, diagnose, load_robot, perturbed, predict, random_poses, simulate
from fastcal.effects.entries import effect_owners
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

Array = NDArray[np.float64]
FULL = os.environ.get("FASTCAL_TEST_FULL") == "1"
NOISE = 3e-5
GRAVITY = 9.80665
SOFT = 2e-6  # [m/N]


def having(robot: Robot, effect: str, owner: str, value: float) -> Robot:
    key = "gap_mm" if effect.endswith("slack") else "compliance_m_n"
    value *= 1e3 if effect.endswith("slack") else 1.0
    return robot.with_(effects=[{"effect": effect, "owner": owner, "parameters": {key: value}}])


def postures(robot: Robot, count: int, seed: int, *payloads: float) -> Dataset:
    q = robot.assemble(random_poses(robot, count, seed=seed)).q
    return Dataset.from_arrays(q, payload=np.resize(payloads, count))


def pulls(robot: Robot, rows: Dataset) -> Array:
    """(N, loops) [N] by the core."""
    model = robot.error_model
    loads = np.asarray(model.loads(robot.conditions(rows.q, payload=rows.payload), model.start))
    return loads[:, robot.core.frame_count :, 2]


def of_statics(robot: Robot, rows: Dataset) -> Array:
    """(N, 6) pulls [N] of six rods that hold a platform up, by its balance of forces and moments in numpy."""
    T = robot.forward(rows.q)
    origins = robot.core.frame_origins(rows.q)
    out = np.zeros((len(rows), 6))
    for i, pose in enumerate(T):
        A = np.zeros((6, 6))
        for k, loop in enumerate(robot.description.loops):
            to = pose[:3, :3] @ np.asarray(loop["to_xyz_mm"]) / 1e3 + pose[:3, 3]
            start = np.asarray(loop["from_xyz_mm"]) / 1e3
            if loop["from"] != "base":
                number = int(loop["from"].removeprefix("link"))
                turn = np.radians(robot.spec["joints"][number - 1]["origin"]["rpy_deg"][2])
                arm = float(rows.q[i, number - 1])
                swing = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
                x, y, z = start
                start = np.array([*(swing @ [x * np.cos(arm) + z * np.sin(arm), y]), z * np.cos(arm) - x * np.sin(arm)])
                start = start + origins[i, 2 * number - 1]
            u = (start - to) / np.linalg.norm(start - to)
            A[:3, k], A[3:, k] = u, np.cross(to - pose[:3, 3], u)
        out[i] = np.linalg.solve(A, [0, 0, rows.payload[i] * GRAVITY, 0, 0, 0])
    return out


@pytest.mark.parametrize("name", ["hexapod", "delta"])
def test_the_pulls_of_rods_are_those_of_statics(name: str) -> None:
    robot = load_robot(name)
    rows = postures(robot, 10, 1, 2.0, 5.0)
    expected = of_statics(robot, rows)
    assert np.abs(expected).max() > 5.0
    assert pulls(robot, rows) == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


def test_a_soft_rod_is_one_of_another_length() -> None:
    robot = load_robot("delta")
    rows = postures(robot, 3, 2, 4.0)
    soft = having(robot, "rod_compliance", "rod2a", SOFT)
    for i in range(3):
        one = rows.select([i])
        loops = [dict(loop) for loop in robot.description.loops]
        length = 550.0
        for _ in range(6):  # the pull is that of the deflected posture
            loops[2]["length_mm"] = length
            longer = robot.with_(loops=loops)
            q = longer.assemble(one.q).q
            length = 550.0 + 1e3 * SOFT * pulls(longer, Dataset.from_arrays(q, payload=one.payload))[0, 2]
        assert abs(length - 550.0) > 1e-3
        assert predict(soft, one).position == pytest.approx(predict(longer, one).position, abs=1e-9)


def test_slack_lengthens_a_rod_by_half_of_it_under_pull_and_shortens_it_under_push() -> None:
    robot = load_robot("hexapod")
    rows = postures(robot, 12, 3, 60.0)
    pull = pulls(robot, rows)[:, 0]
    for sign in (1.0, -1.0):
        loops = [dict(loop) for loop in robot.description.loops]
        loops[0]["length_mm"] += sign * 0.2
        longer = robot.with_(loops=loops)
        of_sign = np.flatnonzero(sign * pull > 15.0)  # less is near to floating
        moved = predict(having(robot, "rod_slack", "leg1", 4e-4), rows).position[of_sign]
        assert moved == pytest.approx(predict(longer, rows).position[of_sign], abs=2e-6)


def test_a_soft_leg_of_a_hexapod_is_a_soft_screw() -> None:
    robot = load_robot("hexapod")
    rows = postures(robot, 8, 4, 0.0, 80.0)
    screw = having(robot, "joint_compliance", "joint3", SOFT)
    leg = having(robot, "rod_compliance", "leg3", SOFT)
    assert np.abs(predict(leg, rows).position - predict(robot, rows).position).max() > 1e-4
    assert predict(leg, rows).position == pytest.approx(predict(screw, rows).position, abs=1e-11)


@pytest.mark.parametrize(
    ("name", "effect", "owner", "value"),
    [
        ("palletizer", "rod_compliance", "bar", 1e-7),
        ("palletizer", "rod_slack", "upper_level_bar", 4e-4),
        ("palletizer", "pin_compliance", "joint5", 1e-7),
        ("delta", "rod_compliance", "rod1b", SOFT),
        ("parallelogram_6r", "pin_compliance", "joint4", 1e-6),
    ],
)
def test_derivatives_are_those_of_differences(name: str, effect: str, owner: str, value: float) -> None:
    robot = load_robot(name)
    rows = postures(robot, 5, 5, 10.0)
    model = having(robot, effect, owner, value).error_model
    J = np.asarray(model.parameter_jacobian(robot.conditions(rows.q, payload=rows.payload), model.start, 3))[:, :, -1]
    step = 1e-3 * value
    # Loads are those of the fit's start, as in every effect that follows them.
    there, here = (predict(having(robot, effect, owner, value + sign * step), rows).position for sign in (1.0, -1.0))
    change = (there - here) / (2 * step)
    assert np.abs(change).max() * value > 1e-5
    assert pytest.approx(change, abs=2e-2 * np.abs(change).max()) == J


def test_only_rods_and_real_pins_have_them() -> None:
    delta, palletizer = load_robot("delta").core, load_robot("palletizer").core
    assert effect_owners("rod_slack", delta) == [f"rod{k}{side}" for k in (1, 2, 3) for side in "ab"]
    assert effect_owners("rod_compliance", load_robot("ur5").core) == []
    assert effect_owners("pin_compliance", palletizer) == ["joint4", "joint5", "joint6"]
    assert effect_owners("pin_compliance", delta) == []  # a platform's hinges are one joint
    with pytest.raises(InvalidInput, match="rod_slack is owned by a rod of a closed loop, got 'joint1'"):
        _core.make_effect("rod_slack", delta, "joint1", {})
    with pytest.raises(InvalidInput, match="has no option 'side'"):
        _core.make_effect("rod_compliance", delta, "rod1a", {"side": 1.0})


def test_owners_are_asked_of_a_robot_once(monkeypatch: pytest.MonkeyPatch) -> None:
    delta, other = load_robot("delta").core, load_robot("ur5").core
    first = effect_owners("rod_slack", delta)
    first.append("what a caller adds")
    monkeypatch.setattr(_core, "effect_owners", None)
    assert effect_owners("rod_slack", delta) == first[:-1]
    with pytest.raises(TypeError):
        effect_owners("rod_slack", other)


def test_zero_is_the_nominal_robot() -> None:
    robot = load_robot("palletizer")
    rows = postures(robot, 5, 6, 50.0)
    for effect, owner in (("rod_slack", "bar"), ("rod_compliance", "bar"), ("pin_compliance", "joint5")):
        assert np.array_equal(predict(having(robot, effect, owner, 0.0), rows).position, predict(robot, rows).position)


@pytest.mark.parametrize(
    ("name", "effect", "owner", "value", "payload"),
    [("delta", "rod_compliance", "rod2a", 2e-5, 4.0), ("palletizer", "pin_compliance", "joint5", 1e-6, 120.0)],
)
def test_it_is_found_again_and_named(name: str, effect: str, owner: str, value: float, payload: float) -> None:
    nominal = load_robot(name)
    real = having(perturbed(nominal, seed=1), effect, owner, value)
    q = random_poses(nominal, 80, seed=11)
    data = simulate(real, q, noise=NOISE, seed=21, payload=np.resize([0.0, payload / 2, payload], 80))
    found = calibrate(nominal, data, effects=["geometry", f"{effect}@{owner}"])
    (parameter,) = (p for p in found.parameters if p.name == "compliance_m_n")
    assert parameter.std is not None
    assert parameter.value == pytest.approx(value, abs=4 * parameter.std)
    assert parameter.std < 0.3 * value
    if name == "palletizer" and not FULL:
        return  # its diagnosis takes minutes
    told: list[Any] = diagnose(nominal, data).effects
    assert (effect, owner) in [(f.effect, f.owner) for f in told] + [other for f in told for other in f.equivalents]
