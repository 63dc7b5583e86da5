# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From a robot and measured poses to the identified model, how sure it is, and what it says of other poses."""
