# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The picture of a cell: arms from what they stand on, cameras and boards where they are, arrows as the errors are."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import fastcal
from fastcal import _core, report
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.importers.corners import load_seen, load_seen_readings
from fastcal.io.tree_file import load_cell
from fastcal.report.arm import LINK_WIDTH, Arm, skeleton, through_points
from fastcal.report.cell_scene import ARMS, arm_and_rig, cell_scene, pictures_scene
from fastcal.report.figures import Figure
from fastcal.report.parameter_sizes import moved_in_cell
from fastcal.report.view import rows_of
from fastcal.units import to_si

from ..cells import camera_scene as camera
from ..cells import track_scene as track
from ..cells.test_calibrate import content, written
from ..cells.test_diagnose import cell_of, waved


def coordinates(trace: dict[str, Any]) -> np.ndarray:
    return np.column_stack([np.asarray(trace[axis], dtype=float) for axis in "xyz"])


def posture(drawn: Figure, k: int) -> np.ndarray:
    """(P, 3) all points of a posture."""
    width = drawn.postures["width"]
    return np.column_stack([drawn.postures["points"][axis][k * width : (k + 1) * width] for axis in "xyz"])


def line_of(drawn: Figure, colour: str) -> list[int]:
    """What an arm's thick line of a colour goes through."""
    lines = [(drawn.traces[part["trace"]].get("line", {}), part["through"]) for part in drawn.postures["parts"]]
    (found,) = [through for line, through in lines if line.get("color") == colour and line["width"] == LINK_WIDTH]
    return list(found)


def named(drawn: Figure, name: str) -> int:
    """The point that a name is written at."""
    for part in drawn.postures["parts"]:
        texts = drawn.traces[part["trace"]].get("text") or []
        if name in texts:
            return int(part["through"][list(texts).index(name)])
    raise AssertionError(name)


def test_on_paper_the_cell_stands_at_the_left_edge_below_its_key(chromium: Any, tmp_path: Path) -> None:
    """The key of several arms took the place of the drawing, which stood small at the right."""
    figure = (
        '<figure class="figure columns-6 scene"><div class="figure-head"><h3>The cell</h3></div>'
        '<span class="key">left right</span><div class="plot" style="height: 600px"></div>'
        '<label class="posture">row 5</label><figcaption>Each arrow</figcaption></figure>'
    )
    style = (Path(report.__file__).parent / "templates" / "page.css").read_text(encoding="utf-8")
    (tmp_path / "page.html").write_text(f"<!DOCTYPE html><style>{style}</style><body>{figure}</body>")
    shown = chromium.new_page(viewport={"width": 687, "height": 900})
    shown.goto((tmp_path / "page.html").as_uri())
    shown.emulate_media(media="print")
    box = {name: shown.locator(name).bounding_box() for name in (".scene", ".key", ".plot", "figcaption")}
    shown.close()
    assert box[".plot"]["x"] == pytest.approx(box[".scene"]["x"])
    assert box[".plot"]["width"] == pytest.approx(440)
    assert box[".plot"]["y"] >= box[".key"]["y"] + box[".key"]["height"] - 1
    assert box["figcaption"]["x"] > box[".plot"]["x"] + 440


@pytest.fixture
def arms(tmp_path: Path) -> tuple[Cell, Readings]:
    cell = cell_of(tmp_path)
    return cell, waved(cell, 40, None)


