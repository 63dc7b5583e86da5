# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sockets, planes and levels have places of their own: what they leave open of the base is not taken from noise."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.calibration.alignment import measurements
from fastcal.calibration.calibrate import calibrate
from fastcal.measurements.dataset import Dataset

from .bench_arm import MOUNT, TOOL, disturbed, on_plane, postures, robot, tilts
from .test_known_lengths import SOCKETS, reaching

FloatArray = NDArray[np.float64]

NOISE = 3e-5  # [m] of a touch, [rad] of a tilt


def seated(rows: FloatArray, each: int, random: np.random.Generator) -> tuple[FloatArray, list[str]]:
    """Postures with the tool's point in two sockets, which hold it but for the noise."""
    q = [
        reaching(rows, TOOL, at + NOISE * random.standard_normal(3), 1, random)[0]
        for at in SOCKETS
        for _ in range(each)
    ]
    return np.array(q), ["a"] * each + ["b"] * each


@pytest.mark.parametrize("gravity_frame", ["base", "measuring"])
def test_a_base_that_sockets_and_levels_do_not_show_stays_where_it_was(gravity_frame: str) -> None:
    truth, random = disturbed(4), np.random.default_rng(5)
    seats, labels = seated(truth, 25, random)
    q = np.concatenate([seats, postures(60, 6)])
    level = np.full((len(q), 2), np.nan)
    level[len(seats) :] = tilts(truth, q[len(seats) :], 3, MOUNT) + NOISE * random.standard_normal((60, 2))
    arm = robot(gravity_frame=gravity_frame)
    sockets = {"socket": labels + [""] * 60}
    data = Dataset.from_arrays(q, observed={"tilt@link3": level}, observed_labels=sockets, robot=arm)
    found = calibrate(arm, data, checks=False)
    assert found.status == "converged"
    step = np.linalg.inv(arm.forward(q[:1])[0]) @ found.model.forward(q[:1])[0]
    assert np.linalg.norm(step[:3, :3] - np.eye(3)) < 0.02
    assert np.linalg.norm(step[:3, 3]) < 0.01
    assert not any(p.owner == "base" and p.std is not None and p.std > 1 for p in found.parameters)


def test_planes_and_levels_on_the_base_do_not_show_where_it_is() -> None:
    rows, q = disturbed(4), postures(60, 6)
    for arm, shown in ((robot(gravity_frame="base"), False), (robot(gravity_frame="measuring"), True)):
        level = Dataset.from_arrays(q, observed={"tilt@link3": tilts(rows, q, 3, MOUNT)}, robot=arm)
        assert measurements(level, arm).shows_base is shown
        there = on_plane(rows, q, np.array([0.0, 0.0, 1.0]), 0.2)
        plane = Dataset.from_arrays(there, observed_labels={"plane": ["floor"] * 60}, robot=arm)
        assert not measurements(plane, arm).shows_base
