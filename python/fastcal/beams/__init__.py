# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Frames of beams under their own weight and loads, posture by posture, and the stiffness of their elements."""
