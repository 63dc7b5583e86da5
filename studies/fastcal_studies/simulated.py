# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the studies' arms have in common: errors that no model of fastcal has, a tracker, and what a model leaves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.evaluation import evaluate
from fastcal.calibration.simulation import simulate
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

WAVES = 3
WORLDS = ("joints", "point", "links")
WORLD_NAMES = {
    "joints": "waves of the joints",
    "point": "waves of the point in the base's axes",
    "links": "waves of the links' tilt and length",
}


@dataclass(frozen=True)
class Unmodelled:
    """Errors that no effect can express: waves over pairs of joints, which grow with the load.

        w_i(q, load) = (1 + growth payload / heaviest) sum_k sin(n_ik . q + p_ik) / sqrt(WAVES)

    n_ik of two joints, orders 1 to 2: what a network is for. In the world of

        joints   e_i = size_i w_i turns joint i. This is the form of `mlp` and `gp`, whose output the Jacobian maps.
        point    d = scale (w_1, w_2, w_3) moves the point in the base's axes: the form of the papers' networks.
        links    d = scale sum_i size_i (z_i |r_i| w_i + r_i w_(n+i)) tilts and stretches the link behind joint i, z_i
                 its axis, r_i from the axis to the point: across what joint i can do, the form of neither.

    Attributes:
        sizes: Of each joint [rad].
        heaviest: Load [kg] at which they have grown by `growth`.
        seed: Of orders and phases.
        world: Of WORLDS.
        scale: See above; `in_world` brings all worlds to the same size.
    """

    sizes: Sequence[float]
    heaviest: float
    growth: float
    seed: int
    world: str = "joints"
    scale: float = 1.0

    def __call__(self, q: FloatArray, payload: FloatArray) -> FloatArray:
        """(N, n) errors of the joints [rad] at q (N, n) [rad] under a payload (N,) [kg]; 0 in other worlds."""
        if self.world != "joints":
            return np.zeros_like(q)
        return np.asarray(self._waves(q, payload, len(self.sizes)) * np.asarray(self.sizes))

    def displacement(self, true: Robot, data: Dataset) -> FloatArray:
        """(N, 3) what else moves the point of the true arm [m], measuring frame; 0 in the world of joints."""
        if self.world == "joints":
            return np.zeros((len(data), 3))
        if self.world == "point":
            R = pose(true.spec["base"])[:3, :3] if "base" in true.spec else np.eye(3)
            return np.asarray(self.scale * self._waves(data.q, data.payload, 3) @ R.T)
        J = true.joint_jacobian(data.q, payload=data.payload)
        z = J[:, 3:]
        r = np.cross(J[:, :3], z, axis=1)
        tilt, stretch = np.split(self._waves(data.q, data.payload, 2 * len(self.sizes)), 2, axis=1)
        moved = z * np.linalg.norm(r, axis=1, keepdims=True) * tilt[:, np.newaxis] + r * stretch[:, np.newaxis]
        return np.asarray(self.scale * moved @ np.asarray(self.sizes))

    def _waves(self, q: FloatArray, payload: FloatArray, count: int) -> FloatArray:
        """(N, count)."""
        random = np.random.default_rng((self.seed, 11))
        w = np.zeros((len(q), count))
        n = q.shape[1]
        for k in range(count):
            for _ in range(WAVES):
                orders = np.zeros(n)
                orders[random.permutation(n)[:2]] = random.integers(1, 3, 2) * random.choice([-1, 1], 2)
                w[:, k] += np.sin(q @ orders + random.uniform(0, 2 * np.pi)) / WAVES**0.5
        return w * (1 + self.growth * payload / self.heaviest)[:, np.newaxis]


def in_world(outside: Unmodelled, world: str, true: Robot, at: Dataset) -> Unmodelled:
    """The waves of another world that move the point of the true arm by the same RMS over the rows `at`."""
    J = true.joint_jacobian(at.q, payload=at.payload)[:, :3]
    wanted = np.einsum("nij,nj->ni", J, outside(at.q, at.payload))
    if world == "joints" or not any(outside.sizes):
        return outside
    other = replace(outside, world=world)
    return replace(other, scale=float(np.linalg.norm(wanted) / np.linalg.norm(other.displacement(true, at))))


def measure(true: Robot, sent: Dataset, outside: Unmodelled, noise: float, seed: int) -> Dataset:
    """What a tracker with `noise` [m] a coordinate sees of the true arm at the commands and loads of `sent`."""
    moved = replace(sent, q=sent.q + outside(sent.q, sent.payload))
    seen = simulate(true, moved, noise=noise, seed=seed)
    if outside.world != "joints" and seen.position is not None:
        seen = replace(seen, position=seen.position + outside.displacement(true, sent))
    return replace(seen, q=sent.q)


def at_one_place(data: Dataset) -> Dataset:
    """The rows labelled as what they are, one set-up of tracker and target: no fit has to look for a move of them."""
    still = np.zeros(len(data), dtype=np.intp)
    return replace(data, station=still, station_names=("tracker",), mount=still, mount_names=("target",))


def left(model: Robot, data: Dataset) -> FloatArray:
    """(N, 3) measured less predicted point [m], in the axes of the model's base: what a network has to give."""
    return -evaluate(model, data).error_after @ pose(model.spec["base"])[:3, :3]


def row_numbers(robot: Robot, names: Iterable[str]) -> dict[str, float]:
    """The numbers of a robot's rows among `names`, "joint2 a_mm" [mm, deg]; those of base and tool are left out."""
    out = {}
    for name in names:
        owner, key = name.split(" ")
        if owner.startswith("joint"):
            out[name] = float(robot.spec["joints"][int(owner.removeprefix("joint")) - 1].get(key, 0.0))
    return out
