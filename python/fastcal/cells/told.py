# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a cell's file knows beforehand, known distances and places, held against what the readings say.

As `contradicted` has it: what the readings contradict neither bends the fit nor takes readings for gross.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.contradicted import SURE_DEG, SURE_MM, Told, contradicted, or_others, place_sentence
from fastcal.cells.asked import WEAK, asked_parameters, priors
from fastcal.cells.cell import Arm, Cell, Distance, Known, Point
from fastcal.cells.fit import geometry_sizes, identified, there
from fastcal.cells.readings import Readings, known_tables
from fastcal.cells.rig_start import rig_start
from fastcal.cells.start import started
from fastcal.errors import FastcalError
from fastcal.robot.core_model import pose
from fastcal.robot.rig import PLACEMENT, known_within
from fastcal.robot.robot_spec import Spec, frame_spec
from fastcal.said import said
from fastcal.units import from_si, to_si

_SIGMAS = ("sigma_mm", "sigma_deg")


def without_what_is_contradicted(
    cell: Cell, readings: Readings, *, effects: bool, arms: Collection[str] | None, loss: str, threads: int
) -> tuple[Cell, list[str]]:
    """The cell without what its file says and the readings contradict, and a sentence on each.

    Args:
        cell: As its file says.
        readings: What was read.
        effects: As of `calibrate_cell`, and so are all others.
        arms: Of which arms.
        loss: On the error of a row.
        threads: Cores.
    """
    free = _free(cell)
    if free is cell:
        return cell, []
    try:
        start, used, _ = started(free, readings)
        places = rig_start(start, used)
        asked = asked_parameters(start, used, effects=effects, arms=arms)
        sizes = geometry_sizes(start, used, asked)
        found = identified(start, used, asked, places, sizes, loss, threads)
    except FastcalError:  # the readings alone fix nothing: what is told is needed
        return cell, []
    if found.status != "converged":
        return cell, []
    measured = used.measured(start)
    theta = np.asarray(found.theta)
    kept = np.setdiff1d(np.arange(len(used)), found.outliers)
    V = _covariance(start, used.pick(kept), asked, theta, list(found.common_noise), sizes, threads)
    told = [*_distances(cell, start, used, theta, threads), *_places(cell, start, theta, asked, measured)]
    wrong = contradicted(told, V)
    model = there(start, measured, found)
    notes = [_sentence(of, others, V, cell, model) for of, others in wrong]
    return _released(cell, [of for of, _ in wrong]), notes


def found_distances(
    cell: Cell, model: Cell, readings: Readings, free: Sequence[int], covariance: FloatArray
) -> list[dict[str, Any]]:
    """`known_distances` of result.json: of each that the file knows, what the fit has.

    Args:
        cell: As its file says.
        model: Identified; of its distances the file's were used.
        readings: In the postures of which they are.
        free: The parameters and unknowns that were identified.
        covariance: (len(free), len(free)) of these.
    """
    theta = np.asarray(model.model.start)
    own = [k for k, i in enumerate(free) if i < len(theta)]
    out = []
    for known, of in zip(cell.distances, _distances(cell, model, readings, theta, 1), strict=True):
        a = of.A[0, [free[k] for k in own]]
        std = float(np.sqrt(max(float(a @ covariance[np.ix_(own, own)] @ a), 0.0)))
        out.append(
            {
                "from": known.start,
                "to": known.end,
                "known_mm": known.mm,
                "known_std_mm": known.sigma_mm,
                "found_mm": known.mm - from_si(float(of.off[0]), "mm"),
                "found_std_mm": from_si(std, "mm"),
                "used": known in model.distances,
            }
        )
    return out


def _free(cell: Cell) -> Cell:
    """The cell with no place or distance known beforehand; the same where none is."""
    members: list[Arm | Point] = [*cell.arms, *cell.points]
    named = [of.name for of in members if _is_told(of) and of.known != Known()]
    rigs = (cell.cameras, cell.boards)
    named += [name for rig in rigs for name, of in rig.items() if any(of.get(key) for key in (*_SIGMAS, "fixed"))]
    return _without(cell, cell.distances, named) if named or cell.distances else cell


def _is_told(member: Arm | Point) -> bool:
    """Is its place what the file says, and not where a URDF forks, which the first joint's own origin says?"""
    return not isinstance(member, Arm) or member.on == "world" or member.robot.kinematics != "urdf"


def _released(cell: Cell, wrong: Sequence[Told]) -> Cell:
    distances = [told.of for told in wrong if isinstance(told.of, Distance)]
    return _without(cell, distances, [told.of[1] for told in wrong if not isinstance(told.of, Distance)])


def _without(cell: Cell, distances: Sequence[Distance], names: Collection[str]) -> Cell:
    """The cell that does not know some distances, nor where some members are."""

    def rig(members: Mapping[str, Spec]) -> dict[str, Spec]:
        return {
            name: {key: value for key, value in of.items() if name not in names or key not in (*_SIGMAS, "fixed")}
            for name, of in members.items()
        }

    return replace(
        cell,
        arms=tuple(replace(of, known=Known()) if of.name in names else of for of in cell.arms),
        points=tuple(replace(of, known=Known()) if of.name in names else of for of in cell.points),
        distances=tuple(of for of in cell.distances if of not in distances),
        cameras=rig(cell.cameras),
        boards=rig(cell.boards),
    )


