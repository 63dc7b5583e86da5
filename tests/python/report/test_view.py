# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fastcal import units
from fastcal.calibration.calibrate import CalibrationResult
from fastcal.calibration.evaluation import ErrorStatistics, Evaluation, distances
from fastcal.calibration.kind_errors import table
from fastcal.calibration.result import IdentifiedParameter
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import kind_named
from fastcal.report import tables
from fastcal.report.calibration_tables import accuracy_table, kind_table, outlier_table, parameter_table
from fastcal.report.view import rows_of

TYPES = ["revolute"] * 6


def test_the_error_of_rows_agrees_with_the_evaluations_statistics(
    make_result: Callable[..., CalibrationResult],
) -> None:
    for kind in ({}, {"missing": 0.2}, {"lengths": True}):
        rows = rows_of("Training", make_result(rows=200, **kind).train, TYPES)
        assert rows is not None
        known = rows.error_after[np.isfinite(rows.error_after)]
        assert len(known) == rows.after.count
        np.testing.assert_allclose([known.mean(), known.max()], [rows.after.mean, rows.after.max], rtol=1e-12)


def test_a_joint_that_moves_by_rounding_is_no_variable(make_result: Callable[..., CalibrationResult]) -> None:
    """A passive joint of a delta has the same angle in every posture, to 1e-7 deg: its panel showed that."""
    result = make_result(rows=50)
    q = result.train.data.q.copy()
    q[:, 3] = 1e-9 * np.random.default_rng(1).standard_normal(50)
    train = replace(result.train, data=replace(result.train.data, q=q))
    rows = rows_of("Training", train, TYPES)
    assert rows is not None
    assert [variable.name for variable in rows.variables if variable.name.startswith("q")] == [
        *("q1", "q2", "q3", "q5", "q6")
    ]


def test_stations_are_named_in_words() -> None:
    assert tables.in_words("base station2_y and joint1 theta").replace("\N{NO-BREAK SPACE}", " ") == (
        "base station 2 y and joint 1 theta"
    )


def test_units_are_those_of_the_page(make_result: Callable[..., CalibrationResult]) -> None:
    result = make_result(rows=50)
    rows = rows_of("Training", result.train, ["prismatic", *TYPES[1:]])
    assert rows is not None
    assert [rows.joints[0].unit, rows.joints[1].unit] == ["mm", "°"]
    np.testing.assert_allclose(rows.joints[0].values, 1000 * result.train.data.q[:, 0])
    np.testing.assert_allclose(rows.joints[1].values, np.degrees(result.train.data.q[:, 1]))
    np.testing.assert_allclose(rows.residual, 1000 * result.train.error_after)
    temperature = next(variable for variable in rows.variables if variable.name == "temperature")
    assert temperature.label == "temperature (°C)"
    np.testing.assert_allclose(temperature.values, np.asarray(result.train.data.temperature) - 273.15)


def test_what_does_not_vary_has_no_panel(make_result: Callable[..., CalibrationResult]) -> None:
    rows = rows_of("Training", make_result(rows=50, conditions=False).train, TYPES)
    assert rows is not None
    assert [variable.name for variable in rows.variables] == ["q1", "q2", "q3", "q4", "q5", "q6", "order"]


def test_points_are_spoken_of_and_lengths_have_their_own_line() -> None:
    point = np.array([[3e-3, 0.0, 4e-3], [np.nan] * 3, [np.nan, 1e-3, 0.0]])
    length = np.array([np.nan, -2e-3, np.nan])
    data = Dataset(np.zeros((3, 6)), np.zeros(3), position=np.zeros((3, 3)), distance=np.ones(3))
    numbers = {kind_named("position"): point[:, np.newaxis], kind_named("length"): length.reshape(-1, 1, 1)}
    judged = ErrorStatistics.of(distances(point))
    found = Evaluation(data, point, length, None, judged, point, judged, kinds=table(numbers, numbers))
    rows = rows_of("Training", found, TYPES)
    assert rows is not None
    assert rows.components == ("x", "y", "z")
    np.testing.assert_allclose(rows.error_after, [5.0, np.nan, np.nan])
    assert rows.with_arrows.tolist() == [True, False, False]
    lines = kind_table([("Training", found)])
    assert lines is not None
    assert [[cell.text for cell in row] for row in lines.groups[0].rows] == [
        ["Positions", "mm", "1", "5.00", "5.00", "5.00"],
        ["Lengths", "mm", "1", "2.00", "2.00", "2.00"],
    ]


def test_a_set_without_anything_to_judge_has_no_rows() -> None:
    nothing = np.full((4, 3), np.nan)
    data = Dataset(np.zeros((4, 6)), np.zeros(4))
    assert rows_of("Test", Evaluation(data, nothing, None, None, None, nothing), TYPES) is None
    assert rows_of("Test", None, TYPES) is None


def test_every_unit_has_a_printed_form() -> None:
    assert [unit for unit in units.UNITS if "_" in tables.unit_text(unit)] == []


def test_parameters_are_grouped_by_owner_and_sorted_by_value(make_result: Callable[..., CalibrationResult]) -> None:
    result = make_result(rows=50)
    table = parameter_table(result.parameters)
    assert [group.title for group in table.groups][:2] == ["Joint\N{NO-BREAK SPACE}1", "Joint\N{NO-BREAK SPACE}2"]
    assert [group.title for group in table.groups][-2:] == ["Base", "Tool"]
    assert sum(len(group.rows) for group in table.groups) == len(result.parameters)
    theta = table.groups[0].rows[0]
    assert [theta[0].text, theta[1].text] == ["theta", "°"]
    parameter = result.parameters[0]
    assert [cell.sort for cell in theta[2:5]] == [parameter.nominal, parameter.value, parameter.std]
    assert theta[6].sort == abs(parameter.value - parameter.nominal) / parameter.std


def test_accuracy_shows_what_remains(make_result: Callable[..., CalibrationResult]) -> None:
    rows = rows_of("Test", make_result(rows=50, test_rows=40).test, TYPES)
    assert rows is not None
    before, after, left = accuracy_table([rows]).groups[0].rows
    assert float(before[2].text) == round(rows.before.mean, 4)
    share = rows.after.mean / rows.before.mean
    assert abs(float(left[2].text.split("\N{NARROW NO-BREAK SPACE}")[0]) / 100 - share) < 0.0051
    assert [before[1].text, after[1].text] == ["40", "40"]


def test_the_worst_row_is_first(make_result: Callable[..., CalibrationResult]) -> None:
    result = make_result(rows=300, outlier_count=40)
    rows = rows_of("Training", result.train, TYPES)
    assert rows is not None
    table = outlier_table(rows, result.outliers, result.weights)
    assert table is not None
    listed = table.groups[0].rows
    assert len(listed) == 25
    errors = [cells[1].sort for cells in listed]
    assert errors == sorted(errors, reverse=True)
    assert listed[0][0].sort == float(np.argmax(rows.error_after))
    assert len(listed[0][-1].text.split(", ")) == 6


def test_the_place_of_a_station_is_told_in_the_words_and_units_of_the_others() -> None:
    turned = IdentifiedParameter("station2_rx_rad", "base", 1e-3, 1e-5, "rad", 0.0)
    (group,) = parameter_table([turned]).groups
    texts = [cell.text for cell in group.rows[0]]
    assert texts[:4] == ["station\N{NO-BREAK SPACE}2 rx", "°", "0.00000", "0.05730"]
    assert group.rows[0][3].sort == pytest.approx(np.rad2deg(1e-3))
