# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The tables of a calibration: accuracy, parameters, correlated pairs, rows that fit badly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal import units
from fastcal.measurements.kinds import POINTS
from fastcal.report.formatting import count, fixed, is_known, percent, plural, significant, with_uncertainty
from fastcal.report.kind_words import kind_title
from fastcal.report.language import _
from fastcal.report.tables import Cell, Column, Group, Table, capitalised, in_words, number_cell, unit_text
from fastcal.report.view import Rows

if TYPE_CHECKING:
    from fastcal.calibration.calibrate import IdentifiedParameter
    from fastcal.calibration.evaluation import Evaluation

OUTLIER_LIMIT = 25
PAIR_LIMIT = 15

_POSE = ("x", "y", "z", "rx", "ry", "rz")
_STATISTICS = ("mean", "std", "rms", "max")


def kind_table(parts: Sequence[tuple[str, Evaluation]]) -> Table | None:
    """Errors of every kind of reading on each set, each in its unit; None where only points were measured."""
    if all(name == POINTS for _set, part in parts for name in part.kinds):
        return None
    columns = [Column(_("What"), numeric=False), Column(_("Unit"), numeric=False), Column(_("Readings"))]
    columns += [Column(title) for title in (_("RMS before"), _("RMS after"), _("Max after"))]
    groups = []
    for title, part in parts:
        lines = []
        for of in part.kinds.values():
            before, after = of.statistics
            sizes = [
                None if before is None else before.rms,
                None if after is None else after.rms,
                None if after is None else after.max,
            ]
            lines.append(
                [
                    Cell(kind_title(of.kind)),
                    Cell(unit_text(of.kind.unit)),
                    Cell(count(0 if after is None else after.count)),
                    *(Cell("" if size is None else significant(of.kind.shown(size))) for size in sizes),
                ]
            )
        groups.append(Group(lines, title))
    return Table(_("Errors of each kind of reading"), columns, groups)


def accuracy_table(sets: list[Rows], outliers: int = 0) -> Table:
    """Mean, std, RMS and maximum of the error before and after on each set, and the share that remains.

    `outliers`: how many rows of the first set are some; they are counted.
    """
    unit = sets[0].unit
    titles = (f"{title} ({unit})" for title in (_("Mean"), _("Std"), "RMS", "Max"))
    of_poses = all(rows.after.count <= rows.row_count for rows in sets)
    counted = _("Poses") if of_poses else _("Readings")
    columns = [Column(_("State"), numeric=False), Column(counted), *(Column(title) for title in titles)]
    groups = []
    for rows in sets:
        before, after = ([float(getattr(state, name)) for name in _STATISTICS] for state in (rows.before, rows.after))
        smallest = min((size for size in after if size > 0.0), default=1.0)
        digits = int(np.clip(2 - np.floor(np.log10(smallest)), 2, 6))
        shares = [percent(b / a) if a > 0.0 else "" for a, b in zip(before, after, strict=True)]
        lines = [
            [Cell(title), Cell(count(state.count)), *(Cell(fixed(size, digits)) for size in sizes)]
            for title, state, sizes in (
                (_("before calibration"), rows.before, before),
                (_("after calibration"), rows.after, after),
            )
        ]
        lines.append([Cell(_("remaining")), Cell(""), *(Cell(share) for share in shares)])
        among = outliers if rows is sets[0] else 0
        note = _("with {outliers}", outliers=plural(among, "outlier")) if among else ""
        groups.append(Group(lines, _("{set} poses", set=rows.name), note))
    return Table(_("Error before and after calibration"), columns, groups)


