# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from fastcal.report import workspace
from fastcal.report.workspace import ARROW_LIMIT, arrow_modes, arrow_scale, flat_views, scene


def cloud(count: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions in a cube of 1 m and vectors of `size` mm, all in mm."""
    random = np.random.default_rng(count)
    vectors = random.normal(size=(count, 3))
    return random.uniform(0, 1000, (count, 3)), size * vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.mark.parametrize(("size", "scale"), [(1.0, 100.0), (0.1, 1000.0), (0.65, 200.0), (2.5, 50.0), (500.0, 0.2)])
def test_scale_is_a_round_number_near_8_percent_of_the_diagonal(size: float, scale: float) -> None:
    corners = np.array([[0.0, 0, 0], [1000, 1000, 1000]])  # diagonal 1732 mm, arrows up to 138.6 mm
    positions, vectors = cloud(100, size)
    assert arrow_scale(np.vstack([positions, corners]), np.vstack([vectors, vectors[:2]])) == scale


def test_without_an_error_nothing_is_enlarged() -> None:
    assert arrow_scale(cloud(10, 1.0)[0], np.zeros((10, 3))) == 1.0


def test_after_is_shown_at_the_scale_of_before_and_at_its_own() -> None:
    positions, before = cloud(200, 1.0)
    modes = arrow_modes(positions, before, before / 10)
    assert [mode.scale for mode in modes] == [100.0, 100.0, 1000.0]
    assert modes[1].colour_end == modes[0].colour_end


def test_an_arrow_is_its_error_times_the_scale_with_two_barbs_at_the_end() -> None:
    positions, before = cloud(50, 1.0)
    figure = scene(positions, before, before / 10, None, "the frame")
    lines = np.column_stack([figure.traces[0][axis] for axis in "xyz"]).reshape(50, -1, 3)
    start, end, gap, left, tip, right, last = lines.transpose(1, 0, 2)
    np.testing.assert_allclose(start, positions)
    np.testing.assert_allclose(end - start, 100.0 * before, atol=1e-9)
    np.testing.assert_array_equal(tip, end)
    assert np.isnan(gap).all()
    assert np.isnan(last).all()
    along = (before / np.linalg.norm(before, axis=1, keepdims=True))[:, None]
    barbs = np.stack([left, right], axis=1) - end[:, None]
    assert (np.sum(barbs * along, axis=2) < 0).all()
    np.testing.assert_allclose(*np.linalg.norm(barbs, axis=2).T)


def test_an_error_of_zero_has_an_arrow_of_no_length() -> None:
    positions, before = cloud(20, 1.0)
    before[3] = 0.0
    lines = workspace.scene(positions, before, before, None, "the frame").traces[0]
    assert lines["x"][7 * 3 + 1] == positions[3, 0]


def test_many_rows_are_thinned_and_that_is_reported() -> None:
    positions, before = cloud(5000, 1.0)
    figure = scene(positions, before, before / 10, None, "the frame")
    assert len(figure.traces[1]["x"]) == ARROW_LIMIT
    assert "450 of 5\N{NARROW NO-BREAK SPACE}000 poses are drawn" in figure.note


def test_buttons_name_their_scale_and_cover_the_traces() -> None:
    positions, before = cloud(100, 1.0)
    figure = scene(positions, before, before / 10, positions.mean(axis=0), "the frame")
    assert [control["label"] for control in figure.controls] == [
        f"{name} ×\N{NARROW NO-BREAK SPACE}{scale}"
        for name, scale in (("Before", 100), ("After, same scale", 100), ("After, enlarged", 1000))
    ]
    assert [trace.get("visible") for trace in figure.traces] == [True, True, False, False, False, False, None]
    assert [k for control in figure.controls for k in control["traces"]] == list(range(6))


def test_a_far_base_does_not_make_the_arrows_small() -> None:
    positions, before = cloud(100, 1.0)
    near = scene(positions, before, before / 10, np.array([500.0, 500.0, -300.0]), "the frame")
    far = scene(positions, before, before / 10, np.array([500.0, 500.0, -900.0]), "the frame")
    assert len(near.traces) == len(far.traces) + 1
    assert near.layout["scene"]["zaxis"]["range"][0] < -300 < -100 < far.layout["scene"]["zaxis"]["range"][0]


def test_flat_views_show_the_two_axes_they_name() -> None:
    positions, before = cloud(30, 1.0)
    views = {figure.id: figure for figure in flat_views(positions, before, before / 10)}
    assert len(views) == 6
    front = views["flat-front-before"]
    assert [front.layout[name]["title"]["text"] for name in ("xaxis", "yaxis")] == ["x (mm)", "z (mm)"]
    np.testing.assert_allclose(front.traces[1]["x"], positions[:, 0])
    np.testing.assert_allclose(front.traces[1]["y"], positions[:, 2])
    np.testing.assert_allclose(np.asarray(front.traces[0]["y"])[1::3], (positions + 100 * before)[:, 2])


def test_the_arrows_of_outliers_are_cut_and_leave_colours_to_the_others() -> None:
    positions, before = cloud(100, 1.0)
    before[:4] *= 500  # 50 m long at the scale of the others
    figure = scene(positions, before, before / 10, None, "the frame")
    lines = np.column_stack([figure.traces[0][axis] for axis in "xyz"]).reshape(100, -1, 3)
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
    diagonal = np.linalg.norm(np.ptp(positions, axis=0))
    np.testing.assert_allclose(length[:4], 0.3 * diagonal)
    np.testing.assert_allclose(length[4:], 100.0)
    assert figure.traces[0]["line"]["cmax"] == pytest.approx(3.0)
    assert "are cut" in figure.note
    for view in flat_views(positions, before, before / 10):
        x = np.asarray(view.traces[0]["x"])
        assert np.nanmax(np.abs(x - np.clip(x, 0, 1000))) < 0.31 * diagonal
    assert "are cut" not in scene(*cloud(100, 1.0), None, None, "the frame").note
