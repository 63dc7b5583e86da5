# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The screens, one a file; each is called with the studio and builds itself into the page."""
