# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The tables of a calibration: accuracy, parameters, correlated pairs, rows that fit badly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal import units
from fastcal.report.formatting import count, fixed, is_known, percent, plural, with_uncertainty
from fastcal.report.tables import Cell, Column, Group, Table, capitalised, number_cell, spaced, unit_text
from fastcal.report.view import Rows

if TYPE_CHECKING:
    from fastcal.calibration.calibrate import IdentifiedParameter

OUTLIER_LIMIT = 25
PAIR_LIMIT = 15

_STATISTICS = {"mean": "Mean (mm)", "std": "Std (mm)", "rms": "RMS (mm)", "max": "Max (mm)"}


def accuracy_table(sets: list[Rows]) -> Table:
    """Mean, std, RMS and maximum of the error before and after on each set, and the share that remains."""
    columns = [Column("", numeric=False), Column("Poses"), *(Column(title) for title in _STATISTICS.values())]
    groups = []
    for rows in sets:
        before, after = ([float(getattr(state, name)) for name in _STATISTICS] for state in (rows.before, rows.after))
        smallest = min((size for size in after if size > 0.0), default=1.0)
        digits = int(np.clip(2 - np.floor(np.log10(smallest)), 2, 6))
        shares = [percent(b / a) if a > 0.0 else "" for a, b in zip(before, after, strict=True)]
        lines = [
            [Cell(title), Cell(count(state.count)), *(Cell(fixed(size, digits)) for size in sizes)]
            for title, state, sizes in (
                ("before calibration", rows.before, before),
                ("after calibration", rows.after, after),
            )
        ]
        lines.append([Cell("remaining"), Cell(""), *(Cell(share) for share in shares)])
        groups.append(Group(lines, f"{rows.name} poses"))
    return Table("Error before and after calibration, in millimetres", columns, groups)


def parameter_table(parameters: list[IdentifiedParameter]) -> Table:
    """Nominal, identified, std and change of every parameter, in groups by owner in the order of the parameters."""
    columns = [Column("Parameter", numeric=False), Column("Unit", numeric=False)]
    columns += [Column(title) for title in ("Nominal", "Identified", "Std", "Change", "Change / std")]
    groups = []
    for owner in dict.fromkeys(parameter.owner for parameter in parameters):
        rows = [_parameter_row(parameter) for parameter in parameters if parameter.owner == owner]
        groups.append(Group(rows, capitalised(spaced(owner)), plural(len(rows), "parameter")))
    return Table("Parameters: nominal, identified, standard deviation and change", columns, groups, is_sortable=True)


def correlated_table(pairs: list[tuple[str, str, float]]) -> Table | None:
    """The strongest correlations; None where there are none."""
    if not pairs:
        return None
    strongest = sorted(pairs, key=lambda pair: -abs(pair[2]))[:PAIR_LIMIT]
    rows = [
        [
            Cell(capitalised(spaced(first))),
            Cell(capitalised(spaced(second))),
            number_cell(fixed(r, 4 if abs(r) > 0.995 else 3), r),
        ]
        for first, second, r in strongest
    ]
    columns = [Column("Parameter", numeric=False), Column("and", numeric=False), Column("Correlation")]
    return Table("Strongly correlated parameters", columns, [Group(rows)])


def outlier_table(rows: Rows, outliers: list[int], weights: NDArray[np.float64]) -> Table | None:
    """The worst of the outlying rows with residual, weight (N,) and posture; None where there are none."""
    if len(outliers) == 0:
        return None
    error, outlying = rows.error_after, np.asarray(outliers, int)
    worst = outlying[np.argsort(-np.nan_to_num(error[outlying]))][:OUTLIER_LIMIT]
    parts = rows.components if len(rows.components) > 1 else ()
    columns = [Column(title) for title in ("Row", "Error (mm)", *(f"{name} (mm)" for name in parts), "Weight")]
    columns.append(
        Column(f"Joint positions ({', '.join(dict.fromkeys(joint.unit for joint in rows.joints))})", numeric=False)
    )
    lines = []
    for row in worst:
        numbers = [
            (row, 0),
            (error[row], 3),
            *((rows.residual[row, k], 3) for k in range(len(parts))),
            (weights[row], 2),
        ]
        posture = ", ".join(fixed(float(joint.values[row]), 1) for joint in rows.joints)
        lines.append([*(number_cell(fixed(float(x), digits), float(x)) for x, digits in numbers), Cell(posture)])
    return Table("Rows that fit badly", columns, [Group(lines)], is_sortable=True)


def _parameter_row(parameter: IdentifiedParameter) -> list[Cell]:
    name, _ = units.parse_name(parameter.name)
    std = parameter.std
    if std is None or not is_known(std) or std <= 0.0:
        std = None
    change = parameter.value - parameter.nominal
    texts = with_uncertainty(std, parameter.nominal, parameter.value, change)
    ratio = abs(change) / std if std else None
    return [
        Cell(name),
        Cell(unit_text(parameter.unit)),
        number_cell(texts[1], parameter.nominal),
        number_cell(texts[2], parameter.value),
        number_cell(texts[0], std),
        number_cell(texts[3], change),
        number_cell("" if ratio is None else fixed(ratio, 1 if ratio < 100 else 0), ratio),
    ]
