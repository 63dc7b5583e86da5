# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A robot program with its targets changed so that the calibrated robot goes where the program intends.

A target is a pose of the controller's nominal robot. With q_n its joints there, q_c the joints that bring the
identified robot's flange to the same pose, a joint target becomes q_c, and a cartesian one the pose f_nominal(q_c): the
controller, which only knows nominal kinematics, then commands q_c by itself. The way back: q_c are the controller's
joints at the targets of a compensated program, and q_n those that bring its nominal robot's flange to
f_identified(q_c).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.compensation.carried import left_by_other_loads, payloads
from fastcal.compensation.commands import METHODS, deviation, notes_on_ranges
from fastcal.compensation.configurations import Configurations, at_axes
from fastcal.compensation.motion import at_rest
from fastcal.compensation.one_step import one_step
from fastcal.compensation.places import Places, TargetRefused
from fastcal.compensation.singular_targets import command_by_small_moves, left_to_the_bars
from fastcal.effects.entries import traits_of
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.measurements.last_moves import directions, last_moves
from fastcal.programs import Cell, Document, Move, Program, Target, Word, doubts_on_joints, stamp
from fastcal.robot import se3
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot
from fastcal.robot.steady import steady
from fastcal.units import from_si, to_si

_REACHED = 1e-7  # m, and entries of a rotation
_SAME_POSTURE = 1e-3  # rad or m
_PASSES = 4  # of the way back
_MOST_TURN = to_si(10.0, "deg")  # by which a target that is given as joints may be corrected


class AlreadyCompensated(InvalidInput):
    """A program that says that it was compensated."""


@dataclass(frozen=True, eq=False)
class CompensatedProgram:
    """A program and what was done to it.

    Attributes:
        documents: Its files, in which nothing but numbers of targets (and words of their configuration) changed, and a
            comment that says so.
        targets: Those of the program that were changed.
        nominal_q: (N, n) joint positions of the controller's robot at each target as it was given [rad or m].
        q: (N, n) what it is commanded instead.
        shift: (N, 6) by how much each target's own tool is sent elsewhere: m along, and a rotation vector in rad about,
            the axes of the robot's base.
        error: (N,) distance [m] by which the tool would miss each nominal target without compensation.
        sigma: (N,) deviation [m] of a coordinate of the model's own point there, the root mean square of the
            three; NaN where the model does not know it.
        payload: (N,) that each is corrected for [kg].
        left: Targets and moves that are left as they are because they were not understood, a sentence each.
        assumed: What the program does not say and is taken for granted, a sentence each.
        notes: What else to know, a sentence each.
    """

    documents: tuple[Document, ...]
    targets: tuple[Target, ...]
    nominal_q: FloatArray
    q: FloatArray
    shift: FloatArray
    error: FloatArray
    sigma: FloatArray
    payload: FloatArray
    left: tuple[str, ...]
    assumed: tuple[str, ...]
    notes: tuple[str, ...]


