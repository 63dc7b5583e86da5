# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Inverse kinematics of a 7R arm beside the Robotics Toolbox and TRAC-IK, and of calibrated arms that give way.

    python bench/python/bench_ik.py [--json FILE] [--repeats N]

7R: the iiwa that comes with fastcal, random reachable targets, random seeds, limits kept, 1e-6 m and 1e-6 rad; all get
the same arm, targets and seeds in the same run, and what they answer is checked with SciPy's rotations and plain numpy.
The Toolbox's ik_LM (C++) has 100 searches and its own damping, TRAC-IK 5 ms each, its usual setting; both are called a
target at a time, which is how they are made, and so is fastcal's PoseSolver beside its batch. A peer that is not
installed is left out, and that is said.
Calibrated: every target that the nominal arm reaches well inside its limits (5 % of the range from them) and away from
singularities (least singular value of the Jacobian, lengths over the reach, above 0.02) on the perturbed arm with
effects, loads at equilibrium, to 1e-9 m and rad: two 6R arms and the spray robot, P R R R R P R, which bends as a frame
of beams. CPU time of one thread, best of the repeats.
"""

from __future__ import annotations

import argparse
import copy
import json
import platform
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal import PoseSolver, Robot, convert, inverse_kinematics, load_robot, perturbed, random_poses
from fastcal.io.urdf_file import urdf_text

Array = NDArray[np.float64]
Answer = tuple[float, Array]
GOALS = {
    "fastcal_over_toolbox": 10.0,
    "fastcal_singly_over_toolbox": 5.0,
    "fastcal_over_tracik": 80.0,
    "fastcal": 300_000.0,
}
# Payload [kg], and targets a second.
CALIBRATED = {
    "staubli_rx160l": (10.0, 20_000.0),
    "siasun_sr210d": (165.0, 20_000.0),
    "spray_7dof": (15.0, 5_000.0),
}
TOLERANCE = 1e-6


def forward(robot: Robot, q: Array) -> Array:
    """(N, 4, 4) of a modified DH table, written from its definition."""
    T = np.tile(np.eye(4), (len(q), 1, 1))
    for i, joint in enumerate(robot.spec["joints"]):
        local = np.tile(np.eye(4), (len(q), 1, 1))
        tilt = Rotation.from_euler("x", joint["alpha_deg"], degrees=True)
        turn = Rotation.from_rotvec((q[:, i] + np.radians(joint["theta_deg"]))[:, None] * [0.0, 0.0, 1.0])
        local[:, :3, :3] = (tilt * turn).as_matrix()
        local[:, :3, 3] = tilt.apply([joint["a_mm"] / 1000, 0, joint["d_mm"] / 1000])
        T = T @ local
    tool = np.eye(4)
    tool[:3, 3] = np.asarray(robot.spec["tool"]["xyz_mm"]) / 1000
    return np.asarray(T @ tool)


def solved(robot: Robot, q: Array, targets: Array) -> float:
    """Share of the rows whose tool stands at its target, all joints within their limits."""
    there = forward(robot, q)
    apart = np.linalg.norm(there[:, :3, 3] - targets[:, :3, 3], axis=1)
    turned = Rotation.from_matrix(there[:, :3, :3].transpose(0, 2, 1) @ targets[:, :3, :3]).magnitude()
    low, high = robot.limits.T
    inside = ((q >= low - 1e-9) & (q <= high + 1e-9)).all(axis=1)
    return float(np.mean((apart <= TOLERANCE) & (turned <= TOLERANCE) & inside))


def timed(run: Callable[[], Array], count: int, repeats: int) -> Answer:
    """Targets in a second of CPU time, best of the repeats, and the answer."""
    best, answer = np.inf, np.zeros(0)
    for _ in range(repeats):
        start = time.process_time()
        answer = run()
        best = min(best, time.process_time() - start)
    return count / best, answer


def by_toolbox(robot: Robot, targets: Array, seeds: Array) -> Answer:
    import roboticstoolbox as rtb

    motions = []
    for joint, limits in zip(robot.spec["joints"], robot.limits, strict=True):
        motions += [rtb.ET.Rx(np.radians(joint["alpha_deg"])), rtb.ET.tx(joint["a_mm"] / 1000)]
        motions += [rtb.ET.tz(joint["d_mm"] / 1000), rtb.ET.Rz(qlim=limits)]
    x, y, z = np.asarray(robot.spec["tool"]["xyz_mm"]) / 1000
    motions += [rtb.ET.tx(x), rtb.ET.ty(y), rtb.ET.tz(z)]
    # What does not move is left out where it does nothing, as its own models do.
    ets = rtb.ETS([motion for motion in motions if motion.isjoint or not np.allclose(motion.A(), np.eye(4))])

    def run() -> Array:  # its tolerance is on half the squared error
        return np.array([ets.ik_LM(T, q0=q, slimit=100, tol=1e-13)[0] for T, q in zip(targets, seeds, strict=True)])

    return timed(run, len(targets), 1)


def by_tracik(robot: Robot, targets: Array, seeds: Array) -> Answer:
    from trac_ik import TracIK

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(urdf_text(convert(robot, "urdf").spec), encoding="utf-8")
        solver = TracIK("base_link", "tool", str(path), timeout=0.005, epsilon=1e-7)

        def run() -> Array:
            found = [solver.ik(T[:3, 3], T[:3, :3], q) for T, q in zip(targets, seeds, strict=True)]
            return np.array([seed if q is None else q for q, seed in zip(found, seeds, strict=True)])

        return timed(run, len(targets), 1)


def redundant_arm(repeats: int) -> dict[str, Any]:
    robot = load_robot("lbr_iiwa14")
    targets = forward(robot, random_poses(robot, 10_000, seed=1))
    seeds = random_poses(robot, 10_000, seed=2)

    def run() -> Array:
        return inverse_kinematics(robot, targets, seeds, tolerance_m=TOLERANCE, tolerance_rad=TOLERANCE).q

    out: dict[str, Any] = {}
    out["fastcal"], q = timed(run, len(targets), repeats)
    out["fastcal_solved"] = solved(robot, q, targets)
    solver = PoseSolver(robot, tolerance_m=TOLERANCE, tolerance_rad=TOLERANCE)

    def singly() -> Array:
        return np.array([solver.inverse(T, seed)[0] for T, seed in zip(targets, seeds, strict=True)])

    out["fastcal_singly"], q = timed(singly, len(targets), repeats)
    out["fastcal_singly_solved"] = solved(robot, q, targets)
    for name, peer, count in (("toolbox", by_toolbox, 5000), ("tracik", by_tracik, 1000)):
        try:
            rate, q = peer(robot, targets[:count], seeds[:count])
        except ImportError as error:
            out[f"{name}_left_out"] = str(error)
            continue
        out[name], out[f"{name}_solved"] = rate, solved(robot, q, targets[:count])
        out[f"fastcal_over_{name}"] = out["fastcal"] / rate
        out[f"fastcal_singly_over_{name}"] = out["fastcal_singly"] / rate
    return out


COMPLIANCE = {
    "staubli_rx160l": [2e-7, 8e-7, 9e-7, 2e-6, 3e-6, 4e-6],
    "siasun_sr210d": [5e-8, 1e-7, 1.5e-7, 4e-7, 8e-7, 1e-6],
}


def giving_way(nominal: Robot) -> Robot:
    """The arm 0.5 mm and 0.5 mrad off in every size; its joints or beams give way; the RX160L has much else besides."""
    spec = copy.deepcopy(perturbed(nominal, seed=3).spec)
    everything = nominal.name == "staubli_rx160l"

    def add(effect: str, owner: str, **parameters: float) -> None:
        spec["effects"].append({"effect": effect, "owner": owner, "parameters": parameters})

    if spec["structure"]:
        add("beam_gravity", "structure", scale=1.0)
    for i, compliance in enumerate(COMPLIANCE.get(nominal.name, []), start=1):
        add("joint_compliance", f"joint{i}", compliance_rad_nm=compliance)
        if everything:
            add("reduction_ratio", f"joint{i}", error=2e-4 * (-1) ** i)
            add("gear_harmonic", f"joint{i}", order=2, amplitude_rad=2e-4, phase_rad=0.3 * i)
            add("backlash", f"joint{i}", gap_rad=2e-4)
            add("bearing_tilt", f"joint{i}", rad_nm=compliance / 4)
    if everything:
        add("coupling_ratio", "joint6<-joint5", ratio=0.01)
        add("link_bending", "link2", inverse_ei_1_nm2=2e-7)
        add("link_torsion", "link4", inverse_gj_1_nm2=2e-7)
        add("payload_mass", "payload", extra_kg=0.4)
    return Robot(spec)


def calibrated_arm(name: str, payload: float, repeats: int) -> dict[str, Any]:
    nominal = load_robot(name)
    model = giving_way(nominal)
    q = random_poses(nominal, 10_000, seed=1)
    middle = nominal.limits.mean(axis=1)
    q = middle + 0.9 * (q - middle)
    J = nominal.joint_jacobian(q)
    J[:, :3] /= nominal.reach
    J[:, :, [kind == "prismatic" for kind in nominal.joint_types]] *= nominal.reach
    q = q[np.linalg.svd(J, compute_uv=False)[:, -1] > 0.02]
    targets = nominal.forward(q)
    conditions = {"payload": payload, "approach": np.ones(nominal.joint_count)}

    def run() -> Array:
        return inverse_kinematics(model, targets, q, **conditions).q

    rate, found = timed(run, len(q), repeats)
    there = model.forward(found, **conditions)
    off = np.linalg.norm((model.forward(q, **conditions) - targets)[:, :3, 3], axis=1)
    left = np.linalg.norm((there - targets)[:, :3, 3], axis=1)
    turned = Rotation.from_matrix(there[:, :3, :3].transpose(0, 2, 1) @ targets[:, :3, :3]).magnitude()
    inside = ((found >= nominal.limits[:, 0]) & (found <= nominal.limits[:, 1])).all(axis=1)
    reached = (left < 1.001e-9) & (turned < 1.001e-9) & inside
    return {"rate": rate, "reached": float(reached.mean()), "count": len(q), "off_m": float(off.mean())}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    result: dict[str, Any] = redundant_arm(options.repeats)
    for name in ("fastcal", "fastcal_singly", "toolbox", "tracik"):
        if name in result:
            print(f"7R {name:27} {result[name]:10,.0f} /s   {result[f'{name}_solved']:8.2%} solved")
        else:
            print(f"7R {name:27} left out: {result[f'{name}_left_out']}")
    for name, goal in GOALS.items():
        if name in result:
            met = "met" if result[name] >= goal else "MISSED"
            print(f"7R {name:27} {result[name]:10,.0f}      goal {goal:,.0f}   {met}")
    for name, (payload, goal) in CALIBRATED.items():
        arm = result[name] = calibrated_arm(name, payload, options.repeats)
        met = "met" if arm["rate"] >= goal and arm["reached"] == 1 else "MISSED"
        print(
            f"calibrated {name:17} {arm['rate']:10,.0f} /s   {arm['reached']:8.2%} of {arm['count']} to 1e-9, "
            f"{1000 * arm['off_m']:.1f} mm off before   goal {goal:,.0f}   {met}"
        )
    if options.json:
        text = json.dumps({"machine": platform.processor() or platform.machine(), **result}, indent=1) + "\n"
        options.json.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
