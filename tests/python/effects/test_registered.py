# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects written in Python: fitted, predicted and refused like those of the core."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.effects import registered
from fastcal.effects.entries import effect_names, parse_effects
from fastcal.effects.registered import States, register_effect
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]


@pytest.fixture(autouse=True)
def _forget(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(registered, "_effects", {})
    return


def cable(states: States) -> FloatArray:
    """A cable along joints 4 and 6 pulls at joint 4."""
    xi = np.zeros((len(states.q), 6, 1))
    xi[:, 5, 0] = states.q[:, 3] * states.q[:, 5]
    return xi


def register_cable(**changes: Any) -> None:
    given: dict[str, Any] = {
        "owners": ["joint4"],
        "parameters": [("pull", "rad", 1e-4, "turn of the joint")],
        "basis": cable,
    }
    register_effect("cable", **(given | changes))


def test_it_is_found_again(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    register_cable()
    assert "cable" in effect_names()
    truth = with_effects(
        perturbed(arm, seed=4), {"effect": "cable", "owner": "joint4", "parameters": {"pull_rad": 2e-4}}
    )
    found = calibrate(arm, simulate(truth, poses, noise=3e-5, seed=9), effects="geometry,cable")
    (entry,) = found.model.spec["effects"]
    got = entry["parameters"]["pull_rad"]
    assert abs(got["value"] - 2e-4) < 3.5 * got["std"]
    assert got["std"] < 1e-5
    assert np.isfinite(found.model.position_deviation(poses.q)).all()


def test_two_of_them_share_the_table(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    register_cable(owners=lambda core: [f"joint{i + 1}" for i in range(core.joint_count)])

    def heat(states: States) -> FloatArray:
        assert states.temperature is not None
        xi = np.zeros((len(states.q), 2, 6, 2))
        xi[:, 0, 2, 0] = states.temperature - 293.15  # the base rises
        xi[:, 1, 0, 1] = states.extra["tilt"]  # the tool shifts along its x
        return xi

    register_effect(
        "heat",
        owners=["robot"],
        parameters=[("rise", "m", 1e-5, "per kelvin"), ("shift", "m", 1e-5, "per unit of tilt")],
        basis=heat,
        frames=["base", "tool"],
        columns=["temperature"],
        extra=["tilt"],
    )
    model = with_effects(
        arm,
        {"effect": "cable", "owner": "joint6", "parameters": {"pull_rad": 1e-3}},
        {"effect": "heat", "owner": "robot", "parameters": {"rise_mm": 0.02, "shift_mm": 0.5}},
    )
    q = poses.q[:1]
    turned = q.copy()
    turned[0, 5] += 1e-3 * q[0, 3] * q[0, 5]
    T = arm.forward(turned)[0]
    up = arm.forward(np.zeros(6))[0][:3, :3] * 0  # the base's own axes, measured: its rotation is that of the file
    rise = np.asarray(arm.core.base_and_tool(arm.core.nominal)[0])[:3, 2] * 10 * 2e-5
    expected = T[:3, 3] + rise + T[:3, 0] * 3 * 5e-4
    got = model.forward(q, temperature=303.15, extra={"tilt": np.array([3.0])})[0]
    assert up.shape == (3, 3)
    assert got[:3, 3] == pytest.approx(expected, abs=1e-13)
    with pytest.raises(InvalidInput, match="heat@robot needs the column temperature_c"):
        model.forward(q, extra={"tilt": np.array([3.0])})
    with pytest.raises(InvalidInput, match="heat@robot needs the column tilt"):
        model.forward(q, temperature=303.15)


def test_invalid_input_is_refused(arm: Robot, poses: Dataset, with_effects: Any) -> None:
    for changes, sentence in (
        ({"parameters": []}, "at least one parameter"),
        ({"parameters": [("pull", "furlong", 1.0, "")]}, "'furlong'.*the units are 1, m, mm"),
        ({"columns": ["temperature_c"]}, "columns of cable are payload, .*temperature,.*got 'temperature_c'.*extra="),
        ({"owners": "joint4"}, r"owners of cable must be a list, such as \['joint4'\], got 'joint4'"),
        ({"parameters": [("pull", "rad", 0.0, "")]}, "size above 0"),
    ):
        with pytest.raises(InvalidInput, match=sentence):
            register_cable(**changes)
    for name in ("backlash", "geometry", "two words", ""):
        with pytest.raises(InvalidInput, match="not taken"):
            register_effect(name, owners=["joint1"], parameters=[("a", "rad", 1.0, "")], basis=cable)
    register_cable()
    with pytest.raises(InvalidInput, match="no owner 'joint1'"):
        parse_effects("cable@joint1", arm.core)
    entry = {"effect": "cable", "owner": "joint4"}
    register_cable(basis=lambda states: np.zeros((len(states.q), 6)))
    with pytest.raises(InvalidInput, match=r"cable@joint4 must have shape \(2, 6, 1\), got \(2, 6\)"):
        with_effects(arm, entry).forward(poses.q[:2])
    register_cable(basis=lambda states: np.full((len(states.q), 6, 1), np.nan))
    with pytest.raises(InvalidInput, match="not finite in row 0"):
        with_effects(arm, entry).forward(poses.q[:2])
    register_cable(basis=lambda states: states.temperature[:, None, None] * np.ones((1, 6, 1)))
    where = r"cable@joint4 cannot be computed \(test_registered.py, line \d+\): TypeError.*columns= asks for it"
    with pytest.raises(InvalidInput, match=where):  # the user's own fault is no internal error of fastcal
        with_effects(arm, entry).forward(poses.q[:2])


def test_a_model_of_another_program_says_what_is_missing(arm: Robot, with_effects: Any) -> None:
    with pytest.raises(InvalidInput, match=r"no effect is called 'cable'.*registered"):
        with_effects(arm, {"effect": "cable", "owner": "joint4"})
