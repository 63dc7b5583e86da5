# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The networks of the papers, for `fastcal train --network NAME`, and the searches that choose their sizes."""
