# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The months after a calibration: does the model still hold, what has changed, a model brought up to date."""
