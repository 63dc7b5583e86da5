# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks of the measurements before they are used: misinterpreted columns, joint positions read back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.evaluation import Evaluation, distances
from fastcal.calibration.result import IdentifiedParameter
from fastcal.calibration.unknowns import CORNERS
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.motor_readings import plausible_motors
from fastcal.measurements.plausibility import plausible
from fastcal.robot.loops import assemble
from fastcal.robot.robot import Robot
from fastcal.said import Said, joined, said
from fastcal.units import from_si, to_si

FloatArray = NDArray[np.float64]

BAD_SHARE = 0.01  # of the reach; calibrated arms miss by a thousandth at most
LEFT = 1e-3  # of the reach; calibrated arms of the right lengths miss by less, whatever is missing
MOVED = 0.15  # of the reach, of one length: more than any drawing is wrong by
BAD_PICTURE = 0.01  # of a picture's width; calibrated cameras miss by a thousandth at most
LEFT_PICTURE = 4e-3  # of a picture's width; calibrated arms miss by less, but for slack joints
BAD_TURN = to_si(5.0, "deg")  # calibrated arms and cameras miss by a degree at most
COOLEST_F, HOTTEST_F = 50.0, 120.0  # degrees Fahrenheit of a workshop, 10 to 49 degC
BESIDE_K = 10.0  # by which rows read as Fahrenheit may lie beyond the other rows
ACCEPT = said("--as-read (in Python as_read=True) accepts the columns as they are")


def check_columns(robot: Robot, data: Dataset, *, as_read: bool = False) -> list[str]:
    """Refuses columns that were probably meant otherwise; with `as_read`, a note says so instead.

    Raises:
        InvalidInput: Another reading of the columns fits at least five times better; both misfits and what was meant.
    """
    notes = _fahrenheit(data)
    bare = robot.with_(effects=[])
    suspicion = (
        plausible_motors(data, bare, lambda q: _assembled(bare, q))
        if robot.passive
        else plausible(data, bare, bare.forward)
    )
    if suspicion is None:
        return notes
    if as_read or not suspicion.refused:
        return [*notes, suspicion.message]
    raise InvalidInput(refused(data, suspicion.message))


