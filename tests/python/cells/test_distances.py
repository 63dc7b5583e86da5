# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lengths between frames of a cell: read by a bar, or known beforehand."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import _core
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell
from fastcal.cli import main
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.tree_file import cell_text, load_cell
from fastcal.io.tree_readings import load_readings

from .test_calibrate import JOINTS, content, csv_of, simulated, written

BAR = {"from": "smr", "to": "other", "mm": 98.0, "sigma_mm": 0.001}
REST = np.zeros((1, 13))


def cell_of(folder: Path, **changes: Any) -> Cell:
    targets = {"smr": {"on": "left", "xyz_mm": [40.0, 10.0, 120.0]}, "other": {"on": "left", "xyz_mm": [40, 108, 120]}}
    return load_cell(written(folder, content(targets=targets, sensors={}, **changes)))


def length(cell: Cell, q: np.ndarray, view: str) -> np.ndarray:
    T = np.asarray(cell.model.predict(_core.Samples(q), cell.model.start, of=view))
    return np.asarray(np.linalg.norm(T[:, :3, 3], axis=1))


def test_a_known_distance_holds_in_the_fit(tmp_path: Path) -> None:
    plain, known = cell_of(tmp_path), cell_of(tmp_path, known_distances=[BAR])
    readings = simulated(plain, np.random.default_rng(3), 40, {"smr": "point", "other": "point"})
    off = [abs(length(calibrate_cell(of, readings).cell, REST, "other:smr")[0] - 0.098) for of in (plain, known)]
    assert off[0] > 2e-6
    assert off[1] < 5e-7
    assert load_cell(written_text(tmp_path, cell_text(known))).distances == known.distances


def written_text(folder: Path, text: str) -> Path:
    (folder / "again.yaml").write_text(text, encoding="utf-8")
    return folder / "again.yaml"


def test_lengths_between_two_arms_are_read_and_fitted(tmp_path: Path) -> None:
    cell = load_cell(written(tmp_path, content(sensors={})))
    q = np.random.default_rng(2).uniform(-1, 1, (60, 13))
    view = "smr:tag"
    tables = {
        f"distance@{view}": length(cell, q, view)[:, np.newaxis],
        f"sigma_position@{view}": np.full((60, 3), 1e-4),
    }
    measured = Readings(q, tables, "").measured(cell)
    r = np.asarray(_core.residuals(cell.model, _core.Samples(q), measured, cell.model.start))
    assert np.abs(r).max() < 1e-12
    near = _core.linearize(cell.model, _core.Samples(q), measured, cell.model.start, [0.0])
    theta, step = np.array(cell.model.start), 1e-6
    k = next(i for i, p in enumerate(cell.core.parameters) if p.owner == "left.joint3")
    theta[k] += step
    moved = np.asarray(_core.residuals(cell.model, _core.Samples(q), measured, theta))
    assert np.allclose(np.asarray(near.J)[:, k] * 1e-4, moved[:, 0] / step, atol=1e-5)


def test_a_column_of_lengths_is_read(tmp_path: Path) -> None:
    cell = cell_of(tmp_path)
    read = load_readings(csv_of(tmp_path, [*JOINTS, "distance_mm@smr:other"], [[0.0] * 13 + [100.0]]), cell)
    assert read.tables["distance@smr:other"] == [[0.1]]


def test_known_lengths_and_standard_deviations_come_in_any_unit(tmp_path: Path) -> None:
    bar = {"from": "smr", "to": "other", "in": 5.0, "sigma_um": 3.0}
    targets = {
        "smr": {"on": "left", "xyz_m": [0.04, 0.01, 0.12], "sigma_um": 20.0, "sigma_mrad": 8.726646259971648},
        "other": {"on": "left", "xyz_mm": [40, 108, 120], "sigma_deg": 0.1},
    }
    cell = load_cell(written(tmp_path, content(targets=targets, sensors={}, known_distances=[bar])))
    known = cell.known("smr")
    assert (known.sigma_mm, known.sigma_deg) == pytest.approx((0.02, 0.5))
    assert cell.known("other").sigma_mm is None
    assert (cell.distances[0].mm, cell.distances[0].sigma_mm) == pytest.approx((127.0, 0.003))


def test_lengths_are_simulated_where_the_postures_have_their_column_or_by_name(tmp_path: Path) -> None:
    path, out = written(tmp_path, content(sensors={})), tmp_path / "read.csv"
    q = np.degrees(np.random.default_rng(5).uniform(-1, 1, (6, 13)))
    sent = csv_of(tmp_path, [*JOINTS, "distance_mm@smr:tag"], [[*row, 1.0] for row in q])
    cell = load_cell(path)
    assert main(["simulate", str(path), str(sent), "-o", str(out)]) == 0
    read = load_readings(out, cell)
    assert list(read.tables) == ["distance@smr:tag"]
    np.testing.assert_allclose(read.tables["distance@smr:tag"][:, 0], length(cell, read.q, "smr:tag"), atol=1e-12)
    assert main(["simulate", str(path), str(sent), "--views", "smr,distance@smr:tag", "-o", str(out)]) == 0
    assert list(load_readings(out, cell).tables) == ["position@smr", "distance@smr:tag"]
    with pytest.raises(InvalidInput, match="'tilt' is no kind of reading that is simulated"):
        simulate_cell(cell, read, ["tilt@smr"])


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"from": "smr", "to": "ball", "mm": 1.0}, "ball"),
        ({"from": "smr", "to": "smr", "mm": 1.0}, "expected another frame than 'smr'"),
        ({"from": "smr", "to": "other", "mm": -1.0}, "expected a number above 0"),
        ({"from": "smr", "to": "other", "mm": 98.0, "m": 0.098}, "m and mm give the same value twice"),
        ({"from": "smr", "to": "other", "sigma_mm": 0.1}, "mm is missing"),
        ({"from": "smr", "to": "other", "m": 0.1, "sigma_um": 0.0}, "sigma_um: expected a standard deviation above 0"),
    ],
)
def test_a_wrong_known_distance_gets_one_sentence(tmp_path: Path, given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParseError, match=sentence) as error:
        cell_of(tmp_path, known_distances=[given])
    assert "\n" not in str(error.value)
