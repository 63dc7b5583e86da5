# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What remains without a name: placed, described by a smooth shrunk function, and added to the model if that holds."""

from fastcal.surrogate.adding import AddedSurrogate, add_surrogate, surrogate_deviation
from fastcal.surrogate.formulas import Formula, formulas

__all__ = ["AddedSurrogate", "Formula", "add_surrogate", "formulas", "surrogate_deviation"]