def _covariance(
    cell: Cell,
    readings: Readings,
    asked: list[int],
    theta: FloatArray,
    noise: list[float],
    sizes: float | None,
    threads: int,
) -> FloatArray:
    """(T, T) of the parameters and unknowns, what no reading shows within WEAK plausible sizes; geometry as held."""
    measured = readings.measured(cell)
    near = _core.linearize(cell.model, readings.samples(cell), measured, theta, noise, threads)
    parameters = [*cell.model.parameters, *measured.parameters]
    own = [*asked, *range(len(cell.model.parameters), len(parameters))]
    open_to = np.where(priors(cell, asked, measured.parameters, sizes).geometry, sizes or WEAK, WEAK)
    size = np.array([parameters[i].sigma for i in own]) * open_to[own] / WEAK
    J = np.asarray(near.J)[:, own] * size
    out = np.zeros((len(parameters), len(parameters)))
    out[np.ix_(own, own)] = np.linalg.inv(J.T @ J + np.eye(len(own)) / WEAK**2) * np.outer(size, size)
    return out


def _distances(cell: Cell, at: Cell, readings: Readings, theta: FloatArray, threads: int) -> Iterator[Told]:
    """The distances of the file, at theta of the cell `at`: their mean over the postures."""
    own, samples = theta[: len(at.model.start)], readings.samples(at)
    for known in cell.distances:
        tables = known_tables(cell, known, len(readings))
        near = _core.linearize(
            at.model, samples, _core.Measurements(at.core, len(readings), tables, {}), own, [0.0], threads
        )
        r, J = np.asarray(near.r), np.asarray(near.J)
        sigma = to_si(known.sigma_mm, "mm")
        each = sigma * np.sqrt(len(r))
        A = np.zeros((1, len(theta)))
        A[0, : len(own)] = each * J.mean(axis=0)
        yield Told(known, f"{known.start} - {known.end}", A, np.array([-each * r.mean()]), np.array([sigma]))


def _places(
    cell: Cell, start: Cell, theta: FloatArray, asked: Sequence[int], measured: _core.Measurements
) -> Iterator[Told]:
    """The places that the file knows; turns as parameters of the cell `start` count from where that stands."""
    count, off = len(cell.model.start), np.zeros(len(theta))
    told, found = (
        cell.core.placements(np.asarray(cell.core.nominal)),
        start.core.placements(theta[: len(start.core.nominal)]),
    )
    for branch, A, B in zip(cell.core.branches, told, found, strict=True):
        first = branch.first_parameter
        off[first : first + 3] = A[:3, 3] - B[:3, 3]
        off[first + 3 : first + 6] = np.asarray(_core.log_so3(B[:3, :3].T @ A[:3, :3]))
    kinds = {**{of.name: "arm" for of in cell.arms}, **{of.name: of.role for of in cell.points}}
    within = np.full(len(theta), np.inf)
    for branch in cell.core.branches:
        known, first = _within(cell.known(branch.name)), branch.first_parameter
        own = [i for i in range(first, first + len(PLACEMENT)) if i in asked]
        within[first : first + 3] = np.inf if known.sigma_mm is None else to_si(known.sigma_mm, "mm")
        within[first + 3 : first + 6] = np.inf if known.sigma_deg is None else to_si(known.sigma_deg, "deg")
        if at := [i for i in own if np.isfinite(within[i])]:
            of = (kinds[branch.name], branch.name)
            yield Told(of, branch.name, np.eye(len(theta))[at], off[at], within[at])
    known_here = known_within(_sure(cell), measured.parameters)
    for owner in dict.fromkeys(of.owner for of in measured.parameters):
        at = [k for k, of in enumerate(measured.parameters) if of.owner == owner and np.isfinite(known_here[k])]
        if at:
            kind, _, name = owner.partition(" ")
            all_at = [count + k for k in at]
            yield Told((kind, name), name, np.eye(len(theta))[all_at], -theta[all_at], known_here[at])


def _within(known: Known) -> Known:
    return Known(sigma_mm=SURE_MM, sigma_deg=SURE_DEG) if known.fixed else known


def _sure(cell: Cell) -> Cell:
    """The cell whose fixed cameras and boards are known within SURE_MM and SURE_DEG."""

    def rig(members: Mapping[str, Spec]) -> dict[str, Spec]:
        sure = {"sigma_mm": SURE_MM, "sigma_deg": SURE_DEG}
        return {name: {**of, **sure} if of.get("fixed") else of for name, of in members.items()}

    return replace(cell, cameras=rig(cell.cameras), boards=rig(cell.boards))


def _sentence(of: Told, others: Sequence[Told], V: FloatArray, cell: Cell, model: Cell) -> str:
    """What is told, what was found, and what may be wrong in its place."""
    if isinstance(of.of, Distance):
        std = float(np.sqrt((of.A @ V @ of.A.T)[0, 0]))
        text = said(
            "from {first} to {second} the file knows {told} mm (standard deviation {sigma}), the readings say {found} "
            "mm ({std}): it is not used",
            first=of.of.start,
            second=of.of.end,
            told=f"{of.of.mm:.3f}",
            sigma=f"{of.of.sigma_mm:.2g}",
            found=f"{of.of.mm - from_si(float(of.off[0]), 'mm'):.3f}",
            std=f"{from_si(std, 'mm'):.2g}",
        )
    else:
        kind, name = of.of
        before, after = _place_of(cell, kind, name), _place_of(model, kind, name)
        text = place_sentence(name, before, after)
    return or_others(text, others)


def _place_of(cell: Cell, kind: str, name: str) -> Spec:
    if kind == "arm":
        return vars(cell.arm(name).robot.description.base)
    if kind in ("camera", "board"):
        entry = (cell.cameras if kind == "camera" else cell.boards)[name]
        return {"xyz_mm": entry["xyz_mm"], "rpy_deg": entry["rpy_deg"]}
    return frame_spec(pose(next(of.place for of in cell.points if of.name == name)))
