# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which poses to measure."""

from __future__ import annotations

from fastcal.design.separation import Separation, separating_poses

__all__ = ["Separation", "separating_poses"]
