# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A fleet in memory: on one core, and on a Dask cluster of one worker and of two.

    python bench/python/bench_fleet.py [--arms 1000] [--rounds 3] [--json FILE]

`calibrate_many` of UR5 arms with 100 measured poses each: CPU time in this process, wall time on clusters of worker
processes with one thread, in turn, medians. Scheduler and workers are processes of their own on this machine; where it
has two cores, scheduler and client take theirs from the workers. Every way must find the same.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import socket
import statistics
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import fastcal
from fastcal.fleet import Arm, Fleet

ROWS = 100
SIGMA = 5e-5  # [m] of a measured coordinate


def arms(count: int) -> list[Arm]:
    """Arms that differ from the nominal one, measured at random poses."""
    robot = fastcal.load_robot("ur5")
    out = []
    for seed in range(count):
        poses = fastcal.Dataset.from_arrays(fastcal.random_poses(robot, ROWS, seed=seed), robot=robot)
        made = fastcal.simulate(fastcal.perturbed(robot, seed=seed), poses, noise=SIGMA, seed=seed)
        out.append(Arm(f"arm{seed}", robot, made))
    return out


@contextmanager
def cluster(workers: int) -> Iterator[str]:
    """The address of a scheduler with so many workers of one thread, all of them processes of this machine."""
    from distributed import Client

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    address = f"tcp://127.0.0.1:{port}"
    scheduler = ["dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard"]
    worker = ["dask_worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny"]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    running = []
    try:
        for command in (scheduler, *[worker] * workers):
            called = [sys.executable, "-m", f"distributed.cli.{command[0]}", *command[1:]]
            running.append(subprocess.Popen(called, env=environment, stderr=subprocess.DEVNULL))
        with Client(address, timeout="30s", set_as_default=False) as client:  # type: ignore[no-untyped-call]
            client.wait_for_workers(workers, timeout=30)
        yield address
    finally:
        for process in reversed(running):
            process.terminate()
            process.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    warnings.filterwarnings("ignore", module="distributed")
    fleet = arms(given.arms)
    fastcal.calibrate_many(fleet[:50])
    taken: dict[str, list[float]] = {"core": [], "worker": [], "workers": []}
    answers = set()

    def note(way: str, clock: Callable[[], float], run: Callable[[], Fleet]) -> None:
        start = clock()
        found = run()
        taken[way].append(clock() - start)
        answers.add(repr([arm.to_row() for arm in found]))

    for _ in range(given.rounds):
        note("core", time.process_time, partial(fastcal.calibrate_many, fleet))
        for way, count in (("worker", 1), ("workers", 2)):
            with cluster(count) as address:
                fastcal.calibrate_many(fleet[:200], cluster=address)  # workers import what they need
                note(way, time.perf_counter, partial(fastcal.calibrate_many, fleet, cluster=address))
    if len(answers) > 1:
        raise SystemExit("the ways find different arms")
    core, one, two = (statistics.median(of) for of in taken.values())
    print(f"{given.arms:,} arms of {ROWS} rows: {core:.2f} s of one core, {1e3 * core / given.arms:.2f} ms an arm")
    print(
        f"Dask: one worker {one:.2f} s, two {two:.2f} s, {one / two:.2f} times as fast; {core / two:.2f} times one core"
    )
    if given.json:
        shown = {"machine": platform.processor() or platform.machine(), "arms": given.arms, "rows": ROWS}
        given.json.write_text(json.dumps(shown | {"taken_s": taken}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