def compensate_program(
    model: Robot,
    program: Program,
    *,
    cell: Cell | None = None,
    nominal: Robot | None = None,
    method: str = "full",
    inverse: bool = False,
    again: bool = False,
    threads: int = 1,
    **conditions: Any,
) -> CompensatedProgram:
    """Changes the targets of a program so that the calibrated robot reaches them; or a program so changed back.

    A comment in the program says that it was compensated, by which model and when; going back takes it away.

    Args:
        model: A calibrated robot.
        program: As `fastcal.programs.read_program` gives it.
        cell: Tools, frames and where base and flange are, where the program does not define them.
        nominal: What the controller believes; None: what the model keeps of it.
        method: `full` or `one-step`, as in `compensate`.
        inverse: The program is compensated: each target becomes the one where the real tool goes.
        again: Compensate a program that says that it was compensated already.
        threads: Cores; the result does not depend on it.
        **conditions: payload [kg], temperature [K] ... of the whole program, in which nothing lags behind that one
            temperature; approach and move are taken from the moves, and so is a payload that is not given.

    Raises:
        ParseError: A target cannot be reached; names the line.
        InvalidInput: The program has no targets whose use and posture are understood, or other joints than the robot,
            or it was compensated already.
    """
    if method not in METHODS:
        raise InvalidInput(f"method must be {' or '.join(METHODS)}, got '{method}'")
    if inverse and method != "full":
        raise InvalidInput("the inverse needs method='full': one step has no exact inverse")
    if not (inverse or again) and (found := stamp.stamped_line(program)):
        raise AlreadyCompensated(f"{found[0]}:{found[1]}: this program says that it was compensated already")
    program.check_targets()
    robot = robot_without_measurement(model)
    conditions = {**steady(robot), **conditions}
    places, q_given, assumed = _understood(Places(robot, nominal_robot(robot, nominal), program, cell or Cell()))
    program, notes = places.program, []
    order = _order(program)
    loads = payloads(places, q_given, _moves(q_given, order) | conditions)
    conditions["payload"] = loads.mass
    if inverse:
        q = _brought_back(places, q_given, order, conditions, threads)
        q_nominal = q
        conditions = _moves(q, order) | conditions
    else:
        q_nominal = q_given
        conditions = _moves(q_nominal, order) | conditions
        q, singular = _compensated(places, q_nominal, method, conditions, threads)
        notes += singular
    poses = places.nominal.forward(q_nominal)
    changes, change_notes = _changes(places, q_given, q)
    if nominal is None and not model.description.calibration:
        notes.append(f"{model.name} holds no calibration: its own geometry is taken as the controller's model")
    notes += [*_on_the_arm(model, program), *program.notes, *loads.notes, *change_notes]
    notes += notes_on_ranges(robot, q, conditions)
    if not inverse:
        notes += left_by_other_loads(places, loads, q_nominal, q, conditions)
        notes += _offsets(places, q_nominal, q, conditions)
    error = np.array(
        [
            np.linalg.norm((places.tool_at(i, got) - places.tool_at(i, wanted))[:3, 3])
            for i, (got, wanted) in enumerate(zip(robot.forward(q_nominal, **conditions), poses, strict=True))
        ]
    )
    shift = _shifts(places, places.nominal.forward(q_given), places.nominal.forward(q))
    left = tuple(map(program.said, program.left))
    serial = model.made_by.get("serial")
    says = None if inverse else stamp.text(model.sha256, serial, _core.__version__)
    return CompensatedProgram(
        stamp.stamped(program.rewritten(changes), program.language.name, says),
        *(program.targets, q_given, np.asarray(q), shift, error, deviation(robot, q, conditions)),
        loads.mass,
        tuple(dict.fromkeys(left)),
        (*assumed, *loads.assumed),
        tuple(dict.fromkeys(notes)),
    )


def _compensated(
    places: Places, q_nominal: FloatArray, method: str, conditions: dict[str, Any], threads: int
) -> tuple[FloatArray, list[str]]:
    """(N, n) joints that bring the real tool where the nominal robot has it at q_nominal; notes on singular ones."""
    poses = places.nominal.forward(q_nominal)
    found = inverse_kinematics(places.robot, poses, seed=q_nominal, restarts=0, threads=threads, **conditions)
    q, notes = np.array(found.q), left_to_the_bars(places.robot, found)
    for i, target in enumerate(places.program.targets):
        swings = target.kind == "joints" and np.abs(_turns(places.nominal, q[i] - q_nominal[i])).max() > _MOST_TURN
        if found.reached[i] and not swings:
            continue
        own = _of_target(conditions, i, len(q))
        near = command_by_small_moves(places.robot, places.nominal, poses[i : i + 1], q_nominal[i : i + 1], **own)
        if near is None:
            if found.reached[i]:
                continue
            _refuse(places.program, target, found.message(i))
        q[i], left = near[0][0], near[1]
        far, turned = from_si(float(np.linalg.norm(left[:3])), "mm"), from_si(float(np.linalg.norm(left[3:])), "deg")
        notes.append(
            f"{places.program.place(target)}: {target.name} lies in a singular posture and is corrected as far as "
            f"small moves of the joints can; {far:.3f} mm and {turned:.3f} deg are left there"
        )
    if method == "one-step":
        return one_step(places.robot, places.nominal, poses, q_nominal, **conditions), notes
    return q, notes


def _turns(robot: Robot, moved: FloatArray) -> FloatArray:
    """What of the moves of joints is a turn [rad]; 0 for slides."""
    return np.where(np.array(robot.joint_types) == "revolute", moved, 0.0)


def _brought_back(
    places: Places, q_given: FloatArray, order: Sequence[int], conditions: dict[str, Any], threads: int
) -> FloatArray:
    """(N, n) joints of the nominal robot where the real tool is at the commands q_given.

    How joints come to a target is taken from the nominal joints, which are looked for: a second pass has the sides,
    and each further one the moves closer by the share of a move that settles.
    """
    q = q_given
    for _ in range(_PASSES):
        real = places.robot.forward(q_given, **(_moves(q, order) | conditions))
        found = inverse_kinematics(places.nominal, real, seed=q_given, restarts=0, threads=threads)
        for i, target in enumerate(places.program.targets):
            if not found.reached[i]:
                _refuse(places.program, target, f"where the real robot goes, for the nominal robot {found.message(i)}")
        q = found.q
    return q


