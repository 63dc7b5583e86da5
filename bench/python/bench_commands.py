# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a command costs from start to end: CPU time (user and system) and the most memory, of one thread.

A simulated UR5: 700 measured rows, 100 poses to predict and 100 targets, 100 arms of 100 rows; 300 rows of a loaded
KR 500 with lost motion in joint 4; with --many a quoted CSV of 300,000 rows too. Each command is a process of its own;
the commands take turns, and a Python that only imports numpy takes turns with them, since a busy machine makes them all
dearer. The first round compiles Python's files, as an installation does, and is not counted.

usage: python bench/python/bench_commands.py [--rounds N] [--many] [--json FILE]
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from multiprocessing import get_context
from pathlib import Path

FASTCAL = (sys.executable, "-m", "fastcal")
COMMANDS = {
    "Python with numpy": (sys.executable, "-c", "import numpy"),
    "--help": (*FASTCAL, "--help"),
    "calibrate, 700 rows": (*FASTCAL, "calibrate", "ur5", "data.csv", "-o", "out"),
    "predict, 100 rows": (*FASTCAL, "predict", "model.yaml", "few.csv", "-o", "predicted.csv"),
    "compensate, 100 targets": (*FASTCAL, "compensate", "model.yaml", "targets.csv", "-o", "commands.csv"),
    "diagnose, 300 rows": (*FASTCAL, "diagnose", "kr500.yaml", "kr500.csv", "-o", "diagnosis"),
    "fleet, 100 arms of 100 rows": (*FASTCAL, "fleet", "fleet.csv", "-o", "arms"),
}
MANY = {"calibrate, 300,000 rows": (*FASTCAL, "calibrate", "ur5", "many.csv", "-o", "out_many")}


def write_files(folder: Path, *, many: bool) -> None:
    """The robot's measurements, a model of it, poses and targets; in a process of its own.

    What a process had in memory when it made another counts as the other's.
    """
    import numpy as np

    import fastcal
    from fastcal.robot.se3 import rotation_to_rpy
    from fastcal.units import from_si

    robot = fastcal.load_robot("ur5")
    arm = fastcal.perturbed(robot, seed=1)
    data = fastcal.simulate(arm, fastcal.random_poses(robot, 700, seed=2), noise=5e-5, seed=3)
    fastcal.write_measurements(folder / "data.csv", data)
    fastcal.write_measurements(folder / "few.csv", data.select(slice(100)))
    fastcal.calibrate(robot, data).model.save(folder / "model.yaml")
    with (folder / "targets.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"])
        for T in robot.forward(np.linspace(0.3, 0.6, 100)[:, np.newaxis] * data.q[0]):  # along a path
            point = [from_si(value, "mm") for value in T[:3, 3]]
            turn = [from_si(value, "deg") for value in rotation_to_rpy(T[:3, :3])]
            writer.writerow([*point, *turn])
    write_lost_motion(folder)
    with (folder / "fleet.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["robot", "data"])
        for k in range(100):
            rows = fastcal.simulate(
                fastcal.perturbed(robot, seed=k), fastcal.random_poses(robot, 100, seed=100 + k), noise=5e-5, seed=k
            )
            fastcal.write_measurements(folder / f"arm{k}.csv", rows)
            writer.writerow(["ur5", f"arm{k}.csv"])
    if many:
        rows = fastcal.simulate(arm, fastcal.random_poses(robot, 300_000, seed=4), noise=5e-5, seed=5)
        fastcal.write_measurements(folder / "plain.csv", rows)
        with (folder / "plain.csv").open(encoding="utf-8") as plain, (folder / "many.csv").open("w") as quoted:
            quoted.writelines(",".join(f'"{cell}"' for cell in line.rstrip("\n").split(",")) + "\n" for line in plain)


def write_lost_motion(folder: Path) -> None:
    """The set of bench_diagnosis_speed.py."""
    import numpy as np
    from diagnosis_arms import setting
    from diagnosis_sets import drawable, measured, scaled

    import fastcal

    random = np.random.default_rng(5)
    at = setting(random, "kuka_kr500_3", 300)
    truth = scaled(at, next(n for n in drawable(at) if n.key == ("backlash", "joint4")), 25.0, random)
    assert truth is not None
    at.nominal.save(folder / "kr500.yaml")
    fastcal.write_measurements(folder / "kr500.csv", measured(at, [truth], random))


def cost(command: tuple[str, ...], folder: Path) -> tuple[float, float]:
    """CPU seconds and most memory [MB] of a process."""
    compiled = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    compiled["PYTHONPYCACHEPREFIX"] = str(folder / "compiled")
    nowhere = subprocess.DEVNULL
    with subprocess.Popen(command, cwd=folder, env=compiled, stdout=nowhere, stderr=nowhere) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--many", action="store_true")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    commands = COMMANDS | (MANY if given.many else {})
    seen: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    with tempfile.TemporaryDirectory() as place:
        files = get_context("spawn").Process(target=write_files, args=(Path(place),), kwargs={"many": given.many})
        files.start()
        files.join()
        for _ in range(given.rounds + 1):
            for name, command in commands.items():
                shutil.rmtree(Path(place) / "arms", ignore_errors=True)  # what is there is not calibrated again
                seen[name].append(cost(command, Path(place)))
    found = {}
    print("| command | CPU, median | least | most memory |\n|---|---|---|---|")
    for name, values in seen.items():
        seconds, memory = zip(*values[1:], strict=True)
        found[name] = {"cpu_s": statistics.median(seconds), "least_s": min(seconds), "memory_mb": max(memory)}
        print(f"| {name} | {found[name]['cpu_s']:.2f} s | {min(seconds):.2f} s | {max(memory):.0f} MB |")
    if given.json is not None:
        given.json.write_text(json.dumps({"load": os.getloadavg()[0], "commands": found}, indent=2) + "\n")


if __name__ == "__main__":
    main()
