# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Simulated measurements whose missing cause is known: what `bench_diagnosis` asks `diagnose` about.

A set is an arm as a workshop would build and measure it: geometry off by 0.5 mm and 0.5 mrad, links off by 6 % and
10 mm, poses with payloads, directions of approach, side pulls, a temperature and a clock, an instrument's noise. A
cause has the wanted SNR: the root of |P W d|^2, d what it moves the points by, W 1/sigma, P what geometry, base and
tool leave.
"""

from __future__ import annotations

import copy
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import Robot, load_robot, perturbed, random_poses
from fastcal.diagnosis import Diagnosis
from fastcal.diagnosis.library import Hypothesis, build_library
from fastcal.effects.entries import build_effects, edge_name, edge_unit
from fastcal.effects.values import written_parameters
from fastcal.measurements.dataset import Dataset
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
Random = np.random.Generator

ARMS = {"kuka_kr500_3": 500.0, "pmc6va030": 30.0, "lbr_iiwa14": 14.0}  # payload_kg they carry
REPEATABILITY, TRANSVERSE, PER_RANGE, RADIAL = 30e-6, 15e-6, 6e-6, 5e-6  # [m], [m], [m/m], [m]
MASS_ERROR, COM_ERROR_MM = 0.06, 10.0
OUTSIDE = ("cable", "cable_far", "field", "bump")
PLAUSIBLE = 60.0  # sizes: a cause that would have to be larger for its SNR is not drawn
ABSORBED = ("measurement_scale", "payload_mass", "payload_com")  # nothing by themselves: geometry or no compliance
_START_C = 20.0


@dataclass(frozen=True)
class Truth:
    """One hidden cause: a name of the library, or one of OUTSIDE that no name has.

    `entry` is as in a robot file, without its parameters; `shift` (N, 3) what it moves the points by [m].
    """

    effect: str
    owner: str
    snr: float
    entry: dict[str, Any]
    shift: FloatArray


@dataclass(frozen=True)
class Setting:
    """A nominal arm, the arm as it is, and rows that nothing has been measured in yet."""

    nominal: Robot
    true: Robot
    poses: Dataset
    still: FloatArray  # (N, 3) points without a cause [m]
    sigma: float  # of a coordinate [m]
    leaves: FloatArray  # (3N, k) orthonormal: what geometry, base and tool take up


@cache
def nominal_arm(name: str) -> Robot:
    """A shipped arm; poses and links as its file has them."""
    return load_robot(name)


def setting(random: Random, name: str | None = None, count: int | None = None) -> Setting:
    """An arm and its rows, drawn where they are not given."""
    name = name or str(random.choice(list(ARMS)))
    nominal = nominal_arm(name)
    true = _built(nominal, random)
    count = count or int(random.integers(150, 301))
    q = random_poses(nominal, count, seed=int(random.integers(2**31)))
    poses = Dataset.from_arrays(q, robot=nominal, source="simulated", **_conditions(nominal, count, ARMS[name], random))
    still = true.poses(poses)[:, :3, 3]
    J = true.parameter_jacobian(q).reshape(3 * count, -1)
    U, s, _ = np.linalg.svd(J / np.maximum(np.linalg.norm(J, axis=0), 1e-300), full_matrices=False)
    spread = _noise(still, np.random.default_rng(0))[1]
    return Setting(nominal, true, poses, still, float(np.sqrt(np.mean(spread**2))), U[:, s > 1e-9 * s[0]])


def _built(nominal: Robot, random: Random) -> Robot:
    spec = copy.deepcopy(perturbed(nominal, seed=int(random.integers(2**31))).spec)
    for joint in spec["joints"]:
        link = joint["link"]
        link["mass_kg"] *= 1 + MASS_ERROR * random.standard_normal()
        link["com_mm"] = (np.array(link["com_mm"]) + COM_ERROR_MM * random.standard_normal(3)).tolist()
    spec["base"] = {
        "xyz_mm": (np.array([3000.0, 500.0, -800.0]) + 100 * random.standard_normal(3)).tolist(),
        "rpy_deg": [0.05 * random.standard_normal(), 0.05 * random.standard_normal(), float(random.uniform(-180, 180))],
    }
    return Robot(spec)


def _conditions(nominal: Robot, count: int, most: float, random: Random) -> dict[str, Any]:
    time = np.cumsum(random.uniform(20, 40, count))
    walk = np.cumsum(random.standard_normal(count)) / np.sqrt(count)
    warm = 12 * (1 - np.exp(-time / (0.4 * time[-1])))
    loads = most * np.array([0.0, 0.5, 1.0])
    out: dict[str, Any] = {
        "time": time,
        "temperature": 273.15 + _START_C + warm + 3 * walk,
        "payload": random.choice(loads, count),
        "approach": random.choice([-1.0, 1.0], (count, nominal.joint_count)),
        "station": np.where(random.uniform(size=count) < 0.5, "s1", "s2").tolist(),
        "mount": np.where(random.uniform(size=count) < 0.5, "m1", "m2").tolist(),
    }
    if random.uniform() < 0.5:  # pulled sideways, by up to half of what it carries
        pull = 0.5 * 9.8 * most * random.uniform(-1, 1, (count, 3))
        out["wrench"] = np.hstack([pull, np.zeros((count, 3))])
    return out


def _noise(points: FloatArray, random: Random) -> tuple[FloatArray, FloatArray]:
    """Noise (N, 3) of a tracker at the origin and the arm's repeatability [m], and its RMS a row."""
    ranges = np.linalg.norm(points, axis=1, keepdims=True)
    along = points / ranges
    across = TRANSVERSE + PER_RANGE * ranges
    e = across * random.standard_normal(points.shape)
    e += along * (RADIAL * random.standard_normal((len(points), 1)) - np.sum(e * along, axis=1, keepdims=True))
    rms = np.sqrt((2 * across**2 + RADIAL**2) / 3 + REPEATABILITY**2)
    return e + REPEATABILITY * random.standard_normal(points.shape), rms[:, 0]


