# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What one Jacobian step leaves (the SR210D paper's way) beside full iteration, on arms that are off and yield.

Arms: shipped ones, sizes off by normal errors of 0.5 mm and 0.5 mrad, joints 2 and 3 giving way by what an arm of that
size does, loaded. Targets: the nominal arm's poses at random postures inside 80 % of the limits, none near singular.
Run: python bench/python/bench_compensation.py
"""

from __future__ import annotations

import numpy as np

import fastcal

COUNT = 2000
REGULAR = 0.02  # least singular value of the Jacobian, lengths over the reach
ARMS = {  # name: payload [kg], compliance of joints 2 and 3 [rad/(N m)]
    "siasun_sr210d": (210.0, 6e-7),
    "kuka_kr500_3": (400.0, 3e-7),
    "staubli_rx160l": (10.0, 1.3e-6),
    "lbr_iiwa14": (10.0, 1e-5),
}


def postures(robot: fastcal.Robot) -> np.ndarray:
    """(COUNT, n) regular postures well inside the limits."""
    low, high = robot.limits.T
    q = (low + high) / 2 + 0.8 * (fastcal.random_poses(robot, 4 * COUNT, seed=1) - (low + high) / 2)
    J = robot.joint_jacobian(q)
    J[:, :3] /= robot.reach
    return q[np.linalg.svd(J, compute_uv=False)[:, -1] > REGULAR][:COUNT]


def main() -> None:
    print("arm              before, RMS mm   one step um: median, RMS, largest   full um: largest   targets")
    for name, (payload, compliance) in ARMS.items():
        nominal = fastcal.load_robot(name)
        yielding = [
            {"effect": "joint_compliance", "owner": joint, "parameters": {"compliance_rad_nm": {"value": compliance}}}
            for joint in ("joint2", "joint3")
        ]
        real = fastcal.perturbed(fastcal.Robot(nominal.spec | {"effects": yielding}), seed=5)
        q = postures(nominal)
        T = nominal.forward(q)
        before = np.linalg.norm((real.forward(q, payload=payload) - T)[:, :3, 3], axis=1)
        left = {}
        for method in ("one-step", "full"):
            found = fastcal.compensate(real, T, q, nominal=nominal, method=method, along_path=False, payload=payload)
            left[method] = 1e6 * found.position_error[found.status == "reached"]
        once, full = left["one-step"], left["full"]
        print(
            f"{name:16s} {1e3 * np.sqrt(np.mean(before**2)):14.3f} {np.median(once):17.2f}, "
            f"{np.sqrt(np.mean(once**2)):6.2f}, {once.max():8.1f} {full.max():17.4f} {len(full):9d}"
        )


if __name__ == "__main__":
    main()
