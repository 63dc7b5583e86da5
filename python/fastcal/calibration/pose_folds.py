# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Assignment of poses to cross-validation folds, and the distance between successive poses.

Along a path of neighbouring poses correlated noise is similar in similar poses: a model that overfits it predicts held-
out neighbours too well. There, stretches of the path are held out. Rows of one posture under several payloads share its
model error, so that whole postures are held out if there are enough of them.
"""

from __future__ import annotations

import numpy as np

from fastcal.arrays import IndexArray
from fastcal.calibration.repeatability import pose_groups, posture_groups
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.splits import deal

# Successive poses nearer than this share of what poses half the set apart are lie along a path, along which noise lasts
# from one part of the joints' ranges to the next; rows of a stretch, more than noise with a memory lasts.
PATH_STEPS, PATH_STRETCH = 0.2, 20
# Postures from which on they are held out whole: of fewer, those that are left do not fix an arm.
MIN_POSTURES = 30


def measuring_place(data: Dataset) -> IndexArray:
    """(N,) place of each row in the order of measuring: by its time, or as the file has it."""
    if data.time is None:
        return np.arange(len(data))
    place = np.empty(len(data), dtype=np.intp)
    place[np.argsort(data.time, kind="stable")] = np.arange(len(data))
    return place


def along_a_path(data: Dataset, near: float = PATH_STEPS) -> bool:
    """Are successive poses nearer than `near` of what poses half the set apart are, in shares of joint ranges?

    What a model lacks is then alike in successive rows as well, and can't be told from noise that is slow.
    """
    q = data.q[np.argsort(measuring_place(data), kind="stable")]
    span = np.ptp(q, axis=0)
    q = q[:, span > 0] / span[span > 0]
    if len(q) < 2 or q.shape[1] == 0:
        return False
    step = np.median(np.abs(np.diff(q, axis=0)).mean(axis=1))
    apart = np.median(np.abs(q - np.roll(q, len(q) // 2, axis=0)).mean(axis=1))
    return bool(step < near * apart)


def pose_folds(data: Dataset, folds: int, random: np.random.Generator) -> IndexArray:
    """(N,) fold 0 ... folds - 1 of each row: postures are dealt out at random, all visits of one to one fold.

    Along a path its stretches are dealt out, each posture in that of its first visit. Of fewer than MIN_POSTURES poses
    are, which differ by their payload too.
    """
    part = posture_groups(data)
    if part.max() + 1 < MIN_POSTURES:
        part = pose_groups(data)
    place = measuring_place(data)
    first = np.full(int(part.max()) + 1, len(data))
    np.minimum.at(first, part, place)
    if along_a_path(data.select(np.sort(np.argsort(place)[first]))):
        length = max(1, min(PATH_STRETCH, len(first) // folds))
        part = (np.argsort(np.argsort(first)) // length)[part]
    return np.asarray(deal(int(part.max()) + 1, folds, random)[part], dtype=np.intp)


__all__ = ["along_a_path", "measuring_place", "pose_folds"]
