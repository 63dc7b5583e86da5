# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cells: several arms, targets and instruments as one tree of frames, read and calibrated together."""
