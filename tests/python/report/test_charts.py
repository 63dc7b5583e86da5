# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
from statistics import NormalDist

import numpy as np
import pytest

from fastcal.report import charts, figures


def test_cumulative_share_is_the_share_of_poses_within() -> None:
    errors = np.array([0.4, 0.1, np.nan, 0.3, 0.2])
    line = charts.cumulative([("after", errors, "#000000", "solid")], "mm").traces[0]
    np.testing.assert_allclose(line["x"], [0.1, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(line["y"], [25, 50, 75, 100])


def test_histogram_counts_every_pose_once() -> None:
    errors = np.abs(np.random.default_rng(0).normal(0, 0.1, 1000))
    errors[:5] = 30.0
    figure = charts.histogram([("test", errors, "#000000")], "mm")
    share = np.asarray(figure.traces[0]["y"])[1:-1:2]
    assert share.sum() == pytest.approx(100.0)
    beyond = int(np.count_nonzero(errors > figure.layout["xaxis"]["range"][1]))
    assert 5 <= beyond < 20
    assert share[-1] >= beyond / 10
    assert figure.note == f"Errors beyond the axis ({beyond}) are counted in the last bin."


def test_normal_noise_lies_on_the_line() -> None:
    total, sigma = 999, 0.05
    place = (np.arange(1, total + 1) - 0.375) / (total + 0.25)
    noise = np.array([NormalDist(0, sigma).inv_cdf(p) for p in place])
    np.random.default_rng(1).shuffle(noise)
    points, line = charts.normal_plot(noise, sigma, np.zeros(total, bool)).traces
    np.testing.assert_allclose(points["y"], sigma * points["x"], atol=1e-12)
    np.testing.assert_allclose(line["y"], sigma * np.array(line["x"]))


def test_normal_plot_keeps_the_tails_and_marks_outliers() -> None:
    residual = np.random.default_rng(2).normal(0, 1, 100_000)
    is_outlier = np.abs(residual) > 3.9
    points, outliers, _ = charts.normal_plot(residual, 1.0, is_outlier).traces
    assert len(points["x"]) + len(outliers["x"]) == 1500
    np.testing.assert_allclose(np.sort(outliers["y"]), np.sort(residual[is_outlier]))


def test_what_is_beyond_the_normal_plot_is_reported() -> None:
    residual = np.append(np.linspace(-1, 1, 50), [99.0, np.nan])
    figure = charts.normal_plot(residual, 1.0, np.zeros(52, bool))
    assert figure.layout["yaxis"]["range"] == [-15.0, 15.0]
    assert figure.note == "1 component beyond 15 standard deviations not drawn."


def test_trend_panel_draws_points_band_and_median_of_each_component() -> None:
    x = np.linspace(0, 1, 400)
    residual = np.column_stack([x, -x, np.full(400, np.nan)])
    key = charts.component_key(("x", "y", "z"))
    figure = charts.trend_panel("q1", ("joint 1", "joint 1 (°)"), x, residual, key, 1.0, np.arange(0, 400, 4))
    assert [trace["mode"] for trace in figure.traces] == ["markers"] * 3 + ["lines"] * 4
    np.testing.assert_allclose(figure.traces[4]["y"], figure.traces[4]["x"])
    np.testing.assert_allclose(figure.traces[6]["y"], -np.asarray(figure.traces[6]["x"]))


def test_a_logarithmic_axis_is_written_out() -> None:
    ticks = figures.log_ticks([0.03, 0.0, 4.0])
    assert ticks["ticktext"][:4] == ["0.01", "0.02", "0.05", "0.1"]
    assert ticks["tickvals"][-1] == 50.0
    assert figures.log_ticks([0.0]) == {}
