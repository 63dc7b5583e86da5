# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The sides of a slack are found from what a model leaves, whichever joint decides them."""

import copy

import numpy as np
import pytest

import fastcal
from fastcal_studies.sides import FEWEST, Sides, found_sides


@pytest.mark.parametrize(("owner", "joint", "deg"), [(1, 2, -72.0), (3, 5, 30.0)])
def test_the_joint_and_the_position_of_a_jump_are_found(owner: int, joint: int, deg: float) -> None:
    """Between the neighbouring rows, though the geometry is off too and the jump is fitted as part of it."""
    nominal = fastcal.load_robot("ur5")
    q = fastcal.random_poses(nominal, 80, seed=joint)
    side = np.where(np.degrees(q[:, joint - 1]) > deg, 1.0, -1.0)
    spec = copy.deepcopy(dict(fastcal.calibration.simulation.perturbed(nominal, length=5e-4, angle=5e-4, seed=1).spec))
    spec["effects"] = [{"effect": "backlash", "owner": f"joint{owner}", "parameters": {"gap_rad": 1e-3}}]
    hidden = fastcal.Dataset.from_arrays(q, approach=np.repeat(side[:, np.newaxis], 6, axis=1))
    seen = fastcal.simulate(fastcal.Robot(spec), hidden, noise=2e-5, seed=3)
    data = fastcal.Dataset.from_arrays(q, position=seen.position)
    model = fastcal.calibrate(nominal, data, loss="none").model
    found = found_sides(model, data)
    assert found.joint == joint
    assert np.array_equal(found(q), side)
    fitted = fastcal.calibrate(nominal, found.marked(data), effects="geometry,backlash")
    gaps = {p.owner: p for p in fitted.parameters if p.name == "gap_rad"}
    own = gaps.pop(f"joint{owner}")
    assert own.value == pytest.approx(1e-3, abs=4 * own.std)
    assert all(abs(gap.value) < 4 * gap.std for gap in gaps.values())


def test_every_joint_is_approached_from_the_side_of_its_row() -> None:
    q = np.array([[0.0, 1.0], [0.0, 3.0]])
    marked = Sides(2, 2.0).marked(fastcal.Dataset.from_arrays(q))
    assert marked.approach is not None
    assert marked.approach.tolist() == [[-1.0, -1.0], [1.0, 1.0]]


def test_a_division_leaves_enough_rows_on_either_side() -> None:
    """A jump of the last two rows is not taken for one: two rows fit anything."""
    robot = fastcal.load_robot("ur5")
    q = fastcal.random_poses(robot, 60, seed=0)
    last = np.sort(q[:, 1])[-2]
    moved = q.copy()
    moved[q[:, 1] >= last, 0] += 1e-3
    data = fastcal.Dataset.from_arrays(q, position=robot.forward(moved)[:, :3, 3])
    found = found_sides(robot, data)
    assert FEWEST <= np.sum(found(q) > 0) <= len(q) - FEWEST
