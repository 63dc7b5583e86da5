# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How robots, data and results show, plot and save themselves, without importing what does it."""