def test_each_arm_stands_on_its_own_frame_and_no_line_joins_their_ends(arms: tuple[Cell, Readings]) -> None:
    cell, readings = arms
    drawn = cell_scene(cell, readings)
    assert drawn is not None
    frames = 1e3 * np.asarray(cell.core.frame_origins(readings.q))
    chosen = [int(row.partition(":")[2]) for row in drawn.postures["rows"]]
    for k, arm in enumerate(cell.arms):
        through = line_of(drawn, ARMS[k])
        branch = next(of for of in cell.core.branches if of.name == arm.name)
        flange = branch.first_frame + branch.frame_count - 1
        for at, row in enumerate(chosen):
            ends = posture(drawn, at)[[through[0], through[-1]]]
            start = frames[row, branch.parent] if branch.parent >= 0 else frames[row, branch.first_frame]
            np.testing.assert_allclose(ends, [start, frames[row, flange]], atol=1e-6)
    # Links are rigid: what a line joins is as far apart in every posture, but along the slide of the column.
    rigid = []
    for k in (1, 2):
        through = line_of(drawn, ARMS[k])
        for a, b in itertools.pairwise(through[1:]):
            rigid.append([np.linalg.norm(np.diff(posture(drawn, at)[[a, b]], axis=0)) for at in range(len(chosen))])
    np.testing.assert_allclose(np.ptp(rigid, axis=1), 0, atol=1e-6)
    assert [key.label for key in drawn.key] == ["column", "left", "right"]


def test_arrows_go_from_measured_to_predicted_points(arms: tuple[Cell, Readings]) -> None:
    cell, readings = arms
    drawn = cell_scene(cell, readings)
    assert drawn is not None
    dots = drawn.traces[1]
    measured = np.vstack([1e3 * readings.tables[f"position@{view}"] for view in ("smr_left", "smr_right")])
    np.testing.assert_allclose(coordinates(dots), measured, atol=1e-6)
    predicted = [
        np.asarray(cell.model.predict(_core.Samples(readings.q), cell.model.start, of=view))[:, :3, 3]
        for view in ("smr_left", "smr_right")
    ]
    np.testing.assert_allclose(dots["customdata"], np.linalg.norm(1e3 * np.vstack(predicted) - measured, axis=1))
    assert list(drawn.postures["of"]) == [*range(40), *range(40)]
    # The first posture that is shown has the largest arrow.
    worst = int(drawn.postures["of"][np.argmax(dots["customdata"])])
    assert drawn.postures["shown"] == worst


def test_what_an_arm_reads_is_drawn_in_the_axes_of_the_measuring_frame(tmp_path: Path) -> None:
    """A sensor on one arm reads a target on the other; off by 2 mm along its own x."""
    targets = {"smr": {"on": "left", "xyz_mm": [40.0, 10.0, 120.0]}}
    sensors = {"head": {"on": "right", "xyz_mm": [10.0, 0.0, 50.0], "rpy_deg": [20.0, -40.0, 70.0]}}
    cell = load_cell(written(tmp_path, content(targets=targets, sensors=sensors)))
    q = np.random.default_rng(3).uniform(-1, 1, (6, 13))
    samples, model = _core.Samples(q), cell.model
    T = np.asarray(model.predict(samples, model.start, of="smr:head"))
    eye = np.asarray(model.predict(samples, model.start, of="head"))
    seen = T[:, :3, 3] - [0.002, 0, 0]  # predicted less measured is 2 mm along x
    drawn = cell_scene(cell, Readings(q, {"position@smr:head": seen}, "file"))
    assert drawn is not None
    start = 1e3 * (np.einsum("rij,rj->ri", eye[:, :3, :3], seen) + eye[:, :3, 3])
    np.testing.assert_allclose(coordinates(drawn.traces[1]), start, atol=1e-6)
    shaft = coordinates(drawn.traces[0]).reshape(6, -1, 3)[:, :2]
    along = np.diff(shaft, axis=1)[:, 0]
    np.testing.assert_allclose(along / np.linalg.norm(along, axis=1, keepdims=True), eye[:, :3, 0], atol=1e-6)
    np.testing.assert_allclose(drawn.traces[1]["customdata"], 2.0)


