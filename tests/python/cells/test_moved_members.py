# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A tracker, a base or a target that was moved between two rows is named, and the model knows both of its places."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.diagnose import names_excluded, with_causes
from fastcal.cells.diagnosis import CellFinding
from fastcal.cells.errors import kind_errors
from fastcal.cells.readings import Labels, Readings
from fastcal.cells.sensor_ways import lengths_alone, seen_ways
from fastcal.cells.simulate import simulate_cell
from fastcal.cells.since_moved import as_since
from fastcal.diagnosis.result import Finding
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.tree_file import cell_text, load_cell
from fastcal.io.tree_readings import load_readings

from .moved_scene import NOISE, ON_A_TRACK, TRACKER, TWO_ARMS, Scene, found_in
from .test_calibrate import content, written

BOTH, FROM_TRACKER = ("smr_left", "smr_right"), ("smr_left:tracker", "smr_right:tracker")
TRACKED = {**TWO_ARMS, **TRACKER}
SCENES = {
    "tracker": (Scene(TRACKED, FROM_TRACKER, "tracker"), "placement_step@tracker"),
    "target": (Scene(TWO_ARMS, BOTH, "smr_left"), "placement_step@smr_left"),
    "base": (Scene(TRACKED, FROM_TRACKER, "left"), "base_step@left.base"),
    "world": (Scene(TWO_ARMS, BOTH, "world"), "placement_step@world"),
    "base from the world": (Scene(TWO_ARMS, BOTH, "left"), "base_step@left.base"),
    "target from a tracker": (Scene(TRACKED, FROM_TRACKER, "smr_right"), "placement_step@smr_right"),
    "target on a track": (Scene({**ON_A_TRACK, **TRACKER}, ("smr:tracker",), "smr"), "placement_step@smr"),
}
CHEAP = ("tracker", "target", "base")


@pytest.mark.parametrize(
    "name", [name if name in CHEAP else pytest.param(name, marks=pytest.mark.full) for name in SCENES]
)
def test_what_was_moved_is_named_and_is_in_the_model(tmp_path: Path, name: str) -> None:
    scene, label = SCENES[name]
    truth = scene.drawn(tmp_path, 5)
    found = scene.diagnosed(tmp_path)
    assert [(of.finding.label, of.finding.grade) for of in found.effects] == [(label, "A")]
    assert found.verdict == "named"
    assert found.notes == []
    (cause,) = found.effects
    values = cause.finding.parameters
    assert values["at_row"].value == 30
    assert list(cause.seen_by) == [view for view in scene.views if scene.moves in (*view.split(":"), "world")] or (
        scene.moves == "left" and "left" in cause.seen_by[0]
    )
    plain, geometry, with_it = (_rms(step.train) for step in found.gap)
    assert plain > geometry > 4 * with_it
    assert with_it < 1.05 * NOISE * np.sqrt(3)
    if "placement" not in label or scene.moves == "world":
        assert np.linalg.norm([values[f"step_r{axis}_rad"].value for axis in "xyz"]) == pytest.approx(
            np.radians(0.02), rel=0.1
        )
        return
    told, drawn = (next(of.knocked for of in cell.points if of.name == scene.moves) for cell in (found.cell, truth))
    assert told is not None
    assert drawn is not None
    assert told["at_row"] == 30
    assert np.allclose(told["before_mm"], drawn["before_mm"], atol=0.05)
    if scene.moves == "tracker":
        assert np.allclose(told["before_deg"], drawn["before_deg"], atol=0.002)


def _rms(kinds: Any) -> float:
    statistics = kinds["position"].statistics[1]
    assert statistics is not None
    return float(statistics.rms)


@pytest.mark.full
def test_the_model_holds_the_step_and_nothing_is_missing_beside_it(tmp_path: Path) -> None:
    scene, _ = SCENES["tracker"]
    scene.drawn(tmp_path, 5)
    model = scene.diagnosed(tmp_path).cell
    (tmp_path / "model.yaml").write_text(cell_text(model), encoding="utf-8")
    again = load_cell(tmp_path / "model.yaml")
    assert np.array_equal(again.core.nominal, model.core.nominal)
    found = found_in(again, tmp_path / "poses.csv")
    assert found.effects == []
    assert found.ways[0].found.train.error_after is not None


