# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Ways in which a second kind of reading can be worthless beside good points."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal.measurements.dataset import Dataset

FloatArray = NDArray[np.float64]
Spoil = Callable[[Dataset, np.random.Generator], Dataset]


def _rotations(data: Dataset) -> Rotation:
    return Rotation.from_quat(np.asarray(data.rotation)[:, [1, 2, 3, 0]])


def _with(data: Dataset, R: Rotation) -> Dataset:
    return replace(data, rotation=R.as_quat()[:, [3, 0, 1, 2]], rotation_angles=None)


def random_orientations(data: Dataset, random: np.random.Generator) -> Dataset:
    return _with(data, Rotation.random(len(data), rng=random))


def another_frame(data: Dataset, random: np.random.Generator) -> Dataset:
    axis = random.standard_normal(3)
    turn = Rotation.from_rotvec(np.radians(random.uniform(2, 170)) * axis / np.linalg.norm(axis))
    return _with(data, turn * _rotations(data))


def conjugated(data: Dataset, random: np.random.Generator) -> Dataset:
    return _with(data, _rotations(data).inv())


def shuffled_orientations(data: Dataset, random: np.random.Generator) -> Dataset:
    return replace(data, rotation=np.asarray(data.rotation)[random.permutation(len(data))], rotation_angles=None)


def shuffled_lengths(data: Dataset, random: np.random.Generator) -> Dataset:
    return replace(data, distance=np.asarray(data.distance)[random.permutation(len(data))])


def lengths_in_inches(data: Dataset, random: np.random.Generator) -> Dataset:
    return replace(data, distance=np.asarray(data.distance) / 25.4)


def shuffled_tilts(data: Dataset, random: np.random.Generator) -> Dataset:
    rows = random.permutation(len(data))
    return replace(data, observed={name: values[rows] for name, values in data.observed.items()})


def untouched_planes(data: Dataset, random: np.random.Generator) -> Dataset:
    """Every row says that it touches, whatever its posture."""
    return replace(data, observed_labels={"plane": [f"p{k}" for k in random.integers(0, 2, len(data))]})


SPOILT: dict[str, list[Spoil]] = {
    "orientation": [random_orientations, another_frame, conjugated, shuffled_orientations],
    "length": [shuffled_lengths, lengths_in_inches],
    "tilt": [shuffled_tilts],
    "plane": [untouched_planes],
}
