# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Identified parameters by what their change moves at the tool: one unit for lengths, angles, stiffnesses and waves."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fastcal.calibration.result import IdentifiedParameter
from fastcal.calibration.unknowns import CORNERS
from fastcal.effects.entries import edge_name
from fastcal.effects.values import polar_pairs
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.place import place_of
from fastcal.report import figures
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import significant
from fastcal.report.language import _
from fastcal.report.sections import bare
from fastcal.report.tables import capitalised, in_words
from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners
from fastcal.units import factor, from_si

if TYPE_CHECKING:
    from fastcal.calibration.result import CalibrationResult
    from fastcal.cells.calibrate import CellResult
    from fastcal.monitoring.compare import Comparison
    from fastcal.robot.robot import Robot


MOST = 24  # parameters drawn
_MOST_ROWS = 500  # that sizes are found from
_SIGNIFICANT = 2.0  # standard deviations
_PLACED = ("base", "tool")  # found anew by every fit: how far they are from where the file has them says nothing


@dataclass(frozen=True)
class Moved:
    """What one parameter's change moves at the tool, and its standard deviation [mm]; does it count as a change?"""

    parameter: IdentifiedParameter
    size: float
    std: float
    is_significant: bool

    @property
    def name(self) -> str:
        """As it is printed: joint 2 theta."""
        owner, name = self.parameter.owner, bare(self.parameter.name, self.parameter.unit)
        return f"{in_words(owner) if place_of(owner).arm else capitalised(in_words(owner))} {name}"


def moved_at_tool(result: CalibrationResult) -> list[Moved]:
    """The parameters of the arm, the significant ones first and in each half the largest first.

    The size of a change d is d * s, with s the root mean square over the rows of how far the tool moves by a unit of
    the parameter; what several parameters do together is not the sum of it. Phases and parameters on a bound, which
    have no symmetric deviation, are left out.
    """
    return _moved(result.parameters, dict(_slopes(result.model, result.train.data)))


def moved_in_cell(found: CellResult) -> list[Moved]:
    """The same of the arms of a cell: how far what is read moves, as what reads it sees it; RMS over rows and views."""
    used = found.readings.pick(figures.spread_rows(len(found.readings), _MOST_ROWS))
    model, samples = found.cell.model, used.samples(found.cell)
    own, square = len(found.cell.core.nominal), np.zeros(len(model.parameters))
    for name in found.views:
        field, _at, view = name.partition("@")
        at = np.zeros(3)
        if field == CORNERS:
            board, _colon, camera = view.partition(":")
            plate = found.cell.boards[board]
            at = (pose(plate) @ np.append(board_corners(plate).mean(axis=0), 1.0))[:3]
            view = f"{plate['on']}:{found.cell.cameras[camera]['on']}"
        J = np.asarray(model.parameter_jacobian(samples, model.start, 6, of=view))
        T = np.asarray(model.predict(samples, model.start, of=view)).reshape(-1, 4, 4)
        moves = J[:, :3] + np.cross(J[:, 3:], (T[:, :3, :3] @ at)[:, :, np.newaxis], axis=1)
        square += np.mean(np.sum(moves**2, axis=1), axis=0)
    sizes = np.sqrt(square / len(found.views))
    slopes = {
        (p.owner, edge_name(p, geometry=k < own)): float(sizes[k])
        for k, p in enumerate(model.parameters)
        if place_of(p.owner).arm and place_of(p.owner).number
    }
    return _moved(found.parameters, slopes)


def differences_at_tool(found: Comparison) -> list[Moved]:
    """The same of the differences between two models, of the parameters that both have, over the postures compared."""
    both = [
        IdentifiedParameter(d.name, d.owner, d.b, d.std, d.unit, d.a)
        for d in found.parameters
        if d.a is not None and d.b is not None
    ]
    at = Dataset(found.q, found.payload, position=found.points)
    try:
        slopes = dict(_slopes(found.first, at))
    except InvalidInput:  # an effect of the model wants a column that postures alone do not have
        return []
    return _moved(both, slopes, {(d.owner, d.name) for d in found.significant})


