# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an attack on the diagnosis found of what has no name, findings D7 and D12: its place, its share, its surrogate.

The arm is that of plain_cobot, in numpy.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Dataset, diagnose

from .plain_cobot import SIGMA, directions, in_full, measured, points, postures, robot, shifted

FloatArray = NDArray[np.float64]

ROWS, TEST = 150, 100


def joints(q: FloatArray, approach: FloatArray, sizes: tuple[float, float]) -> FloatArray:
    """Joint positions with joint 3 off by its direction times a load, joint 5 by its direction and a curve."""
    third = sizes[0] * approach[:, 2] * np.cos(q[:, 1] + q[:, 2])
    fifth = sizes[1] * approach[:, 4] * np.exp(np.sin(q[:, 4]))
    return shifted(q, {3: third, 5: fifth})


def rows(seed: int, sizes: tuple[float, float], field: float = 0.0, azimuth: float = 0.0) -> tuple[Dataset, Dataset]:
    """Rows and others of the same arm, seen in a field [1/m] by an instrument whose azimuth is off [rad]."""
    q, approach = postures(ROWS + TEST, seed), directions(ROWS + TEST, seed)
    p = points(joints(q, approach, sizes), seed)
    x, y, z = p.T
    p = p + field * np.column_stack([x * y, x * z, y**2 - z])
    x, y, z = (p + np.array([2.5, 1.0, -0.5])).T  # the instrument stands beside the arm
    off = azimuth * np.sin(2 * np.arctan2(y, x) + 0.7)
    seen = np.column_stack([x - off * y, y + off * x, z])
    whole = measured(q, seen, seed, approach=approach)
    return whole.select(np.arange(ROWS)), whole.select(np.arange(ROWS, ROWS + TEST))


@pytest.mark.parametrize("seed", [1, *in_full(3)])
def test_a_field_is_not_put_at_a_joint(seed: int) -> None:
    """D7: blocks of one function beat the true field of 48."""
    rest = diagnose(robot(), rows(seed, (0.0, 0.0), field=6e-5)[0], sigma=SIGMA).unexplained
    assert rest is not None
    assert (rest.owner, rest.depends_on) == ("workspace", ("x", "y", "z"))


@pytest.mark.parametrize("seed", [1, *in_full(2, 3)])
def test_a_circle_of_an_instrument_is_not_put_at_a_joint(seed: int) -> None:
    """D7: it was "joint 6 by approach 6, 100 %"."""
    rest = diagnose(robot(), rows(seed, (0.0, 0.0), azimuth=1.5e-4)[0]).unexplained
    assert rest is not None
    assert rest.owner == "instrument"


def test_the_share_is_that_of_the_place_that_is_given() -> None:
    """D7: it was of all that remains, as if joint 3 explained the field beside it as well."""
    rest = diagnose(robot(), rows(1, (5e-4, 0.0), 2e-4)[0]).unexplained
    assert rest is not None
    assert rest.owner == "joint3"
    assert 0.5 < rest.share < 0.8


@pytest.mark.parametrize(("sizes", "field"), [((5e-4, 0.0), 0.0), *in_full(((0.0, 0.0), 3e-4), ((5e-4, 4e-4), 0.0))])
def test_what_has_no_name_closes_the_gap_on_other_poses(sizes: tuple[float, float], field: float) -> None:
    """D7: in 29 of 37 sets nothing was added, so that no gap shrank; D12: a surrogate closes 0.83 in the median."""
    data, other = rows(1, sizes, field)
    found = diagnose(robot(), data, test=other)
    before, after = (found.gap[k].test_rms_mm for k in (0, -1))
    assert before is not None
    assert after is not None
    assert before**2 - after**2 > 0.83 * (before**2 - 3 * (1e3 * SIGMA) ** 2)
    assert all(f.grade != "A" for f in found.effects)


@pytest.mark.parametrize("seed", [1, *in_full(2, 3)])
def test_where_nothing_is_missing_nothing_is_added(seed: int) -> None:
    """D12: without a gate a surrogate does harm there."""
    found = diagnose(robot(), rows(seed, (0.0, 0.0))[0])
    assert (found.verdict, len(found.gap)) == ("none", 1)
