# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""SIASUN SR210D: screws with ratios and couplings, stiffness from motor currents, BSO-MLP, commands that are sent.

Y. Wang, Z. Chen, H. Zu, X. Zhang, C. Mao, Z. Wang. The true arm, its measurements and what each stage finds; what of it
is shown is in siasun_sr210d_page.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.motor_currents import motor_currents
from fastcal.calibration.simulation import random_poses
from fastcal.compensation.commands import compensate
from fastcal.conversion import convert
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.targets import Targets
from fastcal.robot.robot import Robot
from fastcal.units import to_si
from fastcal_studies.exhibits import MM, lengths_mm
from fastcal_studies.learning import HAS_TORCH
from fastcal_studies.siasun_sr210d_page import WORLD_LINES
from fastcal_studies.siasun_sr210d_page import page as page
from fastcal_studies.simulated import WORLDS, FloatArray, Unmodelled, in_world, left, measure
from fastcal_studies.study import Paper, Run

# Tables 3, 4 and 6; the coupling ratio error is in 6.1.
LENGTHS_MM = (313.1011, 1075.1209, 234.2737, 1281.3124)
OFFSETS_DEG = (0.0, 0.0044, 0.0479, 0.4524, -0.1892, 0.0)
RATIOS = (1.0002, 1.0013, 1.0004, 0.9998, 0.9996, 1.0003)
COUPLING = -2.5342e-4
FLEXIBILITY_RAD_A = (0.0, 1.89e-5, -2.49e-5, -5.35e-5, -8.26e-5, 0.0)

LOAD_KG, NOISE_MM = 210.0, 0.02
RANGES_DEG = ((-30, 30), (-40, 20), (-30, 30), (-45, 45), (-45, 45), (-45, 45))
TORQUE_PER_AMPERE = 40.0  # of all motors, at the joint [N m/A]
OWN_WEIGHT, FRICTION = 0.3, 0.03
WAVES_RAD, GROWTH = (2.0e-4, 3.6e-4, 3.6e-4, 3.2e-4, 3.2e-4, 3.2e-4), 1.7
FITTED, LEARNT, UNSEEN, SENT = 50, 200, 200, 50
PARTS = (FITTED, FITTED, FITTED, LEARNT, UNSEEN)
MORE = (600, 1400)  # poses learnt, to show what more of them bring
TRANSMISSION = ("geometry", "reduction_ratio", "coupling_ratio@joint6<-joint5")
SOFT = (2, 3, 4, 5)
CURRENTS = [f"current_compliance@joint{j}" for j in SOFT]
OWN_SAG = [f"gravity_sag@joint{j}:moments=even" for j in (2, 3)]
BY_LOAD = [*TRANSMISSION, *(f"joint_compliance@joint{j}" for j in SOFT), *OWN_SAG]

PAPER = Paper(
    robot="siasun_sr210d",
    reference="Y. Wang, Z. Chen, H. Zu, X. Zhang, C. Mao, Z. Wang, Improvement of Heavy Load Robot Positioning "
    "Accuracy by Combining a Model-Based Identification for Geometric Parameters and an Optimized Neural Network for "
    "the Compensation of Nongeometric Errors",
    arm=(
        "Hidden: the lengths and joint offsets of table 3, the ratios of table 4, the coupling error of -2.5342e-4, "
        "and the flexibilities of table 6 with their signs, on the screws of (1) with axis 6 through axis 5.",
        "Poses: joints within 30 degrees (joint 2 from -40 to 20, the wrist within 45), where the printed errors alone "
        "are 1.3 mm before calibration (paper: 1.13 with everything); over the whole workspace they are 2.6 mm.",
        "Currents: torque about the joint over 40 N m/A, which brings the error under 210 kg to the paper's 7 mm, with "
        "Coulomb friction of 3 % of the joint's largest current to a random side. Three tenths of the links' own "
        "weight act on the joints, the rest is balanced; link masses are 6 % off.",
        "What no model has: waves over pairs of joints, sized so that geometry leaves the paper's 0.3 mm without load, "
        "growing to 2.7 times under 210 kg so that stiffness leaves its 0.93 mm; a tracker's noise of 0.02 mm.",
    ),
)


