# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots, data and results in a shell and a notebook: short, right, and the charts of the report."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import plotly.graph_objects as go
import pytest

import fastcal
from fastcal import CalibrationResult, Diagnosis, InvalidInput
from fastcal.report import effect_figures, figures
from fastcal.report.still import WIDTH, still


@pytest.fixture(scope="module")
def found(hidden_backlash) -> Diagnosis:
    return fastcal.diagnose(hidden_backlash.robot, hidden_backlash.data, test=hidden_backlash.test)


@pytest.fixture(scope="module")
def result(hidden_backlash) -> CalibrationResult:
    return fastcal.calibrate(hidden_backlash.robot, hidden_backlash.data, test=hidden_backlash.test)


def test_a_repr_is_one_short_line(hidden_backlash, result: CalibrationResult, found: Diagnosis) -> None:
    for shown in (hidden_backlash.robot, hidden_backlash.data, result, result.train, found):
        text = repr(shown)
        assert text.startswith(f"<{type(shown).__name__}: ")
        assert "\n" not in text
        assert len(text) < 160
    assert "backlash@joint3" in repr(found)
    assert f"{result.test.after.to_mm()['rms']:.4f} mm on test poses" in repr(result)


def test_a_summary_has_the_figures(result: CalibrationResult, found: Diagnosis) -> None:
    text = result.summary()
    for size in (result.train.before.rms, result.train.after.rms, result.test.after.rms, result.sigma):
        assert f"{1e3 * size:.4f} mm" in text
    assert f"RMS of fit {found.gap[-1].train_rms_mm:.4f} mm" in found.summary()
    assert found.sentence in found.summary()
    assert "ISO" not in result.train.summary()


def test_a_table_for_each(hidden_backlash, result: CalibrationResult, found: Diagnosis) -> None:
    robot = hidden_backlash.robot
    joints = robot.to_frame()
    assert list(joints.index) == [f"joint{i}" for i in range(1, robot.joint_count + 1)]
    parameters = result.to_frame()
    assert list(parameters["value"]) == [p.value for p in result.parameters]
    assert ((parameters["low_95"] < parameters["value"]) & (parameters["value"] < parameters["high_95"])).all()
    errors = result.train.to_frame()
    assert np.sqrt(np.mean(errors["error_mm"] ** 2)) == pytest.approx(result.train.after.to_mm()["rms"])
    (row,) = found.to_frame().to_dict("records")
    assert (row["effect"], row["parameter"]) == ("backlash", "gap_rad")
    assert row["value"] == found.effects[0].parameters["gap_rad"].value


def test_html_is_escaped_and_not_long(hidden_backlash, result: CalibrationResult, found: Diagnosis) -> None:
    for shown in (hidden_backlash.robot, hidden_backlash.data, result, result.train, found):
        assert len(shown._repr_html_()) < 12_000
    named = fastcal.load_robot(hidden_backlash.robot.spec | {"name": "<script>x</script>"})
    assert "<script>" not in named._repr_html_()


@pytest.mark.parametrize("kind", ["errors", "histogram", "residuals", "workspace", "arm", "noise"])
def test_the_charts_of_the_report_are_plotly_figures(result: CalibrationResult, found: Diagnosis, kind: str) -> None:
    for shown in (result, found):
        figure = getattr(shown, f"plot_{kind}")()
        assert isinstance(figure, go.Figure)
        drawn = json.loads(figure.to_json())
        assert any(trace.get("x") for trace in drawn["data"])
        assert drawn["layout"]["meta"]["alt"]