def measured(at: Setting, truths: Sequence[Truth], random: Random) -> Dataset:
    """The rows with what the tracker says; causes add up to first order beside the exact shift of each."""
    points = at.still + sum((t.shift for t in truths), np.zeros_like(at.still))
    return replace(at.poses, position=points + _noise(points, random)[0])


def snr(at: Setting, shift: FloatArray, also: FloatArray | None = None) -> float:
    """Root of the noncentrality of a shift (N, 3), after geometry and the columns `also` (3N, k)."""
    d = _left(at, shift.reshape(-1, 1) / at.sigma)
    if also is not None:
        d -= also @ np.linalg.lstsq(also, d, rcond=None)[0]
    return float(np.linalg.norm(d))


def _left(at: Setting, X: FloatArray) -> FloatArray:
    return X - at.leaves @ (at.leaves.T @ X)


def with_effect(at: Setting, entry: dict[str, Any], theta: FloatArray) -> FloatArray:
    """(N, 3) what an effect of this size moves the points by, at equilibrium."""
    (effect,) = build_effects([entry], at.true.core)
    nan = np.full((len(theta), len(theta)), np.nan)
    whole = {**entry, "parameters": written_parameters(entry, effect, theta, nan)}
    robot = Robot({**at.true.spec, "effects": [whole]})
    return robot.poses(at.poses)[:, :3, 3] - at.still


def named_truth(at: Setting, wanted: float, random: Random) -> Truth | None:
    """A cause of the library, its kind drawn first, then its owner; None where no plausible size has the SNR."""
    names = drawable(at)
    kinds = sorted({name.effect for name in names})
    kind = str(random.choice(kinds))
    some = [name for name in names if name.effect == kind]
    return scaled(at, some[int(random.integers(len(some)))], wanted, random)


def drawable(at: Setting, but: Collection[str] = ABSORBED) -> list[Hypothesis]:
    """Names of the library for these rows."""
    known = build_library(at.nominal, replace(at.poses, position=at.still)).names
    return [n for n in known if n.effect not in but]


