# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Universal Robots: RTDE records, joints actual_q_0 ... in rad; actual_TCP_pose is what the controller computes."""

from fastcal.importers.dialect import Dialect, signed

DIALECT = Dialect(
    "Universal Robots RTDE",
    signed(r"\b(actual|target)_(q|TCP_pose)_?\d|\bRTDE\b"),
    units={"length": ("m", 1.0), "angle": ("rad", 1.0)},
    controller=True,
)
