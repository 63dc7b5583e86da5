# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One fit of all arms and members of a cell, and what is taken in its place where it is worse than the frames alone."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.kind_noise import noise_by_kind
from fastcal.calibration.parameter_limits import bounds_of
from fastcal.calibration.unknowns import CORNERS, unknowns_found
from fastcal.cells.asked import asked_parameters, pictured_ground, priors
from fastcal.cells.axis_noise import noise_of_axes, with_axis_noise
from fastcal.cells.cell import Cell
from fastcal.cells.errors import is_of_rig, view_errors
from fastcal.cells.evidence import SharedNoise, settled
from fastcal.cells.never_worse import arms_to_blame, worse_sights
from fastcal.cells.pose_noise import settled_poses
from fastcal.cells.readings import Readings
from fastcal.cells.rig_start import RigStart
from fastcal.measurements.kinds import KindNoise
from fastcal.monitoring.picture_check import NUMBERS
from fastcal.robot.identified_spec import Solution
from fastcal.robot.rig import pictures
from fastcal.said import said

Progress = Callable[[str], None]

_ENOUGH = 10  # numbers a parameter: with more the geometry is left free without a look
_MANY_OUT = 0.2  # of the rows: where a fit leaves out more, they may not be what is wrong
_WIDE = 3.0  # plausible sizes within which the geometry is held before the readings say how much


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit of a cell and how it was made.

    Attributes:
        start, used, places: The cell before, with what was read of it, and where its cameras and boards begin.
        options: The others of `of`.
        found: What the core identified.
        solution: The same, or as it is weighed by what joints and poses share.
        model: The cell as it was identified.
    """

    start: Cell
    used: Readings
    places: RigStart
    options: dict[str, Any]
    asked: list[int]
    measured: _core.Measurements
    found: _core.Identification
    solution: Solution
    model: Cell
    noise: dict[str, KindNoise]
    shared: SharedNoise | None

    @staticmethod
    def of(
        start: Cell,
        used: Readings,
        places: RigStart,
        *,
        effects: bool,
        arms: Collection[str] | None,
        loss: str,
        threads: int,
        report: Progress,
        near: Cell | None = None,
        shares: bool = True,
    ) -> Fit:
        """The fit of some arms, or all, by a loss: weighed by the axes' noise, and by what joints or poses share.

        It begins at `start`, or at the same cell as another fit has it, `near`. `shares`: may readings of one row err
        together?
        """
        options: dict[str, Any] = {"effects": effects, "arms": arms, "loss": loss, "threads": threads, "shares": shares}
        asked = asked_parameters(start, used, effects=effects, arms=arms)
        sizes = geometry_sizes(start, used, asked)
        few = _numbers_of(start, used) < _ENOUGH * len(asked)
        has_joints = not all(arm.of_poses for arm in start.arms)
        found = identified(start, used, asked, places, sizes, loss, threads, near)
        measured = used.measured(start)
        solution: Solution = found
        model = there(start, measured, found)
        noise = noise_by_kind(measured, found)
        kept = np.setdiff1d(np.arange(len(used)), found.outliers)
        weighed, by_axis = with_axis_noise(used, view_errors(model, used.pick(kept)))
        if by_axis and found.status == "converged":
            found = identified(start, weighed, asked, places, sizes, loss, threads, near)
            measured = weighed.measured(start)
            solution, model = found, there(start, measured, found)
            noise = noise_of_axes(noise, weighed, by_axis)
        shared = None
        ground = pictured_ground(start, used)
        # Where a camera has nothing left but gross pictures, its place is no longer among what is read.
        shares &= len(used.pick(kept).measured(start).parameters) == len(measured.parameters)
        if shares and has_joints and (few or CORNERS in used.tables) and found.status == "converged":
            report("weighing what the joints repeat to")
            known = priors(start, asked, measured.parameters, None if sizes is None else 1.0, ground)
            with suppress(np.linalg.LinAlgError):  # far from all readings, which whoever judges the fit says
                solution, shared = settled(start, weighed.pick(kept), found, known, threads)
            model = there(start, measured, solution)
        elif shares and any(arm.of_poses for arm in start.arms) and found.status == "converged":
            known = priors(start, asked, measured.parameters, sizes, ground)
            poses = settled_poses(start, used.pick(kept), found, known, threads)
            if poses is not None:
                solution, model = poses, there(start, measured, poses)
        return Fit(start, used, places, options, asked, measured, found, solution, model, noise, shared)

    def again(self, report: Progress, **options: Any) -> Fit:
        """The same with some options otherwise."""
        return Fit.of(self.start, self.used, self.places, report=report, **{**self.options, **options})

    def of_more_rows(self, report: Progress) -> Fit:
        """The same, or the fit from where least squares ends, where this one leaves out many rows and that one fewer.

        Far from where all stands, as with a table in two positions, one half of the rows may seem to belong together.
        """
        if self.options["loss"] == "none" or len(self.found.outliers) <= _MANY_OUT * len(self.used):
            return self
        least = self.again(report, loss="none")
        near = self.start.with_values(np.asarray(least.solution.theta))
        tried = self.again(report, near=near)
        is_better = tried.found.status == "converged" and len(tried.found.outliers) < len(self.found.outliers)
        return tried if is_better else self

    def frames(self) -> Cell | None:
        """Where the members stand with the arms as their files say; None where that is this fit, or none is found."""
        asked = asked_parameters(self.start, self.used, arms=())
        if len(asked) == len(self.asked):
            return None
        found = identified(self.start, self.used, asked, self.places, None, "huber", self.options["threads"])
        return there(self.start, self.measured, found) if found.status == "converged" else None

    def errors(self, cell: Cell) -> dict[str, FloatArray]:
        """(N, readings) of each view, of a cell."""
        return {view: of.after for view, of in view_errors(cell, self.used).items()}


def never_worse(fit: Fit, report: Progress) -> tuple[Fit, str, str, list[str]]:
    """The fit, or another where it did not converge or a sight is worse than by frames alone; status, message, notes.

    Then it is that of least squares, or one with a loss that leaves fewer rows out; else the arms that move what is
    worse stay as their files say, and where that is all of them, the frames alone are what is found.
    """
    status, message = fit.found.status, fit.found.message
    frames = fit.frames()
    if frames is None:
        return fit, status, message, []
    before = fit.errors(frames)

    def worse(of: Fit) -> set[str]:
        now = worse_sights(fit.start, of.errors(of.model), before)
        return now if of.found.status == "converged" else {view.partition("@")[2] for view in before}

    if not (now := worse(fit)):
        return fit, status, message, []
    loss, given = fit.options["loss"], fit.options["arms"]
    why = {
        "converged": said("has larger errors than the nominal arm"),
        "too_few_equations": said("has too few equations"),
    }.get(status, said("did not converge"))
    more, notes = _without_sharing(fit)
    for other in (loss, "none", "huber") if more else ("none", "huber"):
        if other == loss and not more:
            continue
        tried = fit.again(report, loss=other, **more)
        if not worse(tried):
            note = said(
                "the fit with the loss {loss} {why}: the result is that with the loss {other}",
                loss=loss,
                why=why,
                other=other,
            )
            return tried, tried.found.status, tried.found.message, notes if other == loss else [note, *notes]
    arms = frozenset(arm.name for arm in fit.start.arms if given is None or arm.name in given)
    ever, held = set[str](), frozenset[str]()
    while now - ever and arms - held:
        ever |= now
        held |= arms_to_blame(fit.start, before.keys(), now, ever)
        tried = fit.again(report, arms=sorted(arms - held), **more)
        now = worse(tried)
    if status == "converged" and not arms - held:
        alone = fit.again(report, arms=(), loss="huber", **more)
        return alone, alone.found.status, alone.found.message, [_as_said(held, ever), *notes]
    if tried.found.status != "converged" or not arms - held:
        what = said(
            "the arms could not be identified: the fit {why}; only the places of the members are fitted", why=why
        )
        status = "not_converged" if status == "converged" else status
        return fit.again(report, arms=(), loss="huber", **more), status, what, notes
    return tried, tried.found.status, tried.found.message, [_as_said(held, ever), *notes]


def _without_sharing(fit: Fit) -> tuple[dict[str, Any], list[str]]:
    """The option, and a note, of fits in which the corners of a picture share nothing, where it was too much."""
    if fit.shared is None or not fit.shared.is_beyond or CORNERS not in fit.used.tables:
        return {}, []
    note = said(
        "what the corners of a picture share is more than joints that do not come back, such as an error of the lens: "
        "it is not weighed, and the deviations stated are too small"
    )
    return {"shares": False}, [note]


def _as_said(arms: Collection[str], views: Collection[str]) -> str:
    return said(
        "{arms}: as the files say, since {views} would be farther off with it identified than with it as it is",
        arms=" and ".join(sorted(arms)),
        views=", ".join(sorted(views)),
    )


def geometry_sizes(cell: Cell, readings: Readings, asked: list[int]) -> float | None:
    """Plausible sizes within which the geometry is held at first, where there are few numbers; None: it is free."""
    few = _numbers_of(cell, readings) < _ENOUGH * len(asked)
    return _WIDE if few and not all(arm.of_poses for arm in cell.arms) else None


def identified(
    cell: Cell,
    readings: Readings,
    asked: list[int],
    places: RigStart,
    sizes: float | None,
    loss: str,
    threads: int,
    near: Cell | None = None,
) -> _core.Identification:
    """The asked parameters of a cell and the unknowns of its readings, its geometry held within some sizes or free.

    It begins at the cell, or at the same as another fit has it, `near`.
    """
    measured = readings.measured(cell)
    given: dict[str, Any] = {"asked": asked, "loss": loss, "threads": threads}
    given["unknowns"] = places.of(measured.parameters)
    given |= priors(cell, asked, measured.parameters, sizes, pictured_ground(cell, readings)).options
    given |= (
        bounds_of(cell.model.parameters, len(measured.parameters))
        if max(asked, default=0) >= len(cell.core.nominal)
        else {}
    )
    return _core.identify((near or cell).model, readings.samples(cell), measured, **given)


def there(cell: Cell, measured: _core.Measurements, found: Solution) -> Cell:
    """The cell as it was identified."""
    values, std = unknowns_found(found, len(cell.model.start), np.asarray(found.covariance))
    there = cell.with_values(np.asarray(found.theta)).with_rig(measured.parameters, values, std)
    pairs = zip(measured.parameters, values.tolist(), strict=True)
    return replace(there, found={(of.owner, of.name): value for of, value in pairs if not is_of_rig(of)})


def _numbers_of(cell: Cell, readings: Readings) -> int:
    """What was measured: three numbers of an orientation, and of all corners of a picture the six of its posture."""
    out = 0
    for name, values in readings.tables.items():
        known = ~np.isnan(values)
        if name.startswith("rotation"):
            out += 3 * int(known.all(axis=1).sum())
        elif name == CORNERS:
            seen = [known[:, 2 * of.start : 2 * of.stop].sum(axis=1) for of in pictures(cell).values()]
            out += int(np.minimum(seen, NUMBERS).sum())
        elif not name.startswith("sigma"):
            out += int(known.sum())
    touches = [of for of in readings.measured(cell).observations if not of.field and not of.is_known]
    return out + sum(len(of.components) // of.reading_count * _touches(readings, of) for of in touches)


def _touches(readings: Readings, of: _core.Observation) -> int:
    """Rows of labels that are all that was read."""
    own = [name for name in readings.labels if name.partition("@")[0] == of.name]
    return sum(int((readings.labels[name].codes >= 0).sum()) for name in own)
