# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Calibration: from a robot and measured poses to the identified model, how sure it is, and what can't be told."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from fastcal import _core
from fastcal.calibration_record import CalibrationRecord
from fastcal.critical_loads import with_critical_loads
from fastcal.dataset import Dataset
from fastcal.effect_origins import with_origins
from fastcal.effect_values import polar_pairs
from fastcal.effects import edge_name, edge_unit, full_name, parse_effects, without_repeats
from fastcal.errors import InvalidInput, Undetermined
from fastcal.evaluation import Evaluation, evaluate
from fastcal.identified import identified, with_frames
from fastcal.nominal import nominal_record
from fastcal.open_effects import with_open_effects_set
from fastcal.parameter_limits import parameter_limits
from fastcal.profile_pull import pulls
from fastcal.profile_range import range_notes
from fastcal.robot import Robot
from fastcal.units import factor, from_si

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]

LOSSES = ("tukey", "huber", "cauchy", "none")
METHODS = ("nls", "bfgs", "bfgs_mean_distance")
OUTLIER_SHARE = 0.01  # a row is listed where normal noise would make one so large in one of a hundred data sets
CORRELATED = 0.95


@dataclass(frozen=True)
class IdentifiedParameter:
    """One number of the result, in the unit of its name: `theta_deg` of `joint2`."""

    name: str
    owner: str
    value: float
    std: float
    unit: str
    nominal: float


@dataclass(frozen=True)
class Unidentifiable:
    """A direction that the data can't tell, in words, and the parameters in it; the first is held at nominal."""

    direction: str
    parameters: list[str]


@dataclass(frozen=True, eq=False)
class CalibrationResult:
    """What `calibrate` found.

    Attributes:
        model: The identified robot; also the start of a next calibration.
        nominal: The robot before, with the best rigid fit of base and tool.
        status: converged, not_converged or too_few_equations.
        parameters: Identified numbers in edge units; `covariance` (P, P) is theirs in SI, in the same order.
        rank: Directions of the asked parameters that change anything that was measured.
        sigma: Noise of one measured coordinate [m], `sigma_note` says where it comes from.
        outliers: Rows whose error the noise does not explain.
        weights: (N,) robust weight of each row, 1 is full.
    """

    status: str
    message: str
    model: Robot
    nominal: Robot
    loss: str
    method: str
    parameters: list[IdentifiedParameter]
    covariance: FloatArray
    unidentifiable: list[Unidentifiable]
    correlated: list[tuple[str, str, float]]
    rank: int
    asked_count: int
    degrees_of_freedom: int
    iterations: int
    sigma: float
    sigma_note: str
    outliers: list[int]
    weights: FloatArray
    train: Evaluation
    test: Evaluation | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def sigma_mm(self) -> float:
        """`sigma` in mm."""
        return from_si(self.sigma, "mm")

    def interval(self, level: float = 0.95) -> FloatArray:
        """(P, 2) two-sided confidence intervals of the parameters in edge units, by Student's t."""
        t = float(special.stdtrit(max(self.degrees_of_freedom, 1), 0.5 + level / 2))
        values = np.array([p.value for p in self.parameters])
        half = t * np.array([p.std for p in self.parameters])
        return np.column_stack([values - half, values + half])

    def to_json_dict(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "status": self.status,
            "message": self.message,
            "method": self.method,
            "loss": self.loss,
            "train": self.train.to_json_dict(),
            "test": None if self.test is None else self.test.to_json_dict(),
            "parameters": [vars(p) for p in self.parameters],
            "rank": self.rank,
            "unidentifiable": [vars(u) for u in self.unidentifiable],
            "correlated": [{"first": a, "second": b, "correlation": r} for a, b, r in self.correlated],
            "sigma_mm": self.sigma_mm,
            "sigma_note": self.sigma_note,
            "degrees_of_freedom": self.degrees_of_freedom,
            "outliers": self.outliers,
            "notes": self.notes,
        }


