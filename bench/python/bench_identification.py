# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Identification of 33 parameters (27 geometric, 6 joint gains) from 50, 1,000 and 100,000 points, beside two peers.

    python bench/python/bench_identification.py [--json FILE] [--repeats N]

Peers: SciPy's least_squares (lm) with an analytic numpy Jacobian, and Gauss-Newton on normal equations summed over
chunks of 1,000 rows in numpy, the strongest way that numpy has. All start at the nominal arm, fit the same rows to the
same 33 parameters without a robust loss, in one run, and must end at the same values; fastcal's time includes rank,
gauge, noise and covariance, which the peers do not compute. CPU time of one thread, best of the repeats.
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
from numpy_arm import position_and_jacobian
from scipy.optimize import least_squares

import fastcal
from fastcal import _core
from fastcal.robot.core_model import ROW_KEYS, pose
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
CHUNK = 1000
NOISE = 5e-5


class Arm:
    """The shipped UR10 as numpy sees it, with the 33 parameters that positions fix."""

    def __init__(self) -> None:
        spec = fastcal.load_robot("ur10").spec
        effects = [{"effect": "reduction_ratio", "owner": f"joint{i + 1}"} for i in range(6)]
        self.robot = fastcal.Robot({**spec, "effects": effects})
        self.rows = np.array(
            [[to_si(float(j.get(k, 0.0)), k.rsplit("_", 1)[1]) for k in ROW_KEYS.values()] for j in spec["joints"]]
        )
        self.tool = pose(spec["tool"])[:3, 3] + [0.03, 0.02, 0.0]
        self.free = self._independent()

    def _independent(self) -> list[int]:
        """33 independent columns of 45, by pivoted QR on random postures: as an engineer would find them."""
        from scipy.linalg import qr

        q = np.random.default_rng(1).uniform(-2, 2, (400, 6))
        _, J = self.model(q, np.zeros(45))
        J = J.reshape(-1, 45)
        _, _, order = qr(J / np.maximum(np.linalg.norm(J, axis=0), 1e-12), mode="economic", pivoting=True)
        return sorted(int(i) for i in order[:33])

    def model(self, q: FloatArray, delta: FloatArray) -> tuple[FloatArray, FloatArray]:
        return position_and_jacobian(
            q, delta[:6], self.rows + delta[6:36].reshape(6, 5), self.tool + delta[36:39], delta[39:]
        )

    def core_indices(self) -> list[int]:
        """The same parameters in the core's order: base 6, rows 30, tool 6, gains 6."""
        return [i if i < 39 else i + 3 for i in self.free]


def make_data(arm: Arm, count: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(count)
    q = rng.uniform(-2.5, 2.5, (count, 6))
    truth = np.zeros(45)
    truth[arm.free] = rng.normal(0, 3e-4, 33)
    p, _ = arm.model(q, truth)
    return q, p + rng.normal(0, NOISE, p.shape)


def by_scipy(arm: Arm, q: FloatArray, p: FloatArray) -> FloatArray:
    last: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def at(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = x.tobytes()
        if key not in last:
            last.clear()
            delta = np.zeros(45)
            delta[arm.free] = x
            got, J = arm.model(q, delta)
            last[key] = (got - p).ravel(), J.reshape(-1, 45)[:, arm.free]
        return last[key]

    return least_squares(
        lambda x: at(x)[0], np.zeros(33), jac=lambda x: at(x)[1], method="lm", xtol=1e-12, ftol=1e-12
    ).x


def by_numpy(arm: Arm, q: FloatArray, p: FloatArray) -> FloatArray:
    x = np.zeros(33)
    for _ in range(20):
        delta = np.zeros(45)
        delta[arm.free] = x
        A, g = np.zeros((33, 33)), np.zeros(33)
        for begin in range(0, len(q), CHUNK):
            got, J = arm.model(q[begin : begin + CHUNK], delta)
            J = J.reshape(-1, 45)[:, arm.free]
            A += J.T @ J
            g += J.T @ (got - p[begin : begin + CHUNK]).ravel()
        step = -np.linalg.solve(A, g)
        x = x + step
        if np.abs(step).max() < 1e-10:
            break
    return x


def problem(arm: Arm, q: FloatArray, p: FloatArray) -> tuple[_core.ErrorModel, _core.Samples, _core.Measurements]:
    """The arm with its tool, postures (N, 6) [rad] and points (N, 3) [m] as the core takes them."""
    T_tool = np.eye(4)
    T_tool[:3, 3] = arm.tool
    model = arm.robot.error_model.with_robot(arm.robot.core.with_base_and_tool(np.eye(4), T_tool))
    return model, _core.Samples(q), _core.Measurements(model.robot, len(q), {"position": p})


def by_fastcal(arm: Arm, q: FloatArray, p: FloatArray) -> FloatArray:
    model, samples, measured = problem(arm, q, p)
    found = _core.identify(model, samples, measured, asked=arm.core_indices(), loss="none")
    if found.status != "converged" or len(found.free) != 33:
        raise RuntimeError(f"{found.status}, {len(found.free)} of 33 identified")
    return (np.asarray(found.theta) - np.asarray(model.start))[arm.core_indices()]


def cpu_seconds(
    run: Callable[[Arm, FloatArray, FloatArray], FloatArray], arm: Arm, q: FloatArray, p: FloatArray, repeats: int
) -> tuple[float, FloatArray]:
    best, answer = np.inf, np.zeros(0)
    for _ in range(repeats):
        start = time.process_time()
        answer = run(arm, q, p)
        best = min(best, time.process_time() - start)
    return best, answer


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    arm = Arm()
    table: list[dict[str, Any]] = []
    print("   poses    fastcal      scipy   numpy GN   scipy / fastcal   numpy GN / fastcal   largest difference")
    for count in (50, 1000, 100_000):
        q, p = make_data(arm, count)
        repeats = options.repeats if count < 100_000 else min(2, options.repeats)
        seconds, answers = {}, {}
        for name, solver in (("fastcal", by_fastcal), ("scipy", by_scipy), ("numpy", by_numpy)):
            seconds[name], answers[name] = cpu_seconds(solver, arm, q, p, repeats)
        apart = max(float(np.abs(answers["fastcal"] - answers[name]).max()) for name in ("scipy", "numpy"))
        row = {
            "poses": count,
            **seconds,
            "scipy_over_fastcal": seconds["scipy"] / seconds["fastcal"],
            "numpy_over_fastcal": seconds["numpy"] / seconds["fastcal"],
            "apart": apart,
        }
        table.append(row)
        print(
            f"{count:8d} " + " ".join(f"{seconds[name]:9.4f}s" for name in ("fastcal", "scipy", "numpy")),
            f"  {row['scipy_over_fastcal']:15.1f}   {row['numpy_over_fastcal']:18.1f}   {apart:.1e} m, rad",
        )
    if options.json:
        options.json.write_text(
            json.dumps(
                {"machine": platform.processor() or platform.machine(), "noise_m": NOISE, "rows": table}, indent=1
            )
            + "\n",
            encoding="utf-8",
        )


if __name__ == "__main__":
    main()