@pytest.mark.parametrize("turned", [False, True])
def test_one_arm_cannot_tell_its_base_from_its_tracker(tmp_path: Path, turned: bool) -> None:
    """An arm on a track: what stands on the slide looks alike too."""
    scene = Scene({**ON_A_TRACK, **TRACKER}, ("smr:tracker",), "tracker" if not turned else "track")
    scene.drawn(tmp_path, 6, rows=60)
    found = scene.diagnosed(tmp_path)
    (cause,) = found.effects
    assert (found.verdict, cause.finding.label, cause.finding.grade) == ("one_of", "placement_step@tracker", "B")
    assert set(cause.finding.equivalents) == {("base_step", "track.base"), ("base_step", "arm.base")}
    assert cause.reasons == ["other causes explain the data equally well"]


@pytest.mark.parametrize("name", ["tracker", "target on a track"])
def test_nothing_is_named_where_nothing_was_moved(tmp_path: Path, name: str) -> None:
    still = replace(SCENES[name][0], moves="")
    still.drawn(tmp_path, 3)
    assert still.diagnosed(tmp_path).effects == []


@pytest.mark.full
@pytest.mark.parametrize("seed", range(20, 26))
@pytest.mark.parametrize("name", ["tracker", "world", "target on a track"])
def test_nothing_is_named_where_nothing_was_moved_of_more(tmp_path: Path, name: str, seed: int) -> None:
    still = replace(SCENES[name][0], moves="")
    still.drawn(tmp_path, seed)
    assert still.diagnosed(tmp_path).effects == []


@pytest.mark.parametrize(
    ("name", "owner", "excluded"),
    [
        ("placement_step", "tracker", [["base_step@base"], ["base_step@base"]]),
        ("placement_step", "smr_left", [["tool_step@tool"], []]),
        ("base_step", "left.base", [["base_step@base"], []]),
    ],
)
def test_a_name_that_is_excluded_is_each_ways_own(
    tmp_path: Path, name: str, owner: str, excluded: list[list[str]]
) -> None:
    cell = load_cell(written(tmp_path, TRACKED))
    read = Readings(np.zeros((1, 12)), {f"position@{view}": np.ones((1, 3)) for view in FROM_TRACKER}, "")
    assert names_excluded(seen_ways(cell, read), [f"{name}@{owner}"]) == excluded


def test_an_arm_that_was_not_read_before_tells_nothing_of_the_tracker(tmp_path: Path) -> None:
    scene, _ = SCENES["tracker"]
    scene.drawn(tmp_path, 5)
    lines = (tmp_path / "poses.csv").read_text(encoding="utf-8").splitlines()
    own = [k for k, title in enumerate(lines[0].split(",")) if title.endswith("@smr_right:tracker")]
    for row in range(1, 31):
        cells = lines[row].split(",")
        lines[row] = ",".join("" if k in own else cell for k, cell in enumerate(cells))
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (cause,) = scene.diagnosed(tmp_path).effects
    assert (cause.finding.label, cause.finding.grade) == ("placement_step@tracker", "B")
    assert cause.finding.equivalents == (("base_step", "left.base"),)


def test_lengths_alone_are_not_looked_at_which_is_said(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, TRACKED))
    lengths = Readings(np.zeros((2, 12)), {"distance@smr_left:tracker": np.ones((2, 1))}, "")
    with pytest.raises(InvalidInput, match="smr_left:tracker: no cause is looked for in lengths alone; expected"):
        seen_ways(cell, lengths)
    both = {**lengths.tables, "position@smr_right:tracker": np.ones((2, 3))}
    assert lengths_alone(replace(lengths, tables=both)) == ["smr_left:tracker"]


def test_a_cause_at_an_instrument_that_no_arm_can_have_is_told_and_not_in_the_model(tmp_path: Path) -> None:
    """The error of its owner, which no arm has, ended the diagnosis."""
    cell = load_cell(written(tmp_path, TRACKED))
    read = Readings(np.zeros((1, 12)), {f"position@{view}": np.ones((1, 3)) for view in FROM_TRACKER}, "")
    (way, _) = seen_ways(cell, read)
    entry = {"effect": "base_drift", "owner": "base", "parameters": {}}
    found = CellFinding(Finding("base_drift", "tracker", "A", {}, 20.0, 1e-9), entry, (way.name,))
    ways: Any = [SimpleNamespace(way=way)]
    there, notes = with_causes(cell, read, ways, [replace(found, entry={**entry, "owner": "base"})])
    assert there is cell
    (note,) = notes
    assert "base_drift" in note
    assert "is not in model.yaml" in note


