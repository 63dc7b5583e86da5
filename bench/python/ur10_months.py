# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A real arm, months later: the UR10's campaign b gives the model, twenty rows of c check it and bring it up to date.

Both campaigns are of ../shared/data/ur10_tmac (docs/public-data.md). Judged on the other rows of c, base and tool laid
on, beside a model that was calibrated from all of c.

    python bench/python/ur10_months.py [--draws 10] [--out FILE]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

import fastcal
from fastcal.calibration.realign import realign
from fastcal.io.atomic import write_text
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "ur10_tmac"
ROWS = 20
GROSS = 5e-3  # [m] a few points of c are gross


def rms_mm(model: Robot, rows: Dataset) -> float:
    """RMS distance on rows, gross points counted as 5 mm, base and tool laid on."""
    laid = realign(model, rows)
    off = np.linalg.norm(laid.poses(rows)[:, :3, 3] - rows.position, axis=1)
    return float(1e3 * np.sqrt(np.mean(np.minimum(off, GROSS) ** 2)))


def drawn(model: Robot, c: Dataset, seed: int) -> dict[str, Any]:
    """One draw of twenty rows."""
    chosen = np.random.default_rng(seed).choice(len(c), ROWS, replace=False)
    few, rest = c.select(np.sort(chosen)), c.select(np.setdiff1d(np.arange(len(c)), chosen)[::5])
    checked = fastcal.check(model, few)
    updated = fastcal.update(model, few)
    return {
        "verdict": checked.verdict,
        "causes": [cause.label for cause in checked.causes],
        "rms_mm": checked.rms_mm,
        "expected_rms_mm": checked.expected_rms_mm,
        "p_value": checked.p_value,
        "left_out": len(updated.left_out),
        "rest_old_mm": rms_mm(model, rest),
        "rest_updated_mm": rms_mm(updated.model, rest),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    robot = fastcal.load_robot(DATA / "robot.yaml")
    b, c = (fastcal.load_measurements(DATA / f"campaign_{name}.csv", robot) for name in "bc")
    of_b, of_c = (fastcal.calibrate(robot, data).model for data in (b, c))
    compared = fastcal.compare(of_b, of_c)
    found = {
        "rows": {"b": len(b), "c": len(c), "check": ROWS},
        "draws": [drawn(of_b, c, seed) for seed in range(options.draws)],
        "rest_calibrated_on_c_mm": rms_mm(of_c, c.select(slice(None, None, 5))),
        "noise_mm": {"b": of_b.record.sigma_mm, "c": of_c.record.sigma_mm},
        "at_tool_mm": compared.to_json_dict()["at_tool_mm"],
        "significant": [f"{d.owner} {d.name}: {d.difference:+.4g} +- {d.std:.2g}" for d in compared.significant],
    }
    text = json.dumps(found, indent=1) + "\n"
    if options.out:
        write_text(options.out, text)
    print(text)


if __name__ == "__main__":
    main()
