# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What `diagnose` finds in the studies' arms, as `fastcal paper NAME --diagnose` shows it, without the studies.

    python bench/papers/diagnosed.py --arms 10

Arm by arm into diagnosed.json beside this file, each with the commit of its code; arms that are there already are not
diagnosed again.
"""

import argparse
import json
from pathlib import Path

from keep import head, rounded

from fastcal.io.results import read_json
from fastcal_studies import NAMES
from fastcal_studies.diagnoses import diagnosed_arm

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--arms", type=int, default=10, help="of each study, seeds 0, 1, ...")
parser.add_argument("--out", type=Path, default=Path(__file__).parent / "diagnosed.json")
asked = parser.parse_args()

known = read_json(asked.out)["arms"] if asked.out.exists() else {}
for seed in range(asked.arms):
    for name in NAMES:
        runs = known.setdefault(name, [])
        if seed < len(runs):
            continue
        runs.append({"commit": head()} | rounded(diagnosed_arm(name, seed)))
        print(f"{name} {seed}: {runs[-1]['after_mm']} mm, plain {runs[-1]['plain_mm']} mm", flush=True)
        text = json.dumps({"arms": known}, ensure_ascii=False, separators=(",", ":"))
        asked.out.write_text(text.replace('{"commit"', '\n{"commit"') + "\n", encoding="utf-8")
