# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An effect of one's own, registered by one call, goes every way that those of the core go: no other file knows it.

A pedestal that yields sideways: the base turns about its x by the moment that the arm puts on it there, c M_x. (About
both axes alike, it would be the same as a bearing of joint 1 that tilts.) The C++ test examples/own_effect_in_the_core
runs these tests with the same effect compiled into the core, from tests/cpp/examples/pedestal_tilt.cpp alone.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, _core, calibrate, convert, diagnose, load_robot, perturbed, simulate
from fastcal.compensation.programs import robot_without_measurement
from fastcal.diagnosis import Diagnosis
from fastcal.diagnosis.partial_residuals import of_finding
from fastcal.effects import registered
from fastcal.effects.registered import States, register_effect
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.report.diagnosis_report import diagnosis_page

SIGMA = 3e-5  # [m]
ROWS = 140
IN_CORE = os.environ.get("FASTCAL_OWN") == "core"


def pedestal(states: States) -> NDArray[np.float64]:
    """The base turns about its own x by the moment about it."""
    xi = np.zeros((len(states.q), 6, 1))
    xi[:, 3, 0] = states.load_on("base")[:, 3]
    return xi


@pytest.fixture(autouse=True, scope="module")
def _registered() -> Iterator[None]:
    before = dict(registered._effects)
    assert ("pedestal_tilt" in _core.effect_names()) == IN_CORE
    if not IN_CORE:
        register_effect(
            "pedestal_tilt",
            owners=["base"],
            parameters=[("", "rad_nm", 1e-7, "turn of the base per moment")],
            basis=pedestal,
            phrase="a pedestal that yields",
            depends_on=["load"],
            refers_to="base",
            follows_loads=True,
        )
    yield
    registered._effects.clear()
    registered._effects.update(before)


@cache
def arm() -> Robot:
    return load_robot("pmc6va030")


@cache
def poses() -> Dataset:
    random = np.random.default_rng(3)
    q = random.uniform(*arm().limits.T, (ROWS, 6))
    return Dataset.from_arrays(q, robot=arm(), payload=random.choice([0.0, 30.0], ROWS))


def measured(tilt: float, noise: float = SIGMA) -> Dataset:
    entry = {"effect": "pedestal_tilt", "owner": "base", "parameters": {"rad_nm": tilt}}
    true = perturbed(arm(), seed=2)
    return simulate(Robot(dict(true.spec) | {"effects": [entry]}), poses(), noise=noise, seed=5)


@cache
def deviation() -> float:
    """Standard deviation of the tilt [rad/(N m)] that these data give."""
    found = calibrate(arm(), measured(1e-7), effects="geometry,pedestal_tilt", loss="none")
    (entry,) = [e for e in found.model.spec["effects"] if e["effect"] == "pedestal_tilt"]
    assert abs(entry["parameters"]["rad_nm"]["value"] - 1e-7) < 4 * entry["parameters"]["rad_nm"]["std"]
    return float(entry["parameters"]["rad_nm"]["std"])


@cache
def found_at(snr: float) -> Diagnosis:
    return diagnose(arm(), measured(snr * deviation()), sigma=SIGMA)


@pytest.mark.parametrize(("snr", "grade"), [(20.0, "B"), (60.0, "A")])
def test_it_is_named_and_proved_at_the_signal_that_an_effect_of_loads_takes(snr: float, grade: str) -> None:
    found = found_at(snr)
    assert [f.label for f in found.effects] == ["pedestal_tilt@base"]
    (finding,) = found.effects
    assert finding.snr == pytest.approx(snr, abs=4)
    assert finding.grade == grade, finding.reasons


def test_errors_of_the_masses_are_carried_beside_it() -> None:
    entries = found_at(60.0).model.spec["effects"]
    assert {e["effect"] for e in entries} == {"pedestal_tilt", "link_mass", "link_com"}
    assert all(e.get("prior") == "yes" for e in entries if e["effect"] != "pedestal_tilt")


def test_it_is_worded_and_drawn() -> None:
    found = found_at(60.0)
    assert "a pedestal that yields" in found.sentence
    drawn = of_finding(found.state, found.effects[0])
    assert (drawn.depends_on, drawn.quantity) == (("itself",), "displacement")
    assert np.ptp(drawn.reading.fitted) > 3 * SIGMA
    text = diagnosis_page(found)
    assert "a pedestal that yields" in text
    assert "turn of the base per moment" in text


@pytest.mark.skipif(IN_CORE, reason="the traits of an effect of the core do not change")
def test_it_is_drawn_along_itself_where_the_data_lack_its_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    found, own = found_at(60.0), registered._effects["pedestal_tilt"]
    traits = replace(own.traits, plotted_over="time_s")
    monkeypatch.setitem(registered._effects, "pedestal_tilt", replace(own, traits=traits))
    assert of_finding(found.state, found.effects[0]).depends_on == ("itself",)


def test_it_is_converted_where_the_base_stays() -> None:
    """With the errors of masses taken out, which no other kind of kinematics carries."""
    model = found_at(60.0).model
    own = [e for e in model.spec["effects"] if e["effect"] == "pedestal_tilt"]
    alone = Robot(dict(model.spec) | {"effects": own})
    q = poses().q[:4]
    for kind in ("poe", "urdf"):
        moved = convert(alone, kind)
        assert moved.spec["effects"] == own
        np.testing.assert_allclose(Robot(moved.spec).forward(q), alone.forward(q), atol=1e-9)


def test_it_is_compensated_as_the_robot_has_it() -> None:
    model = found_at(60.0).model
    assert robot_without_measurement(model).spec["effects"] == model.spec["effects"]


def test_a_registered_effect_of_rows_is_refused_by_a_conversion() -> None:
    register_effect(
        "sag", owners=["link2"], parameters=[("", "rad_nm", 1e-7, "turn")], basis=lambda s: np.zeros((len(s.q), 6, 1))
    )
    model: dict[str, Any] = dict(arm().spec) | {"effects": [{"effect": "sag", "owner": "link2", "parameters": {}}]}
    with pytest.raises(InvalidInput, match="sag@link2 can't be carried"):
        convert(Robot(model), "urdf")
