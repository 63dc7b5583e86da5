# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The command `fastcal`."""

from fastcal.cli.app import main

__all__ = ["main"]
