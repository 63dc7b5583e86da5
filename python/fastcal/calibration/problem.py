# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The calibration problem common to all fits: robot, measured rows, parameters to identify, weights of rows."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.core_rows import CoreRows
from fastcal.calibration.options_from_data import with_origins
from fastcal.calibration.parameter_limits import parameter_limits
from fastcal.calibration.placement import Placement as Placement
from fastcal.calibration.placement import by_points
from fastcal.calibration.rarest_labels import with_rarest
from fastcal.calibration.setups import with_setups
from fastcal.calibration.some_rows import SHOWN_ROWS, some_rows
from fastcal.effects.entries import extra_columns, full_name, parse_effects, without_repeats
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LongDataset
from fastcal.measurements.observations import core_tables
from fastcal.robot.core_model import pose
from fastcal.robot.loops import hidden_parameters
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.rig import known_within
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]


_PLACING_LOSS = "huber"  # as that of the rigid fit: gross rows hardly move it, and the arm's own errors all count


@dataclass(frozen=True, eq=False)
class CalibrationProblem:
    """A robot with the effects to identify, its model with base and tool fitted, and what was measured.

    Attributes:
        robot: With its effects.
        data: The measured rows; of a long data set some of them.
        model: The robot's model; base and tool are those of the best rigid fit.
        samples, measured: The rows as the core reads them.
        alignment: Base, tool and unknowns of the nominal arm, where the fit starts.
        asked: Indices of the model's parameters to identify; the observations' unknowns always are.
        loss: Robust loss on the whitened error of a row.
        threads: Cores; no result depends on it.
        long: All rows, where `data` are some of those of a long data set.
    """

    robot: Robot
    data: Dataset
    model: _core.ErrorModel
    samples: _core.Samples
    measured: _core.Measurements
    alignment: Placement
    asked: list[int]
    loss: str = "tukey"
    threads: int = 1
    long: LongDataset | None = None

    @cached_property
    def parameters(self) -> list[_core.Parameter]:
        """The model's parameters, which the core copies each time it is asked."""
        return self.model.parameters

    @cached_property
    def names(self) -> list[str]:
        """Names such as "joint2 a", of the model's parameters."""
        return [full_name(parameter) for parameter in self.parameters]

    @property
    def unknown_count(self) -> int:
        """Unknowns of the observations, which follow the model's parameters in theta."""
        return len(self.measured.parameters)

    @cached_property
    def effect_places(self) -> list[range]:
        """Indices of each effect's parameters in the model."""
        out, at = [], len(self.model.robot.nominal)
        for effect in self.robot.effects:
            out.append(range(at, at + len(effect.parameters)))
            at += len(effect.parameters)
        return out

    def with_(self, **changes: Any) -> CalibrationProblem:
        """The same problem with other fields; a new `robot` brings its own model, base and tool fitted as before.

        It brings its samples too where it looks at other columns, such as a temperature behind another lag.
        """
        if "robot" in changes and "model" not in changes:
            changes["model"] = changes["robot"].error_model.with_robot(self.model.robot)
            if extra_columns(changes["robot"].entries) != extra_columns(self.robot.entries):
                changes.setdefault("samples", changes["robot"].samples(self.data))
        return replace(self, **changes)

    def limits(self, *, priors: bool = False) -> dict[str, FloatArray]:
        """Bounds and priors as keyword arguments of `identify`; with `priors`, every parameter is held near nominal."""
        if not priors:
            return self._own_limits
        return parameter_limits(self.robot, self.model, self._known_within, priors=True)

    @cached_property
    def _known_within(self) -> FloatArray:
        return known_within(self.robot.description, self.measured.parameters)

    @cached_property
    def _own_limits(self) -> dict[str, FloatArray]:
        return parameter_limits(self.robot, self.model, self._known_within, priors=False)

    def identify(self, **options: Any) -> _core.Identification:
        """Identifies what is asked; options as the core's `identify` has them, among these its bounds and priors."""
        given: dict[str, Any] = {
            "asked": self.asked,
            "unknowns": self.alignment.unknowns,
            "loss": self.loss,
            "threads": self.threads,
            **self.limits(),
            **options,
        }
        if self.long is not None:
            given["rows"] = CoreRows(self.robot, self.long)
        return _core.identify(self.model, self.samples, self.measured, **given)

    @cached_property
    def near_the_file(self) -> FloatArray:
        """Where a robust fit ends whose parameters all have priors about the file's.

        Postures near a fold of loops draw least squares elsewhere, if a rod is off by a hundredth of its length.
        """
        return np.asarray(self.identify(loss="tukey", **self.limits(priors=True)).theta)

    def linearize(self, theta: FloatArray, noise: Sequence[float]) -> _core.Linearization:
        """Whitened residuals and their Jacobian at theta; `noise`: common to all rows, by observation."""
        return _core.linearize(self.model, self.samples, self.measured, theta, list(noise), self.threads)


