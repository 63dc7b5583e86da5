# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The ISO 9283 test as a robot program, and the list of its visits by which the measured rows are matched.

Thirty cycles P5 P4 P3 P2 P1, so that each pose is always approached from the one before: AP, RP and, from P2 and P4,
AD and RD. For vAP, P1, P2 and P4 are visited thirty times from each of three directions, those of the base's axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fastcal.acceptance.cube import POSES, Cube, largest_cube
from fastcal.arrays import FloatArray
from fastcal.compensation.programs import robot_without_measurement
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.measurements.last_moves import last_moves
from fastcal.programs import Document, doubts_on_joints
from fastcal.programs.measuring import Cycles, Stop, as_written, write_cycles
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot
from fastcal.robot.steady import assumed_temperature, steady, warmed
from fastcal.units import from_si

CYCLES = 30
_ORDER = (4, 3, 2, 1, 0)  # P5, P4, P3, P2, P1
_FROM_THREE_SIDES = (0, 1, 3)  # P1, P2, P4
_SIDES = ("x", "y", "z")
_APPROACH = 0.1  # of the cube's edge


@dataclass(frozen=True, eq=False)
class Visit:
    """One measured stop: its pose, the side it is approached from (empty: from the pose before), its cycle from 1."""

    pose: str
    direction: str
    cycle: int


@dataclass(frozen=True, eq=False)
class AcceptancePlan:
    """A test as it is to be driven and measured.

    Attributes:
        cube: In the robot's base.
        documents: The program's files.
        visits: In the order in which they are measured.
        q: (N, n) what is commanded at each visit, as the program's own digits say [rad or m].
        approach: (N, n) direction in which each joint arrives.
        commanded: (N, 4, 4) T_base_tool that each visit is to reach.
        payload: [kg].
        temperature: [K] that the commands are made for; None where they do not depend on it.
        compensated: Do the commands bring the calibrated arm there, or the controller's nominal one?
        notes: What a reader should know.
    """

    cube: Cube
    documents: tuple[Document, ...]
    visits: tuple[Visit, ...]
    q: FloatArray
    approach: FloatArray
    commanded: FloatArray
    payload: float
    temperature: float | None
    compensated: bool
    notes: tuple[str, ...]


def plan_acceptance(
    model: Robot,
    *,
    language: str,
    program: str,
    compensate: bool = False,
    directions: bool = False,
    cycles: int = CYCLES,
    centre: FloatArray | None = None,
    edge: float | None = None,
    rotation: FloatArray | None = None,
    payload: float = 0.0,
    temperature: float | None = None,
    dwell_s: float = 3.0,
    speed: float = 0.5,
) -> AcceptancePlan:
    """Places the cube, solves its poses and writes the program.

    Args:
        model: A calibrated model, or a nominal robot.
        language: `rapid`, `krl`, `fanuc` or `urscript`.
        program: The file that it will be; gives the program its name.
        compensate: Command what brings the calibrated arm to the poses; False: what the controller itself would.
        directions: Also the approaches from three sides, for vAP.
        cycles: Thirty, as the standard has it, or fewer.
        centre: (3,) of the cube in the base [m]; None: where the largest one lies.
        edge: Of the cube [m].
        rotation: (3, 3) of the tool in the base, in all poses.
        payload: Mass at the tool during the test [kg].
        temperature: Of the arm during the test [K], which no effect lags behind; None: the middle of what the model was
            fitted on.
        dwell_s: Wait at each measured stop [s].
        speed: Share of the greatest speed.

    Raises:
        InvalidInput: No such cube is reached, or the language can't hold the arm.
    """
    controller = nominal_robot(model)
    cube, q = largest_cube(controller, centre=centre, edge=edge, rotation=rotation)
    points, names, loops, measured = _route(cube, cycles, directions)
    poses = cube.poses(points)
    q_nominal = _solved(controller, poses, np.vstack([q, q[_seeds(len(points))]]), names)
    stops = [stop for count, several in loops for _ in range(count) for stop in several]
    order = [stop.target for stop in stops]
    arrivals = _arrivals(q_nominal, order)
    is_measured = np.array([stop.is_measured for stop in stops])
    q = q_nominal
    notes: list[str] = []
    if compensate:
        # One command a pose, from whichever side it is reached: that of its first visit.
        first = [next(i for i, stop in enumerate(stops) if stop.target == at) for at in range(len(names))]
        first[0] = next(i for i, stop in enumerate(stops) if stop.target == 0 and stop.is_measured)
        arm = robot_without_measurement(model)
        temperature, notes = assumed(arm, temperature)
        known = {"approach": arrivals[first], "move": last_moves(q_nominal[order], None)[first], **steady(arm)}
        q = _solved(arm, poses, q_nominal, names, payload=payload, temperature=temperature, **known)
    else:
        temperature = None
    comment = ["ISO 9283 test by fastcal", f"arm: {model.name[:40]}", f"measured stops: {len(measured)}"]
    comment.append("targets are compensated" if compensate else "targets are not compensated")
    shown = model.pendant.shown(q)
    documents = write_cycles(language, program, Cycles(names, shown, loops, dwell_s, speed, comment))
    at = [stop.target for stop in stops if stop.is_measured]
    if not model.description.pendant:
        notes += doubts_on_joints(documents[0].name, model.name)
    if cycles < CYCLES:
        notes.append(f"{cycles} cycles are fewer than the {CYCLES} of ISO 9283")
    driven = as_written(documents, [stop for _, several in loops for stop in several], shown)
    written = model.follow(model.pendant.chain(driven))[at]
    return AcceptancePlan(
        cube,
        documents,
        measured,
        written,
        arrivals[is_measured],
        poses[at],
        payload,
        temperature,
        compensate,
        tuple(notes),
    )