def test_a_camera_sees_along_its_axis_what_its_picture_holds(tmp_path: Path) -> None:
    """The pyramid stands where numpy alone says that the camera of an arm on a track is."""
    scene = track.Scene(8)
    scene.write(tmp_path, 12)
    cell = load_cell(tmp_path / "cell.yaml")
    readings = load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")
    drawn = cell_scene(cell, readings)
    assert drawn is not None
    place = named(drawn, "wrist")
    names = [titles[0] for titles in cell.joint_columns]
    turning = [names.index(f"arm.q{i}") for i in range(1, 7)]
    for k in range(12):
        slide, q = 1e3 * readings.q[k, names.index("track.q1")], np.degrees(readings.q[k, turning])
        on = camera.pose(*track.TRACK) @ camera.pose((0, 0, 0), (90, 0, 0)) @ camera.pose((0, 0, slide), (0, 0, 0))
        eye = on @ camera.pose(*track.ARM) @ camera.flange(q) @ camera.pose((300, 200, -100), (40, -30, 100))
        points = posture(drawn, k)[place : place + 5]
        np.testing.assert_allclose(points[0], eye[:3, 3], atol=1e-6)
        sides = (points[1:] - points[0]) @ eye[:3, :3]
        np.testing.assert_allclose(sides[:, :2] / sides[:, 2:], [
            [(u - camera.CENTRE[0]) / camera.FOCAL[0], (v - camera.CENTRE[1]) / camera.FOCAL[1]]
            for u, v in ((0, 0), (1280, 0), (1280, 960), (0, 960))
        ], atol=1e-9)  # fmt: skip
        assert (sides[:, 2] > 0).all()


def test_a_board_that_is_off_across_the_view_is_an_arrow_as_long(tmp_path: Path) -> None:
    """The file has the board 3 mm beside where pictures show it; the camera, which moves, has the opposite arrow."""
    camera.write(tmp_path, 20, noise_px=0.0)
    content = camera.cell()
    content["cameras"]["wrist"] |= {"xyz_mm": [5.0, -68.0, 52.0], "rpy_deg": [-7.0, 1.0, 4.0]}
    shift = np.array([0.0, 3.0, 0.0])
    content["boards"]["plate"] |= {
        "xyz_mm": (np.array([720.0, 40.0, 90.0]) + shift).tolist(),
        "rpy_deg": [178.0, -1.0, 15.0],
    }
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(content))
    robot = fastcal.load_robot(tmp_path / "cell.yaml")
    part = fastcal.evaluate(robot, load_seen(tmp_path / "poses.csv", robot, tmp_path / "corners.csv"))
    drawn = pictures_scene(robot, None, part)
    assert drawn is not None
    place = named(drawn, "wrist")
    eyes = np.array([posture(drawn, k)[place] for k in range(20)])
    np.testing.assert_allclose(coordinates(drawn.traces[1]), eyes, atol=1e-6)
    shafts = np.diff(coordinates(drawn.traces[0]).reshape(20, -1, 3)[:, :2], axis=1)[:, 0]
    sizes = np.asarray(drawn.traces[1]["customdata"])
    for k, q in enumerate(np.degrees(part.data.q)):
        axis = (camera.flange(q) @ camera.WRIST)[:3, 2]
        across = shift - axis * (axis @ shift)
        found = -shafts[k] / np.linalg.norm(shafts[k]) * sizes[k]
        assert np.linalg.norm(found - across) < 0.5  # of 3 mm: what is off along the view counts a little


def test_an_arm_that_a_tracker_measured_shows_its_camera_and_board_too(tmp_path: Path) -> None:
    camera.write(tmp_path, 3)
    robot = fastcal.load_robot(tmp_path / "cell.yaml")
    q = np.radians(np.random.default_rng(4).uniform(-60, 60, (12, 6)))

    def drawn(robot: fastcal.Robot) -> Arm:
        points = fastcal.Dataset.from_arrays(q, position=robot.forward(q)[:, :3, 3] + 1e-4)
        part = fastcal.evaluate(robot, points)
        kinds = {name: replace(of, numbers_before=of.numbers) for name, of in part.kinds.items()}
        part = replace(part, error_before=part.error_after, kinds=kinds)
        arm = arm_and_rig(robot, robot, [(rows_of("Training", part, robot.joint_types), part), (None, None)])
        assert arm is not None
        return arm

    arm = drawn(robot)
    (eye,) = (run.through[0] for run in arm.runs if run.names == ("wrist",))
    (plate,) = (run.through[0] for run in arm.runs if run.names == ("plate",))
    mounted = camera.pose(camera.cell()["cameras"]["wrist"]["xyz_mm"], camera.cell()["cameras"]["wrist"]["rpy_deg"])
    expected = [(camera.flange(each) @ mounted)[:3, 3] for each in np.degrees(q)]
    np.testing.assert_allclose(arm.points[:, eye], expected, atol=1e-6)
    assert np.ptp(arm.points[:, plate], axis=0).max() == 0
    assert len(drawn(fastcal.load_robot("ur5e")).runs) == 1


