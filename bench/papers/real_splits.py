# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What mlp and gp leave of real rows in splits with other seeds than those of the study `fastcal paper real`.

Rows, splits, nominal arms and networks are the study's own; DATA is its --data. 70 % of the rows are learnt, and the
median over the splits of the mean and RMS error of the others is printed, in mm, with the least and the greatest mean.

    python bench/papers/real_splits.py DATA [--first 100] [--splits 10] [--campaigns "UR5" "UR10 c"] [-o FILE]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from fastcal.calibration.calibrate import calibrate
from fastcal.networks.problem import lengths_mm
from fastcal_studies.real_data import CAMPAIGNS, split
from fastcal_studies.real_methods import behind
from fastcal_studies.simulated import left

METHODS = ("mlp", "gp")


def main() -> None:
    """Runs it, prints the medians and writes the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--splits", type=int, default=10)
    parser.add_argument("--campaigns", nargs="+", choices=[c.name for c in CAMPAIGNS], default=["UR5", "UR10 c"])
    parser.add_argument("-o", type=Path)
    given = parser.parse_args()
    out: dict[str, dict[str, list[dict[str, float]]]] = {}
    for campaign in CAMPAIGNS:
        if campaign.name not in given.campaigns:
            continue
        rows = campaign.rows(given.data)
        found: dict[str, list[dict[str, float]]] = {name: [] for name in ("geometry", *METHODS)}
        for seed in range(given.first, given.first + given.splits):
            learnt, unseen = split(rows, seed)
            model = calibrate(campaign.nominal(), learnt).model
            found["geometry"].append(lengths_mm(left(model, unseen)))
            for name, lengths in behind(model, learnt, unseen, METHODS, seed, full=False).items():
                found[name].append(lengths)
        out[campaign.name] = found
        for name, each in found.items():
            mean, rms = ([lengths[key] for lengths in each] for key in ("mean", "rms"))
            print(
                f"{campaign.name} {name}: mean {np.median(mean):.4f} ({min(mean):.4f} to {max(mean):.4f}), "
                f"RMS {np.median(rms):.4f}",
                flush=True,
            )
    if given.o is not None:
        rounded = {
            campaign: {
                name: [{key: round(value, 6) for key, value in lengths.items()} for lengths in each]
                for name, each in found.items()
            }
            for campaign, found in out.items()
        }
        given.o.write_text(json.dumps({"first": given.first, "splits": rounded}, indent=1) + "\n")


if __name__ == "__main__":
    main()
