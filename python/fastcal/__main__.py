# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`python -m fastcal`: the same as the command `fastcal`."""

import sys

from fastcal.cli import main

sys.exit(main())
