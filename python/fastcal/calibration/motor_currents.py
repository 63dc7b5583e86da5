# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The currents with which motors hold an arm: what a simulation gives `current_compliance`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]


def motor_currents(
    robot: Robot,
    data: Dataset,
    torque_per_ampere: ArrayLike,
    *,
    friction: ArrayLike = 0.0,
    seed: int = 0,
    threads: int = 1,
) -> FloatArray:
    """Currents (N, n) [A] of motors that hold each row: I_i = (tau_i + F_i s_i) / K_i.

    tau_i is what all weights and wrenches put on joint i, its effects at equilibrium, so that a joint of compliance c
    has c_i = c K_i in `current_compliance`. s_i is the side from which it came: its `approach`, at random where none is
    known.

    Args:
        robot: With the masses of its links.
        data: Postures, loads, and approach directions.
        torque_per_ampere: K of all motors or of each, gear included [N m/A, of a slide N/A]; below 0 where the motor
            counts the other way.
        friction: F, Coulomb's, of all joints or of each [N m, of a slide N].
        seed: Of the sides that are not known.
        threads: Cores to use.

    Raises:
        InvalidInput: A number is invalid, or loops hold the arm, whose loads no motor alone carries.
    """
    factor, slip = np.asarray(torque_per_ampere, dtype=float), np.asarray(friction, dtype=float)
    for name, values, allowed in (
        ("torque_per_ampere", factor, factor != 0),
        ("friction", slip, slip >= 0),
    ):
        if values.shape not in ((), (robot.joint_count,)) or not (np.isfinite(values) & allowed).all():
            what = "not 0" if name == "torque_per_ampere" else "of at least 0"
            raise InvalidInput(f"{name} must be one number or {robot.joint_count}, {what}, got {values.tolist()}")
    if robot.passive:
        raise InvalidInput(f"motor currents are simulated of arms without closed loops, and {robot.name} has one")
    model = robot.error_model
    loads = np.asarray(model.loads(robot.samples(data), model.start, False, threads))
    axis = [5 if kind == "revolute" else 2 for kind in robot.joint_types]
    torque = loads[:, 2 * np.arange(robot.joint_count) + 1, axis]
    side = np.random.default_rng((seed, 5)).choice([-1.0, 1.0], torque.shape)
    if data.approach is not None:
        side = np.where(data.approach == 0, side, data.approach)
    return np.asarray((torque + slip * side) / factor)
