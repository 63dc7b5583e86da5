# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What to measure after a check that leaves something open."""

from __future__ import annotations

from fastcal.measurements.dataset import Dataset
from fastcal.monitoring import next_poses
from fastcal.monitoring.linear import record_of
from fastcal.monitoring.result import Cause, NextPose
from fastcal.monitoring.setting import Setting


def what_next(
    setting: Setting,
    data: Dataset,
    verdict: str,
    causes: list[Cause],
    rivals: list[list[int]],
    sigma: float,
    enough: bool,
) -> list[NextPose]:
    """Poses that tell rivals apart, those that fit ill alone again, or more of them where they are too few."""
    record = record_of(setting.arm)
    if verdict == "changed":
        for group in rivals:
            pairs = [
                (setting.possible[i], setting.evidence.tests[i].value)
                for i in group
                if i < len(setting.possible) and setting.possible[i].directions is not None
            ][:4]
            if len(pairs) > 1:
                return next_poses.separating(setting.extended_arm, record, setting.rows, data, pairs, sigma)
        return []
    if verdict == "cannot_tell" and causes:
        wrong = [setting.possible[group[0]].row for group in rivals if group[0] < len(setting.possible)]
        return next_poses.repeated(setting.arm, data, [row for row in wrong if row is not None])
    if verdict == "cannot_tell" and not enough:
        watched = [h for h in setting.possible if h.kind in ("zero", "tool", "effect")]
        poses = next_poses.informative(
            setting.extended_arm, record, data, watched, setting.rows.R, sigma, next_poses.MOST
        )
        return next_poses.as_poses(setting.arm, poses)
    return []
