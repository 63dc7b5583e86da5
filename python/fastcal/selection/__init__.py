# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which parameters to identify: the set that predicts best what was not fitted."""
