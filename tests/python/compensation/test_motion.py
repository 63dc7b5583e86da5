# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arms with play and settling: commands hold for the moves between them, as `predict` reads a table of commands."""

import numpy as np
import pytest

import fastcal
from fastcal.compensation.commands import shifts
from fastcal.io.targets import load_targets, write_commands

PLAY = {"effect": "backlash", "owner": "joint3", "parameters": {"gap_rad": {"value": 4e-4}}}
CREEP = {"effect": "settling", "owner": "joint2", "parameters": {"rad_rad": {"value": 2e-3}}}


def _arm(*effects: dict) -> fastcal.Robot:
    return fastcal.Robot(fastcal.load_robot("staubli_rx160l").spec | {"effects": list(effects)})


def _poses(arm: fastcal.Robot, count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    q = 0.4 * fastcal.random_poses(arm, count, seed=2)
    return q, fastcal.Robot(arm.spec | {"effects": []}).forward(q)


def _missed(arm: fastcal.Robot, found: fastcal.Compensation, poses: np.ndarray) -> np.ndarray:
    """(N,) [m] by which the arm misses the targets when it drives through the commands."""
    got = fastcal.predict(arm, fastcal.Dataset.from_arrays(found.q)).position
    return np.linalg.norm(got - poses[:, :3, 3], axis=1)


@pytest.mark.parametrize("effects", [(PLAY,), (CREEP,), (PLAY, CREEP)])
def test_predict_on_the_commands_gives_the_targets(effects) -> None:
    """It missed them by the play and by all settling: directions and moves were taken to be 0."""
    arm = _arm(*effects)
    q, poses = _poses(arm)
    found = fastcal.compensate(arm, poses, q)
    assert found.reached.all()
    assert _missed(arm, found, poses).max() < 1e-8
    assert "each row is taken to be driven to from the row before it" in found.notes[0]
    assert all(f"{each['effect']}@{each['owner']}" in found.notes[0] for each in effects)
    bare = fastcal.compensate(_arm(), poses, q)
    assert not bare.notes
    assert _missed(arm, bare, poses).max() > 1e-4  # so much there was to correct


def test_targets_of_a_file_without_directions_are_driven_through_too(tmp_path) -> None:
    arm = _arm(PLAY, CREEP)
    q, poses = _poses(arm)
    wxyz = fastcal.predict(_arm(), fastcal.Dataset.from_arrays(q)).rotation
    rows = np.column_stack([poses[:, :3, 3] * 1000, wxyz, np.degrees(q)])
    names = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz", *(f"q{j}_deg" for j in range(1, 7))]
    lines = [",".join(names), *(",".join(map(repr, row)) for row in rows.tolist())]
    (tmp_path / "targets.csv").write_text("\n".join(lines) + "\n")
    wanted = load_targets(tmp_path / "targets.csv", arm)
    assert not {"approach", "move"} & set(wanted.conditions)
    found = fastcal.compensate(arm, wanted)
    residual = (found.position_error, found.rotation_error)
    write_commands(tmp_path / "commands.csv", arm, found.q, residual, found.sigma, found.status)
    sent = fastcal.load_measurements(tmp_path / "commands.csv", arm, require_measured=False)
    assert np.abs(fastcal.predict(arm, sent).position - poses[:, :3, 3]).max() < 1e-8
    shift, missed = shifts(arm, found, wanted, np.arange(len(q)))
    assert np.isfinite(shift).all()
    assert missed.max() > 1e-4


def test_given_directions_count() -> None:
    arm = _arm(PLAY)
    q, poses = _poses(arm)
    up = np.ones_like(q)
    found = fastcal.compensate(arm, poses, q, approach=up)
    assert not found.notes
    np.testing.assert_allclose(arm.forward(found.q, approach=up), poses, atol=1e-8)


def test_single_points_say_what_they_leave_out() -> None:
    arm = _arm(PLAY, CREEP)
    q, poses = _poses(arm)
    found = fastcal.compensate(arm, poses, q, along_path=False)
    (note,) = found.notes
    assert note.startswith("backlash@joint3, settling@joint2: single points do not say how the joints come to them")
    assert note.endswith("give columns approach1 ..., or the rows as a path")


def test_a_joint_that_stays_keeps_its_side_and_a_move_within_the_play_is_told() -> None:
    arm = _arm(PLAY)
    q = np.tile(np.radians([10.0, 20.0, 80.0, 15.0, 50.0, -20.0]), (4, 1))
    q[1:, 2] += 0.2
    q[2, 0] += 0.1
    q[3, 0] += 0.2
    poses = _arm().forward(q)
    found = fastcal.compensate(arm, poses, q)
    assert _missed(arm, found, poses).max() < 2e-8
    np.testing.assert_array_equal(found.conditions["approach"][1:, 2], 1.0)  # not the sign of rounding
    q[2, 2] -= 1e-4
    poses = _arm().forward(q)
    found = fastcal.compensate(arm, poses, q)
    np.testing.assert_allclose(found.position_error, _missed(arm, found, poses), atol=1e-9)
    assert 1e-4 < found.position_error.max() < 2.3e-4  # half the play; the whole of it is 0.425 mm
    assert found.notes[1].startswith("rows 2, 3: a joint moves there by so little that its direction turns")


def test_a_path_is_driven_with_its_directions() -> None:
    arm = _arm(PLAY)
    q = np.radians([10.0, 20.0, 80.0, 15.0, 50.0, -20.0])
    poses = np.repeat(_arm().forward(q), 3, axis=0)
    poses[:, 0, 3] += [0.0, 0.1, -0.1]
    driven = fastcal.path_accuracy(arm, poses, q)
    assert driven.after[driven.points].max() < 1e-8