def _assembled(robot: Robot, q: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Poses (N, 4, 4) of the tool at q (N, n), and where (N,) the loops close; elsewhere the start posture is taken."""
    assembly = assemble(robot.core, q)
    fits = np.array(assembly.status) != "open"
    closed = _core.Samples(np.where(fits[:, np.newaxis], assembly.q, robot.core.home))
    return np.asarray(robot.error_model.predict(closed, robot.error_model.start)), fits


def refused(data: Dataset, message: str) -> Said:
    """A sentence on columns that may be taken as they are all the same."""
    return joined("", [f"{data.source}: ", joined("; ", [message, ACCEPT])])


def _fahrenheit(data: Dataset) -> list[str]:
    """Whether temperatures, of all rows or of some, look like degrees Fahrenheit: no fit can tell the scale of all."""
    if data.temperature is None:
        return []
    T = from_si(data.temperature, "c")
    high = (T > COOLEST_F) & (T < HOTTEST_F)
    if not high.any():
        return []
    if high.all():
        return [
            f"temperature_c is between {T.min():.4g} and {T.max():.4g}: if these are degrees Fahrenheit, what depends "
            f"on temperature is found 1.8 times too small"
        ]
    others, read = T[~high], from_si(to_si(T[high], "f"), "c")
    if read.min() < others.min() - BESIDE_K or read.max() > others.max() + BESIDE_K:
        return []
    if T[high].min() - others.max() < BESIDE_K:
        return []  # an arm that warms up goes through all temperatures
    rows = ", ".join(map(str, np.flatnonzero(high)[:3]))
    return [f"temperature_c of {high.sum()} rows ({rows} ...) looks like degrees Fahrenheit beside that of the others"]


def check_fit(robot: Robot, fit: Evaluation, *, as_read: bool = False) -> list[str]:
    """Refuses a calibration that explains nothing: half of the rows, or of the corners, are still far off.

    With `as_read`, a note says so instead.

    Raises:
        InvalidInput: The data are of another robot, or no measurements at all.
    """
    messages = [
        message for message in (_far_points(robot, fit), _far_orientations(fit), _far_corners(robot, fit)) if message
    ]
    if messages and not as_read:
        raise InvalidInput(refused(fit.data, messages[0]))
    return messages or _another_arm(robot, fit) or _another_arm_in_pictures(robot, fit)


def check_lengths(
    robot: Robot, table: Sequence[IdentifiedParameter], data: Dataset, *, as_read: bool = False
) -> list[str]:
    """Refuses an arm that has shrunk into its touches: all of one point's touches agree where no link has a length.

    Sockets, balls, blocks and planes do not show the scale of all lengths; where the joints are in another order than
    the file's, no lengths fit but none at all. With `as_read`, a note says so instead.

    Raises:
        InvalidInput: A link's length has moved by a good part of the reach.
    """
    moved = [p for p in table if p.owner.startswith("joint") and p.unit == "mm"]
    gone = max(moved, key=lambda p: abs(p.value - p.nominal), default=None)
    reach = float(from_si(robot.reach, "mm"))
    if gone is None or abs(gone.value - gone.nominal) <= MOVED * reach:
        return []
    message = said(
        "the touches fit this robot only with other lengths: {owner} {name} has moved by {moved:.4g} mm, with a reach "
        "of {reach:.4g} mm; is it the right robot, with its joints in order and every touch labelled as what it "
        "touched?",
        owner=gone.owner,
        name=gone.name.partition("_")[0],
        moved=gone.value - gone.nominal,
        reach=reach,
    )
    if not as_read:
        raise InvalidInput(refused(data, message))
    return [message]


def _another_arm(robot: Robot, fit: Evaluation) -> list[str]:
    """Do points miss the nominal arm as another one's would, and the calibrated one by more than any cause does?"""
    if fit.error_before is None or fit.before is None or fit.after is None:
        return []
    before, after = (float(np.nanmedian(np.linalg.norm(e, axis=1))) for e in (fit.error_before, fit.error_after))
    if before <= BAD_SHARE * robot.reach or after <= LEFT * robot.reach:
        return []
    return [
        said(
            "half of the points miss the nominal arm by more than {before:.4g} mm after the best fit of base and tool, "
            "and the calibrated one by more than {after:.4g} mm, with a reach of {reach:.4g} mm: is it this arm that "
            "was measured?",
            before=float(from_si(before, "mm")),
            after=float(from_si(after, "mm")),
            reach=float(from_si(robot.reach, "mm")),
        )
    ]


def _another_arm_in_pictures(robot: Robot, fit: Evaluation) -> list[str]:
    """The same of corners, where they are all that was read."""
    if list(fit.kinds) != [CORNERS]:
        return []
    of = fit.kinds[CORNERS]
    if of.before is None or np.isnan(of.before).all() or np.isnan(of.after).all():
        return []
    width = _widest(robot)
    before, after = float(np.nanmedian(of.before)), float(np.nanmedian(of.after))
    if before <= BAD_PICTURE * width or after <= LEFT_PICTURE * width:
        return []
    return [
        said(
            "half of the corners miss the nominal arm by more than {before:.3g} px with cameras and boards where they "
            "fit best, and the calibrated one by more than {after:.3g} px, in pictures {width:.0f} px wide: is it this "
            "arm that moved, and are board and lens those of the files?",
            before=before,
            after=after,
            width=width,
        )
    ]


def _widest(robot: Robot) -> float:
    """The width of the widest pictures [px]."""
    return max(float(camera["size_px"][0]) for camera in robot.description.cameras.values())


def _far_points(robot: Robot, fit: Evaluation) -> str | None:
    limit = BAD_SHARE * robot.reach
    if fit.rows is None and fit.after is not None and 2 * fit.after.mean < limit:
        return None  # half of some lengths are at most twice their mean
    known = distances(fit.error_after, fit.length_after)
    known = known[~np.isnan(known)]
    median = float(np.median(known)) if len(known) else 0.0
    if median <= limit:
        return None
    return said(
        "the points do not fit this robot: even when calibrated it misses half of them by more than {miss:.4g} mm, "
        "with a reach of {reach:.4g} mm; is it the right robot, with its joints in order and every point in the row "
        "of its pose?",
        miss=float(from_si(median, "mm")),
        reach=float(from_si(robot.reach, "mm")),
    )


def _far_orientations(fit: Evaluation) -> str | None:
    known = np.zeros(0) if fit.turn_after is None else fit.turn_after[~np.isnan(fit.turn_after)]
    median = float(np.median(known)) if len(known) else 0.0
    if median <= BAD_TURN:
        return None
    return said(
        "the orientations do not fit this robot: even when calibrated it misses half of them by more than {miss:.3g} "
        "deg; are they of this target, in the frame of the points, by the convention that was named, and every one in "
        "the row of its pose?",
        miss=float(from_si(median, "deg")),
    )


def _far_corners(robot: Robot, fit: Evaluation) -> str | None:
    """Corners beside other readings are judged as a kind that does not belong to these (`kind_misfits`)."""
    if list(fit.kinds) != [CORNERS]:
        return None
    (of,) = fit.kinds.values()
    median = float(np.nanmedian(of.after)) if not np.isnan(of.after).all() else 0.0
    width = _widest(robot)
    if median <= BAD_PICTURE * width:
        return None
    return said(
        "the pictures do not fit this robot: even when calibrated it misses half of the corners by more than "
        "{miss:.3g} px in pictures {width:.0f} px wide; is every picture in the row of its posture, are board, lens "
        "and arm those of the files, the joints in their order?",
        miss=median,
        width=width,
    )


def readback_notes(robot: Robot, data: Dataset) -> list[str]:
    """How far joint positions read back are from those commanded, a sentence each joint; they are never fitted."""
    if data.q_read is None:
        return []
    notes = []
    for joint, kind in enumerate(robot.joint_types):
        unit = "deg" if kind == "revolute" else "mm"
        difference = from_si(data.q_read[:, joint] - data.q[:, joint], unit)
        difference = difference[~np.isnan(difference)]
        if len(difference):
            mean, largest = float(np.mean(difference)), float(np.max(np.abs(difference)))
            notes.append(
                f"joint {joint + 1} read back less commanded: {mean:.4g} {unit} on average, {largest:.4g} {unit} at "
                f"most, in {len(difference)} rows; not used"
            )
    return notes
