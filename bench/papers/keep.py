# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Keeps a study's paper.json here, without its runs: python bench/papers/keep.py OUT"""

import sys
from pathlib import Path

from fastcal.io.results import read_json, write_json

content = read_json(Path(sys.argv[1]) / "paper.json")
content.pop("runs")
write_json(Path(__file__).parent / f"{content['paper']['name']}.json", content)
