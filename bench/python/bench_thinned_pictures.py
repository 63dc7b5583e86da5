# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Real pictures, thinned: is `calibrate` from few of them no worse than the plain hand-eye on the others?

The pictures of FOLDER (cell.yaml, poses.csv, corners.csv and test_* files, of one arm) are judged and mended as a whole
and put together. A draw fits COUNT postures and predicts all others: with `calibrate` as it comes (the arm, cameras and
boards), and by the plain hand-eye, the places of cameras and boards alone with the arm as its file says. Printed is the
RMS of the corners left out [px], of each camera alone and of all together.

    python bench/python/bench_thinned_pictures.py FOLDER --out FILE [--counts 15 20 30] [--first 1] [--draws 6]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fastcal import calibrate
from fastcal.calibration.pictures import judged_pictures
from fastcal.calibration.unknowns import CORNERS
from fastcal.importers.corners import load_seen
from fastcal.io.atomic import write_text
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import pictures
from fastcal.robot.robot import Robot


def mended(folder: Path, robot: Robot) -> Dataset:
    """All pictures of the folder, in the rows and in the order of corners that they fit."""
    parts = [load_seen([str(folder / f"{of}poses.csv")], robot, folder / f"{of}corners.csv") for of in ("", "test_")]
    corners = np.vstack([part.observed[CORNERS] for part in parts])
    whole = replace(Dataset.from_arrays(np.vstack([part.q for part in parts])), observed={CORNERS: corners})
    return judged_pictures(robot, whole, mend=True).data


def of_cameras(robot: Robot, data: Dataset, cameras: list[str]) -> Dataset:
    """What some cameras saw, in the rows in which they saw all or part of a board."""
    uv = data.observed[CORNERS].reshape(len(data), -1, 2).copy()
    for (camera, _), part in pictures(robot.description).items():
        if camera not in cameras:
            uv[:, part] = np.nan
    seen = np.flatnonzero(np.isfinite(uv).any(axis=(1, 2)))
    return replace(data, observed={CORNERS: uv.reshape(len(data), -1)}).select(seen)


def left_out(robot: Robot, data: Dataset, rows: np.ndarray, **options: Any) -> float:
    """RMS [px] of the corners of all other rows, with a fit of these."""
    others = np.setdiff1d(np.arange(len(data)), rows)
    found = calibrate(robot, data.select(np.sort(rows)), test=data.select(others), **options)
    assert found.test is not None
    rms = found.test.kinds["corner"].rms
    assert rms is not None
    return float(rms)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--counts", type=int, nargs="+", default=[15, 20, 30])
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--draws", type=int, default=6)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    robot = load_robot(given.folder / "cell.yaml")
    data = mended(given.folder, robot)
    names = list(robot.description.cameras)
    rows: list[dict[str, Any]] = []
    for cameras in [*([name] for name in names), *([names] if len(names) > 1 else [])]:
        own = of_cameras(robot, data, cameras)
        for count in given.counts:
            for seed in range(given.first, given.first + given.draws):
                fit = np.random.default_rng([seed, count]).permutation(len(own))[:count]
                row = {"cameras": " ".join(cameras), "count": count, "others": len(own) - count, "seed": seed}
                row["calibrate"] = left_out(robot, own, fit)
                row["hand_eye"] = left_out(robot, own, fit, parameters=[])
                rows.append(row)
                print(json.dumps(row), flush=True)
    for key in dict.fromkeys((of["cameras"], of["count"]) for of in rows):
        pairs = np.array([(of["calibrate"], of["hand_eye"]) for of in rows if (of["cameras"], of["count"]) == key])
        worse = int(np.sum(pairs[:, 0] > pairs[:, 1]))
        print(*key, "median px", *np.median(pairs, axis=0).round(3), f"worse in {worse} of {len(pairs)}")
    if given.out is not None:
        write_text(given.out, json.dumps({"set": given.folder.name, "draws": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