@pytest.mark.parametrize("kind", ["errors", "histogram", "residuals", "workspace", "arm", "noise", "parameters"])
def test_a_chart_is_a_picture_where_no_script_runs(result: CalibrationResult, kind: str) -> None:
    """A saved notebook keeps it, as SVG and in the HTML, from which only a script takes it away."""
    figure = getattr(result, f"plot_{kind}")()
    in_jupyter = {"application/vnd.plotly.v1+json": {}, "text/html": "<div></div><script>draw()</script>"}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(go.Figure, "_repr_mimebundle_", lambda *_, **__: in_jupyter)
        bundle = figure._repr_mimebundle_()
    assert bundle.keys() == in_jupyter.keys() | {"image/svg+xml"}
    assert "<script>draw()</script>" in bundle["text/html"]
    picture = bundle["image/svg+xml"]
    assert picture in bundle["text/html"].split("<script")[0]
    drawn = ElementTree.fromstring(picture)  # noqa: S314 - our own
    marks = [each for each in drawn.iter() if each.tag.rpartition("}")[2] in ("path", "circle")]
    assert len(marks) > (2 if kind in ("errors", "histogram") else 10)
    texts = [each.text for each in drawn.iter() if each.tag.endswith("text")]
    assert any("mm" in str(text) for text in texts)
    assert "nan" not in picture
    if kind == "arm":  # each joint is a disc with a rim
        joints = [each for each in marks if each.get("stroke") == figures.INK]
        assert len(joints) >= result.model.joint_count


def test_a_still_picture_has_its_points_where_the_numbers_are() -> None:
    drawn = figures.layout("x (mm)", "y (mm)", xaxis={"range": [0, 10]}, yaxis={"range": [0, 100]})
    traces = [figures.points([0.0, 5.0, 10.0], [0.0, 50.0, 100.0], "#d55e00", 6)]
    picture = ElementTree.fromstring(still([figures.Figure("f", "title", "alt <&>", traces, drawn)]))  # noqa: S314 - our own
    dots = [each for each in picture.iter() if each.tag.endswith("circle")]
    x, y = (np.array([float(str(dot.get(name))) for dot in dots]) for name in ("cx", "cy"))
    assert x[1] == pytest.approx((x[0] + x[2]) / 2, abs=0.1)
    assert y[1] == pytest.approx((y[0] + y[2]) / 2, abs=0.1)
    assert x[2] - x[0] == pytest.approx(WIDTH - 70 - 16, abs=0.1)
    assert y[0] > y[2]
    assert picture.get("aria-label") == "alt <&>"


def test_the_arm_and_the_parameters_are_drawn_too(result: CalibrationResult) -> None:
    drawn = result.plot_arm().data
    chain, joints, point = drawn[-3:]
    assert len(joints.x) == result.model.joint_count
    rows = np.vstack([result.train.data.position, result.test.data.position])
    errors = np.linalg.norm(np.vstack([result.train.error_after, result.test.error_after]), axis=1)
    worst = int(np.argmax(errors))
    np.testing.assert_allclose([point.x[0], point.y[0], point.z[0]], 1e3 * rows[worst], atol=1e-6)
    np.testing.assert_allclose([chain.x[-1], chain.y[-1], chain.z[-1]], 1e3 * rows[worst], atol=5)
    dots = result.plot_parameters().data
    shown = {name for trace in dots[:2] for name in trace.y}
    assert shown
    assert not any(name.startswith(("Base", "Tool")) for name in shown)


def test_the_arm_of_a_check_and_a_comparison(result: CalibrationResult) -> None:
    """Where they say that something moved: its rows, errors and joints, as on their pages."""
    model = result.model
    checked = fastcal.check(model, result.test.data)
    compared = fastcal.compare(model, fastcal.perturbed(model, seed=3))
    for shown in (checked, compared):
        drawn = shown.plot_arm()
        assert "<svg" in drawn._still
        joints = drawn.data[-2]
        assert len(joints.x) == model.joint_count


