# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Touches by joints in another order: an arm whose links have no length left explains them all, and is refused.

It was "converged" with a noise of 0.0000 mm, and two sockets 50 mm apart were 0.000 mm apart and said to agree.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.calibration.inspection import check_lengths
from fastcal.calibration.known_lengths import KnownLength
from fastcal.calibration.result import IdentifiedParameter
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset

ARM = fastcal.load_robot("franka_panda")
COUNT = 30


def touches(order: list[int]) -> Dataset:
    """Of two sockets 50 mm apart, with the joints in some order."""
    random = np.random.default_rng(3)
    T = np.tile(np.eye(4), (2 * COUNT, 1, 1))
    turns = Rotation.from_rotvec(random.uniform(-0.7, 0.7, (2 * COUNT, 3)))
    T[:, :3, :3] = (turns * Rotation.from_euler("x", np.pi)).as_matrix()
    T[:, :3, 3] = np.array([0.45, 0.1, 0.25]) + np.repeat([[0, 0, 0], [0.05, 0, 0]], COUNT, axis=0)
    start = np.array([0.0, 0.3, 0.0, -1.8, 0.0, 2.1, 0.7]) + random.uniform(-0.4, 0.4, (2 * COUNT, 7))
    found = fastcal.inverse_kinematics(ARM, T, seed=start)
    q = found.q + 1e-4 * random.standard_normal(found.q.shape)
    return Dataset.from_arrays(q[:, order], observed_labels={"socket": ["a"] * COUNT + ["b"] * COUNT})


def test_an_arm_that_has_shrunk_into_its_touches_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"only with other lengths: joint\d [a-z]+ has moved by -?\d+"):
        fastcal.calibrate(ARM, touches([1, 0, 2, 3, 4, 5, 6]))
    assert fastcal.calibrate(ARM, touches([0, 1, 2, 3, 4, 5, 6])).status == "converged"


def test_a_diagnosis_refuses_it_in_the_same_words() -> None:
    """It said of joints 3 and 4 exchanged that no effect is missing."""
    with pytest.raises(InvalidInput) as refused:
        fastcal.calibrate(ARM, touches([0, 1, 3, 2, 4, 5, 6]))
    with pytest.raises(InvalidInput) as told:
        fastcal.diagnose(ARM, touches([0, 1, 3, 2, 4, 5, 6]))
    assert str(told.value) == str(refused.value)
    assert fastcal.diagnose(ARM, touches([0, 1, 2, 3, 4, 5, 6])).verdict == "none"


def test_as_read_says_it_in_a_note_and_turns_and_tools_are_no_lengths_of_links() -> None:
    data = touches([0, 1, 2, 3, 4, 5, 6])
    gone = IdentifiedParameter("z_mm", "joint5", -384.0, 1.0, "mm", 0.0)
    other = [
        IdentifiedParameter("z_mm", "tool", -384.0, 1.0, "mm", 0.0),
        IdentifiedParameter("theta_deg", "joint2", 360.0, 1.0, "deg", 0.0),
    ]
    assert check_lengths(ARM, other, data) == []
    (note,) = check_lengths(ARM, [*other, gone], data, as_read=True)
    assert "joint5 z has moved by -384 mm" in note


def test_two_points_that_fell_together_do_not_agree_with_a_known_length() -> None:
    assert "they agree" not in KnownLength(("socket a", "socket b"), 0.05, 1e-4, 2e-17, 2e-17).note
    assert "they agree" in KnownLength(("socket a", "socket b"), 0.05, 1e-4, 0.0501, 1e-4).note
