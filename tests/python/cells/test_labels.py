# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sockets, planes and anchors in cells of several arms: columns of their targets, one point for all that touch it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fastcal import _core
from fastcal.cells.branches import ways_of
from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.cell import Cell, Distance
from fastcal.cells.readings import Labels, Readings
from fastcal.cells.simulate import view_poses
from fastcal.cli.app import main
from fastcal.errors import ParseError
from fastcal.io.tree_file import write_cell
from fastcal.io.tree_readings import load_readings
from fastcal.io.tree_readings_out import write_readings
from fastcal.io.way_readings import way_datasets

from .test_calibrate import csv_of
from .test_uses import two_arms

SOCKETS = {"a": (0.35, 0.05, 0.45), "b": (0.30, 0.15, 0.60), "c": (0.42, -0.10, 0.52)}
TOUCHES = 9  # of each socket by each arm
NOISE = 2e-5  # [m]
JOINTS = [f"{arm}.q{i}_deg" for arm in ("left", "right") for i in range(1, 7)]


def touching(cell: Cell, view: str, p: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(N, n) joints with the target at p (N, 3), from anywhere: damped steps, begun anew where they fail."""
    count = len(cell.joint_columns)

    def at(q: np.ndarray) -> np.ndarray:
        return view_poses(cell, Readings(q, {}, ""), view)[:, :3, 3]

    q = rng.uniform(-2, 2, (len(p), count))
    for k in range(400):
        off = at(q) - p
        wrong = np.linalg.norm(off, axis=1) > 1e-12
        if not wrong.any():
            return q
        if k % 40 == 39:
            q[wrong] = rng.uniform(-2, 2, (int(wrong.sum()), count))
            continue
        J = np.stack([(at(q + 1e-6 * step) - at(q - 1e-6 * step)) / 2e-6 for step in np.eye(count)], axis=2)
        weight = J @ J.transpose(0, 2, 1) + 1e-6 * np.eye(3)
        step = np.einsum("nji,nj->ni", J, np.linalg.solve(weight, off[:, :, np.newaxis])[:, :, 0])
        q -= step * np.minimum(1, 0.5 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-12))
    raise AssertionError("out of reach")


def touches(cell: Cell, seed: int, rows: int = TOUCHES) -> Readings:
    """Each arm in turn touches each socket."""
    rng = np.random.default_rng(seed)
    names = np.repeat(list(SOCKETS), rows)
    at = np.array([SOCKETS[name] for name in names])
    q = np.vstack([touching(cell, of, at + rng.normal(0, NOISE, at.shape), rng) for of in ("smr", "tag")])
    none = [""] * len(names)
    labels = {"socket@smr": Labels.of([*names, *none]), "socket@tag": Labels.of([*none, *names])}
    return Readings(q, {}, "touched", labels=labels)


@pytest.fixture(scope="module")
def touched(tmp_path_factory: pytest.TempPathFactory) -> tuple[Cell, Cell, Readings, CellResult]:
    cell = two_arms(tmp_path_factory.mktemp("cell"))
    theta = np.array(cell.core.nominal)
    own = [i for i, p in enumerate(cell.core.parameters) if p.owner in ("right.base", "smr")]
    theta[own] += np.random.default_rng(1).normal(0, 1e-2, len(own))
    true = cell.with_values(theta)
    read = touches(true, 2)
    return true, cell, read, calibrate_cell(cell, read, arms=())


def test_two_arms_that_touch_the_same_sockets_stand_where_they_do(
    touched: tuple[Cell, Cell, Readings, CellResult],
) -> None:
    true, _, read, found = touched
    assert found.status == "converged"
    assert set(found.views) == {"socket@smr", "socket@tag"}
    after = found.train["socket"].statistics[1]
    assert after is not None
    assert after.rms < 1.1 * NOISE * np.sqrt(3)
    assert {f"socket {name}" for name in SOCKETS} <= {p.owner for p in found.parameters}
    # Where the tip of one arm is, seen from the tip of the other, no common motion of all changes.
    apart = [view_poses(of, read, "smr:tag")[:, :3, 3] for of in (true, found.cell)]
    assert np.linalg.norm(apart[0] - apart[1], axis=1).max() < 10 * NOISE
    # A touch of a test file is of the same socket, though it touches it once.
    again = calibrate_cell(touched[1], read, test=touches(true, 5, 1), arms=())
    assert again.test is not None
    held_out = again.test["socket"].statistics[1]
    assert held_out is not None
    assert held_out.rms < 2 * NOISE * np.sqrt(3)


def test_a_known_length_between_sockets_is_reported(touched: tuple[Cell, Cell, Readings, CellResult]) -> None:
    _, cell, read, _ = touched
    a, b = (np.array(SOCKETS[name]) for name in "ab")
    mm = 1e3 * float(np.linalg.norm(a - b))
    for told, agrees in ((mm, True), (1.1 * mm, False)):
        found = calibrate_cell(replace(cell, touched=(Distance("socket a", "socket b", told, 0.1),)), read, arms=())
        (length,) = found.known_distances
        assert length["found_mm"] == pytest.approx(mm, abs=5e3 * NOISE)
        assert not length["used"]
        assert length["scale"] == pytest.approx(told / mm, rel=1e-3)
        assert ("they agree" in found.notes[-1]) == agrees
        assert found.cell.touched


def test_derivatives_of_a_shared_socket_are_those_of_differences(
    touched: tuple[Cell, Cell, Readings, CellResult],
) -> None:
    _, cell, read, _ = touched
    some = read.pick(np.array([0, 30]))
    measured, samples = some.measured(cell), some.samples(cell)
    count = len(cell.model.start)
    theta = np.append(np.asarray(cell.model.start), np.full(len(measured.parameters), 0.3))
    (of,) = measured.observations
    assert (of.name, of.reading_count, len(of.components)) == ("socket", 2, 6)
    near = _core.linearize(cell.model, samples, measured, theta, [1.0])
    J = np.asarray(near.J)
    for k in (*range(0, count, 7), *range(count, len(theta))):
        step = 1e-6 * np.eye(len(theta))[k]
        ends = [np.asarray(_core.residuals(cell.model, samples, measured, theta + s * step)) for s in (1, -1)]
        slope = ((ends[0] - ends[1]) / 2e-6)[np.asarray(near.row), np.asarray(near.number)]
        assert np.allclose(J[:, k], slope, atol=1e-6)


def test_columns_of_labels_are_read_written_and_seen_by_each_way(
    touched: tuple[Cell, Cell, Readings, CellResult], tmp_path: Path
) -> None:
    _, cell, read, _ = touched
    write_readings(tmp_path / "read.csv", cell, read)
    again = load_readings(tmp_path / "read.csv", cell)
    assert again.notes == ()
    assert {name: of.texts for name, of in again.labels.items()} == {name: of.texts for name, of in read.labels.items()}
    # The column of an arm is that of its one target, and lengths have the anchor beside them.
    titles = [*JOINTS, "left.socket", "plane@tag", "anchor@smr", "distance_mm@smr"]
    rows = [[*[0.0] * 12, "a", "floor", "", ""], [*[10.0] * 12, "a", "", "wire", 500.0]]
    path = csv_of(tmp_path, titles, rows)  # type: ignore[arg-type]
    found = load_readings(path, cell)
    assert list(found.labels) == ["socket@smr", "plane@tag", "anchor@smr"]
    assert found.views == ["smr", "tag"]
    assert not found.is_read_from_world
    kinds = {of.name: [p.owner for p in of.parameters] for of in found.measured(cell).observations}
    assert kinds == {"length": ["anchor wire"] * 3, "plane": ["plane floor"] * 3, "socket": ["socket a"] * 3}
    ways = ways_of(cell, found.views)
    data = dict(zip([way.name for way in ways], way_datasets(path, cell, ways, found), strict=True))
    assert data["smr"].observed_labels["socket"] == ["a", "a"]
    assert data["tag"].observed_labels["plane"] == ["floor", ""]
    assert data["smr"].anchor_names == ("wire",)
    assert ways[0].rows(cell, found).observed_labels["socket"] == ["a", "a"]


@pytest.mark.parametrize(
    ("titles", "row", "sentence"),
    [
        (["socket"], ["a"], "column 'socket': it names no target; expected socket@smr or socket@tag"),
        (["middle.socket"], ["a"], "names no arm of this cell; its arms are left, right"),
        (["left.socket", "socket@smr"], ["a", "b"], "column 'socket@smr' gives socket@smr a second time"),
        (["socket@ball"], ["a"], "names 'ball', which is no target or sensor here; there are smr, tag"),
        (["socket@smr:tag"], ["a"], "expected a target, as what it touches stands in the measuring frame"),
        (["anchor@smr"], ["wire"], "holds no reading"),
        (["plane@smr"], [""], "holds a posture and no reading of any target"),
    ],
)
def test_wrong_labels_get_one_sentence(titles: list[str], row: list[str], sentence: str, tmp_path: Path) -> None:
    cell = two_arms(tmp_path)
    path = csv_of(tmp_path, [*JOINTS, *titles], [[*[0.0] * 12, *row]])
    with pytest.raises(ParseError) as error:
        load_readings(path, cell)
    assert sentence in str(error.value)


def test_commands_take_touches(touched: tuple[Cell, Cell, Readings, CellResult], tmp_path: Path) -> None:
    """The page too: its figure has lines of sight that are none where nothing was read, and no arrows."""
    true, cell, read, _ = touched
    write_cell(cell, tmp_path / "cell.yaml")
    write_readings(tmp_path / "read.csv", cell, read)
    write_readings(tmp_path / "new.csv", cell, touches(true, 9, 3))
    at = {name: str(tmp_path / name) for name in ("cell.yaml", "read.csv", "new.csv", "out", "e.json")}
    assert main(["calibrate", at["cell.yaml"], at["read.csv"], "--effects", "none", "-o", at["out"]]) == 0
    model = str(tmp_path / "out/model.yaml")
    assert main(["evaluate", model, at["new.csv"], "-o", at["e.json"]]) == 0
    figures = json.loads((tmp_path / "e.json").read_text(encoding="utf-8"))["kinds"]["socket"]
    assert figures["before"] is None
    assert figures["after"]["rms"] < 1.5e3 * NOISE * np.sqrt(3)
    assert main(["check", model, at["new.csv"]]) in (0, 3)
