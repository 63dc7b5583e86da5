# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measured poses, what they must satisfy, which conditions they were taken under, and what is asked of a tool."""
