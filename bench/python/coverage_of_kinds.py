# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do 95 % intervals hold the truth whatever was measured: each kind of reading alone, and each pair of them?

Counted are all geometric parameters that are identified, the tool among them, and the base where points show it: else
anchors or planes that the gauge holds are where it is told from, and they are held where the nominal arm finds them in
these very readings, noise and all. Which ones the gauge holds depends
on the kind, and what a held one is off moves into others; so the truth of a set is what the same readings with a
thousandth of their noise give for the very same parameters.
"""

from __future__ import annotations

import copy
import functools
import zlib
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.simulation import perturbed, random_poses, simulate
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import without_kinds
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

HEAD = "kind "
# [m], [rad]
NOISE = {"position": 3e-5, "orientation": 1e-4, "length": 2e-5, "plane": 2e-5, "tilt": 2e-5, "socket": 3e-5}
TOUCHED = {"dial": 2e-5, "ball": 2e-5, "cube": 2e-5}  # counted alone
# Corners need a camera in a cell.
KINDS = [kind for kind in _core.observation_names() if kind in NOISE]
LABELS = [HEAD + "+".join(kinds) for size in (1, 2) for kinds in combinations(KINDS, size)]
TOUCH_LABELS = [HEAD + kind for kind in TOUCHED]
ROWS = 120
LEVELS = (3, 5)
ANCHORS = np.array([[3.0, -1.5, 0.2], [-1.0, 3.0, 0.4], [1.0, 1.5, -1.2]])
PLANES = np.array([[0.0, 0.0, 1.2], [1.2, 0.0, 1.4], [0.3, 1.1, 1.1]])  # rx, ry, offset
SOCKETS = np.array([[1.9, -0.6, 1.1], [1.2, 1.4, 1.6], [0.6, -1.9, 1.3]])
BALLS = np.array([[1.9, -0.6, 1.1, 0.1], [1.2, 1.4, 1.6, 0.06], [0.6, -1.9, 1.3, 0.15]])  # centre, radius
CUBES = np.array([[0.1, -0.1, 0.15, 1.6, 0.9, 1.4], [-0.1, 0.1, -0.2, 1.2, -1.5, 1.2]])  # turn, offsets of faces
GAUGES = np.array([[0.0, 0.4, 1.2], [1.3, 0.1, 0.5]])  # rx, ry, zero
ROUNDS = 500  # of postures tried for a touch
WIDE = 0.2  # [m] of the faces of a cube
FAINT = 1e-3
NEAR = 1.0  # [rad] of a joint on the way to a plane


class Number(NamedTuple):
    """A parameter's value, its interval and its deviation, and the truth."""

    name: str
    value: float
    low: float
    high: float
    std: float
    true: float


@functools.cache
def arm() -> Robot:
    """The KR500 before an instrument that stands askew."""
    spec = copy.deepcopy(load_robot("kuka_kr500_3").spec)
    spec["base"] = {"xyz_mm": [300.0, -200.0, 400.0], "rpy_deg": [0.5, -0.8, 35.0]}
    return Robot(spec)


