# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From target poses to joint positions on the model with all its effects, for six joints and more."""
