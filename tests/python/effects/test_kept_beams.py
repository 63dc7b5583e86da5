# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A link bends and twists about the beam that it was first fitted as, whatever the same fit makes of the table."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.effects.entries import core_options
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

OWNER = "link5"
NUMBERS = {"link_bending": "inverse_ei_1_nm2", "link_torsion": "inverse_gj_1_nm2"}
ARMS = [  # d [mm] of the link, what its a truly is where the nominal one is 0, and its 1 / EI
    (20.0, 1.0, 1e-3),  # what a calibration leaves of 0: no beam
    (200.0, 6.0, 1e-4),  # more than that: by the identified table alone, the link's own length
]


def wrist(arm: Robot, d: float, a: float, *effects: dict[str, Any]) -> Robot:
    """The arm with a fifth link of this d and a [mm], rows by the modified convention."""
    spec = copy.deepcopy(arm.spec)
    spec["joints"][4]["d_mm"], spec["joints"][5]["a_mm"] = d, a
    return Robot(spec | {"effects": list(effects)})


@pytest.mark.parametrize("effect", NUMBERS)
@pytest.mark.parametrize(("d", "a", "value"), ARMS)
def test_the_model_that_is_written_is_the_one_that_was_fitted(
    d: float, a: float, value: float, effect: str, arm: Robot, poses: Dataset, tmp_path: Path
) -> None:
    beam = [0.0, -d, 0.0]  # alpha of row 6 turns joint 5's z to -y of the far end
    cause = {"effect": effect, "owner": OWNER, "beam_mm": beam, "parameters": {NUMBERS[effect]: value}}
    data = fastcal.simulate(wrist(arm, d, a, cause), poses, noise=1e-5, seed=2)
    asked = f"geometry,{effect}@{OWNER}"
    found = fastcal.calibrate(wrist(arm, d, 0.0), data, effects=asked, loss="none")
    assert found.status == "converged"
    found.save(tmp_path / "out")
    written = fastcal.load_robot(tmp_path / "out" / "model.yaml")
    assert written.spec["joints"][5]["a_mm"] == pytest.approx(a, abs=0.3)
    left = written.poses(data)[:, :3, 3] - np.asarray(data.position)
    assert np.sqrt(np.mean(left**2)) < found.sigma  # which divides by fewer than all rows

    again = fastcal.calibrate(written, data, effects=asked, loss="none")
    assert again.status == "converged"
    (first,), (second,) = written.spec["effects"], again.model.spec["effects"]
    assert first["beam_mm"] == pytest.approx(beam, abs=1e-9)
    assert second["beam_mm"] == first["beam_mm"]
    np.testing.assert_allclose(again.model.poses(data), written.poses(data), atol=1e-6)  # a tenth of the noise


def test_the_beam_of_a_calibrated_model_is_the_nominal_link(arm: Robot, poses: Dataset) -> None:
    """Where it gets its effect later, its own table has an a of 6 mm that would pass for the link."""
    beam = [0.0, -200.0, 0.0]
    cause = {"effect": "link_bending", "owner": OWNER, "beam_mm": beam, "parameters": {NUMBERS["link_bending"]: 1e-4}}
    data = fastcal.simulate(wrist(arm, 200.0, 6.0, cause), poses, noise=1e-5, seed=2)
    geometry = fastcal.calibrate(wrist(arm, 200.0, 0.0), data, effects="geometry", loss="none").model
    assert abs(geometry.spec["joints"][5]["a_mm"]) > 5
    later = fastcal.calibrate(geometry, data, effects=f"geometry,link_bending@{OWNER}", loss="none").model
    assert later.spec["effects"][0]["beam_mm"] == pytest.approx(beam, abs=1e-9)


@pytest.mark.parametrize("effect", NUMBERS)
def test_a_link_that_came_out_too_short_stays_an_owner(effect: str, arm: Robot, poses: Dataset) -> None:
    there = {"effect": effect, "owner": OWNER, "beam_mm": [0.0, -5.2, 0.0], "parameters": {NUMBERS[effect]: 1e-3}}
    identified = wrist(arm, 4.8, 0.3, there)
    data = fastcal.simulate(identified, poses, noise=1e-5, seed=2)
    again = fastcal.calibrate(identified, data, effects=f"{effect}@{OWNER}", loss="none")
    (entry,) = again.model.spec["effects"]
    assert entry["beam_mm"] == there["beam_mm"]
    with pytest.raises(InvalidInput, match="no owner 'link5'"):
        fastcal.calibrate(wrist(arm, 4.8, 0.3), data, effects=f"{effect}@{OWNER}")


def test_a_file_without_a_beam_has_that_of_its_table(arm: Robot, poses: Dataset) -> None:
    cause = {"effect": "link_bending", "owner": OWNER, "parameters": {NUMBERS["link_bending"]: 1e-4}}
    bare = wrist(arm, 200.0, 0.0, cause)
    kept = wrist(arm, 200.0, 0.0, cause | {"beam_mm": [0.0, -200.0, 0.0]})
    np.testing.assert_allclose(bare.poses(poses), kept.poses(poses), atol=1e-15)
    assert not np.allclose(bare.poses(poses), wrist(arm, 200.0, 0.0).poses(poses), atol=1e-5)


def test_a_list_reaches_the_core_in_si() -> None:
    entry = {"effect": "link_bending", "owner": OWNER, "beam_mm": [0, -200, 9]}
    assert core_options(entry) == {"beam": [0.0, -0.2, 0.009]}