def assumed(arm: Robot, given: float | None) -> tuple[float | None, list[str]]:
    """[K] The temperature of the commands, None where no effect of the arm asks for it, and a note on its choice."""
    asking = warmed(arm)
    if not asking or given is not None:
        return (given if asking else None), []
    if arm.record is None:
        raise InvalidInput(
            f"{asking[0]} needs the temperature of the test: {arm.name} holds no calibration to take it from"
        )
    return arm.record.temperature, [f"{', '.join(asking)}: the commands are for {assumed_temperature(arm.record)}"]


def _seeds(count: int) -> list[int]:
    """Which of P1 ... P5 each further target lies beside."""
    return [_FROM_THREE_SIDES[i // len(_SIDES)] for i in range(count - len(POSES))]


def _route(
    cube: Cube, cycles: int, directions: bool
) -> tuple[FloatArray, list[str], list[tuple[int, list[Stop]]], tuple[Visit, ...]]:
    """Points (K, 3) of all targets, their names, the loops over them and the measured visits."""
    if cycles < 1:
        raise InvalidInput(f"cycles must be at least 1, got {cycles}")
    points, names = cube.points, list(POSES)
    # The first move goes to P1, from which the cycle begins and where it ends.
    loops = [(1, [Stop(0, False)]), (cycles, [Stop(at, True) for at in _ORDER])]
    visits = [Visit(POSES[at], "", cycle + 1) for cycle in range(cycles) for at in _ORDER]
    if directions:
        stops = []
        for at in _FROM_THREE_SIDES:
            for axis, side in enumerate(_SIDES):
                # Outwards would leave the cube: from the side where the middle is.
                towards = np.sign(cube.centre - points[at])[axis] or 1.0
                points = np.vstack([points, points[at] + towards * _APPROACH * cube.edge * np.eye(3)[axis]])
                names.append(f"{POSES[at]}{side}")
                stops += [Stop(len(names) - 1, False), Stop(at, True)]
        loops.append((cycles, stops))
        visits += [
            Visit(POSES[at], side, cycle + 1) for cycle in range(cycles) for at in _FROM_THREE_SIDES for side in _SIDES
        ]
    return points, names, loops, tuple(visits)


def _solved(robot: Robot, poses: FloatArray, seed: FloatArray, names: Sequence[str], **conditions: Any) -> FloatArray:
    """(K, n) joints at poses (K, 4, 4) in the base, in the seeds' configuration."""
    T_world_base, _ = robot.core.base_and_tool(robot.core.nominal)
    found = inverse_kinematics(robot, T_world_base @ poses, seed=seed, restarts=0, **conditions)
    for i, name in enumerate(names):
        if not found.reached[i]:
            x, y, z = from_si(poses[i, :3, 3], "mm")
            raise InvalidInput(f"{robot.name}, {name} at {x:.1f}, {y:.1f}, {z:.1f} mm: {found.message(i)}")
    return found.q


def _arrivals(q: FloatArray, order: Sequence[int]) -> FloatArray:
    """(M, n) the direction in which each joint last moved when the targets `order` of joints q (K, n) are reached.

    Where a joint has not moved yet, it arrives as in its first move.
    """
    moved = np.sign([q[now] - q[before] for before, now in pairwise(order)])
    out = np.zeros((len(order), q.shape[1]))
    for i, signs in enumerate(moved, start=1):
        out[i] = np.where(signs == 0, out[i - 1], signs)
    return out