def prepare(
    robot: Robot,
    data: Dataset,
    *,
    effects: str | Sequence[str],
    parameters: Sequence[str] | None = None,
    equilibrium: bool | None = None,
    loss: str = "tukey",
    threads: int = 1,
    long: LongDataset | None = None,
    moved: Collection[str] = (),
) -> CalibrationProblem:
    """Adds effects, fits base and tool, and says which parameters of the model are asked for; arguments of `calibrate`.

    `moved`: effects of stations or mounts that are added too (`setups.thrown_out`).

    Raises:
        InvalidInput: An unknown effect or parameter, data without a measured column, or poses that fix no base.
    """
    geometry, added = parse_effects(effects, robot.core, robot.entries)
    # A correction was trained on what another identification left.
    spec = plain_copy({key: value for key, value in robot.spec.items() if key != "correction"})
    spec["effects"] = without_repeats(
        [with_origins(entry, robot, long or data) for entry in (spec.get("effects") or []) + plain_copy(added)]
    )
    if equilibrium is not None:
        spec["equilibrium"] = equilibrium
    spec = with_setups(spec, data, moved)
    # Of what the chain is built of, base and tool alone may have changed.
    start = Robot.keeping(spec, robot.core.with_base_and_tool(pose(spec["base"]), pose(spec["tool"])))
    samples, measured = start.samples(data), measurements(data, start)
    alignment = _aligned(start, data, samples, measured, threads, has_others=long is not None)
    if not alignment.found:
        raise Undetermined(f"{data.source}: {with_rarest(alignment.message, data)}")
    place = by_points(start, data, Placement.of(alignment), threads)
    model = start.error_model.with_robot(start.core.with_base_and_tool(place.T_world_base, place.T_flange_tool))
    asked = asked_parameters(model, geometry or parameters is not None, **shown_ends(measured))
    if parameters is not None:
        names = parameter_names(model)
        owners = [parameter.owner for parameter in model.parameters]
        for name in parameters:
            if name not in names:
                raise InvalidInput(f"there is no parameter '{name}' to identify; there are {', '.join(names)}")
        asked = [i for i in asked if names[i] in parameters or owners[i] in ("base", "tool")]
    return _placed(CalibrationProblem(start, data, model, samples, measured, place, asked, loss, threads, long))


def _placed(problem: CalibrationProblem) -> CalibrationProblem:
    """With base, tool and unknowns fitted by the noise of each kind; points alone have them from the rigid fit."""
    if not problem.unknown_count and len(problem.measured.observations) == 1:
        return problem
    model = problem.model
    own = len(model.robot.nominal)
    ends = [i for i in problem.asked if i < own and problem.parameters[i].owner in ("base", "tool")]
    found = problem.identify(asked=ends, loss=_PLACING_LOSS)
    if found.status != "converged":
        return problem.with_(alignment=replace(problem.alignment, is_fitted=False))
    theta = np.asarray(found.theta)
    T_base, T_tool = model.robot.base_and_tool(theta[:own])
    place = Placement(np.asarray(T_base), np.asarray(T_tool), theta[len(model.start) :])
    return problem.with_(model=model.with_robot(model.robot.with_base_and_tool(T_base, T_tool)), alignment=place)


def _aligned(
    start: Robot, data: Dataset, samples: _core.Samples, measured: _core.Measurements, threads: int, *, has_others: bool
) -> _core.Alignment:
    """The best rigid fit of base and tool to the rows, or to SHOWN_ROWS of very many that are all alike.

    What the fit of so many leaves uncertain is a hundredth of what the nominal arm is off.
    """
    is_split = data.station is not None or data.mount is not None or len(measured.parameters) > 0
    if (
        len(data) > SHOWN_ROWS
        and not has_others
        and not is_split
        and all(np.isfinite(t).all() for t in core_tables(data)[0].values())
    ):
        data = data.select(some_rows(len(data), SHOWN_ROWS))
        samples, measured = start.samples(data), measurements(data, start)
    return _core.align(start.error_model, samples, measured, threads)


def parameter_names(model: _core.ErrorModel) -> list[str]:
    """Names such as "joint2 a", in the order of the model."""
    return [full_name(parameter) for parameter in model.parameters]


def shown_ends(measured: _core.Measurements) -> dict[str, bool]:
    """What measurements can show of base and tool, as `asked_parameters` takes it."""
    return {"tool": measured.shows_tool, "turned": measured.shows_tool_turn, "placed": measured.shows_base}


def asked_parameters(
    model: _core.ErrorModel, geometry: bool, *, turned: bool, placed: bool, tool: bool = True
) -> list[int]:
    """Base and tool always (as far as the kind of measurement can show them), geometry where asked, every effect."""
    out = []
    own = len(model.robot.nominal)
    hidden = hidden_parameters(model.robot)
    for i, parameter in enumerate(model.parameters[:own]):
        owner = parameter.owner
        if owner == "base":
            if placed:
                out.append(i)
        elif owner == "tool":
            if tool and (turned or not parameter.name.startswith("r")):
                out.append(i)
        elif geometry and i not in hidden:
            out.append(i)
    return [*out, *range(own, len(model.start))]