def true_arm(seed: int) -> Robot:
    """The printed parameters and a part of the own weight."""
    spec = copy.deepcopy(dict(load_robot(PAPER.robot).spec))
    random = np.random.default_rng((seed, 3))
    one, two, three, four = LENGTHS_MM
    along = [(0.0, 0.0), (one, 0.0), (one, two), (0.0, two + three), (one + four, two + three), (0.0, two + three)]
    for joint, (x, z), offset in zip(spec["joints"], along, OFFSETS_DEG, strict=True):
        joint |= {"point_mm": [x, 0.0, z], "theta_deg": offset}
        joint["link"]["mass_kg"] *= OWN_WEIGHT * (1 + 0.06 * float(random.standard_normal()))
    spec["home"]["xyz_mm"] = [one + four + 260, 0.0, two + three]
    ratios: list[tuple[str, str, dict[str, float]]] = [
        ("reduction_ratio", f"joint{k}", {"error": ratio - 1}) for k, ratio in enumerate(RATIOS, start=1)
    ]
    yielding = [
        ("joint_compliance", f"joint{k}", {"compliance_rad_nm": abs(c) / TORQUE_PER_AMPERE})
        for k, c in enumerate(FLEXIBILITY_RAD_A, start=1)
        if c
    ]
    effects = [*ratios, ("coupling_ratio", "joint6<-joint5", {"ratio": COUPLING}), *yielding]
    spec["effects"] = [{"effect": name, "owner": owner, "parameters": own} for name, owner, own in effects]
    return Robot(spec)


def nominal_arm() -> Robot:
    """Table 1, without link masses: neither the paper nor fastcal is given them here."""
    spec = copy.deepcopy(dict(load_robot(PAPER.robot).spec))
    for joint in spec["joints"]:
        joint.pop("link")
    return Robot(spec)


def poses(robot: Robot, count: int, seed: int) -> FloatArray:
    """Random joints (count, 6) [rad] within RANGES_DEG."""
    spec = copy.deepcopy(dict(robot.spec))
    for joint, (low, high) in zip(spec["joints"], RANGES_DEG, strict=True):
        joint |= {"min_deg": float(low), "max_deg": float(high)}
    return random_poses(Robot(spec), count, seed=seed)


def measured(true: Robot, outside: Unmodelled, q: FloatArray, load: float, seed: int) -> Dataset:
    """Points and motor currents of the true arm at the commands q (N, 6)."""
    sent = Dataset.from_arrays(q, payload=np.full(len(q), load))
    signs = np.where(np.array(FLEXIBILITY_RAD_A) < 0, -1.0, 1.0)
    current = motor_currents(true, sent, signs * TORQUE_PER_AMPERE)
    side = np.random.default_rng((seed, 5)).choice([-1.0, 1.0], current.shape)
    data = measure(true, sent, outside, to_si(NOISE_MM, "mm"), seed)
    return replace(data, current=current + FRICTION * np.abs(current).max(axis=0) * side)


