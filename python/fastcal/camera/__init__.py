# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures of boards: corners found in them (with OpenCV, an extra), and pictures drawn of a simulated cell."""