def test_the_loops_of_a_delta_are_drawn_to_their_balls() -> None:
    robot = fastcal.load_robot("delta")
    q = fastcal.random_poses(robot, 5, seed=3)
    points, joints, through = skeleton(robot, q)
    assert len(joints) == robot.joint_count
    rods = [loop for loop in robot.description.loops if "length_mm" in loop]
    assert rods
    for k in range(5):
        line = through_points(points[k], through)
        steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
        for rod in rods:
            assert np.isclose(steps, rod["length_mm"], atol=1e-6).any()


def test_contributions_of_a_cell_are_how_far_what_is_read_moves(arms: tuple[Cell, Readings]) -> None:
    before, readings = arms
    joints = list(before.arm("left").robot.joints)
    joints[1] = replace(joints[1], a_mm=(joints[1].a_mm or 0.0) + 0.7)
    bent = before.arm("left").robot.with_(joints=joints)
    cell = replace(before, arms=tuple(replace(arm, robot=bent) if arm.name == "left" else arm for arm in before.arms))
    drawn = cell_scene(cell, readings, before)
    assert drawn is not None
    moves = [
        np.asarray(of.model.predict(_core.Samples(readings.q), of.model.start, of="smr_left"))[:, :3, 3]
        for of in (cell, before)
    ]
    far = 1e3 * np.linalg.norm(moves[1] - moves[0], axis=1)
    expected = np.sqrt(np.mean(np.concatenate([far, np.zeros_like(far)]) ** 2))  # the other target does not move
    (dots,) = [trace for trace in drawn.traces if "left joint 2" in str(trace.get("text"))]
    sizes = dict(zip([text.partition(":")[0] for text in dots["text"]], dots["marker"]["color"], strict=True))
    assert sizes.pop("left joint 2") == pytest.approx(expected, rel=1e-6)
    np.testing.assert_allclose(list(sizes.values()), 0, atol=1e-9)


def test_a_notebook_draws_the_cell_and_its_gap(arms: tuple[Cell, Readings]) -> None:
    cell, readings = arms
    found = calibrate_cell(cell, readings)
    drawn = found.plot_arm()
    assert {trace.name for trace in drawn.data if trace.name} == {"column", "left", "right"}  # its legend
    assert all(trace.type == "scatter3d" for trace in drawn.data)
    assert "smr_left" in drawn._still  # names are on the still picture too
    gap = found.plot_gap().data[0]
    before, after = found.train["position"].statistics
    assert before is not None
    assert after is not None
    np.testing.assert_allclose(gap.x, [1e3 * before.rms, 1e3 * (before.rms - after.rms), 1e3 * after.rms])
    # The same numbers by what they move: of one parameter its change times how far a unit moves what is read.
    sizes = moved_in_cell(found)
    assert all(of.parameter.owner.partition(".")[0] in ("column", "left", "right") for of in sizes)
    first = sizes[0]
    index = next(
        k for k, p in enumerate(found.cell.core.parameters)
        if p.owner == first.parameter.owner and p.name == first.parameter.name.removesuffix(f"_{first.parameter.unit}")
    )  # fmt: skip
    theta = np.array(found.cell.core.nominal)
    theta[index] -= to_si(first.parameter.value - first.parameter.nominal, first.parameter.unit)
    other, square = found.cell.with_values(theta), 0.0
    for view in readings.views:
        there, here = (
            np.asarray(of.model.predict(readings.samples(of), of.model.start, of=view))[:, :3, 3]
            for of in (other, found.cell)
        )
        square += float(np.mean(np.sum((there - here) ** 2, axis=1))) / 2
    assert abs(first.size) == pytest.approx(1e3 * square**0.5, rel=0.02)
