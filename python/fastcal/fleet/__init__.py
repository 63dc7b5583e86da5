# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Many arms at once: each calibrated on its own, side by side or on a cluster, and one table of all at the end."""

from fastcal.fleet.arms import Arm, read_list
from fastcal.fleet.result import ArmResult, Fleet
from fastcal.fleet.side_by_side import calibrate_many, diagnose_many

__all__ = ["Arm", "ArmResult", "Fleet", "calibrate_many", "diagnose_many", "read_list"]
