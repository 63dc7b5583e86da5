# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots with closed loops in service: they are checked, brought up to date and compared as any arm is."""

from __future__ import annotations

from pathlib import Path

import pytest

from fastcal import Robot, calibrate, check, compare, evaluate, load_robot, perturbed, random_poses, simulate, update
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.hypotheses import hypotheses
from fastcal.monitoring.words import cause_text

NAMES = ["delta", "delta_printer", "five_bar", "hexapod", "palletizer", "parallelogram_6r"]


def measured(nominal: Robot, real: Robot, count: int, seed: int) -> Dataset:
    return simulate(real, random_poses(nominal, count, seed=seed), noise=5e-5, seed=seed + 1)


def longer(robot: Robot, by_mm: float) -> Robot:
    """The same with its first rod longer, as one that was exchanged."""
    loops = [dict(loop) for loop in robot.description.loops]
    rod = next(loop for loop in loops if "length_mm" in loop)
    rod["length_mm"] += by_mm
    return robot.with_(loops=loops)


@pytest.mark.parametrize("name", NAMES)
def test_a_model_of_loops_is_checked_updated_and_compared(name: str, tmp_path: Path) -> None:
    nominal = load_robot(name)
    real = perturbed(nominal, length=3e-4, angle=3e-4, seed=4)
    calibrate(nominal, measured(nominal, real, 80, 201)).save(tmp_path)
    model = load_robot(tmp_path / "model.yaml")
    holds = check(model, measured(nominal, real, 20, 401))
    assert holds.verdict == "holds"
    assert not [note for note in holds.notes if "stood still" in note]  # of joints that no motor moves
    repaired = longer(real, 1.5)
    after = measured(nominal, repaired, 40, 501)
    changed = check(model, after)
    assert changed.verdict == "changed"
    assert all("inf" not in cause_text(cause) for cause in changed.causes)
    rod = next(loop["name"] for loop in real.description.loops if "length_mm" in loop)
    assert any(cause.label == f"{rod} geometry" for cause in changed.causes)
    new = update(model, after)
    later = measured(nominal, repaired, 40, 601)
    was, now = evaluate(model, later).after, evaluate(new.model, later).after
    assert was is not None
    assert now is not None
    assert now.rms < 1.4e-4 < was.rms  # a coordinate's noise is 0.05 mm
    assert compare(model, new.model).at_tool.rms > 1e-4


def test_a_passive_joint_and_a_rod_have_no_zero() -> None:
    """leg4 is no joint 4."""
    robot = load_robot("hexapod")
    labels = {h.label: h for h in hypotheses(robot, robot, [], False)}
    zeros = {label for label, h in labels.items() if h.kind == "zero"}
    motors = {f"joint{i + 1} zero" for i in range(robot.joint_count) if i not in robot.passive}
    assert zeros == motors
    assert "leg4 geometry" in labels


def test_a_link_behind_a_passive_joint_may_have_been_bent() -> None:
    robot = load_robot("palletizer")
    links = {h.label for h in hypotheses(robot, robot, [], False) if h.kind == "link"}
    assert {f"joint{i + 1} geometry" for i in robot.passive} <= links