def readings(truth: Robot, kinds: list[str], q: FloatArray, noise: float, seed: int) -> Dataset:
    """What instruments read of the true arm, each number with `noise` times its kind's deviation."""
    random = np.random.default_rng(seed)
    count = len(q)
    given: dict[str, Any] = {"observed": {}}
    unknowns: dict[str, FloatArray] = {}
    if "length" in kinds:
        which = random.integers(0, len(ANCHORS), count)
        given |= {"distance": np.ones(count), "anchor": [f"a{k}" for k in which]}
        unknowns |= {f"anchor a{k}": place for k, place in enumerate(ANCHORS)}
    if "tilt" in kinds:
        given["observed"] |= {f"tilt@link{link}": np.zeros((count, 2)) for link in LEVELS}
        unknowns |= {f"level on link{link}": random.uniform(-0.5, 0.5, 3) for link in LEVELS}
    if "plane" in kinds:
        q, labels = touches(truth, q, 1 if len(kinds) == 1 else 2, noise * NOISE["plane"], random)
        given["observed_labels"] = {"plane": labels}
    if "socket" in kinds:
        at = SOCKETS[np.arange(count) % len(SOCKETS)] + noise * NOISE["socket"] * random.standard_normal((count, 3))
        names = [f"s{k % len(SOCKETS)}" for k in range(count)]
        q, labels = seated(truth, q, 1 if len(kinds) == 1 else 2, at, names, random)
        given.setdefault("observed_labels", {})["socket"] = labels
        if "plane" in kinds:  # a posture touches one of them
            planes = given["observed_labels"]["plane"]
            given["observed_labels"]["plane"] = ["" if at else plane for at, plane in zip(labels, planes, strict=True)]
    sent = Dataset.from_arrays(q, robot=truth, source="+".join(kinds), **given)
    read = simulate(
        truth,
        without_kinds(sent, ["plane", "socket"]),
        noise=noise * NOISE["position"],
        noise_rotation=noise * NOISE["orientation"] if "orientation" in kinds else None,
        seed=seed + 1,
        unknowns=unknowns,
    )
    if "position" in kinds:
        given["position"] = read.position
    if "orientation" in kinds:
        given["rotation"] = read.rotation
    if "length" in kinds:
        given["distance"] = read.distance + noise * NOISE["length"] * random.standard_normal(count)
    for name, values in read.observed.items():
        given["observed"][name] = values + noise * NOISE["tilt"] * random.standard_normal(values.shape)
    return Dataset.from_arrays(q, robot=truth, source=sent.source, **given)


def touched(truth: Robot, kind: str, q: FloatArray, noise: float, seed: int) -> Dataset:
    """`readings` of one kind of TOUCHED alone."""
    random = np.random.default_rng(seed)
    if kind == "dial":
        which = np.arange(len(q)) % len(GAUGES)
        gauges = GAUGES[which]
        p, (rx, ry, zero) = truth.forward(q)[:, :3, 3], gauges.T
        n = np.array([np.asarray(_core.exp_so3([a, b, 0.0]))[:, 2] for a, b in zip(rx, ry, strict=True)])
        read = np.einsum("ni,ni->n", n, p) - zero + noise * TOUCHED[kind] * random.standard_normal(len(q))
        labels = {"gauge": [f"g{k}" for k in which]}
        given: dict[str, Any] = {"observed": {"dial": read[:, np.newaxis]}, "observed_labels": labels}
        return Dataset.from_arrays(q, robot=truth, source=kind, **given)
    at, names = on_surfaces(kind, len(q), noise * TOUCHED[kind], random)
    q, names = seated(truth, q, 1, at, names, random)
    return Dataset.from_arrays(q, robot=truth, source=kind, observed_labels={kind: names})


def touches(
    truth: Robot, q: FloatArray, each: int, noise: float, random: np.random.Generator
) -> tuple[FloatArray, list[str]]:
    """Postures of which every `each`-th touches a plane, but for the noise, and the planes' labels.

    One that would turn far on its way there touches none.
    """
    rows = np.arange(0, len(q), each)
    which = np.arange(len(rows)) % len(PLANES)
    own = [f"touch {k}" for k in range(len(rows))]  # each a plane of its own, as far off as its noise
    sent = Dataset.from_arrays(q[rows], robot=truth, observed_labels={"plane": own})
    heights = noise * random.standard_normal(len(rows))
    unknowns = {
        f"plane {name}": PLANES[k] + [0.0, 0.0, height] for name, k, height in zip(own, which, heights, strict=True)
    }
    there = simulate(truth, sent, unknowns=unknowns, points=False).q
    near = np.abs(there - q[rows]).max(axis=1) < NEAR
    out = q.copy()
    out[rows[near]] = there[near]
    labels = np.full(len(q), "", dtype=object)
    labels[rows[near]] = [f"p{k}" for k in which[near]]
    return out, [str(label) for label in labels]


