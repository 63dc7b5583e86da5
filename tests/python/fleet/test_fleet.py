# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A fleet: each arm as `calibrate` alone has it, one table, and an arm that can't be calibrated stops no other."""

import csv
import html
import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

import fastcal
from fastcal.fleet import calibrate_many, read_list
from fastcal.fleet.arms import Arm
from fastcal.fleet.one_arm import key_of
from fastcal.fleet.page import fleet_page
from fastcal.fleet.result import ArmResult, Fleet
from fastcal.fleet.side_by_side import suspects
from fastcal.report.formatting import significant

COUNT = 7


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A LIST of seven arms; the last one's joint 2 turns the other way round."""
    path = tmp_path_factory.mktemp("fleet")
    robot = fastcal.load_robot("staubli_rx160l")
    lines = ["robot,data,test,name"]
    for k in range(COUNT):
        true = fastcal.perturbed(robot, seed=k)
        for kind, poses, seed in (("fit", 60, k), ("test", 20, 100 + k)):
            data = fastcal.simulate(true, fastcal.random_poses(robot, poses, seed=seed), noise=5e-5, seed=seed)
            if k == COUNT - 1:
                data = replace(data, q=data.q * [1, -1, 1, 1, 1, 1])
            fastcal.write_measurements(path / f"{kind}{k}.csv", data)
        lines.append(f"staubli_rx160l,fit{k}.csv,test{k}.csv,arm {k}")
    (path / "arms.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def fleet(folder: Path) -> Fleet:
    return calibrate_many(read_list(folder / "arms.csv"), out=folder / "out")


def test_an_arm_of_a_fleet_is_the_arm_alone(folder: Path, fleet: Fleet) -> None:
    robot = fastcal.load_robot("staubli_rx160l")
    data = fastcal.load_measurements(folder / "fit3.csv", robot)
    alone = fastcal.calibrate(robot, data, test=fastcal.load_measurements(folder / "test3.csv", robot))
    row = fleet["arm 3"]
    assert row.status == "converged"
    assert row.checks == "fit"
    assert row.model is not None
    np.testing.assert_array_equal(row.model.forward(data.q), alone.model.forward(data.q))
    assert (row.sigma_mm, row.rows, row.outliers) == (alone.sigma_mm, 60, len(alone.outliers))
    assert alone.test is not None
    assert row.test_mm == alone.test.to_json_dict()["after_mm"]["rms"]
    written = fastcal.load_robot(folder / "out" / "arm 3" / "model.yaml")
    np.testing.assert_array_equal(written.forward(data.q), row.model.forward(data.q))


def test_an_arm_unlike_the_others_gets_all_checks_and_its_reason(folder: Path, fleet: Fleet) -> None:
    odd = fleet[f"arm {COUNT - 1}"]
    assert (odd.status, odd.checks) == ("refused", "all")
    assert "joint 2" in odd.message
    assert fleet.failed == [odd]
    assert not (folder / "out" / odd.name / "model.yaml").exists()


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Data files that are calibrated."""
    found: list[str] = []
    calibrate = fastcal.calibrate

    def count(robot: object, data: object, **options: object) -> object:
        found.append(Path(str(data)).name)
        return calibrate(robot, data, **options)  # type: ignore[arg-type]

    monkeypatch.setattr("fastcal.fleet.one_arm.calibrate", count)
    return found  # type: ignore[return-value]


def test_a_second_run_does_what_is_new_alone(folder: Path, fleet: Fleet, counted: list[str], tmp_path: Path) -> None:
    again = shutil.copytree(folder, tmp_path / "again")
    lines = (again / "fit1.csv").read_text(encoding="utf-8").splitlines()
    (again / "fit1.csv").write_text("\n".join(lines[:-1]) + "\n", encoding="utf-8")
    (again / "out" / "arm 2" / "result.json").unlink()
    found = calibrate_many(read_list(again / "arms.csv"), out=again / "out")
    assert sorted(set(counted)) == ["fit1.csv", "fit2.csv"]
    assert [arm.to_row() for arm in found][2:] == [arm.to_row() for arm in fleet][2:]
    assert found["arm 1"].rows == 59
    counted.clear()
    calibrate_many(read_list(again / "arms.csv"), out=again / "out", loss="huber")
    assert len(set(counted)) == COUNT


def test_processes_and_a_cluster_find_the_same(folder: Path, fleet: Fleet) -> None:
    distributed = pytest.importorskip("distributed")
    arms = read_list(folder / "arms.csv")
    rows = [arm.to_row() for arm in fleet]
    assert [arm.to_row() for arm in calibrate_many(arms, jobs=2)] == rows
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        assert [arm.to_row() for arm in calibrate_many(arms, cluster=cluster.scheduler_address)] == rows


@pytest.fixture(scope="module")
def sick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A LIST of three arms: joint 3 of one has lost motion, another one is as it should be, the third has no file."""
    path = tmp_path_factory.mktemp("sick")
    robot = fastcal.load_robot("staubli_rx160l")
    play = {"effect": "backlash", "owner": "joint3", "parameters": {"gap_rad": 4e-4}}
    approach = np.random.default_rng(1).choice([-1.0, 1.0], (90, 6))
    for name, spec in (("play", {**robot.spec, "effects": [play]}), ("sound", robot.spec)):
        true = fastcal.perturbed(fastcal.Robot(spec), seed=1)
        poses = fastcal.random_poses(robot, 90, seed=2)
        data = fastcal.simulate(true, poses, noise=5e-5, seed=3, approach=approach)
        fastcal.write_measurements(path / f"{name}.csv", data)
    lines = ["robot,data", *(f"staubli_rx160l,{name}.csv" for name in ("play", "sound", "absent"))]
    (path / "arms.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_fleet_is_diagnosed(sick: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from fastcal.cli import main

    command = ["fleet", str(sick / "arms.csv"), "--diagnose", "-o", str(sick / "out")]
    assert main(command) == 3  # one arm has no file
    said = capfd.readouterr().out.splitlines()
    assert said[:3] == ["2 of 3 arms diagnosed", "  play: named: A backlash@joint3", "  sound: none"]
    assert said[3].startswith("  absent: refused: ")
    alone = fastcal.diagnose("staubli_rx160l", sick / "play.csv")
    with (sick / "out" / "fleet.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert rows["play"]["verdict"] == alone.verdict == "named"
    assert float(rows["play"]["after_mm"]) == alone.steps[-1].train.to_json_dict()["after_mm"]["rms"]
    assert float(rows["play"]["after_mm"]) < 0.5 * float(rows["play"]["before_mm"])
    page = (sick / "out" / "report.html").read_text(encoding="utf-8")
    assert "2 of 3 arms diagnosed" in page
    assert "play: joint 3 backlash (A)" in page
    written = json.loads((sick / "out" / "play" / "diagnosis.json").read_text(encoding="utf-8"))
    assert written["verdict"] == "named"
    assert (sick / "out" / "play" / "report.html").is_file()

    monkeypatch.setattr("fastcal.diagnosis.diagnose", None)  # nothing but what is new is diagnosed again
    again = fastcal.diagnose_many(read_list(sick / "arms.csv")[:2], out=sick / "out")
    assert again["play"].causes == "A backlash@joint3"
    assert again["play"].model is not None


def test_a_cluster_diagnoses_the_same(sick: Path) -> None:
    distributed = pytest.importorskip("distributed")
    arms = read_list(sick / "arms.csv")[:2]
    rows = [arm.to_row() for arm in fastcal.diagnose_many(arms)]
    assert [arm.to_row() for arm in fastcal.diagnose_many(arms, jobs=2)] == rows
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        assert [arm.to_row() for arm in fastcal.diagnose_many(arms, cluster=cluster.scheduler_address)] == rows
        drawn = fastcal.bootstrap("staubli_rx160l", sick / "sound.csv", draws=3, cluster=cluster.scheduler_address)
    here = fastcal.bootstrap("staubli_rx160l", sick / "sound.csv", draws=3)
    np.testing.assert_array_equal(drawn.values, here.values)


def test_a_diagnosis_chooses_the_effects(sick: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from fastcal.cli import main

    assert main(["fleet", str(sick / "arms.csv"), "--diagnose", "--check-all", "-o", str(sick / "none")]) == 2
    assert "--diagnose goes without" in capfd.readouterr().err
    assert not (sick / "none").exists()


def test_objects_in_place_of_files() -> None:
    robot = fastcal.load_robot("ur5")
    data = fastcal.simulate(robot, fastcal.random_poses(robot, 30, seed=1), noise=5e-5, seed=1)
    found = fastcal.calibrate_many([fastcal.Arm("a", robot, data), fastcal.Arm("b", robot, data)])
    assert [arm.checks for arm in found] == ["all", "all"]
    assert found["a"].sigma_mm == found["b"].sigma_mm
    assert list(found.to_frame()["name"]) == ["a", "b"]
    with pytest.raises(fastcal.InvalidInput, match="no arm 'c'"):
        found["c"]


def test_arms_in_memory_are_taken_up_again_after_they_were_looked_at(tmp_path: Path) -> None:
    robot = fastcal.load_robot("ur5")
    data = fastcal.simulate(robot, fastcal.random_poses(robot, 30, seed=1), noise=5e-5, seed=2)
    arm = Arm("one", robot, data)
    before = key_of(arm, {})
    calibrate_many([arm], out=tmp_path)
    assert key_of(arm, {}) == before
    page = (tmp_path / "one" / "result.json").stat().st_mtime_ns
    calibrate_many([arm], out=tmp_path)
    assert (tmp_path / "one" / "result.json").stat().st_mtime_ns == page


def test_pages_of_arms_are_in_the_language_of_the_fleet_also_after_another(tmp_path: Path) -> None:
    robot = fastcal.load_robot("ur5")
    data = fastcal.simulate(robot, fastcal.random_poses(robot, 30, seed=1), noise=5e-5, seed=2)
    for language in ("en", "de", "de"):
        calibrate_many([Arm("one", robot, data)], out=tmp_path, reports=True, language=language)
        assert f'<html lang="{language}">' in (tmp_path / "one" / "report.html").read_text()


def test_the_command_writes_table_and_page(folder: Path, fleet: Fleet, capfd: pytest.CaptureFixture[str]) -> None:
    from fastcal.cli import main

    code = main(["fleet", str(folder / "arms.csv"), "-o", str(folder / "out")])
    said = capfd.readouterr().out.splitlines()
    assert code == 3  # one arm has no model
    assert said[0] == "6 of 7 arms calibrated"
    assert said[1].startswith("  arm 6: refused: ")
    with (folder / "out" / "fleet.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["name"] for row in table] == [f"arm {k}" for k in range(COUNT)]
    assert float(table[3]["after_mm"]) == fleet["arm 3"].after_mm
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "6 of 7 arms calibrated" in page
    assert "arm 6</strong>: refused" in page
    result = json.loads((folder / "out" / "arm 0" / "result.json").read_text(encoding="utf-8"))
    assert result["fleet"]["row"] == fleet["arm 0"].to_row()


def test_the_page_says_first_what_became_of_the_arms_and_leads_to_their_pages(fleet: Fleet, tmp_path: Path) -> None:
    done = [arm for arm in fleet if arm.after_mm is not None]
    first, second = done[:2]
    for arm in (first, second):
        (tmp_path / arm.name).mkdir()
    (tmp_path / first.name / "report.html").write_text("")
    lost = replace(first, name="lost", after=None, after_mm=None, model=None)
    lost = replace(lost, status="refused", message="q1_deg is missing")
    document = fleet_page(Fleet([first, second, lost]), tmp_path)
    box = document.split('<section class="verdict')[1].split("</section>")[0]
    worst = max((first, second), key=lambda arm: arm.after_mm or 0.0)
    assert f"2 of 3 arms have a model; the largest error is {worst.after_mm:.3g} mm RMS, of {worst.name}." in box
    assert "lost: q1_deg is missing" in box
    assert f'<a href="{quote(first.name)}/report.html">{first.name}</a>' in document
    assert f'<a href="{quote(second.name)}/report.html">' not in document


def test_the_drawing_begins_with_the_worst_and_a_click_opens_its_page(fleet: Fleet, tmp_path: Path) -> None:
    """With the limit beyond which the verdict names an arm: twice the median error."""
    done = [arm for arm in fleet if arm.after_mm is not None]
    (tmp_path / done[1].name).mkdir()
    (tmp_path / done[1].name / "report.html").write_text("")
    errors = [0.1, 0.3, 0.12]
    arms = [replace(arm, after=size, after_mm=size) for arm, size in zip(done, errors, strict=False)]
    document = fleet_page(Fleet(arms), tmp_path)
    drawing = document.split('id="figure-fleet"')[1].split('<script type="application/json">')[1].split("</script>")[0]
    drawn = json.loads(drawing)
    _nominal, calibrated, limit = drawn["data"]
    assert calibrated["y"] == [0.3, 0.12, 0.1]
    assert limit["y"] == pytest.approx([0.24, 0.24])
    assert drawn["pages"] == [f"{quote(done[1].name)}/report.html", "", ""]
    assert "A click on an arm opens its page." in document


def test_what_was_noticed_of_an_arm_is_on_the_page(fleet: Fleet) -> None:
    """Below the table, where a sentence has room, of arms that have a model; the others have a list of their own."""
    arms = [replace(arm, message="the residuals depend on the posture") for arm in fleet]
    notes = fleet_page(Fleet(arms)).split("<h2>Notes</h2>")[1].split("</section>")[0]
    assert notes.count("the residuals depend on the posture") == sum(arm.status == "converged" for arm in arms)
    assert "<h2>Notes</h2>" not in fleet_page(Fleet([replace(arm, message="") for arm in arms]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("robot,name\nur5,a\n", r"no column 'data'"),
        ("robot,data,colour\nur5,a.csv,red\n", r"unknown column 'colour'"),
        ("robot,data\nur5,\n", r"column 'data': expected a file, got an empty cell"),
        ("robot,data,name\nur5,a.csv,..\n", r"name of an arm is that of its folder"),
        ("robot,data,name\nur5,a.csv,x/y\n", r"name of an arm is that of its folder"),
        ("robot,data\nur5,a.csv\nur5,b/a.csv\n", r"two arms are called 'a'"),
    ],
)
def test_an_invalid_list_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "arms.csv").write_text(text, encoding="utf-8")
    with pytest.raises(fastcal.FastcalError, match=message):
        read_list(tmp_path / "arms.csv")


def test_a_missing_file_is_a_row_and_a_cluster_that_does_not_answer_an_error(tmp_path: Path) -> None:
    arms = [Arm("a", "ur5", tmp_path / "absent.csv")]
    assert "there is no such file" in calibrate_many(arms)["a"].message
    with pytest.raises(fastcal.InvalidInput, match="expected at least one arm"):
        calibrate_many([])
    with pytest.raises(fastcal.InvalidInput, match="jobs must be at least 1"):
        calibrate_many(arms, jobs=0)
    with pytest.raises(fastcal.InvalidInput, match="expected the address of a Dask scheduler"):
        calibrate_many(arms, cluster="nonsense://nowhere")


def test_who_fits_worse_than_three_times_the_median_is_looked_at(fleet: Fleet) -> None:
    good = [arm for arm in fleet if arm.status == "converged"]
    assert suspects(good) == set()
    worse = replace(good[0], name="odd", after=1.0)
    assert suspects([*good, worse]) == {"odd"}


def test_arms_without_points_have_their_own_figures(tmp_path: Path) -> None:
    """Of arms measured by lengths and tilts every size was empty, and none of them was ever looked at closely."""
    from ..calibration.bench_arm import robot
    from ..calibration.kind_sets import read

    arms = [
        *(Arm(f"length {k}", robot(), read(("length",), 90, k), read(("length",), 40, k)) for k in range(3)),
        Arm("tilt", robot(), read(("tilt",), 90, 1)),
        Arm("points", robot(), read(("position", "tilt"), 60, 1)),
    ]
    found = calibrate_many(arms, out=tmp_path / "out")
    assert not found.failed
    row = found["tilt"]
    assert (row.kind, row.unit, row.before_mm, row.sigma_mm) == ("tilt", "deg", None, None)
    assert None not in (row.before, row.after, row.noise)
    assert row.after is not None
    assert row.before is not None
    assert row.after < row.before
    length = found["length 1"]
    assert (length.kind, length.unit) == ("length", "mm")
    assert length.test is not None
    assert 0.015 < length.test < 0.04
    points = found["points"]
    assert (points.kind, points.before, points.noise) == ("position", points.before_mm, points.sigma_mm)
    text = fleet_page(found)
    assert f"{significant(row.after)} °" in text
    assert text.index("points") < text.index(">tilt<")  # lengths first
    worse = replace(found["length 2"], after=10 * (found["length 0"].after or 0.0))
    assert suspects([found["length 0"], found["length 1"], worse, found["tilt"]]) == {"length 2"}


def test_the_page_names_arms_that_stand_out_and_no_folder(tmp_path: Path) -> None:
    done = {"status": "converged", "rows": 40, "unit": "mm", "message": ""}
    arms = [ArmResult(name=f"cell {k}", before=1.0, after=size, after_mm=size, **done) for k, size in
            enumerate((0.08, 0.09, 0.1, 0.35))]  # fmt: skip
    file = tmp_path / "anna" / "lost.csv"
    lost = ArmResult(name="lost", status="refused", message=f"{file}: no column 'q3_deg'")
    page = fleet_page(Fleet([*arms, lost]))
    assert "More than 2 times the error of the median arm: cell 3 (0.350 mm)." in page
    assert "lost: lost.csv: no column" in html.unescape(page)
    assert "anna" not in page
    assert "median arm:" not in fleet_page(Fleet(arms[:3]))