def measurements(data: Dataset) -> _core.Measurements:
    """What was measured, as the core reads it."""
    if data.position is None and data.rotation is None and data.distance is None:
        raise InvalidInput(
            f"{data.source}: no measured column; expected x_mm y_mm z_mm, an orientation, or distance_mm"
        )
    return _core.Measurements(
        position=data.position,
        rotation=data.rotation,
        distance=data.distance,
        anchor=None if data.anchor is None else data.anchor.astype(np.int32),
        anchor_count=len(data.anchor_names) if data.distance is not None else 0,
        sigma_position=data.sigma_position,
        sigma_rotation=data.sigma_rotation,
    )


def align(robot: Robot, data: Dataset, threads: int = 1) -> _core.Alignment:
    """Best rigid fit of base and tool (and anchors) to the data; closed form, no initial guess."""
    return _core.align(robot.error_model, robot.samples(data), measurements(data), threads)


class Prepared(NamedTuple):
    """A robot with the effects asked for, and its model with base and tool fitted to the data."""

    robot: Robot
    model: _core.ErrorModel
    samples: _core.Samples
    measured: _core.Measurements
    alignment: _core.Alignment
    asked: list[int]


def prepare(
    robot: Robot,
    data: Dataset,
    *,
    effects: str | Sequence[str],
    parameters: Sequence[str] | None = None,
    equilibrium: bool | None = None,
    threads: int = 1,
) -> Prepared:
    """Adds effects, fits base and tool, and says which parameters of the model are asked for; arguments of `calibrate`.

    Raises:
        InvalidInput: An unknown effect or parameter, data without a measured column, or poses that fix no base.
    """
    geometry, added = parse_effects(effects, robot.core)
    spec = copy.deepcopy(robot.spec)
    spec.pop("correction", None)  # it was trained on what another identification left
    spec["effects"] = without_repeats(
        [with_origins(entry, robot, data) for entry in (spec.get("effects") or []) + added]
    )
    if equilibrium is not None:
        spec["equilibrium"] = equilibrium
    start = Robot(spec)
    samples, measured = start.samples(data), measurements(data)
    alignment = _core.align(start.error_model, samples, measured, threads)
    if not alignment.found:
        raise Undetermined(f"{data.source}: {alignment.message}")
    model = start.error_model.with_robot(start.core.with_base_and_tool(alignment.T_world_base, alignment.T_flange_tool))
    placed = data.position is not None or data.rotation is not None
    asked = asked_parameters(model, geometry or parameters is not None, turned=data.rotation is not None, placed=placed)
    if parameters is not None:
        names = parameter_names(model)
        for name in parameters:
            if name not in names:
                raise InvalidInput(f"there is no parameter '{name}' to identify; there are {', '.join(names)}")
        asked = [i for i in asked if names[i] in parameters or model.parameters[i].owner in ("base", "tool")]
    return Prepared(start, model, samples, measured, alignment, asked)


def parameter_names(model: _core.ErrorModel) -> list[str]:
    """Names such as "joint2 a", in the order of the model."""
    return [full_name(parameter) for parameter in model.parameters]


