# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Data of each kind of reading, alone and mixed, of the arm in numpy that is written from the docs alone."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal.measurements.dataset import Dataset

from .bench_arm import MOUNT, disturbed, frames, on_plane, postures, robot, tilts, tool_points

FloatArray = NDArray[np.float64]

NOISE = {"position": 3e-5, "orientation": 2e-4, "length": 2e-5, "plane": 2e-5, "tilt": 2e-5}  # [m], [rad]
ALONE = [(kind,) for kind in NOISE]
PAIRS = list(combinations(NOISE, 2))
ANCHORS = np.array([[0.9, -0.3, 0.1], [-0.2, 1.0, 0.2], [0.3, 0.2, -0.4]])
PLANES = [(np.array([0.0, 0.0, 1.0]), 0.25), (np.array([0.96, 0.0, 0.28]), 0.45), (np.array([0.6, 0.64, 0.48]), 0.3)]
LEVELS = (3, 5)


def read(
    kinds: Sequence[str],
    count: int = 90,
    seed: int = 1,
    *,
    truth: FloatArray | None = None,
    base: FloatArray | None = None,
    claimed: bool = False,
    q: FloatArray | None = None,
) -> Dataset:
    """What instruments read of an arm with DH rows `truth`; with `base` (4, 4) its pose is seen from elsewhere.

    Where planes are touched, only every second row touches one if anything else is read.
    """
    rows = disturbed(seed) if truth is None else truth
    random = np.random.default_rng([seed, 7])
    q = postures(count, seed + 50) if q is None else q
    fields: dict[str, Any] = {}
    if "plane" in kinds:
        touching = np.arange(0, len(q), 1 if len(kinds) == 1 else 2)
        labels = np.full(len(q), "", dtype=object)
        q = q.copy()
        for i in touching:
            k = int(i // (1 if len(kinds) == 1 else 2)) % len(PLANES)
            normal, offset = PLANES[k]
            at = offset + NOISE["plane"] * random.standard_normal()
            q[i], labels[i] = on_plane(rows, q[i : i + 1], normal, at)[0], f"p{k}"
        fields["observed_labels"] = {"plane": labels.tolist()}
    points = tool_points(rows, q)
    T = np.eye(4) if base is None else base
    seen = points @ T[:3, :3].T + T[:3, 3]
    if "position" in kinds:
        fields["position"] = seen + NOISE["position"] * random.standard_normal(points.shape)
        if claimed:
            fields["sigma_position"] = np.full(len(q), NOISE["position"])
    if "orientation" in kinds:
        R = Rotation.from_matrix(np.array([T[:3, :3] @ frames(rows, row)[-1][0] for row in q]))
        R = R * Rotation.from_rotvec(NOISE["orientation"] * random.standard_normal(points.shape))
        fields["rotation"] = R.as_quat()[:, [3, 0, 1, 2]]
        if claimed:
            fields["sigma_rotation"] = np.full(len(q), NOISE["orientation"])
    if "length" in kinds:
        which = random.integers(0, len(ANCHORS), len(q))
        lengths = np.linalg.norm(points - ANCHORS[which], axis=1)
        fields["distance"] = lengths + NOISE["length"] * random.standard_normal(len(q))
        fields["anchor"] = [f"a{k}" for k in which]
    if "tilt" in kinds:
        fields["observed"] = {
            f"tilt@link{link}": tilts(rows, q, link, MOUNT) + NOISE["tilt"] * random.standard_normal((len(q), 2))
            for link in LEVELS
        }
        if claimed:
            fields["observed"]["sigma_tilt"] = np.full(len(q), NOISE["tilt"])
    return Dataset.from_arrays(q, robot=robot(), source="+".join(kinds), **fields)
