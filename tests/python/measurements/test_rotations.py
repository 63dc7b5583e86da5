# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Best rotations and motions, of what is a motion, of noise and of mirrors."""

import numpy as np
from scipy.spatial.transform import Rotation

from fastcal.measurements.rotations import best_motion, nearest_rotation


def test_a_motion_is_found_again() -> None:
    random = np.random.default_rng(1)
    R, t = Rotation.from_rotvec([0.4, -1.1, 2.0]).as_matrix(), np.array([0.3, -2.0, 1.5])
    p = random.standard_normal((6, 3))
    motion = best_motion(p, p @ R.T + t)
    np.testing.assert_allclose(motion[:3], np.column_stack([R, t]), atol=1e-14)
    np.testing.assert_array_equal(motion[3], [0, 0, 0, 1])


def test_the_rotation_is_that_of_an_independent_program() -> None:
    random = np.random.default_rng(2)
    p, x = random.standard_normal((2, 9, 3))
    wanted, _ = Rotation.align_vectors(x - x.mean(axis=0), p - p.mean(axis=0))
    np.testing.assert_allclose(best_motion(p, x)[:3, :3], wanted.as_matrix(), atol=1e-12)


def test_a_mirror_gives_a_rotation_and_many_matrices_one_each() -> None:
    mirror = np.diag([3.0, 2.0, -1.0])
    np.testing.assert_allclose(nearest_rotation(mirror), np.eye(3), atol=1e-15)
    turns = Rotation.random(4, random_state=3).as_matrix()
    np.testing.assert_allclose(nearest_rotation(2.0 * turns), turns, atol=1e-14)