def scaled(at: Setting, name: Hypothesis, wanted: float, random: Random) -> Truth | None:
    """The cause at the size that has the SNR; of a compliance that bends, the SNR of the bend alone."""
    entry = {key: value for key, value in name.entry.items() if key != "corner"}
    (effect,) = build_effects([entry], at.true.core)
    direction = np.array([p.sigma * random.standard_normal() for p in effect.parameters])
    direction = np.array([abs(x) if p.lower >= 0 else x for x, p in zip(direction, effect.parameters, strict=True)])
    also, bends = None, name.effect == "joint_compliance_nonlinear"
    if bends:
        straight = {"effect": "joint_compliance", "owner": name.owner}
        unit = with_effect(at, straight, np.array([1e-3 * effect.parameters[0].sigma]))
        also = _left(at, unit.reshape(-1, 1) / at.sigma)
        low = effect.parameters[0].sigma
        direction = np.array([low, low * random.uniform(0.3, 0.6), _corner(at, name)])
    free = slice(0, 2) if bends else slice(None)
    theta = direction.copy()
    theta[free] *= 1e-2
    for _ in range(4):  # the size follows from the SNR but for what equilibrium bends
        now = snr(at, with_effect(at, entry, theta), also)
        if now < 1e-9 * wanted:
            return None
        theta[free] *= wanted / now
        if np.max(np.abs(theta[free] / direction[free])) > PLAUSIBLE:
            return None
    return Truth(name.effect, name.owner, wanted, name.entry, with_effect(at, entry, theta))


def _corner(at: Setting, name: Hypothesis) -> float:
    """Load at which the compliance bends: a quantile of the loads of the rows."""
    joint = int(name.owner.removeprefix("joint")) - 1
    return float(np.quantile(np.abs(loads(at)[:, joint]), name.entry["corner"]))


def loads(at: Setting) -> FloatArray:
    """(N, n) load about each joint's axis [N m]."""
    model = at.true.error_model
    both = np.asarray(model.loads(at.true.samples(at.poses), model.start, False, 1))
    return both[:, 1 : 2 * at.nominal.joint_count : 2, 5]


def of_size(at: Setting, said: Diagnosis, random: Random) -> Truth:
    """One of the smallest effects that a diagnosis promises to see four times in five."""
    kind = str(random.choice(sorted({s.effect for s in said.smallest})))
    some = [s for s in said.smallest if s.effect == kind]
    told = some[int(random.integers(len(some)))]
    parameter, _, variant = told.parameter.partition(" of ")
    named = [n for n in drawable(at, ()) if n.key == (told.effect, told.owner)]
    name = next(n for n in named if n.variant == variant or not variant)
    (effect,) = build_effects([name.entry], at.true.core)
    theta = np.zeros(len(effect.parameters))
    if variant:
        phase = random.uniform(-np.pi, np.pi)
        theta[:] = told.value * np.array([np.cos(phase), np.sin(phase)])
    else:
        edge = [edge_name(p, geometry=False) for p in effect.parameters]
        k = edge.index(parameter)
        theta[k] = to_si(told.value, edge_unit(effect.parameters[k], geometry=False))
    shift = with_effect(at, name.entry, theta)
    return Truth(name.effect, name.owner, snr(at, shift), name.entry, shift)


def outside_truth(at: Setting, wanted: float, random: Random) -> Truth:
    """A cause that no name of the library has, at the SNR."""
    kind = str(random.choice(OUTSIDE))
    q, n = at.poses.q, at.nominal.joint_count
    if kind == "field":
        x = at.still - at.still.mean(axis=0)
        shift = (x @ random.standard_normal((3, 3)) / 2) ** 2 @ random.standard_normal((3, 3))
        shift *= wanted / snr(at, shift)
        return Truth(kind, "workspace", wanted, {}, shift)
    joint = {"cable": n - 2, "cable_far": 2}.get(kind, int(random.integers(1, n - 1)))
    if kind == "bump":
        centre = np.quantile(q[:, joint], random.uniform(0.25, 0.75))
        curve = np.exp(-(((q[:, joint] - centre) / 0.25) ** 2))
    else:
        a, b = (n - 3, n - 1) if kind == "cable" else (2, 3)
        curve = np.tanh(q[:, a] * q[:, b] / 2)
    entry = {"effect": "regressor", "owner": f"joint{joint + 1}", "column": "hidden", "axis": "rz"}
    hidden = replace(at, poses=replace(at.poses, extra={"hidden": curve}))
    unit = with_effect(hidden, entry, np.array([1e-4]))
    return Truth(kind, f"joint{joint + 1}", wanted, {}, unit * wanted / snr(at, unit))