def _shifts(places: Places, before: FloatArray, after: FloatArray) -> FloatArray:
    """(N, 6) from one pose of the targets' own tools to another, in the axes of the robot's base."""
    R = places.T_world_base[:3, :3].T
    out = np.zeros((len(before), 6))
    for i, (old, new) in enumerate(zip(before, after, strict=True)):
        a, b = places.tool_at(i, old), places.tool_at(i, new)
        out[i, :3] = R @ (b - a)[:3, 3]
        out[i, 3:] = R @ np.asarray(_core.log_so3(b[:3, :3] @ a[:3, :3].T))
    return out


def _on_the_arm(model: Robot, program: Program) -> list[str]:
    """How the controller may count otherwise than the file, and where the arm of a URDF ends."""
    notes = []
    if model.description.pendant is None and any(target.kind == "joints" for target in program.targets):
        notes += doubts_on_joints(program.documents[0].name, model.name)
    if tip := model.description.source.get("tip_link"):
        notes.append(f"{model.name} ends at the link {tip} of its URDF, from which the tools of the program are told")
    return notes


def robot_without_measurement(model: Robot) -> Robot:
    """The model without the effects of the instrument and the set-up: the controller meets the robot alone."""
    effects = [e for e in model.entries if not traits_of(e["effect"]).of_the_measurement]
    return model.with_(effects=effects)


def _order(program: Program) -> list[int]:
    """The targets as the moves come upon them in the text; those that no move uses at the end."""
    return list(dict.fromkeys([*(move.target for move in program.moves), *range(len(program.targets))]))


def _understood(places: Places) -> tuple[Places, FloatArray, tuple[str, ...]]:
    """The targets whose tool, frame and posture are known, the controller's joints (N, n) there, what is assumed."""
    places = places.leaving(places.frames.left)
    configurations = Configurations(places.nominal, places.program.language)
    start, assumed = _start(places, configurations)
    q, left = _nominal_joints(places, configurations, start)
    return places.leaving(left), np.delete(q, sorted(left), axis=0), assumed


def _start(places: Places, configurations: Configurations) -> tuple[FloatArray | None, tuple[str, ...]]:
    """The joints where the arm stands when the program begins, None where they are not known; what is assumed.

    A script of poses alone, in a language without words for postures, would be left as a whole: there the posture
    nearest to the middle of the joints' ranges is assumed for the first pose.
    """
    program = places.program
    stated = any(target.kind == "joints" for target in program.targets) or any(m.near for m in program.moves)
    if places.cell.start is not None:
        count = places.nominal.pendant.axis_count
        if len(places.cell.start) != count:
            raise InvalidInput(f"start_deg: expected {count} joints, as {places.nominal.name} has")
        return at_axes(places.nominal, places.cell.start), ()
    if program.language.names_postures or stated or not program.moves:
        return None, ()
    first = program.targets[program.moves[0].target]
    middle = configurations.middle
    T = places.world(program.moves[0].target, program.language.pose(first.values))
    found, count = configurations.nearest(T, middle)
    sentence = (
        f"{program.place(first)}: nothing in the program says in which of {count} postures the arm comes to "
        f"{first.name}; of them the one nearest to the middle of its joints is taken; a cell file's start_deg decides"
    )
    return found, (sentence,) if count > 1 else ()


def _nominal_joints(
    places: Places, configurations: Configurations, start: FloatArray | None
) -> tuple[FloatArray, dict[int, str]]:
    """(N, n) joint positions of the controller's robot at the targets; why a target's posture is not known."""
    program, nominal = places.program, places.nominal
    q = np.full((len(program.targets), nominal.joint_count), np.nan)
    left: dict[int, str] = {}
    for i, target in enumerate(program.targets):
        if target.kind == "joints":
            _check_joints(program, target, nominal)
            q[i] = at_axes(nominal, target.values)
    poses = [i for i, target in enumerate(program.targets) if target.kind == "pose"]
    wanted = {i: places.world(i, program.language.pose(program.targets[i].values)) for i in poses}
    before = start
    for move in _visits(program):
        i = move.target
        before = None if move.afresh else before
        if i in wanted and i not in left:
            found, why = configurations.solve(program.targets[i], wanted[i], before, move)
            if found is None:
                left[i] = why
            elif np.abs(wanted[i] - nominal.forward(found[np.newaxis])[0]).max() > _REACHED:
                missed = inverse_kinematics(nominal, wanted[i], seed=found)
                _refuse(program, program.targets[i], f"for the nominal robot {missed.message(0)}")
            elif np.isnan(q[i]).any():
                q[i] = found
            elif np.abs(found - q[i]).max() > _SAME_POSTURE:
                left[i] = "its moves come to it in different postures"
        before = None if i in left else q[i]
    return q, left