def one_arm(seed: int, full: bool) -> Run:
    """All stages on one arm; errors in mm."""
    nominal, true = nominal_arm(), true_arm(seed)
    outside = Unmodelled(WAVES_RAD, LOAD_KG, GROWTH, seed)
    q = np.split(poses(nominal, sum(PARTS) + SENT, seed), np.cumsum(PARTS))
    free, held_out, loaded, learnt, unseen = tracked(true, outside, q[:5], seed)
    screws = calibrate(nominal, free, effects=TRANSMISSION, loss="none")
    asked = [f"joint{j} rad_a" for j in SOFT]
    stiff = calibrate(screws.model, loaded, effects=CURRENTS, parameters=asked, loss="none")
    both = Dataset.concatenate([free, loaded])
    joint = calibrate(nominal, both, effects=[*TRANSMISSION, *CURRENTS])
    alone, by_load = fastcal_fits(nominal, free, both)
    run: Run = {
        "geometry": {
            "before": lengths_mm(np.asarray(screws.train.error_before)),
            "fitted": lengths_mm(left(screws.model, free)),
            "held_out": lengths_mm(left(screws.model, held_out)),
            "best_fitted": lengths_mm(left(alone.model, free)),
            "best_held_out": lengths_mm(left(alone.model, held_out)),
            "by_pose": {
                "before": _by_pose(np.asarray(screws.train.error_before)),
                "fitted": _by_pose(left(screws.model, free)),
            },
        },
        "screws": {"true": lengths(true), "found": lengths(screws.model)},
        "transmission": {**_values(screws, "error"), **_values(screws, "ratio")},
        "flexibility": {
            "paper": _values(stiff, "rad_a"),
            "joint": _values(joint, "rad_a"),
            "load": _values(by_load, "compliance_rad_nm"),
        },
        "stiffness": {
            "before": lengths_mm(left(screws.model, loaded)),
            "after": lengths_mm(left(stiff.model, loaded)),
            "best": lengths_mm(left(by_load.model, loaded)),
            "others": lengths_mm(left(stiff.model, unseen)),
            "best_others": lengths_mm(left(by_load.model, unseen)),
            "by_pose": {
                "before": _by_pose(left(screws.model, loaded)),
                "after": _by_pose(left(stiff.model, loaded)),
                "best": _by_pose(left(by_load.model, loaded)),
            },
        },
    }
    sent = {"one_step": (stiff.model, "one-step"), "full": (stiff.model, "full"), "best": (by_load.model, "full")}
    run["without_waves"] = without_waves(nominal, true, replace(outside, sizes=(0.0,) * 6), q[:5], seed)
    if HAS_TORCH:
        from fastcal_studies.siasun_sr210d_best import behind, by_rows
        from fastcal_studies.siasun_sr210d_networks import networks, with_networks

        run["best"] = {
            "free": behind(alone.model, free, seed, {"fitted": free, "others": held_out}),
            "loaded": behind(by_load.model, both, seed, {"fitted": loaded, "others": unseen}),
        }
        rows = Dataset.concatenate([both, learnt])
        best, by_current = (calibrate(nominal, rows, effects=e).model for e in (BY_LOAD, [*TRANSMISSION, *CURRENTS]))
        run |= networks(stiff.model, best, by_current, learnt, unseen, seed, full)
        taught = with_networks(stiff.model, best, learnt, seed)
        sent |= {name: (model, "full") for name, model in taught.items()}
        run["worlds"] = {"joints": {key: run["networks"][key]["unseen"]["mean"] for key in WORLD_LINES}}
        for world in WORLDS[1:]:
            there = in_world(outside, world, true, unseen)
            run["worlds"][world] = elsewhere(nominal, tracked(true, there, q[:5], seed), seed, full)
        further = measured(true, outside, poses(nominal, MORE[-1] - LEARNT, 1000 + seed), LOAD_KG, 10 * seed + 5)
        fit = partial(calibrate, nominal, effects=BY_LOAD)
        run["by_rows"] = by_rows(fit, both, Dataset.concatenate([learnt, further]), MORE, unseen, seed)
    run["commands"] = commands(screws.nominal, sent, true, outside, q[5])
    return run


def elsewhere(nominal: Robot, rows: Sequence[Dataset], seed: int, full: bool) -> Run:
    """Mean error [mm] of the 200 unseen poses by the lines of the three worlds, all from the five parts anew."""
    from fastcal_studies.siasun_sr210d_networks import compared

    free, _, loaded, learnt, unseen = rows
    screws = calibrate(nominal, free, effects=TRANSMISSION, loss="none")
    asked = [f"joint{j} rad_a" for j in SOFT]
    stiff = calibrate(screws.model, loaded, effects=CURRENTS, parameters=asked, loss="none")
    best = calibrate(nominal, Dataset.concatenate([free, loaded, learnt]), effects=BY_LOAD)
    return compared(stiff.model, best.model, learnt, unseen, seed, full)


