# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the studies' arms have in common, and the searches."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal_studies.searches import Counted, bee_colony, genetic, particle_swarm
from fastcal_studies.simulated import WORLDS, Unmodelled, at_one_place, in_world, left, measure, row_numbers


def test_waves_have_their_size_and_grow_with_the_load() -> None:
    waves = Unmodelled((1e-4, 0.0, 3e-4), 10.0, 2.0, 4)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (4000, 3))
    empty = waves(q, np.zeros(len(q)))
    assert empty.std(axis=0) == pytest.approx([1e-4 / 2**0.5, 0.0, 3e-4 / 2**0.5], rel=0.05)
    assert waves(q, np.full(len(q), 10.0)) == pytest.approx(3 * empty)


@pytest.mark.parametrize("world", WORLDS)
def test_every_world_moves_the_point_as_far_and_links_only_across_their_joints(world: str) -> None:
    robot = fastcal.load_robot("siasun_sr210d")
    sent = fastcal.Dataset.from_arrays(fastcal.random_poses(robot, 300, seed=1))
    waves = Unmodelled((1e-4,) * 6, 10.0, 0.0, 4)
    there = in_world(waves, world, robot, sent)
    still, moved = (
        np.asarray(measure(robot, sent, w, 0.0, 0).position) for w in (Unmodelled((0.0,) * 6, 10.0, 0.0, 4), there)
    )
    wanted = np.einsum("nij,nj->ni", robot.joint_jacobian(sent.q)[:, :3], waves(sent.q, sent.payload))
    assert np.linalg.norm(moved - still) == pytest.approx(np.linalg.norm(wanted), rel=1e-3)
    assert np.any(there(sent.q, sent.payload)) == (world == "joints")
    if world == "links":
        only = replace(there, sizes=(0.0, 1e-4, 0.0, 0.0, 0.0, 0.0))
        along = np.einsum("ni,ni->n", only.displacement(robot, sent), robot.joint_jacobian(sent.q)[:, :3, 1])
        assert np.abs(along).max() < 1e-15


def test_rows_of_one_place_are_fitted_as_rows_without_a_label() -> None:
    robot = fastcal.load_robot("siasun_sr210d")
    sent = fastcal.Dataset.from_arrays(fastcal.random_poses(robot, 60, seed=2))
    rows = measure(fastcal.perturbed(robot, seed=3), sent, Unmodelled((1e-4,) * 6, 10.0, 0.0, 4), 2e-5, 1)
    plain, labelled = (fastcal.calibrate(robot, data) for data in (rows, at_one_place(rows)))
    assert [p.value for p in labelled.parameters] == [p.value for p in plain.parameters]
    assert labelled.train.after == plain.train.after


def test_torques_are_those_of_a_lever() -> None:
    """The payload's moment about joint 2 of the stretched KR500 is its weight times the horizontal distance."""
    spec = dict(fastcal.load_robot("kuka_kr500_3").spec)
    for joint in spec["joints"]:
        joint.pop("link")
    robot = fastcal.Robot(spec)
    data = fastcal.Dataset.from_arrays(np.zeros((1, 6)), payload=np.array([100.0]))
    com = robot.forward(data.q)[0] @ [*(np.array([60 - 120, -40, 200 - 250]) / 1e3), 1]
    lever = np.hypot(*com[:2]) - 0.5
    loads = np.asarray(robot.error_model.loads(robot.samples(data), robot.error_model.start))
    assert abs(loads[0, 3, 5]) == pytest.approx(100 * 9.80665 * lever, rel=1e-6)


def test_hidden_numbers_of_rows_are_those_of_the_file() -> None:
    robot = fastcal.load_robot("pmc6va030")
    found = row_numbers(robot, ["joint2 a_mm", "joint2 beta_deg", "tool x_mm", "base z_mm"])
    assert found == {"joint2 a_mm": robot.spec["joints"][1]["a_mm"], "joint2 beta_deg": 0.0}


def test_left_is_measured_less_predicted_in_the_base() -> None:
    robot = fastcal.load_robot("ur5")
    turned = fastcal.Robot(dict(robot.spec) | {"base": {"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 90]}})
    q = fastcal.random_poses(robot, 5, seed=0)
    data = fastcal.Dataset.from_arrays(q, position=turned.forward(q)[:, :3, 3] + [1e-3, 0, 0])
    assert left(turned, data) == pytest.approx(np.tile([0, -1e-3, 0], (5, 1)), abs=1e-12)


@pytest.mark.parametrize("search", [particle_swarm, genetic, bee_colony])
def test_a_search_finds_the_bottom_of_a_bowl_within_its_evaluations(search: Any) -> None:
    bowl = Counted(lambda x: ((x - 0.3) ** 2).sum(axis=1), target=1e-3)
    search(bowl, np.random.default_rng(0).uniform(-1, 1, (20, 2)), 2000, 1)
    assert bowl.value < 1e-3
    assert bowl.reached is not None
    assert bowl.reached <= bowl.evaluations <= 2000
    assert bowl.x == pytest.approx([0.3, 0.3], abs=0.04)


def test_the_course_of_a_search_is_the_best_so_far() -> None:
    f = Counted(lambda x: x[:, 0])
    for values in ([5.0, 4.0], [6.0, 7.0], [1.0, 3.0]):
        f(np.array(values)[:, np.newaxis])
    assert f.best_by(np.array([1.0, 2.0, 4.0, 5.0, 6.0, 100.0])).tolist() == [4.0, 4.0, 4.0, 4.0, 1.0, 1.0]