def _visits(program: Program) -> list[Move]:
    """The moves, and behind them one to each target that no move uses."""
    unused = sorted(set(range(len(program.targets))) - {move.target for move in program.moves})
    return [*program.moves, *(Move(i, 0, program.targets[i].line) for i in unused)]


def _check_joints(program: Program, target: Target, nominal: Robot) -> None:
    wanted, count = nominal.pendant.axis_count, len(target.numbers)
    if count != wanted:
        _refuse(program, target, f"expected {wanted} joints, as {nominal.name} has, got {count}")
    kinds = {nominal.pendant.axis(joint): kind for joint, kind in enumerate(nominal.joint_types)}
    for joint, number in enumerate(target.numbers, start=1):
        kind = kinds.get(joint - 1, "revolute")
        if (number.unit in ("mm", "m")) != (kind == "prismatic"):
            _refuse(program, target, f"joint {joint} of {nominal.name} is {kind}, but it is given in {number.unit}")


def _moves(q: FloatArray, order: Sequence[int]) -> dict[str, FloatArray]:
    """Conditions `approach` and `move` (N, n) of targets that are reached in the program's order."""
    move, approach = np.zeros_like(q), np.zeros_like(q)
    move[order] = last_moves(at_rest(q[order]), None)
    approach[order] = directions(move[order])
    return {"approach": approach, "move": move}


def _changes(places: Places, q_nominal: FloatArray, q: FloatArray) -> tuple[list[tuple[Word, str]], list[str]]:
    """The new text of every target, and notes on configurations whose words had to change."""
    program, language = places.program, places.program.language
    arm = Configurations(places.nominal, language).arm
    changes: list[tuple[Word, str]] = []
    notes = []
    poses = places.nominal.forward(q)
    for i, target in enumerate(program.targets):
        if target.kind == "joints":
            values = places.nominal.pendant.shown(q[i])
        else:
            values = language.values(places.in_frame(i, poses[i]), target.values)
        pairs = zip(target.numbers, values, strict=True)
        changes += [(number, language.number(number, float(value))) for number, value in pairs]
        if not target.words or not arm.has_configurations:
            continue
        had, has = language.words(target, q_nominal[i], arm), language.words(target, q[i], arm)
        for name, word in target.words.items():
            if had.get(name) == word.text != has.get(name):
                changes.append((word, has[name]))
                place = program.place(target)
                notes.append(f"{place}: {target.name}: {name} {word.text} becomes {has[name]}, as a joint crosses it")
    return changes, notes


def _offsets(places: Places, q_nominal: FloatArray, q: FloatArray, conditions: dict[str, Any]) -> list[str]:
    """What is left where a move adds something to a target, which carries the target's correction along."""
    program, language = places.program, places.program.language
    notes = []
    for move in program.moves:
        if move.offset is None:
            continue
        target = program.targets[move.target]
        where = f"{program.documents[move.document].name}:{move.line}: {target.name} is shifted at run time"
        if math.nan in move.offset or not np.isfinite(move.offset).all() or target.kind == "joints":
            notes.append(f"{where}; there the correction of {target.name} itself holds")
            continue
        shift = se3.pose(position=move.offset)
        wanted = places.world(move.target, shift @ language.pose(target.values))
        T_frame_tool = places.in_frame(move.target, places.nominal.forward(q[move.target])[0])
        commanded = places.world(move.target, shift @ T_frame_tool)
        joints = inverse_kinematics(places.nominal, commanded, seed=q[move.target], restarts=0).q
        own = _of_target(conditions, move.target, len(q))
        got = places.robot.forward(joints, **own)[0]
        left = np.linalg.norm((places.tool_at(move.target, got) - places.tool_at(move.target, wanted))[:3, 3])
        notes.append(
            f"{where}; with the correction of {target.name} {from_si(float(left), 'mm'):.3f} mm are left there"
        )
    return notes


def _of_target(conditions: dict[str, Any], row: int, count: int) -> dict[str, Any]:
    """The conditions of one target: of those that every target has its own of, as the approach, that one's."""
    own = dict(conditions)
    for name, value in conditions.items():
        array = np.asarray(value)
        if (array.ndim == 2 or name == "payload") and len(array) == count:
            own[name] = array[row : row + 1]
    return own


def _refuse(program: Program, target: Target, sentence: str) -> NoReturn:
    document = program.documents[target.numbers[0].document]
    refused = TargetRefused(f"{target.name}: {sentence}", document.name, target.line)
    refused.target = target
    raise refused
