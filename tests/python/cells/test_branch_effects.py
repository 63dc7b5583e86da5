# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects of an arm in a cell are those of the arm alone."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal import _core
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.errors import InvalidInput
from fastcal.io.robot_file import read_spec
from fastcal.io.tree_file import cell_text, load_cell

from .test_calibrate import NOISE, content, simulated, written

VALUES = np.array([1e-6, 1e-4, 0.3, 2e-4])


def effects_of(cell: Cell, arm: str) -> list[_core.Effect]:
    core = cell.arm(arm).robot.core
    own = [
        _core.make_effect("joint_compliance", core, "joint2"),
        _core.make_effect("gear_harmonic", core, "joint3", {"order": 2.0}),
        _core.make_effect("reduction_ratio", core, "joint4"),
    ]
    return [_core.on_branch(effect, cell.core, arm, core) for effect in own]


def test_owners_carry_the_arm_and_derivatives_are_exact(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, content()))
    model = _core.ErrorModel(cell.core, effects_of(cell, "right"), VALUES)
    first = len(cell.core.parameters)
    assert [p.owner for p in model.parameters[first:]] == ["right.joint2", *["right.joint3"] * 2, "right.joint4"]
    q, theta = np.random.default_rng(1).uniform(-1, 1, (7, 13)), np.asarray(model.start)
    J = np.asarray(model.parameter_jacobian(_core.Samples(q), theta, of="tag"))
    assert not np.asarray(model.parameter_jacobian(_core.Samples(q), theta, of="smr"))[:, :, first:].any()
    for k, step in zip(range(first, len(theta)), (1e-8, 1e-6, 1e-4, 1e-6), strict=True):
        h = step * np.eye(len(theta))[k]
        ends = [np.asarray(model.predict(_core.Samples(q), theta + s * h, of="tag"))[:, :3, 3] for s in (1, -1)]
        difference = (ends[0] - ends[1]) / (2 * step)
        assert np.allclose(J[:, :, k], difference, atol=1e-4 * np.abs(difference).max())


def test_an_arm_that_stands_alone_in_a_cell_gives_like_the_arm(tmp_path: Path) -> None:
    arms = {"right": {"robot": "ur10", "xyz_mm": [100.0, -200.0, 300.0], "rpy_deg": [50.0, 0.0, 0.0]}}
    cell = load_cell(written(tmp_path, content(arms=arms, targets={"tag": {"on": "right"}}, sensors={})))
    robot = cell.arm("right").robot
    own = [_core.make_effect("joint_compliance", robot.core, f"joint{i}") for i in range(1, 7)]
    own.append(_core.make_effect("link_bending", robot.core, "link2"))
    values = np.append(np.full(6, 1e-6), 1e-5)
    q = np.random.default_rng(2).uniform(-1, 1, (9, 6))
    alone = _core.ErrorModel(robot.core, own, values)
    there = _core.ErrorModel(cell.core, [_core.on_branch(e, cell.core, "right", robot.core) for e in own], values)
    flange = "right.link6"
    assert np.allclose(
        there.predict(_core.Samples(q), there.start, of=flange),
        alone.predict(_core.Samples(q), alone.start, of="link6"),
        atol=1e-10,
    )


def test_what_a_cell_has_not_is_refused(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, content()))
    core = cell.arm("left").robot.core
    mass = _core.make_effect("link_mass", core, "link2")
    with pytest.raises(InvalidInput, match=r"left.link2 changes weights or beams"):
        _core.on_branch(mass, cell.core, "left", core)
    with pytest.raises(InvalidInput, match="the cell has no arm 'middle' of 6 joints"):
        _core.on_branch(_core.make_effect("backlash", core, "joint2"), cell.core, "middle", core)


def test_an_arm_may_bring_its_effects_into_a_cell(tmp_path: Path) -> None:
    right = read_spec("ur10")
    yields = {
        "effect": "joint_compliance",
        "owner": "joint2",
        "parameters": {"compliance_rad_nm": {"value": 2e-6, "std": 1e-8}},
    }
    members = content()
    members["arms"]["right"]["robot"] = right | {"effects": [yields]}
    cell = load_cell(written(tmp_path, members))
    readings = simulated(cell, np.random.default_rng(4), 60, {"smr": "point", "tag": "point"})
    found = calibrate_cell(cell, readings)
    assert found.train["position"].statistics[1].rms < 1.1 * NOISE * np.sqrt(3)  # type: ignore[union-attr]
    stiff = calibrate_cell(load_cell(written(tmp_path, content())), readings)
    assert stiff.train["position"].statistics[1].rms > 2 * NOISE * np.sqrt(3)  # type: ignore[union-attr]
    again = load_cell(written(tmp_path, yaml.safe_load(cell_text(found.cell))))
    assert again.arm("right").robot.spec["effects"] == [yields]
    assert np.array_equal(again.model.start, found.cell.model.start)
