# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arms that carry 6 to 500 kg, as a data sheet has them and as a workshop builds and measures them."""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import Robot, _core, load_robot, perturbed, random_poses
from fastcal.measurements.dataset import Dataset

FloatArray = NDArray[np.float64]
Random = np.random.Generator

# payload [kg] they carry
ARMS = {
    "kuka_kr500_3": 500.0,
    "kuka_kr210_r2700": 210.0,
    "pmc6va030": 30.0,
    "staubli_rx160l": 20.0,
    "lbr_iiwa14": 14.0,
    "ur10e": 12.5,
    "kuka_kr6_r900": 6.0,
}
TARGET_MM = [60.0, 0.0, 110.0]  # where a file has its tool at the flange
MASS_OF_PAYLOAD = 7.0  # mass of an arm whose file has none, in payloads: KR 210 5.5, KR 6 8.7
SHARES = (0.34, 0.26, 0.18, 0.12, 0.06, 0.04)  # of its links
WITHOUT_MASSES = 0.3  # of the sets: the user has no table of masses
MASS_ERROR, COM_ERROR_MM = 0.06, 10.0
HELD_OUT = 1000  # rows behind those that are diagnosed: by 60 a model seems 2 % worse that is none, by chance
BEHIND = 60  # poses whose time they take, one after the other: as much of the conditions is new as in a usual test
START_C = 20.0
NOISES = {"white": 0.6, "heavy-tailed": 0.2, "serial": 0.2}
# How well each joint repeats [rad; of slides m], beside all other noise, in shares of the sets.
JOINTS = {0.0: 0.7, 3e-5: 0.1, 1e-4: 0.15, 3e-4: 0.05}
FREEDOM = 4  # of Student's t: a number of four standard deviations in 100
RHO = (0.3, 0.8)  # of noise with a memory
REPEATABILITY, TRANSVERSE, PER_RANGE, RADIAL = 30e-6, 15e-6, 6e-6, 5e-6  # [m], [m], [m/m], [m]


@dataclass(frozen=True)
class Setting:
    """A nominal arm, the arm as it is, and rows that nothing has been measured in yet.

    Attributes:
        nominal: As the user has it, with or without masses; `complete` with what its maker knows of them.
        poses: All rows, the last HELD_OUT of them held out.
        still: (N, 3) points without a cause [m].
        sigma: Of a coordinate [m], RMS over the rows.
        leaves: (3 n, k) orthonormal over the n rows that are diagnosed: what geometry, base and tool take up.
        noise: A key of NOISES.
        joints: How well each joint repeats, a key of JOINTS.
    """

    nominal: Robot
    complete: Robot
    true: Robot
    poses: Dataset
    still: FloatArray
    sigma: float
    leaves: FloatArray
    noise: str
    joints: float = 0.0

    @property
    def count(self) -> int:
        """Rows that are diagnosed."""
        return len(self.poses) - HELD_OUT

    @property
    def has_masses(self) -> bool:
        """Does the user have a table of masses?"""
        return self.nominal is self.complete


@cache
def nominal_arm(name: str) -> Robot:
    """A shipped arm with a target off its last axis; where its file has no masses, with those of a usual arm."""
    return complete_arm(load_robot(name), ARMS[name])


def complete_arm(robot: Robot, most: float) -> Robot:
    """An arm that carries `most` [kg], with a target off its last axis and, where its file has none, usual masses."""
    spec = copy.deepcopy(robot.spec)
    if not any(spec["tool"]["xyz_mm"]):
        spec["tool"]["xyz_mm"] = list(TARGET_MM)
    lengths = [max(abs(j.get("a_mm", 0.0)), 100.0) for j in spec["joints"]]
    for joint, share, length in zip(spec["joints"], SHARES, lengths, strict=False):
        if not (joint.get("link") or {}).get("mass_kg"):
            mass = share * MASS_OF_PAYLOAD * most
            joint["link"] = {"mass_kg": mass, "com_mm": [length / 2, 0.1 * length, 0.1 * length]}
    return Robot(spec)


@cache
def bare_arm(name: str) -> Robot:
    """The same where nobody has weighed it."""
    return without_links(nominal_arm(name))


def without_links(robot: Robot) -> Robot:
    """The robot without what its links weigh."""
    spec = copy.deepcopy(robot.spec)
    for joint in spec["joints"]:
        joint.pop("link", None)
    return Robot(spec)


def setting(random: Random, name: str | None = None, count: int | None = None) -> Setting:
    """An arm and its rows, drawn where they are not given."""
    given = name is not None
    name = name or str(random.choice(list(ARMS)))
    complete = nominal_arm(name)
    bare = not given and random.uniform() < WITHOUT_MASSES
    noise = "white" if given else str(random.choice(list(NOISES), p=list(NOISES.values())))
    true = built(complete, random)
    count = count or int(random.integers(90, 161))
    whole = count + HELD_OUT
    q = random_poses(complete, whole, seed=int(random.integers(2**31)))
    poses = Dataset.from_arrays(
        q, robot=complete, source="simulated", **_conditions(complete, count, ARMS[name], random)
    )
    still = true.poses(poses)[:, :3, 3]
    J = true.parameter_jacobian(q[:count]).reshape(3 * count, -1)
    U, s, _ = np.linalg.svd(J / np.maximum(np.linalg.norm(J, axis=0), 1e-300), full_matrices=False)
    joints = 0.0 if given else drawn_joints(random)
    spread = np.sqrt(np.mean(spread_of(still) ** 2) + spread_by_joints(true, poses, joints) ** 2)
    leaves = U[:, s > 1e-9 * s[0]]
    nominal = bare_arm(name) if bare else complete
    return Setting(nominal, complete, true, poses, still, float(spread), leaves, noise, joints)