@pytest.mark.full
def test_two_bases_moved_at_two_times_are_no_tracker(tmp_path: Path) -> None:
    left, right = Scene(TRACKED, FROM_TRACKER, "left"), Scene(TRACKED, FROM_TRACKER, "right")
    cell = left.drawn(tmp_path, 7, at_row=20)
    first = load_readings(tmp_path / "poses.csv", cell)
    right.drawn(tmp_path, 7, at_row=50)
    lines = (tmp_path / "poses.csv").read_text(encoding="utf-8").splitlines()
    own = [k for k, title in enumerate(lines[0].split(",")) if title.endswith("@smr_left:tracker")]
    for row, values in enumerate(1e3 * first.tables["position@smr_left:tracker"]):
        cells = lines[row + 1].split(",")
        for k, value in zip(own, values, strict=True):
            cells[k] = f"{value:.9f}"
        lines[row + 1] = ",".join(cells)
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = left.diagnosed(tmp_path)
    named = {of.finding.label: of.finding.parameters["at_row"].value for of in found.effects}
    assert named == {"base_step@left.base": 20, "base_step@right.base": 50}


def test_a_cell_knows_both_places(tmp_path: Path) -> None:
    """Readings of all kinds are of the frame that stood there; as if since, they are those of a cell at rest."""
    knocked = {"at_row": 4, "before_mm": [1.0, -2.0, 0.5], "before_deg": [0.3, 0.1, -0.2]}
    parts = content()
    parts["targets"]["smr"]["knocked"] = knocked
    parts["sensors"]["camera"]["knocked"] = {**knocked, "at_row": 7}
    cell = load_cell(written(tmp_path, parts))
    at_rest = replace(cell, points=tuple(replace(of, knocked=None) for of in cell.points))
    q = np.random.default_rng(1).uniform(-2, 2, (10, 13))
    order = Readings(q, {}, "", row=np.arange(10))
    views = ("smr", "smr:camera", "tag:camera", "distance@smr:tag")
    read = replace(simulate_cell(cell, order, views, noise_rotation=0.0), row=order.row)
    still = simulate_cell(at_rest, order, views, noise_rotation=0.0)
    apart = np.linalg.norm(read.tables["position@smr"] - still.tables["position@smr"], axis=1)
    assert np.allclose(apart[:4], 1e-3 * np.linalg.norm(knocked["before_mm"]))
    assert not apart[4:].any()
    for kind, of in kind_errors(cell, read).items():
        assert np.nanmax(np.abs(of.numbers)) < 1e-12, kind
    unordered = kind_errors(cell, replace(read, row=None))["position"].numbers
    assert np.nanmax(np.abs(unordered)) > 1e-3
    since = as_since(cell, read)
    for name, table in still.tables.items():
        assert np.allclose(since.tables[name], table, atol=1e-12), name
    assert as_since(at_rest, read) is read
    socket = Readings(q, {}, "", row=np.arange(10), labels={"socket@smr": Labels.of(["a"] * 10)})
    told = socket.of_frames(cell).labels
    assert {name: of.texts.count("a") for name, of in told.items()} == {"socket@smr before row 4": 4, "socket@smr": 6}


def test_a_fit_places_what_was_moved_twice(tmp_path: Path) -> None:
    scene, _ = SCENES["target"]
    truth = scene.drawn(tmp_path, 8)
    cell = load_cell(tmp_path / "cell.yaml")
    start = {"at_row": 30, "before_mm": [0.0] * 3, "before_deg": [0.0] * 3}
    points = tuple(replace(of, knocked=start) if of.name == "smr_left" else of for of in cell.points)
    found = calibrate_cell(replace(cell, points=points), load_readings(tmp_path / "poses.csv", cell))
    assert found.status == "converged"
    told, drawn = (next(of.knocked for of in each.points if of.knocked) for each in (found.cell, truth))
    assert told is not None
    assert drawn is not None
    assert np.allclose(told["before_mm"], drawn["before_mm"], atol=0.05)
    assert [of.name for of in found.placements] == ["left", "right", "smr_left", "smr_right"]


def test_a_wrong_knock_gets_one_sentence(tmp_path: Path) -> None:
    parts = content()
    parts["targets"]["smr"]["knocked"] = {"at_row": -1, "before_mm": [0, 0, 0], "before_deg": [0, 0, 0]}
    with pytest.raises(ParseError, match=r"targets.smr.knocked.*at_row"):
        load_cell(written(tmp_path, parts))
