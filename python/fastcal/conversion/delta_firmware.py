# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The numbers that the firmware of a delta printer computes with, from an identified one.

Klipper and Marlin think of upright towers on a circle and of one arm a tower between two points. Carriage i of a nozzle
at (x, y, z) then stands at

    h_i = z + e_i + (L_i^2 - (R cos a_i + x_0 - x)^2 - (R sin a_i + y_0 - y)^2)^0.5

L_i the arm's length, R the delta radius (from the nozzle's axis to the arms' upper ends, less the effector's), a_i the
tower's angle, e_i by how much its firmware counts the carriage too high. (x_0, y_0) only moves a print aside, and
a turn about z is in the angles. All are fitted to carriages and points of the robot (least squares over postures within
its limits); what the firmware has no number for, such as towers that lean or a platform that tilts, is left and told.
Sources: klipper3d.org/Delta_Calibrate.html, klippy/kinematics/delta.py; marlinfw.org, M665 and M666.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.robot import se3
from fastcal.robot.loops import closed_within
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

FIRMWARES = ("klipper", "marlin")
TOWERS = 3
_POSTURES, _FEWEST = 2000, 50
_LEAST_RISE = 0.2  # of an arm above the nozzle, over the radius: lower, it is about to fold over
_NOMINAL_DEG = (210.0, 330.0, 90.0)  # Marlin counts its angles from these


@dataclass(frozen=True)
class DeltaNumbers:
    """What a firmware knows of a delta printer, SI.

    Attributes:
        arms: (3,) lengths of the arms [m].
        radius: Delta radius [m].
        angles: (3,) of the towers [rad].
        raised: (3,) e_i, by how much q counts the carriages too high [m].
        left: Root of the mean square of what the firmware's model leaves of a carriage's height [m].
        most: The largest of it [m].
    """

    arms: FloatArray
    radius: float
    angles: FloatArray
    raised: FloatArray
    left: float
    most: float

    @property
    def arm_heights(self) -> FloatArray:
        """(3,) of the carriages above the nozzle at the centre [m]."""
        return np.asarray(np.sqrt(self.arms**2 - self.radius**2))


