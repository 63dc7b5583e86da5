# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects as a robot file or the command line states them, their values as people read them, effects from Python."""