def test_a_chart_that_is_saved_by_itself_is_a_picture_without_javascript(
    result: CalibrationResult, tmp_path: Path
) -> None:
    drawn = result.plot_gap()
    drawn.write_html(tmp_path / "gap.html", include_plotlyjs="cdn")
    page = (tmp_path / "gap.html").read_text()
    assert page == drawn.to_html(include_plotlyjs="cdn", div_id=re.search(r'div id="([^"]+)"', page)[1])
    assert f"<body><noscript>{drawn._still}</noscript>" in page
    part = drawn.to_html(full_html=False, include_plotlyjs=False)
    assert part.startswith(f"<noscript>{drawn._still}</noscript>")


def test_the_gap_of_a_calibration(result: CalibrationResult) -> None:
    """Of the test poses: before, what was taken of it, after."""
    before, after = (of.to_mm()["rms"] for of in (result.test.before, result.test.after))
    drawn = result.plot_gap()
    bars, noise = drawn.data[:2]
    np.testing.assert_allclose(bars.x, [before, before - after, after])
    np.testing.assert_allclose(noise.x, 1e3 * result.sigma * np.sqrt(3))
    assert "<svg" in drawn._still


def test_what_a_model_is_used_for_shows_itself_too(result: CalibrationResult) -> None:
    model, data = result.model, result.train.data[:4]
    poses = model.forward(data.q)
    line = np.array([poses[0], poses[0]])
    line[1, 2, 3] += 0.01
    predicted = fastcal.predict(model, data)
    solved = fastcal.inverse_kinematics(model, poses, seed=data.q)
    commands = fastcal.compensate(model, poses, seed=data.q, along_path=False)
    path = fastcal.path_accuracy(model, line, seed=data.q[0])
    design = fastcal.design_poses(model, 10, candidate_count=64)
    targets = fastcal.Targets(poses)
    for shown in (predicted, solved, commands, path, design, targets):
        assert len(repr(shown)) < 160
        assert repr(shown).startswith(f"<{type(shown).__name__}: ")
        assert repr(shown)[1:-1].partition(": ")[2].split(" ")[0] in shown.summary()
        assert shown._repr_html_().count("<tr") > 1
    np.testing.assert_allclose(predicted.to_frame()["x_mm"], 1e3 * predicted.position[:, 0])
    for found in (solved, commands, design):
        np.testing.assert_allclose(found.to_frame()["q2_deg"], np.degrees(found.q[:, 1]))
    assert repr(solved) == "<InverseKinematics: 4 targets: 4 reached>"
    assert list(commands.to_frame()["status"]) == ["reached"] * 4
    assert path.to_frame()["error_after_mm"].max() == pytest.approx(1e3 * path.after.max())
    assert json.loads(path.plot_path().to_json())["layout"]["meta"]["alt"]


def test_targets_that_are_missed_are_named(result: CalibrationResult) -> None:
    far = result.model.forward(result.train.data.q[:8])
    far[:6, 0, 3] += 50.0
    found = fastcal.inverse_kinematics(result.model, far, seed=result.train.data.q[:8], restarts=0)
    lines = found.summary().splitlines()
    assert lines[0] == "8 targets: 6 unreachable, 2 reached"
    assert lines[1].startswith("row 0: the target is out of reach; the nearest pose is ")
    assert lines[-1] == "and 1 row more"


def test_residuals_over_a_variable(result: CalibrationResult) -> None:
    drawn = result.plot_residuals("q2")
    assert drawn.layout.xaxis.title.text == "joint 2 (°)"
    assert [trace.name for trace in drawn.data if trace.showlegend is not False] == ["x", "y", "z"]
    with pytest.raises(InvalidInput, match=r"can be drawn over q1, .*, got 'q9'"):
        result.plot_residuals("q9")


