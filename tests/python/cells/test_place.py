# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Members of a cell where readings put them; a track's and a turntable's axis, and how far they go."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from fastcal import _core
from fastcal.cells.cell import Cell
from fastcal.cells.place import PlacedMembers, place_axis, place_members
from fastcal.cells.readings import Readings
from fastcal.errors import InvalidInput, Undetermined
from fastcal.io.tree_file import load_cell, write_cell

FloatArray = NDArray[np.float64]
NOISE, RATIO = 5e-5, 3e-4  # [m] of a coordinate; error of the axis' gear


def cell(folder: Path, base: tuple[list[float], list[float]], mark: list[float], kind: str) -> Cell:
    """A fixed arm with a tip, and a table (or track) with a mark."""
    joint: dict[str, Any] = {"type": kind, "theta_deg": 10.0, "d_mm": 150.0, "a_mm": 20.0, "alpha_deg": 5.0}
    if kind == "prismatic":
        joint |= {"min_mm": 0.0, "max_mm": 2000.0}
    content = {
        "cell": "placing",
        "arms": {
            "arm": {"robot": "ur5", "xyz_mm": [0, 0, 0], "fixed": True},
            "table": {
                "robot": {"name": "t", "kinematics": "dh", "joints": [joint]},
                "xyz_mm": base[0],
                "rpy_deg": base[1],
            },
        },
        "targets": {"mark": {"on": "table", "xyz_mm": mark}},
        "sensors": {"tip": {"on": "arm", "xyz_mm": [10, 0, 150]}},
    }
    path = folder / "cell.yaml"
    path.write_text(yaml.safe_dump(content))
    return load_cell(path)


def pair(folder: Path, kind: str) -> tuple[Cell, Cell]:
    """The cell as it is and as its file says."""
    true = cell(folder, ([900.0, 100.0, -200.0], [2.0, -3.0, 40.0]), [150.0, 60.0, 30.0], kind)
    return true, cell(folder, ([850.0, 150.0, -150.0], [0.0, 0.0, 0.0]), [0.0, 0.0, 0.0], kind)


def axis_column(of: Cell) -> int:
    return [names[0] for names in of.joint_columns].index("table.q1")


def mark(of: Cell, q: FloatArray, ratio: float = 0.0, frame: str = "mark") -> FloatArray:
    """(N, 4, 4) of a frame whose axis goes farther than it is sent by a ratio."""
    there = q.copy()
    there[:, axis_column(of)] *= 1 + ratio
    return np.asarray(of.model.predict(_core.Samples(there), of.model.start, of=frame))


def read(true: Cell, count: int, seed: int, *, by_tip: bool = False, reach: float = 1.5) -> Readings:
    """The mark, by a tracker or touched by the arm's tip."""
    random = np.random.default_rng(seed)
    q = random.uniform(-1, 1, (count, 7))
    turns = true.joint_types[axis_column(true)] == "revolute"
    q[:, axis_column(true)] = np.linspace(-reach if turns else 0.0, reach, count)
    p = mark(true, q, RATIO)[:, :3, 3] + NOISE * random.standard_normal((count, 3))
    if not by_tip:
        return Readings(q, {"position@mark": p}, "turns.csv")
    tip = mark(true, q, frame="tip")
    return Readings(q, {"position@mark:tip": np.einsum("nji,nj->ni", tip[:, :3, :3], p - tip[:, :3, 3])}, "turns.csv")


def error(found: PlacedMembers, true: Cell) -> float:
    """[mm] largest of the mark, predicted over the whole way of the axis."""
    q = np.zeros((20, 7))
    q[:, axis_column(true)] = np.linspace(0, 1.5, 20)
    return 1e3 * float(np.abs(mark(found.cell, q)[:, :3, 3] - mark(true, q, RATIO)[:, :3, 3]).max())


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize("by_tip", [False, True])
def test_an_axis_is_found_from_a_far_start_with_its_ratio(tmp_path: Path, kind: str, by_tip: bool) -> None:
    true, sent = pair(tmp_path, kind)
    inside = []
    for seed in range(20):
        found = place_axis(sent, read(true, 10, seed, by_tip=by_tip))
        assert error(found, true) < 0.2
        assert found.ratio is not None
        inside.append(abs(found.ratio[0] - RATIO) < 1.96 * found.ratio[1])
    assert np.mean(inside) >= 0.8  # of 20 at 95 %: fewer than 16 come by in 1 of 3,000 cases
    assert [of.name for of in found.members] == ["table", "mark"]
    assert found.free  # where along its line the base is


