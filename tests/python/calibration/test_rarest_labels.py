# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A label that is misspelt in one row is named with the number of its rows, by calibrate and by place."""

import numpy as np
import pytest

import fastcal
from fastcal.calibration.rarest_labels import with_rarest
from fastcal.calibration.touches import find_place
from fastcal.errors import Undetermined
from fastcal.measurements.dataset import Dataset

ARM = fastcal.load_robot("ur5")


def touches(field: str, labels: list[str]) -> Dataset:
    q = fastcal.random_poses(ARM, len(labels), seed=1)
    return Dataset.from_arrays(q, observed_labels={field: labels}, robot=ARM)


@pytest.mark.parametrize(
    ("field", "labels", "said"),
    [
        ("socket", ["a"] * 9 + ["b"] * 9 + ["aa"], "at least two touches; the fewest rows are of socket 'aa' (1)"),
        ("ball", ["b"] * 9 + ["bl", "bl"], "at least five touches; the fewest rows are of ball 'bl' (2)"),
        ("cube", ["k/x"] * 9 + ["k/z"] * 9, "of its faces x, y and z; the fewest rows are of cube 'k/y' (0)"),
    ],
)
def test_the_misspelt_label_is_named(field: str, labels: list[str], said: str) -> None:
    data = touches(field, labels)
    with pytest.raises(Undetermined) as calibrated:
        fastcal.calibrate(ARM, data, as_read=True)
    assert str(calibrated.value).endswith(said)
    with pytest.raises(Undetermined) as placed:
        find_place(ARM, data, "tool")
    assert str(placed.value).endswith(said)


def test_other_reasons_stay_as_they_are() -> None:
    data = touches("socket", ["a", "a"])
    assert with_rarest("base and tool need at least three measured points", data).endswith("points")
    bare = Dataset.from_arrays(data.q, position=np.zeros((2, 3)), robot=ARM)
    assert with_rarest("each anchor needs at least four lengths", bare) == "each anchor needs at least four lengths"
