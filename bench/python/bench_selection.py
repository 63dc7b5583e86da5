# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""All 2^15 sets of parameters in ten folds, 90 points of a 6R arm, beside two ways of numpy in the same run.

    python bench/python/bench_selection.py [--json FILE] [--repeats N]

Nine joint parameters, base and tool are in every set, fifteen more may be left out, as in the RX160L study. Peers:
lstsq of the rows for every set and fold, what a script would do, and numpy on normal matrices that sets and folds
share, all sets of one size solved in one call. The peers take a sample of the sets, which they must agree on to 1e-8.
CPU time of one thread, best of the repeats.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fastcal import _core, load_robot, random_poses
from fastcal_studies.staubli_rx160l import ALWAYS, OPTIONAL

Array = NDArray[np.float64]
POSES, FOLDS, OPTIONAL = 90, 10, len(OPTIONAL)
GOAL_SECONDS = 60.0  # for all sets, the project's own


def problem() -> tuple[Array, Array, Array, NDArray[np.int32]]:
    """Kept (270, 18) and optional (270, 15) columns of an arm's Jacobian, r, and the fold of each row."""
    robot = load_robot("staubli_rx160l")
    random = np.random.default_rng(0)
    names = robot.parameter_names
    J = (
        robot.parameter_jacobian(random_poses(robot, POSES)).reshape(3 * POSES, -1) * 1e-3 / 1e-4
    )  # plausible size / noise
    kept = [*names[:6], *ALWAYS, "tool x", "tool y", "tool z"]
    r = J @ random.standard_normal(len(names)) + random.standard_normal(len(J))
    fold = (np.repeat(random.permutation(POSES), 3) % FOLDS).astype(np.int32)
    return J[:, [names.index(n) for n in kept]], J[:, [names.index(n) for n in OPTIONAL]], r, fold


def by_lstsq(kept: Array, optional: Array, r: Array, fold: NDArray[np.int32], sets: NDArray[np.bool_]) -> Array:
    errors = np.zeros(len(sets))
    for s, members in enumerate(sets):
        J = np.column_stack([kept, optional[:, members]])
        for k in range(FOLDS):
            b = np.linalg.lstsq(J[fold != k], r[fold != k], rcond=1e-10)[0]
            errors[s] += np.mean((r[fold == k] - J[fold == k] @ b) ** 2) / FOLDS
    return errors


def by_normal_matrices(
    kept: Array, optional: Array, r: Array, fold: NDArray[np.int32], sets: NDArray[np.bool_]
) -> Array:
    """pinv, as sets hold copies of base and tool; H and M are the Gram matrices of rows held out and fitted."""
    A = np.column_stack([kept, optional, r])
    errors = np.zeros(len(sets))
    always = np.arange(kept.shape[1])
    for size in np.unique(sets.sum(axis=1)):
        which = np.flatnonzero(sets.sum(axis=1) == size)
        free = np.nonzero(sets[which])[1].reshape(len(which), size) + len(always)
        columns = np.column_stack([np.broadcast_to(always, (len(which), len(always))), free])
        for k in range(FOLDS):
            M, H = A[fold != k].T @ A[fold != k], A[fold == k].T @ A[fold == k]
            fitted = np.linalg.pinv(M[columns[:, :, None], columns[:, None, :]], rcond=1e-13, hermitian=True)
            b = np.einsum("sij,sj->si", fitted, M[columns, -1])
            outer = H[columns[:, :, None], columns[:, None, :]]
            held_out = H[-1, -1] - 2 * np.sum(b * H[columns, -1], axis=1) + np.einsum("si,sij,sj->s", b, outer, b)
            errors[which] += held_out / np.count_nonzero(fold == k) / FOLDS
    return errors


def seconds(run: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """CPU time, best of the repeats, and the answer."""
    best, answer = np.inf, None
    for _ in range(repeats):
        start = time.process_time()
        answer = run()
        best = min(best, time.process_time() - start)
    return best, answer


def measure(repeats: int) -> dict[str, Any]:
    given = problem()
    count = 2**OPTIONAL
    all_seconds, mean = seconds(lambda: np.asarray(_core.SubsetSearch(*given).all().mean), repeats)
    some = np.random.default_rng(1).choice(count, 1000, replace=False)
    sets = (some[:, None] >> np.arange(OPTIONAL)) & 1 == 1
    result: dict[str, Any] = {"seconds": {"fastcal, all sets": all_seconds}, "apart": {}}
    for name, peer, sample in (("lstsq", by_lstsq, 100), ("normal matrices", by_normal_matrices, 1000)):
        taken, errors = seconds(lambda peer=peer, sample=sample: peer(*given, sets[:sample]), min(repeats, 3))
        result["seconds"][f"{name}, all sets from {sample}"] = taken * count / sample
        result["apart"][name] = float(np.max(np.abs(errors / mean[some[:sample]] - 1)))
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    with threadpool_limits(1):
        result = measure(options.repeats)
    print(f"2^{OPTIONAL} sets, {FOLDS} folds, {POSES} points")
    for name, taken in result["seconds"].items():
        print(f"{name:38} {taken:10.3f} s")
    reached = result["seconds"]["fastcal, all sets"]
    print(f"goal {GOAL_SECONDS:.0f} s   {'met' if reached <= GOAL_SECONDS else 'MISSED'}")
    print("errors apart, relative:", ", ".join(f"{name} {value:.1e}" for name, value in result["apart"].items()))
    if options.json:
        text = json.dumps({"machine": platform.processor() or platform.machine(), **result}, indent=1) + "\n"
        options.json.write_text(text, encoding="utf-8")
    if max(result["apart"].values()) > 1e-8:
        raise SystemExit("the ways do not agree to 1e-8")


if __name__ == "__main__":
    main()