def delta_numbers(robot: Robot, bed: FloatArray | None = None) -> DeltaNumbers:
    """The numbers of a firmware that come nearest to a printer within its limits.

    Args:
        robot: The printer.
        bed: (3,) rx, ry [rad] and offset [m] of the plane that is z = 0 to the firmware, as `unknowns` of a calibration
            with touches has it; None: z = 0 of the robot.

    Raises:
        InvalidInput: The robot has not three motors that slide.
    """
    motors = [i for i in range(robot.joint_count) if i not in robot.passive]
    if len(motors) != TOWERS or any(robot.joint_types[i] != "prismatic" for i in motors):
        raise InvalidInput(f"expected a delta printer, whose three motors slide on towers; {robot.name} is none")
    low, high = robot.limits.T
    drawn = np.random.default_rng(0).uniform(low, high, (_POSTURES, robot.joint_count))
    q = closed_within(robot.core, drawn, robot.limits)
    point, height = robot.forward(q)[:, :3, 3], q[:, motors]
    towers = np.array([_foot(robot, motor) for motor in motors])
    radius = float(np.linalg.norm(towers, axis=1).mean())
    arm = 2 * radius
    hangs = (height - point[:, 2:] > _LEAST_RISE * radius).all(axis=1) & (np.linalg.norm(point[:, :2], axis=1) < radius)
    point, height = point[hangs], height[hangs]
    if len(point) < _FEWEST:
        raise InvalidInput(
            f"{robot.name}: {len(point)} of {_POSTURES} postures within its limits hang below the towers"
        )
    if bed is not None:
        turn = np.array([[bed[0], bed[1], 0.0]])
        point = point @ se3.rotations_by(turn)[0] - [0.0, 0.0, bed[2]]

    def heights(x: FloatArray) -> FloatArray:
        L, R, a, e, aside = x[:3], x[3], x[4:7], x[7:10], x[10:]
        across = R * np.column_stack([np.cos(a), np.sin(a)]) + aside - point[:, np.newaxis, :2]
        return np.asarray(point[:, 2:] + e + np.sqrt(np.maximum(L**2 - (across**2).sum(axis=2), 0.0)))

    start = np.concatenate([[arm] * 3, [radius], np.arctan2(towers[:, 1], towers[:, 0]), [0.0] * 5])
    scale = np.concatenate([np.full(4, radius), np.ones(3), np.full(5, radius)])
    fitted = optimize.least_squares(
        lambda x: (heights(x * scale) - height).ravel(), start / scale, xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    x = fitted.x * scale
    off = heights(x) - height
    return DeltaNumbers(x[:3], float(x[3]), x[4:7], x[7:10], float(np.sqrt(np.mean(off**2))), float(np.abs(off).max()))


def firmware_text(firmware: str, found: DeltaNumbers, before: DeltaNumbers, endstops_mm: Sequence[float]) -> str:
    """What to put into a firmware's configuration, a comment with what its model leaves at the head.

    A switch stays where it is: the carriage's height there by the old numbers, less what these count too much, is that
    by the new ones.

    Args:
        firmware: klipper or marlin.
        found: Of the identified printer.
        before: Of the printer as the firmware had it when it was measured.
        endstops_mm: Height of the nozzle at the centre with each carriage at its switch, as the firmware had it:
            klipper's position_endstop, Marlin's height less its adjustments; one for all or three.

    Raises:
        InvalidInput: Another firmware, or neither one nor three heights.
    """
    if firmware not in FIRMWARES:
        raise InvalidInput(f"expected {' or '.join(FIRMWARES)} as the firmware, got {firmware!r}")
    if len(endstops_mm) not in (1, TOWERS):
        raise InvalidInput(f"expected one height of the endstops or three, got {len(endstops_mm)}")
    old = to_si(np.broadcast_to(np.asarray(endstops_mm, dtype=float), (TOWERS,)), "mm")
    heights = old + before.arm_heights - found.arm_heights - (found.raised - before.raised)
    left, most = (from_si(value, "mm") for value in (found.left, found.most))
    head = f"leaves {left:.4f} mm of a carriage's height (root of the mean square), {most:.4f} mm at most"
    arms, radius, endstops = (np.asarray(from_si(v, "mm")) for v in (found.arms, found.radius, heights))
    angles = np.asarray(from_si(found.angles, "deg")) % 360
    if firmware == "klipper":
        lines = [f"# {head}", "[printer]", f"delta_radius: {radius:.4f}"]
        for name, arm, angle, endstop in zip("abc", arms, angles, endstops, strict=True):
            lines += [
                f"[stepper_{name}]",
                f"arm_length: {arm:.4f}",
                f"angle: {angle:.4f}",
                f"position_endstop: {endstop:.4f}",
            ]
        return "\n".join(lines) + "\n"
    arm = float(arms.mean())
    off = np.exp(1j * (found.angles - to_si(np.array(_NOMINAL_DEG), "deg")))
    trims = np.asarray(from_si(np.angle(off), "deg"))
    height = float(endstops.max())
    trimmed = " ".join(f"{axis}{trim:.3f}" for axis, trim in zip("XYZ", trims, strict=True))
    rods = " ".join(f"{axis}{length - arm:.3f}" for axis, length in zip("ABC", arms, strict=True))
    switches = " ".join(f"{axis}{endstop - height:.3f}" for axis, endstop in zip("XYZ", endstops, strict=True))
    return f"; {head}\nM665 L{arm:.3f} R{radius:.3f} H{height:.3f} {trimmed} {rods}\nM666 {switches}\nM500\n"


def _foot(robot: Robot, motor: int) -> FloatArray:
    """(2,) where a tower stands, as the file has it."""
    xyz = robot.spec["joints"][motor]["origin"]["xyz_mm"] if robot.kinematics == "urdf" else [0.0, 0.0, 0.0]
    return np.asarray(to_si(np.asarray(xyz[:2], dtype=float), "mm"))