def on_surfaces(kind: str, count: int, noise: float, random: np.random.Generator) -> tuple[FloatArray, list[str]]:
    """Points (N, 3) on balls or faces of cubes, but for the noise, and their labels."""
    off, out, labels = noise * random.standard_normal(count), np.empty((count, 3)), []
    for k in range(count):
        if kind == "ball":
            ball, u = BALLS[k % len(BALLS)], random.standard_normal(3)
            out[k] = ball[:3] + (ball[3] + off[k]) * u / np.linalg.norm(u)
            labels.append(f"b{k % len(BALLS)}")
            continue
        cube, face = CUBES[k % len(CUBES)], k // len(CUBES) % 3
        at = cube[3:] + WIDE * random.uniform(-1, 1, 3)
        at[face] = cube[3 + face] + off[k]
        out[k] = np.asarray(_core.exp_so3(cube[:3])) @ at
        labels.append(f"c{k % len(CUBES)}/{'xyz'[face]}")
    return out, labels


def seated(
    truth: Robot, q: FloatArray, each: int, at: FloatArray, names: list[str], random: np.random.Generator
) -> tuple[FloatArray, list[str]]:
    """Postures of which every `each`-th has the tool's point where it is to be, `at` (N, 3), and the `names` of these.

    From postures of the list by Newton's steps of least length, dq = J^+ (at - point); where one ends beyond its
    joints' limits, from another.
    """
    out, low, high = q.copy(), *truth.limits.T
    labels = [""] * len(q)
    waiting = np.arange(len(q) - 1, -1, -each)
    for _ in range(ROUNDS):
        if not waiting.size:
            break
        there = q[random.integers(0, len(q), len(waiting))]
        for _ in range(60):
            apart = at[waiting] - truth.forward(there)[:, :3, 3]
            steps = np.linalg.pinv(truth.joint_jacobian(there)[:, :3], rcond=1e-2) @ apart[:, :, np.newaxis]
            there = there + np.clip(steps[:, :, 0], -0.3, 0.3)
        there = np.where(np.abs(there) > np.pi, np.arctan2(np.sin(there), np.cos(there)), there)
        short = np.linalg.norm(at[waiting] - truth.forward(there)[:, :3, 3], axis=1) > 1e-9
        good = ~short & ((there > low) & (there < high)).all(axis=1)
        for row, posture in zip(waiting[good], there[good], strict=True):
            out[row], labels[row] = posture, names[row]
        waiting = waiting[~good]
    if waiting.size:
        raise ValueError(f"the arm does not reach {names[waiting[0]]} at {at[waiting[0]].tolist()}")
    return out, labels


def numbers(label: str, seed: int, loss: str) -> list[Number] | None:
    """The identified parameters of one set; None where it did not converge."""
    kinds = label.removeprefix(HEAD).split("+")
    random = np.random.default_rng([zlib.crc32(label.encode()), seed])
    nominal = arm()
    truth = perturbed(nominal, seed=int(random.integers(2**31)))
    q = random_poses(nominal, ROWS, region=[[-2.5, -2.5, 0.8], [2.5, 2.5, 3.0]], seed=int(random.integers(2**31)))
    at = int(random.integers(2**31))
    alone = kinds[0] in TOUCHED
    read = functools.partial(touched, truth, kinds[0]) if alone else functools.partial(readings, truth, kinds)
    found = calibrate(nominal, read(q, 1.0, at), loss=loss)
    if found.status != "converged" or found.held:
        return None
    names = [name for name in full_names(found) if name.startswith("joint")]
    options: dict[str, Any] = {"parameters": names, "loss": "none", "checks": False}
    there = calibrate(nominal, read(q, FAINT, at), **options)
    if there.status != "converged" or full_names(there) != full_names(found):
        return None
    return compared(found, there, based="position" in kinds)


def full_names(found: CalibrationResult) -> list[str]:
    """Of the identified parameters, as `parameters` of `calibrate` takes them."""
    return [f"{p.owner} {p.name.rpartition('_')[0]}" for p in found.parameters]


def compared(found: CalibrationResult, there: CalibrationResult, *, based: bool) -> list[Number]:
    """Each geometric parameter against its truth; with `based`, those of the base too."""
    owners = ("base", "tool") if based else ("tool",)
    rows = zip(found.parameters, found.interval(), there.parameters, strict=True)
    return [
        Number(f"{p.owner} {p.name}", p.value, float(low), float(high), float(p.std or np.nan), other.value)
        for p, (low, high), other in rows
        if p.owner in owners or p.owner.startswith("joint")
    ]
