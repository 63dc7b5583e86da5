# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Positions of anchors, planes and mountings, with the parameters of the arm held fixed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.rarest_labels import with_rarest
from fastcal.effects.entries import full_name
from fastcal.errors import Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import without_kinds
from fastcal.robot.calibration_record import lower_root
from fastcal.robot.identified_spec import Solution
from fastcal.robot.rig import about_found
from fastcal.robot.robot import Robot

CORNERS = "corner"  # the kind of reading whose unknowns a model keeps


def of_corners(near: _core.Linearization, measured: _core.Measurements) -> NDArray[np.bool_]:
    """(m,) which numbers of a linearization are coordinates of corners; there must be some."""
    of = next(of for of in measured.observations if of.field == CORNERS)
    number = np.asarray(near.number)
    return (number >= of.first_number) & (number < of.first_number + len(of.components))


def placed(
    model: Robot, data: Dataset, measured: _core.Measurements, *, with_base: bool, where: str = "", threads: int = 1
) -> tuple[FloatArray, FloatArray]:
    """(4, 4) the base, fitted where asked for, and (U,) the observations' unknowns; noise is found by kind.

    Raises:
        Undetermined: Too few readings to place something.
    """
    samples = model.samples(data)
    start = _core.align(model.error_model, samples, measured, threads)
    if not start.found:
        raise Undetermined(f"{where or data.source}: {with_rarest(start.message, data)}")
    core = model.error_model
    own = len(core.robot.nominal)
    base = [i for i, p in enumerate(core.parameters[:own]) if p.owner == "base"]
    found = _core.identify(
        core,
        samples,
        measured,
        asked=base if with_base else [],
        unknowns=start.unknowns,
        loss="huber",
        threads=threads,
    )
    theta = np.asarray(found.theta)
    return np.asarray(core.robot.base_and_tool(theta[:own])[0]), theta[len(core.start) :]


def fitted_unknowns(model: Robot, data: Dataset, threads: int = 1) -> dict[str, FloatArray]:
    """The unknowns by what they are of, fitted beside a model; none where there are none, or too few readings."""
    rig = given_rig(model, data)
    data = without_kinds(data, [CORNERS]) if rig else data
    if not data.kinds:
        return rig
    measured = measurements(data, model)
    if not measured.parameters:
        return rig
    try:
        return rig | unknowns_by_owner(measured, placed(model, data, measured, with_base=False, threads=threads)[1])
    except Undetermined:
        return rig


def given_rig(model: Robot, data: Dataset) -> dict[str, FloatArray]:
    """Cameras and boards where the model has them: their unknowns are changes of that, and 0."""
    if CORNERS not in data.kinds:
        return {}
    measured = measurements(without_kinds(data, [kind for kind in data.kinds if kind != CORNERS]), model)
    return unknowns_by_owner(measured, np.zeros(len(measured.parameters)))


def unknowns_found(found: Solution, count: int, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(U,) the unknowns behind `count` parameters of a model, and their standard deviations, NaN where held.

    `covariance` is that of the free parameters.
    """
    theta = np.asarray(found.theta)
    std = np.full(len(theta), np.nan)
    std[list(found.free)] = np.sqrt(np.diag(covariance))
    return theta[count:], std[count:]


def unknowns_with_covariance(
    found: Solution, measured: _core.Measurements, count: int, covariance: FloatArray
) -> tuple[list[tuple[str, str]], FloatArray, FloatArray]:
    """Owner and name of each unknown, their values (U,), and covariance (U, U), 0 of what is held.

    Arguments as of `unknowns_found`.
    """
    theta = np.asarray(found.theta)
    whole = np.zeros((len(theta), len(theta)))
    whole[np.ix_(list(found.free), list(found.free))] = covariance
    return [(p.owner, p.name) for p in measured.parameters], theta[count:], whole[count:, count:]


def kept_unknowns(
    found: Solution, measured: _core.Measurements, count: int, covariance: FloatArray
) -> tuple[list[str], FloatArray]:
    """Names of the cameras' and boards' unknowns, and their rows (U, P + U) of a root, as CalibrationRecord has them.

    P of the `count` parameters of the model are free; other arguments as of `unknowns_found`. What is kept are changes
    of the places that were found.
    """
    parameters = measured.parameters
    own = [k for k, p in enumerate(parameters) if p.owner.partition(" ")[0] in ("camera", "board")]
    if not own:
        return [], np.zeros((0, 0))
    free = [i for i in found.free if i < count]
    whole = np.zeros((count + len(parameters), count + len(parameters)))
    whole[np.ix_(list(found.free), list(found.free))] = covariance
    change = about_found(parameters, np.asarray(found.theta)[count:])[own]
    to_kept = np.zeros((len(free) + len(own), len(whole)))
    to_kept[range(len(free)), free] = 1.0
    to_kept[len(free) :, count:] = change
    root = lower_root(to_kept @ whole @ to_kept.T)
    return [full_name(parameters[k]) for k in own], root[len(free) :]


def unknowns_by_owner(measured: _core.Measurements, values: FloatArray) -> dict[str, FloatArray]:
    """Values of the observations' unknowns by what they are of: the place (3,) [m] of "anchor 2"."""
    out: dict[str, list[float]] = {}
    for parameter, value in zip(measured.parameters, values, strict=True):
        out.setdefault(parameter.owner, []).append(float(value))
    return {owner: np.array(numbers) for owner, numbers in out.items()}