def drawn_joints(random: Random) -> float:
    """How well joints repeat; what is drawn after it is as if nothing had been."""
    return float(random.spawn(1)[0].choice(list(JOINTS), p=list(JOINTS.values())))


def stopped(poses: Dataset, joints: float, random: Random) -> Dataset:
    """The rows where the joints came to a halt; what is drawn after it is as if nothing had been."""
    if joints == 0:
        return poses
    return replace(poses, q=poses.q + joints * random.spawn(1)[0].standard_normal(poses.q.shape))


def spread_by_joints(true: Robot, poses: Dataset, joints: float) -> float:
    """RMS of a coordinate [m] that joints which repeat so add."""
    J = np.asarray(_core.joint_jacobian(true.error_model, true.samples(poses), 1))[:, :3]
    return joints * float(np.sqrt(np.sum(J**2) / (3 * len(J))))


def built(nominal: Robot, random: Random, mass: float = MASS_ERROR, com_mm: float = COM_ERROR_MM) -> Robot:
    """The arm as it is: geometry, masses by a share, centres of mass, and where the instrument sees it."""
    spec = copy.deepcopy(perturbed(nominal, seed=int(random.integers(2**31))).spec)
    for link in (joint["link"] for joint in spec["joints"] if joint.get("link")):
        link["mass_kg"] *= 1 + mass * random.standard_normal()
        link["com_mm"] = (np.array(link["com_mm"]) + com_mm * random.standard_normal(3)).tolist()
    spec["base"] = {
        "xyz_mm": (np.array([3000.0, 500.0, -800.0]) + 100 * random.standard_normal(3)).tolist(),
        "rpy_deg": [0.05 * random.standard_normal(), 0.05 * random.standard_normal(), float(random.uniform(-180, 180))],
    }
    return Robot(spec)


def _conditions(nominal: Robot, rows: int, most: float, random: Random) -> dict[str, Any]:
    """Of the rows that are diagnosed and of those held out, which follow one another faster."""
    count = rows + HELD_OUT
    pace = np.repeat([1.0, BEHIND / HELD_OUT], [rows, HELD_OUT])
    time = np.cumsum(pace * random.uniform(20, 40, count))
    walk = np.cumsum(np.sqrt(pace) * random.standard_normal(count)) / np.sqrt(rows + BEHIND)
    warm = 12 * (1 - np.exp(-time / (0.4 * time[-1])))
    loads = most * np.array([0.0, 0.5, 1.0])
    out: dict[str, Any] = {
        "time": time,
        "temperature": 273.15 + START_C + warm + 3 * walk,
        "payload": random.choice(loads, count),
        "approach": random.choice([-1.0, 1.0], (count, nominal.joint_count)),
        "station": np.where(random.uniform(size=count) < 0.5, "s1", "s2").tolist(),
        "mount": np.where(random.uniform(size=count) < 0.5, "m1", "m2").tolist(),
    }
    if random.uniform() < 0.5:  # pulled sideways, by up to half of what it carries
        pull = 0.5 * 9.8 * most * random.uniform(-1, 1, (count, 3))
        out["wrench"] = np.hstack([pull, np.zeros((count, 3))])
    return out


def spread_of(points: FloatArray) -> FloatArray:
    """(N,) RMS of a coordinate [m]: a tracker at the origin and the arm's repeatability."""
    ranges = np.linalg.norm(points, axis=1)
    return np.asarray(np.sqrt((2 * (TRANSVERSE + PER_RANGE * ranges) ** 2 + RADIAL**2) / 3 + REPEATABILITY**2))


def noise_of(kind: str, points: FloatArray, random: Random) -> FloatArray:
    """(N, 3) noise of a kind [m]."""
    ranges = np.linalg.norm(points, axis=1, keepdims=True)
    along = points / ranges
    tracker, arm = (_unit_noise(kind, points.shape, random) for _ in range(2))
    e = (TRANSVERSE + PER_RANGE * ranges) * tracker
    e += along * (RADIAL * random.standard_normal((len(points), 1)) - np.sum(e * along, axis=1, keepdims=True))
    return np.asarray(e + REPEATABILITY * arm)


def _unit_noise(kind: str, shape: tuple[int, int], random: Random) -> FloatArray:
    """Of variance 1; heavy tails a row at a time: a bad reading is bad in all directions."""
    e = random.standard_normal(shape)
    if kind == "heavy-tailed":
        return np.asarray(e * np.sqrt((FREEDOM - 2) / random.chisquare(FREEDOM, (shape[0], 1))))
    if kind == "serial":
        rho = random.uniform(*RHO)
        for k in range(1, len(e)):
            e[k] = rho * e[k - 1] + np.sqrt(1 - rho**2) * e[k]
    return e