def parameter_table(parameters: list[IdentifiedParameter], *, holds: bool = True) -> Table:
    """Nominal, identified, std and change of every parameter, in groups by owner in the order of the parameters.

    Args:
        parameters: Identified ones.
        holds: Do their standard deviations hold? Else the title of their column says so.
    """
    columns = [Column(_("Parameter"), numeric=False), Column(_("Unit"), numeric=False)]
    std = _("Std") if holds else _("Std (does not hold)")
    columns += [Column(title) for title in (_("Nominal"), _("Identified"), std, _("Change"), _("Change / std"))]
    groups = []
    for owner in dict.fromkeys(parameter.owner for parameter in parameters):
        rows = [_parameter_row(parameter) for parameter in parameters if parameter.owner == owner]
        groups.append(Group(rows, capitalised(in_words(owner)), plural(len(rows), "parameter")))
    caption = _("Parameters: nominal, identified, standard deviation and change")
    return Table(caption, columns, groups, is_sortable=True)


def correlated_table(pairs: list[tuple[str, str, float]]) -> Table | None:
    """The strongest correlations; None where there are none."""
    if not pairs:
        return None
    strongest = sorted(pairs, key=lambda pair: -abs(pair[2]))[:PAIR_LIMIT]
    rows = [
        [
            Cell(capitalised(in_words(first))),
            Cell(capitalised(in_words(second))),
            number_cell(fixed(r, 4 if abs(r) > 0.995 else 3), r),
        ]
        for first, second, r in strongest
    ]
    columns = [Column(_("Parameter"), numeric=False), Column(_("and"), numeric=False), Column(_("Correlation"))]
    return Table(_("Strongly correlated parameters"), columns, [Group(rows)])


def outlier_table(rows: Rows, outliers: Sequence[int] | NDArray[np.intp], weights: NDArray[np.float64]) -> Table | None:
    """The worst of the outlying rows with residual, weight (N,) and posture; None where there are none."""
    if len(outliers) == 0:
        return None
    error, outlying = rows.error_after, np.asarray(outliers, int)
    worst = outlying[np.argsort(-np.nan_to_num(error[outlying]))][:OUTLIER_LIMIT]
    parts = rows.components if len(rows.components) > 1 else ()
    titles = [f"{name} ({rows.unit})" for name in (_("Error"), *parts)]
    columns = [Column(title) for title in (_("Row"), *titles, _("Weight"))]
    units_of = ", ".join(dict.fromkeys(joint.unit for joint in rows.joints))
    columns.append(Column(_("Joint positions ({units})", units=units_of), numeric=False))
    lines = []
    for row in worst:
        numbers = [
            (rows.numbers[row], 0),
            (error[row], 3),
            *((rows.residual[row, k], 3) for k in range(len(parts))),
            (weights[row], 2),
        ]
        posture = ", ".join(fixed(float(joint.values[row]), 1) for joint in rows.joints)
        lines.append([*(number_cell(fixed(float(x), digits), float(x)) for x, digits in numbers), Cell(posture)])
    return Table(_("Rows that fit badly"), columns, [Group(lines)], is_sortable=True, rows_of=0)


def _is_placed(parameter: IdentifiedParameter) -> bool:
    """Whether it places a frame, an anchor or a plane, which every fit finds from nothing: no deviation is expected."""
    quantity = parameter.name.split("_")[0]
    return " " in parameter.owner or (parameter.owner in ("base", "tool") and quantity in _POSE)


def _parameter_row(parameter: IdentifiedParameter) -> list[Cell]:
    name, _ = units.parse_name(parameter.name)
    std = parameter.std
    if std is None or not is_known(std) or std <= 0.0:
        std = None
    unit = "deg" if parameter.unit == "rad" else parameter.unit  # as all other angles of the table
    factor = 1.0 if unit == parameter.unit else float(units.from_si(1.0, unit))
    nominal, value, std = factor * parameter.nominal, factor * parameter.value, None if std is None else factor * std
    change = value - nominal
    texts = with_uncertainty(std, nominal, value, change)
    ratio = abs(change) / std if std and not _is_placed(parameter) else None
    return [
        Cell(in_words(name)),
        Cell(unit_text(unit)),
        number_cell(texts[1], nominal),
        number_cell(texts[2], value),
        number_cell(texts[0], std),
        number_cell(texts[3], change),
        number_cell("" if ratio is None else fixed(ratio, 1 if ratio < 100 else 0), ratio),
    ]
