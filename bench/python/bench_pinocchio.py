# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Kinematics of many rows by fastcal's public calls against pinocchio's C++, one thread, CPU time.

Pinocchio's program (bench/cpp/peers/pinocchio_rows.cpp) is compiled here with -O3 -march=native against the headers
that `pip install pin` brings, without its checks. Both get the same rows and in turn; the tool's points must agree. The
regressor of all joint placements is what pinocchio offers for calibration, 6 x 6 n numbers a row, into one matrix that
all rows share; fastcal's Jacobian is that of its own parameters, every row's, into an array that is given to it.

    python bench/python/bench_pinocchio.py [--arm ur5] [--rows 100000] [--rounds 9] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio

import fastcal
from fastcal.io.urdf_file import urdf_text

SOURCE = Path(__file__).resolve().parents[1] / "cpp" / "peers" / "pinocchio_rows.cpp"
CALLS = 5
DEFINED = ("BOOST_MPL_LIMIT_LIST_SIZE=30", "BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS", "NDEBUG")


def compiled(folder: Path) -> Path:
    """Pinocchio's program."""
    prefix = Path(pinocchio.__file__).parents[4]
    program = folder / "pinocchio_rows"
    flags = ["-std=c++17", "-w", "-O3", "-march=native", *(f"-D{name}" for name in DEFINED)]
    places = ["-isystem", str(prefix / "include"), "-isystem", "/usr/include/eigen3"]
    libraries = [f"-L{prefix / 'lib'}", f"-Wl,-rpath,{prefix / 'lib'}", "-lboost_serialization"]
    subprocess.run(["g++", *flags, *places, str(SOURCE), "-o", str(program), *libraries], check=True)
    return program


def write_chain(robot: fastcal.Robot, path: Path) -> None:
    """Where each joint is on the one before it, and the tool on the last: for the program, column by column."""
    model = pinocchio.buildModelFromXML(urdf_text(fastcal.convert(robot, "urdf").spec))
    if {model.joints[k].shortname() for k in range(1, model.njoints)} != {"JointModelRZ"}:
        raise SystemExit("the arm has joints that do not turn about their z")
    places = [model.jointPlacements[k].homogeneous for k in range(1, model.njoints)]
    tool = model.frames[model.nframes - 1].placement.homogeneous
    np.array([place.T for place in (*places, tool)]).tofile(path)


def cpu_of(call: Callable[[], object]) -> float:
    """CPU seconds of a call, the mean of five in a row: the first meets what the peers left in the caches."""
    start = time.process_time()
    for _ in range(CALLS):
        call()
    return (time.process_time() - start) / CALLS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arm", default="ur5")
    parser.add_argument("--rows", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    robot = fastcal.load_robot(given.arm)
    yields = {"effect": "joint_compliance", "parameters": {"compliance_rad_nm": 1e-6}}
    joints = [f"joint{k + 1}" for k in range(robot.joint_count)]
    loaded = fastcal.Robot({**robot.spec, "effects": [{**yields, "owner": joint} for joint in joints]})
    q = fastcal.random_poses(robot, given.rows, seed=1)
    poses = np.zeros((given.rows, 4, 4))
    of_point, of_pose = (np.zeros((given.rows, rows, len(robot.parameter_names))) for rows in (3, 6))
    seen: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        program = compiled(folder)
        write_chain(robot, folder / "chain.bin")
        q.tofile(folder / "q.bin")
        for round_ in range(given.rounds + 1):
            files = [str(folder / name) for name in ("chain.bin", "q.bin", "points.bin")]
            said = subprocess.run([program, *files], check=True, capture_output=True, text=True).stdout.split()
            found = dict(zip(("pinocchio, forward", "pinocchio, regressor"), map(float, said), strict=True))
            found["fastcal, forward"] = cpu_of(lambda: robot.forward(q, out=poses))
            found["fastcal, Jacobian of the pose"] = cpu_of(lambda: robot.parameter_jacobian(q, rows=6, out=of_pose))
            found["fastcal, Jacobian of the point"] = cpu_of(lambda: robot.parameter_jacobian(q, out=of_point))
            found["fastcal, forward with compliances"] = cpu_of(lambda: loaded.forward(q, out=poses))
            for name, seconds in found.items() if round_ else ():
                seen.setdefault(name, []).append(seconds)
        points = np.fromfile(folder / "points.bin").reshape(-1, 3)
    apart = float(np.max(np.abs(points - robot.forward(q)[:, :3, 3])))
    if apart > 1e-9:
        raise SystemExit(f"the tool's points are {apart:.3g} m apart")
    medians = {name: statistics.median(values) for name, values in seen.items()}
    print(f"| {given.rows:,} rows of the {given.arm} | CPU, ms |\n|---|---|")
    for name, seconds in medians.items():
        print(f"| {name} | {1e3 * seconds:.1f} |")
    forward = medians["pinocchio, forward"] / medians["fastcal, forward"]
    of_points, of_poses = (
        medians["pinocchio, regressor"] / medians[f"fastcal, Jacobian of the {what}"] for what in ("point", "pose")
    )
    share = medians["fastcal, forward"] / medians["fastcal, forward with compliances"]
    print(f"\nforward {forward:.1f} times, Jacobian of points {of_points:.1f}, of poses {of_poses:.1f} times pinocchio")
    print(f"with compliances {share:.3f} of the rows of forward")
    if given.json is not None:
        given.json.write_text(json.dumps(medians, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