def to_diagnose(seed: int) -> tuple[Robot, Dataset, Dataset, Robot]:
    """Nominal arm, the rows without and with load, those held out of both, and the hidden arm."""
    nominal, true = nominal_arm(), true_arm(seed)
    q = np.split(poses(nominal, sum(PARTS) + SENT, seed), np.cumsum(PARTS))
    free, held_out, loaded, _, unseen = tracked(true, Unmodelled(WAVES_RAD, LOAD_KG, GROWTH, seed), q[:5], seed)
    return nominal, Dataset.concatenate([free, loaded]), Dataset.concatenate([held_out, unseen]), true


def tracked(true: Robot, outside: Unmodelled, q: Sequence[FloatArray], seed: int) -> list[Dataset]:
    """The five parts: fitted and held out without load; fitted, learnt and unseen under it."""
    loads = (0.0, 0.0, LOAD_KG, LOAD_KG, LOAD_KG)
    return [
        measured(true, outside, own, load, 10 * seed + k) for k, (own, load) in enumerate(zip(q, loads, strict=True))
    ]


def fastcal_fits(nominal: Robot, free: Dataset, both: Dataset) -> tuple[CalibrationResult, CalibrationResult]:
    """What fastcal fits: to the rows without load alone, and to these and the loaded ones at once."""
    alone = calibrate(nominal, free, effects=[*TRANSMISSION, *OWN_SAG])
    return alone, calibrate(nominal, both, effects=BY_LOAD)


def without_waves(nominal: Robot, true: Robot, still: Unmodelled, q: Sequence[FloatArray], seed: int) -> Run:
    """What fastcal's models leave [mm] of the same poses of an arm that has nothing outside them."""
    free, held_out, loaded, _, unseen = tracked(true, still, q, seed)
    alone, by_load = fastcal_fits(nominal, free, Dataset.concatenate([free, loaded]))
    return {"held_out": lengths_mm(left(alone.model, held_out)), "others": lengths_mm(left(by_load.model, unseen))}


def commands(
    nominal: Robot, models: Mapping[str, tuple[Robot, str]], true: Robot, outside: Unmodelled, q: FloatArray
) -> dict[str, dict[str, float]]:
    """Errors [mm] of the true arm, loaded, at commands for the poses that the nominal arm reaches at q (N, 6).

    Currents at a commanded pose are those that the true arm draws where the nominal arm would go.

    Args:
        nominal: What the controller believes.
        models: By line of the table, a model and the method of compensation.
        true: The hidden arm.
        outside: Its waves.
        q: Joints of the poses.
    """
    targets = nominal.forward(q)
    load = np.full(len(q), LOAD_KG)
    asked = Targets(
        targets, seed=q, conditions={"payload": load, "current": measured(true, outside, q, LOAD_KG, 0).current}
    )
    sent = {"none": q}
    for label, (model, method) in models.items():
        sent[label] = compensate(model, asked, nominal=nominal, method=method, along_path=False).q
    out = {}
    for label, own in sent.items():
        moved = own + outside(own, load)
        out[label] = lengths_mm(targets[:, :3, 3] - true.forward(moved, payload=load)[:, :3, 3])
    return out


def lengths(robot: Robot) -> dict[str, float]:
    """L1 to L4 [mm] and the offsets of joints 2 to 5 [deg] of a robot's axes, whatever its screws count from."""
    rows = convert(robot, "dh", drop_effects=True).spec["joints"]
    sizes = {f"L{k + 1} (mm)": abs(rows[k]["a_mm"]) for k in range(3)} | {"L4 (mm)": abs(rows[3]["d_mm"])}
    return sizes | {f"theta{k + 1} (deg)": rows[k]["theta_deg"] for k in range(1, 5)}


def _values(found: CalibrationResult, name: str) -> dict[str, dict[str, float | None]]:
    return {p.owner: {"value": p.value, "std": p.std} for p in found.parameters if p.name == name}


def _by_pose(errors: FloatArray) -> list[float]:
    return [float(x) for x in np.linalg.norm(errors, axis=1) / MM]
