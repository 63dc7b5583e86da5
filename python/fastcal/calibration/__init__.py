# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From a robot and measured poses to the identified model, its uncertainty, and what it predicts for other poses."""
