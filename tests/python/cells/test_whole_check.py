# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cells whose sensor stands on an arm, that take pictures, or whose arms bend: checked and updated as a whole."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from fastcal import _core
from fastcal.cells.asked import with_effects
from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.cell import Cell
from fastcal.cells.check import checked_ways
from fastcal.cells.motions import to_written
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import simulate_cell
from fastcal.cells.whole_check import check_whole
from fastcal.cli.app import main
from fastcal.errors import InvalidInput
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import load_cell, write_cell
from fastcal.io.tree_readings_out import write_readings

from . import track_scene as track
from .test_calibrate import content, written
from .test_sensor_ways import NOISE, NOISE_TURN, VIEWS, cell_of
from .test_uses import disturbed

SLIP = 3e-3  # [rad]


def read(cell: Cell, count: int, seed: int, slipped: str = "", views: tuple[str, ...] = (*VIEWS,)) -> Readings:
    """Poses of both tags from the head, with a zero that has slipped or none."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-2.4, 2.4, (count, len(cell.joint_columns)))
    there = q.copy()
    if slipped:
        there[:, [titles[0] for titles in cell.joint_columns].index(slipped)] += SLIP
    sizes: dict[str, Any] = {"noise": NOISE, "noise_rotation": NOISE_TURN, "seed": seed}
    return replace(simulate_cell(cell, Readings(there, {}, "simulated"), views, **sizes), q=q)


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Cell]:
    """A folder with model.yaml of a head that sees two hands, and the true cell."""
    folder = tmp_path_factory.mktemp("head")
    cell = cell_of(folder)
    true = disturbed(cell, 3)
    write_cell(calibrate_cell(cell, read(true, 90, 1)).cell, folder / "model.yaml")
    return folder, true


def checked(model: Path, poses: Path, folder: Path, code: int, *options: str) -> dict[str, Any]:
    out = folder / "check.json"
    assert main(["check", str(model), str(poses), *options, "-o", str(out)]) == code
    return dict(json.loads(out.read_text(encoding="utf-8")))


def test_a_head_that_holds(head: tuple[Path, Cell], tmp_path: Path) -> None:
    folder, true = head
    write_readings(tmp_path / "new.csv", true, read(true, 14, 5))
    found = checked(folder / "model.yaml", tmp_path / "new.csv", tmp_path, 0, "--tolerance-mm", "1")
    assert (found["verdict"], found["within_tolerance"], found["causes"]) == ("holds", True, [])
    assert set(found["kinds"]) == {"position", "orientation"}
    assert not found["blind"]
    assert not found["next_poses"]
    assert found["rms_mm"] == found["kinds"]["position"]["after"]["rms"]
    assert found["expected_rms_mm"] == found["kinds"]["position"]["expected_rms"]
    page = tmp_path / "check.html"
    assert main(["check", str(folder / "model.yaml"), str(tmp_path / "new.csv"), "-o", str(page)]) == 0
    assert "the readings agree with it to within the noise" in page.read_text(encoding="utf-8")


def test_a_slipped_zero_of_an_arm_that_a_head_sees_is_named(head: tuple[Path, Cell], tmp_path: Path) -> None:
    folder, true = head
    write_readings(tmp_path / "new.csv", true, read(true, 14, 6, "left.q3"))
    found = checked(folder / "model.yaml", tmp_path / "new.csv", tmp_path, 4)
    (cause,) = found["causes"]
    assert cause["label"] == "left.joint3 zero"
    assert cause["changes"][0]["change"] == pytest.approx(np.degrees(SLIP), abs=4 * cause["changes"][0]["std"])
    page = tmp_path / "check.html"
    command = ["check", str(folder / "model.yaml"), str(tmp_path / "new.csv"), "-o", str(page), "--page-language", "de"]
    assert main(command) == 4
    assert "hat sich bewegt" in page.read_text(encoding="utf-8")
    assert main(["update", str(folder / "model.yaml"), str(tmp_path / "new.csv"), "-o", str(tmp_path / "u")]) == 0
    write_readings(tmp_path / "later.csv", true, read(true, 14, 7, "left.q3"))
    assert checked(tmp_path / "u/model.yaml", tmp_path / "later.csv", tmp_path, 0)["verdict"] == "holds"


def test_a_head_holds_as_often_as_it_should(head: tuple[Path, Cell]) -> None:
    folder, true = head
    model = load_cell(folder / "model.yaml")
    checks = [check_whole(model, read(true, 12, seed)) for seed in range(100, 112)]
    assert sum(found.verdict == "holds" for found in checks) >= 11
    # Errors are as large as noise and what is known of the cell make them, 12 sets of 36 numbers and more.
    for kind in ("position", "orientation"):
        ratio = [np.sqrt(np.mean(of.kinds[kind].after ** 2)) / of.expected[kind] for of in checks]
        assert np.sqrt(np.mean(np.square(ratio))) == pytest.approx(1, abs=0.1)


def test_postures_that_decide_are_asked_for(head: tuple[Path, Cell]) -> None:
    """One point decides nothing; with the postures that are asked for nothing of the chain to its target is unseen."""
    folder, true = head
    model = load_cell(folder / "model.yaml")
    names = [titles[0] for titles in true.joint_columns]
    one = Readings(read(true, 1, 8).q, {}, "one")
    found = check_whole(model, simulate_cell(true, one, ["tag_left:camera"], noise=NOISE, seed=1))
    assert found.verdict == "cannot_tell"
    poses = found.to_json_dict()["next_poses"]
    assert len(poses) == 6
    assert set(poses[0]) == {f"{name}_deg" for name in names}
    asked = np.radians([[pose[f"{name}_deg"] for name in names] for pose in poses])
    more = Readings(np.vstack([one.q, asked]), {}, "more")
    again = check_whole(model, simulate_cell(true, more, ["tag_left:camera"], noise=NOISE, seed=2))
    assert again.verdict == "holds"
    assert not [name for name in again.blind if name.startswith("left.joint")]


def test_a_joint_that_no_reading_moves_with_is_not_seen(head: tuple[Path, Cell]) -> None:
    folder, true = head
    model = load_cell(folder / "model.yaml")
    found = check_whole(model, read(true, 12, 8, views=("tag_left:camera",)))
    assert found.verdict == "holds"
    assert {f"right.joint{k} zero" for k in range(1, 7)} <= set(found.blind)
    assert not len(found.next)  # no posture would show them by this view
    assert not any(name.startswith("left") for name in found.blind)


def test_arms_with_what_no_longer_arm_brings_along_are_checked_and_updated(tmp_path: Path) -> None:
    """A bearing that tilts refers to the rows of its own arm."""
    cell = with_effects(load_cell(written(tmp_path, content(sensors={}))), "geometry,bearing_tilt@left.joint2")
    true = disturbed(cell, 4)
    true = true.with_values(np.append(true.core.nominal, 2e-6))  # [rad/(N m)]
    known = calibrate_cell(cell, read(true, 80, 1, views=("smr", "tag")), effects=True).cell
    assert not checked_ways(known, read(true, 8, 2, views=("smr", "tag")))
    write_cell(known, tmp_path / "model.yaml")
    write_readings(tmp_path / "new.csv", true, read(true, 12, 2, views=("smr", "tag")))
    assert checked(tmp_path / "model.yaml", tmp_path / "new.csv", tmp_path, 0)["verdict"] == "holds"
    write_readings(tmp_path / "new.csv", true, read(true, 12, 3, "left.q2", ("smr", "tag")))
    causes = checked(tmp_path / "model.yaml", tmp_path / "new.csv", tmp_path, 4)["causes"]
    assert [of["label"] for of in causes] == ["left.joint2 zero"]
    assert main(["update", str(tmp_path / "model.yaml"), str(tmp_path / "new.csv"), "-o", str(tmp_path / "u")]) == 0
    assert json.loads((tmp_path / "u/result.json").read_text())["moved"] == ["left.joint2 zero"]


def test_pictures_of_a_cell_are_checked(tmp_path: Path) -> None:
    scene = track.Scene(3)
    scene.write(tmp_path, 40)
    cell = load_cell(tmp_path / "cell.yaml")
    known = calibrate_cell(cell, load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")).cell
    write_cell(known, tmp_path / "model.yaml")
    scene.write(tmp_path, 6, prefix="new_")
    options = ("--corners", str(tmp_path / "new_corners.csv"))
    found = checked(tmp_path / "model.yaml", tmp_path / "new_poses.csv", tmp_path, 0, *options)
    assert (found["verdict"], set(found["kinds"])) == ("holds", {"corner"})


def test_what_cannot_be_checked_gets_one_sentence(
    head: tuple[Path, Cell], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, true = head
    write_readings(tmp_path / "new.csv", true, read(true, 8, 9))
    assert main(["check", str(folder / "cell.yaml"), str(tmp_path / "new.csv")]) == 2
    assert "keeps no covariance of all its parameters" in capsys.readouterr().err
    model, new = load_cell(folder / "model.yaml"), read(true, 8, 9)
    with pytest.raises(InvalidInput, match="keeps no covariance of all its parameters"):
        check_whole(replace(model, record=None), new)
    turns = {name: table for name, table in new.tables.items() if name.startswith("rotation")}
    with pytest.raises(InvalidInput, match="a tolerance is of points, and none was measured"):
        check_whole(model, replace(new, tables=turns), tolerance=1e-3)
    assert check_whole(model, read(true, 1, 9, views=("tag_left:camera",))).verdict in ("holds", "cannot_tell")


def test_what_a_track_cell_is_expected_to_show_is_what_it_shows(tmp_path: Path) -> None:
    """Held directions without the board's share, and turns counted from where the cell stood before, made it 14449 px.

    The table's zero and the board on it move together: held was the one, and the record had not the other.
    """
    scene = track.Scene(5)
    scene.write(tmp_path, 30)
    scene.write(tmp_path, 12, prefix="new_")
    content = track.cell()
    for name in ("track", "table"):  # turned by degrees: where the written cell stands is another place to count from
        content["arms"][name]["rpy_deg"] = [0.0, 2.0, 3.0]
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")
    model = calibrate_cell(cell, load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")).cell
    new = load_seen_readings(tmp_path / "new_poses.csv", model, tmp_path / "new_corners.csv")
    found = check_whole(model, new)
    after = found.kinds["corner"].statistics[1]
    assert after is not None
    assert found.verdict == "holds"
    assert found.expected["corner"] == pytest.approx(after.rms, rel=0.15)


def test_small_changes_are_those_of_the_written_cell(tmp_path: Path) -> None:
    track.Scene(5).write(tmp_path, 1)
    cell = load_cell(tmp_path / "cell.yaml")
    random = np.random.default_rng(1)
    theta = np.asarray(cell.model.start) + random.normal(0, 0.02, len(cell.model.start))
    written = cell.with_values(theta)
    change = to_written(cell, theta, written)
    q = random.uniform(-0.5, 0.5, (2, len(cell.joint_columns)))
    for k in random.choice(len(theta), 15, replace=False):
        slopes = []
        for of, at, step in (
            (cell, theta, 1e-6 * np.eye(len(theta))[k]),
            (written, np.asarray(written.model.start), 1e-6 * change[:, k]),
        ):
            ends = [of.model.predict(_core.Samples(q), at + sign * step, of="arm.link6") for sign in (1, -1)]
            slopes.append((np.asarray(ends[0]) - np.asarray(ends[1])) / 2e-6)
        assert slopes[0] == pytest.approx(slopes[1], abs=1e-6)
