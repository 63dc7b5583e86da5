# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What remains without a name: placed, described by a smooth shrunk function, and added to the model if that holds."""

from fastcal.surrogate.adding import AddedSurrogate, add_surrogate
from fastcal.surrogate.formulas import Formula, formulas
from fastcal.surrogate.thresholds import Thresholds

__all__ = ["AddedSurrogate", "Formula", "Thresholds", "add_surrogate", "formulas"]