def calibrate(
    robot: Robot,
    data: Dataset,
    *,
    test: Dataset | None = None,
    effects: str | Sequence[str] = "geometry",
    parameters: Sequence[str] | None = None,
    method: str = "nls",
    loss: str = "tukey",
    priors: bool = False,
    equilibrium: bool | None = None,
    max_iterations: int = 100,
    threads: int = 1,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Identifies a robot from measured poses.

    Args:
        robot: Nominal robot, or an identified one as a new start; its effects stay and are identified again.
        data: Measured poses; read-back joint positions are never used.
        test: Other poses, only reported on.
        effects: Names as on the command line; base and tool are always identified.
        parameters: Exactly these besides base and tool, such as "joint2 a" (`Robot.parameter_names`); the others keep
            their values. None: all parameters of `effects`.
        method: nls (Levenberg-Marquardt), bfgs (PMC paper: BFGS on the root of the mean squared distance),
            bfgs_mean_distance (its printed cost).
        loss: Robust loss on the whitened error of a row: tukey, huber, cauchy, none.
        priors: Hold parameters near nominal with a standard deviation of three plausible sizes.
        equilibrium: Take loads in the deflected posture (True) or in the undeflected one, to first order (False, as the
            papers do); the model keeps it. None: as the robot says, which is True unless its file has `equilibrium:
            false`.
        max_iterations: Of one solve.
        threads: Cores; the result does not depend on it.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: An unknown effect, parameter, loss or method, or data without a measured column.
    """
    if loss not in LOSSES:
        raise InvalidInput(f"loss must be one of {', '.join(LOSSES)}, got '{loss}'")
    if method not in METHODS:
        raise InvalidInput(f"method must be one of {', '.join(METHODS)}, got '{method}'")
    say = progress or (lambda text: None)
    say("aligning base and tool")
    start, model, samples, measured, alignment, asked = prepare(
        robot, data, effects=effects, parameters=parameters, equilibrium=equilibrium, threads=threads
    )
    names = parameter_names(model)

    say("identifying")
    start = with_critical_loads(start, model, samples, measured, asked, alignment.anchors, loss=loss, threads=threads)
    start = with_open_effects_set(
        start, model, samples, measured, asked, alignment.anchors, data, loss=loss, threads=threads
    )
    model = start.error_model.with_robot(model.robot)
    found = _core.identify(
        model,
        samples,
        measured,
        asked=asked,
        anchors=alignment.anchors,
        method=method,
        loss=loss,
        max_iterations=max_iterations,
        threads=threads,
        **parameter_limits(start, model, len(alignment.anchors), priors=priors),
        **pulls(start, model, samples, measured, asked, alignment.anchors, loss=loss, threads=threads),
    )

    say("reporting")
    aligned = Robot(with_frames(start.spec, alignment.T_world_base, alignment.T_flange_tool))
    identified_spec = identified(start, model, found)
    free_names = [full_name(found.parameters[i]) for i in found.free]
    covariance = np.asarray(found.covariance)
    sigma = found.sigma[0] if found.sigma[0] > 0 else found.sigma[2]
    kept = [k for k, i in enumerate(found.free) if i < len(names)]
    if kept:
        record = CalibrationRecord(
            [free_names[k] for k in kept],
            np.asarray(np.linalg.cholesky(covariance[np.ix_(kept, kept)]), dtype=np.float64),
            from_si(sigma, "mm"),
            found.degrees_of_freedom,
        )
        identified_spec["calibration"] = record.to_spec() | {"nominal": nominal_record(start.spec)}
    result_model = Robot(identified_spec)
    places = _anchors(found, data, len(names))
    places_before = (
        dict(zip(data.anchor_names, np.asarray(alignment.anchors), strict=True)) if data.distance is not None else {}
    )
    judge: dict[str, Any] = {"before": aligned, "anchors": places, "anchors_before": places_before, "threads": threads}
    table, table_covariance = _table(start, model, found, data)
    beyond = [] if test is None else [f"{test.source}: {note}" for note in range_notes(result_model, test)]
    return CalibrationResult(
        status=found.status,
        message=found.message,
        model=result_model,
        nominal=aligned,
        loss=loss,
        method=method,
        parameters=table,
        covariance=table_covariance,
        unidentifiable=[
            Unidentifiable(text, [names[i] for i in parts if i < len(names)])
            for text, parts in zip(found.unidentifiable, found.unidentifiable_parts, strict=True)
        ],
        correlated=_correlated(free_names, covariance),
        rank=found.rank,
        asked_count=len(found.free) + len(found.held),
        degrees_of_freedom=found.degrees_of_freedom,
        iterations=found.iterations,
        sigma=sigma,
        sigma_note=_sigma_note(found, data),
        outliers=_outliers(found),
        weights=np.asarray(found.weights),
        train=evaluate(result_model, data, **judge),
        test=None if test is None else evaluate(result_model, test, **judge),
        notes=[*data.notes, *beyond],
    )


def asked_parameters(model: _core.ErrorModel, geometry: bool, *, turned: bool, placed: bool) -> list[int]:
    """Base and tool always (as far as the kind of measurement can show them), geometry where asked, every effect."""
    out = []
    own = len(model.robot.parameters)
    for i, parameter in enumerate(model.parameters):
        if i >= own:
            out.append(i)
        elif parameter.owner == "base":
            if placed:
                out.append(i)
        elif parameter.owner == "tool":
            if turned or not parameter.name.startswith("r"):
                out.append(i)
        elif geometry:
            out.append(i)
    return out


def _table(
    start: Robot, model: _core.ErrorModel, found: _core.Identification, data: Dataset
) -> tuple[list[IdentifiedParameter], FloatArray]:
    """Identified numbers in edge units and their covariance in SI; harmonics as amplitude and phase.

    The turns of base and tool are those from nominal to identified, about their own axes.
    """
    own = len(model.robot.parameters)
    count = len(model.parameters)
    nominal = np.concatenate([start.error_model.start, np.zeros(len(found.parameters) - count)])
    theta = np.array(found.theta)
    for first, T, T_nominal in zip(
        (0, own - 6), model.robot.base_and_tool(theta[:own]), start.core.base_and_tool(start.core.nominal), strict=True
    ):
        theta[first + 3 : first + 6] = _core.log_so3(T_nominal[:3, :3].T @ T[:3, :3])
    names = {i: edge_name(p, geometry=i < own or i >= count) for i, p in enumerate(found.parameters)}
    place = {i: k for k, i in enumerate(found.free)}
    slope = np.eye(len(place))
    for pair in polar_pairs(start.spec.get("effects") or [], start.effects, own, theta):
        if all(i in place for i in pair.indices):
            at = [place[i] for i in pair.indices]
            slope[np.ix_(at, at)] = pair.slope
            theta[pair.indices], nominal[pair.indices] = pair.values, pair.polar_of(nominal[pair.indices])
            names |= dict(zip(pair.indices, pair.names, strict=True))
    covariance = slope @ np.asarray(found.covariance).reshape(slope.shape) @ slope.T
    out = []
    for i, deviation in zip(found.free, np.sqrt(np.diag(covariance)), strict=True):
        parameter = found.parameters[i]
        unit = edge_unit(parameter, geometry=i < own or i >= count)
        owner = (
            parameter.owner if i < count else f"anchor {data.anchor_names[int(parameter.owner.removeprefix('anchor'))]}"
        )
        value, before = from_si(float(theta[i]), unit), from_si(float(nominal[i]), unit)
        out.append(IdentifiedParameter(names[i], owner, value, float(deviation) / factor(unit), unit, before))
    return out, covariance


def _anchors(found: _core.Identification, data: Dataset, count: int) -> dict[str, FloatArray]:
    places = np.asarray(found.theta)[count:].reshape(-1, 3)
    return dict(zip(data.anchor_names, places, strict=True)) if len(places) else {}


def _correlated(names: list[str], covariance: FloatArray) -> list[tuple[str, str, float]]:
    """Pairs whose estimates move together, strongest first."""
    if len(names) < 2:
        return []
    scale = np.sqrt(np.diag(covariance))
    r = covariance / np.outer(scale, scale)
    i, j = np.triu_indices(len(names), 1)
    strong = np.flatnonzero(np.abs(r[i, j]) > CORRELATED)
    order = strong[np.argsort(-np.abs(r[i, j][strong]), kind="stable")]
    return [(names[i[k]], names[j[k]], float(r[i[k], j[k]])) for k in order]


def _outliers(found: _core.Identification) -> list[int]:
    """Rows whose whitened error is larger than normal noise makes it in OUTLIER_SHARE of all such data sets."""
    squares = np.asarray(found.whitened_squares)
    numbers = np.sum(~np.isnan(np.asarray(found.residuals)), axis=1)
    used = numbers > 0
    limit = np.full(len(squares), np.inf)
    limit[used] = special.chdtri(numbers[used], OUTLIER_SHARE / max(int(used.sum()), 1))
    return [int(i) for i in np.flatnonzero(squares / max(found.variance_factor, 1e-300) > limit)]


def _sigma_note(found: _core.Identification, data: Dataset) -> str:
    """Where the noise level comes from, for the reader."""
    if data.sigma_position is None:
        return "estimated from what the model leaves; the data claim none"
    common = from_si(found.common_noise[0] if data.position is not None else found.common_noise[2], "mm")
    if common > 0:
        return f"the data's own claims and a common part of {common:.4f} mm, which the claims do not explain"
    return f"the data's own claims times {found.variance_factor**0.5:.3f}, which is what the model leaves"