def test_a_diagnosis_draws_its_gap_and_its_effect(found: Diagnosis, hidden_backlash) -> None:
    bars = found.plot_gap().data[0]
    assert bars.x[0] == pytest.approx(found.gap[0].test_rms_mm)
    effect = found.plot_effect("backlash@joint3")
    assert [trace.name for trace in effect.data if trace.showlegend is not False] == [
        k.label for k in effect_figures.effect_key()
    ]
    fitted = [trace for trace in effect.data if trace.mode == "lines" and trace.y is not None and len(trace.y) == 2]
    levels = sorted(float(trace.y[0]) for trace in fitted if trace.y[0] is not None)
    unit = {"arcmin": 60 * 180 / np.pi, "arcsec": 3600 * 180 / np.pi, "mrad": 1e3, "°": 180 / np.pi}
    text = effect.layout.yaxis.title.text
    scale = next(size for name, size in unit.items() if f"({name})" in text)
    assert levels[-1] - levels[0] == pytest.approx(scale * abs(found.effects[0].parameters["gap_rad"].value), rel=0.05)
    with pytest.raises(InvalidInput, match="there is no finding gear@joint1; found were backlash@joint3"):
        found.plot_effect("gear@joint1")


def test_a_diagnosis_draws_which_causes_look_alike(found: Diagnosis) -> None:
    shares, _written = found.plot_likeness().data
    np.testing.assert_allclose(np.diag(np.array(shares.z, dtype=float)), 1, atol=1e-9)
    assert np.nanmax(shares.z) <= 1 + 1e-9


def test_one_way_to_write(result: CalibrationResult, found: Diagnosis, tmp_path: Path) -> None:
    result.save(tmp_path / "calibration")
    found.save(tmp_path / "diagnosis")
    assert {p.name for p in (tmp_path / "calibration").iterdir()} == {"model.yaml", "result.json", "report.html"}
    assert {"model.yaml", "diagnosis.json", "report.html"} <= {p.name for p in (tmp_path / "diagnosis").iterdir()}
    for shown in (result, found):
        fastcal.write_report(shown, tmp_path / "page.html")
        assert shown.model.name in (tmp_path / "page.html").read_text(encoding="utf-8")
    with pytest.raises(InvalidInput, match="expected a CalibrationResult or a Diagnosis, got Robot"):
        fastcal.write_report(result.model, tmp_path / "page.html")  # type: ignore[arg-type]


def test_paths_tables_and_names_are_read(hidden_backlash, result: CalibrationResult, tmp_path: Path) -> None:
    robot, data = hidden_backlash.robot, hidden_backlash.data
    robot.save(tmp_path / "robot.yaml")
    fastcal.write_measurements(tmp_path / "data.csv", data, robot.joint_types)
    for given in (
        tmp_path / "data.csv",
        str(tmp_path / "data.csv"),
        fastcal.load_measurements(tmp_path / "data.csv", robot).to_frame(),
    ):
        again = fastcal.calibrate(str(tmp_path / "robot.yaml"), given)
        assert again.train.after.rms == pytest.approx(result.train.after.rms, rel=1e-9)
    assert fastcal.evaluate(result.model, tmp_path / "data.csv").after.rms == pytest.approx(result.train.after.rms)
    assert len(fastcal.predict(result.model, tmp_path / "data.csv").position) == len(data)


@pytest.mark.parametrize(
    ("slip", "message"),
    [
        (lambda r, d, c: fastcal.calibrate(d, r), "the robot comes first and the data second, got a Dataset"),
        (lambda r, d, c: fastcal.calibrate(r, r), "the robot comes first and the data second, got a Robot"),
        (lambda r, d, c: fastcal.calibrate(c, d), "got a CalibrationResult; its robot is its attribute .model"),
        (lambda r, d, c: fastcal.diagnose(r, [1, 2]), "path of a measurement file or a pandas table, got list"),
        (lambda r, d, c: fastcal.evaluate(7, d), "name of a shipped arm, got int"),
        (lambda r, d, c: fastcal.calibrate(r, "no_such.csv"), "no_such.csv: there is no such file"),
        (lambda r, d, c: fastcal.load_robot(3.5), "expected a robot file, .*, got float"),
    ],
)
def test_a_wrong_type_names_the_right_one(hidden_backlash, result: CalibrationResult, slip, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        slip(hidden_backlash.robot, hidden_backlash.data, result)
