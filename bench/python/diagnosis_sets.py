# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Simulated measurements whose missing cause is known: what `bench_diagnosis` asks `diagnose` about.

A set is an arm as a workshop would build and measure it (`diagnosis_arms`): geometry off by 0.5 mm and 0.5 mrad, links
off by 6 % and 10 mm, poses with payloads, directions of approach, side pulls, a temperature and a clock, an
instrument's noise. A cause has the wanted SNR: the root of |P W d|^2, d what it moves the points by, W 1/sigma, P what
geometry, base and tool leave.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from diagnosis_arms import Setting, noise_of, stopped
from numpy.typing import NDArray

from fastcal import Robot
from fastcal.diagnosis import Diagnosis
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import build_library
from fastcal.effects.entries import build_effects, edge_name, edge_unit
from fastcal.effects.values import written_parameters
from fastcal.measurements.dataset import Dataset
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
Random = np.random.Generator

OUTSIDE = ("cable", "cable_far", "field", "bump", "last_move", "sway")
PLAUSIBLE = 60.0  # sizes: a cause that would have to be larger for its SNR is not drawn
ABSORBED = ("measurement_scale", "payload_mass", "payload_com")  # nothing by themselves: geometry or no compliance


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


def points_of(at: Setting, truths: Sequence[Truth]) -> FloatArray:
    """(N, 3) where the points are [m]; causes add up to first order beside the exact shift of each."""
    return np.asarray(at.still + sum((t.shift for t in truths), np.zeros_like(at.still)))


def measured(at: Setting, truths: Sequence[Truth], random: Random) -> Dataset:
    """The rows that are diagnosed, with what the tracker says."""
    halted = stopped(at.poses, at.joints, random)
    points = points_of(at, truths) + at.true.poses(halted)[:, :3, 3] - at.still
    seen = replace(at.poses, position=points + noise_of(at.noise, points, random))
    return seen.select(np.arange(at.count))


def snr(at: Setting, shift: FloatArray, also: FloatArray | None = None) -> float:
    """Root of the noncentrality of a shift (N, 3), after geometry and the columns `also` (3N, k)."""
    d = _left(at, shift[: at.count].reshape(-1, 1) / at.sigma)
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
    rows = replace(at.poses, position=at.still).select(np.arange(at.count))
    known = build_library(at.complete, rows).names
    return [n for n in known if n.effect not in but and (at.has_masses or not _is_hidden(n, at))]


def _is_hidden(name: Hypothesis, at: Setting) -> bool:
    """Does it take a table of masses to name it? Of what follows loads, only a joint that yields needs none."""
    (effect,) = build_effects([{k: v for k, v in name.entry.items() if k != "corner"}], at.true.core)
    return bool(effect.follows_loads) and name.effect != "joint_compliance"


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
        also = _left(at, unit[: at.count].reshape(-1, 1) / at.sigma)
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
    elif kind == "last_move":  # the joint stops short of where it came from, the more the further it is bent
        came = np.sign(np.diff(q[:, joint], prepend=q[0, joint]))
        curve = came * (1 + np.sin(q[:, joint])) / 2
    elif kind == "sway":  # a pedestal that leans to where the arm reaches
        curve = np.sin(q[:, 0]) * np.cos(q[:, 1])
    else:
        a, b = (n - 3, n - 1) if kind == "cable" else (2, 3)
        curve = np.tanh(q[:, a] * q[:, b] / 2)
    owner = "base" if kind == "sway" else f"joint{joint + 1}"
    entry = {"effect": "regressor", "owner": owner, "column": "hidden", "axis": "rx" if kind == "sway" else "rz"}
    hidden = replace(at, poses=replace(at.poses, extra={"hidden": curve}))
    unit = with_effect(hidden, entry, np.array([1e-4]))
    return Truth(kind, owner, wanted, {}, unit * wanted / snr(at, unit))