def test_the_written_cell_has_the_axis_its_ratio_and_how_surely(tmp_path: Path) -> None:
    true, sent = pair(tmp_path, "revolute")
    found = place_axis(sent, read(true, 12, 3), "table")
    write_cell(found.cell, tmp_path / "placed.yaml")
    again = load_cell(tmp_path / "placed.yaml")
    q = np.random.default_rng(1).uniform(-1, 1, (5, 7))
    assert np.array_equal(mark(again, q), mark(found.cell, q))
    known = again.known("table")
    assert known.sigma_mm is not None
    assert 0.005 < known.sigma_mm < 0.2
    entry = again.arm("table").robot.entries[0]
    assert (entry["effect"], entry["owner"]) == ("reduction_ratio", "joint1")
    assert entry["parameters"]["error"]["std"] > 0
    # A second time, from the placed one: the ratio is found anew and stands once.
    twice = place_axis(again, read(true, 12, 3), "table")
    assert len(twice.cell.arm("table").robot.entries) == 1
    assert twice.ratio == pytest.approx(found.ratio, rel=1e-3)


def test_three_positions_leave_the_ratio_as_it_is(tmp_path: Path) -> None:
    true, sent = pair(tmp_path, "revolute")
    assert place_axis(sent, read(true, 3, 1)).ratio is None


def test_an_arms_base_and_a_target_are_placed_by_name(tmp_path: Path) -> None:
    true, sent = pair(tmp_path, "revolute")
    random = np.random.default_rng(2)
    q = random.uniform(-1, 1, (30, 7))
    p = mark(true, q)[:, :3, 3] + NOISE * random.standard_normal((30, 3))
    readings = Readings(q, {"position@mark": p}, "turns.csv")
    found = place_members(true, readings, ["mark"])  # all else is where the file says
    (placed,) = found.members
    assert np.abs(np.array(placed.xyz_mm) - [150, 60, 30]).max() < 0.1
    assert all(std is not None and std < 0.05 for std in placed.std_mm)
    base = place_members(sent_with_mark(true, sent), readings, ["table"])
    assert np.abs(np.array(base.members[0].xyz_mm) - [900, 100, -200]).max() < 1.0


def sent_with_mark(true: Cell, sent: Cell) -> Cell:
    """The cell as sent, its mark where it is."""
    return Cell(sent.name, sent.arms, true.points)


def test_what_is_missing_is_said(tmp_path: Path) -> None:
    true, sent = pair(tmp_path, "revolute")
    with pytest.raises(Undetermined, match=r"turns.csv: targets on table were read at 2 of its positions; expected 3"):
        place_axis(sent, read(true, 2, 1))
    with pytest.raises(Undetermined, match=r"the axis was turned by 5.7 deg; expected 20 deg"):
        place_axis(sent, read(true, 6, 1, reach=0.05))
    with pytest.raises(InvalidInput, match="'arm' is no arm of one joint of this cell"):
        place_axis(sent, read(true, 6, 1), "arm")
    with pytest.raises(InvalidInput, match="'bench' is no arm, target or sensor of this cell; there are arm, table"):
        place_members(sent, read(true, 6, 1), ["bench"])
    with pytest.raises(Undetermined, match="no reading shows where tip stands"):
        place_members(sent, read(true, 6, 1), ["tip"])
    with pytest.raises(InvalidInput, match="nothing was read of a target on table"):
        place_axis(sent, Readings(np.zeros((3, 7)), {"position@tip": np.zeros((3, 3))}, "turns.csv"))