def _moved(
    parameters: Sequence[IdentifiedParameter],
    slopes: Mapping[tuple[str, str], float],
    beyond: Collection[tuple[str, str]] | None = None,
) -> list[Moved]:
    """`beyond`: those that count as changed; None: those changed by more than two standard deviations."""
    found = []
    for p in parameters:
        slope = slopes.get((p.owner, p.name))
        if slope is not None and p.std is not None and p.owner not in _PLACED:
            per_unit = float(from_si(slope, "mm")) * factor(p.unit)
            size, std = (p.value - p.nominal) * per_unit, p.std * per_unit
            counts = abs(size) > _SIGNIFICANT * std if beyond is None else (p.owner, p.name) in beyond
            found.append(Moved(p, size, std, counts))
    return sorted(found, key=lambda m: (not m.is_significant, -abs(m.size)))


def _slopes(model: Robot, data: Dataset) -> Iterator[tuple[tuple[str, str], float]]:
    """How far the tool moves [m] (RMS over rows) by a unit (SI) of each parameter, by its owner and written name."""
    rows = data.select(figures.spread_rows(len(data), _MOST_ROWS))
    core = model.error_model
    J = np.asarray(core.parameter_jacobian(model.samples(rows), core.start, 3, 1, None))
    own = len(model.core.nominal)
    pairs = polar_pairs(model.entries, model.effects, own, np.asarray(core.start))
    waves = {k: pair for pair in pairs for k in pair.indices}
    for k, parameter in enumerate(core.parameters):
        column = J[:, :, k]
        if k in waves:
            pair = waves[k]
            if k != pair.indices[0]:
                continue
            phase = pair.values[1]  # amplitude a, phase p: sine a cos p, cosine a sin p
            column = J[:, :, pair.indices[0]] * np.cos(phase) + J[:, :, pair.indices[1]] * np.sin(phase)
            name = pair.names[0]
        else:
            name = edge_name(parameter, geometry=k < own)
        yield (parameter.owner, name), float(np.sqrt(np.mean(np.sum(column**2, axis=1))))


def sizes_figure(moved: list[Moved], *, compared: bool = False) -> Figure | None:
    """A dot a parameter with its 95 % interval, in mm at the tool; None where there are none.

    compared: The changes are from one model to another, not from nominal.
    """
    if not moved:
        return None
    shown = moved[:MOST][::-1]
    names = [m.name for m in shown]
    traces = []
    for is_significant, colour in ((True, figures.AFTER), (False, figures.BEFORE)):
        some = [m for m in shown if m.is_significant == is_significant]
        texts = [
            f"{significant(m.size, 3)} ± {significant(1.96 * m.std, 2)} mm "
            f"({significant(m.parameter.value - m.parameter.nominal, 3)} {m.parameter.unit})"
            for m in some
        ]
        dots = figures.points([m.size for m in some], [m.name for m in some], colour, 9, hover="%{y}: %{text}")
        bars = {"type": "data", "array": [1.96 * m.std for m in some], "color": colour, "thickness": 1.5, "width": 4}
        traces.append(dots | {"text": texts, "error_x": bars})
    drawn = figures.layout(
        _("change, as it moves the tool (mm, RMS over the poses)"), "",
        yaxis={
            "type": "category", "automargin": True, "nticks": 0, "dtick": 1,
            "categoryorder": "array", "categoryarray": names,
        },
        margin={"l": 120},
    )  # fmt: skip
    largest = max(shown, key=lambda m: abs(m.size))
    alt = _(
        "Each parameter's change and its 95 % interval in mm at the tool; the largest is {name} with {size} mm.",
        name=largest.name, size=significant(abs(largest.size), 2),
    )  # fmt: skip
    note = "" if len(moved) <= MOST else _("The {some} first of {all} are drawn.", some=MOST, all=len(moved))
    title = _("What the differences move at the tool") if compared else _("What the changes move at the tool")
    beyond = _("beyond noise") if compared else _("significant (95 %)")
    key = [Key(beyond, figures.AFTER, "point")] if any(m.is_significant for m in shown) else []
    key.append(Key(_("within noise") if compared else _("not distinguishable from nominal"), figures.BEFORE, "point"))
    return Figure(
        "sizes", title, alt, traces, drawn, note,
        height=70 + 22 * len(shown), paper_height=60 + 14 * len(shown), key=key,
    )  # fmt: skip
