# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A robot: what its file says, the model that is built from it, and its controller's own kinematics."""
