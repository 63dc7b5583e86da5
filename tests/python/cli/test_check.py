# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal check` as a process: exit codes, check.json, and what goes wrong."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import fastcal as library
from fastcal.robot.robot import Robot


@pytest.fixture(scope="module")
def month(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """model.yaml of a calibrated arm, and checks: held.csv, moved.csv (joint 3's zero by 0.05 deg)."""
    folder = tmp_path_factory.mktemp("month")
    nominal = library.load_robot("staubli_rx160l")
    true = library.perturbed(nominal, seed=3)
    data = library.simulate(true, library.random_poses(nominal, 60, seed=1), noise=3e-5, seed=2)
    library.write_measurements(folder / "data.csv", data)
    result = library.calibrate(nominal, data, who={"serial": "RX-7", "date": "2026-01-31"})
    result.model.save(folder / "model.yaml")
    poses = library.check_poses(result.model, 8)
    for name, turn in (("held", 0.0), ("moved", 0.05)):
        spec = Robot(true.spec | {"base": {"xyz_mm": [900, 0, 100], "rpy_deg": [0, 0, 70]}}).spec
        spec["joints"][2]["theta_deg"] += turn
        found = library.simulate(Robot(spec), poses.q, noise=3e-5, seed=3)
        library.write_measurements(folder / f"{name}.csv", found)
    return folder


def test_exit_codes_give_the_verdict(month, process, tmp_path) -> None:
    held = process("check", "model.yaml", "held.csv", "-o", tmp_path / "check.json", cwd=month)
    assert held.code == 0, held.err
    assert "still holds" in held.out
    moved = process("check", "model.yaml", "moved.csv", cwd=month)
    assert moved.code == 4
    assert "joint 3 zero by +0.0" in moved.out
    few = month / "few.csv"
    few.write_text("\n".join((month / "held.csv").read_text().splitlines()[:4]) + "\n")
    assert process("check", "model.yaml", few, cwd=month).code == 3


def test_check_json_holds_what_the_contract_names(month, fastcal, tmp_path) -> None:
    out = tmp_path / "check.json"
    said = fastcal(
        "check", month / "model.yaml", month / "moved.csv", "--tolerance-mm", "0.2", "-o", out, "--date", "2026-02-28",
        "--operator", "M. Weber",
    )  # fmt: skip
    assert said.code == 4
    found = json.loads(out.read_text())
    assert {
        "verdict",
        "rms_mm",
        "expected_rms_mm",
        "p_value",
        "within_tolerance",
        "aligned",
        "changed",
        "next_poses",
    } <= (set(found))
    assert (found["verdict"], found["within_tolerance"]) == ("changed", False)
    assert set(found["aligned"]) == {"xyz_mm", "rpy_deg"}
    (change,) = found["changed"]
    assert set(change) == {"name", "owner", "value", "std", "unit", "was", "p_value"}
    assert (change["name"], change["owner"], change["unit"]) == ("theta_deg", "joint3", "deg")
    assert change["value"] - change["was"] == pytest.approx(0.05, abs=5 * change["std"])
    assert found["made_by"] | {"serial": "RX-7", "date": "2026-02-28", "operator": "M. Weber"} == found["made_by"]
    assert found["made_by"]["data"] == ["moved.csv"]


def test_a_check_out_of_tolerance_is_4_though_nothing_changed(month, fastcal) -> None:
    noisy = library.load_measurements(month / "held.csv", library.load_robot(month / "model.yaml"))
    assert library.check(month / "model.yaml", noisy, tolerance=1e-5).within_tolerance in (None, False)
    code = fastcal("check", month / "model.yaml", month / "held.csv", "--tolerance-mm", "0.00001").code
    assert code in (3, 4)


def test_poses_of_a_check_are_planned(month, fastcal, tmp_path) -> None:
    said = fastcal("check", month / "model.yaml", "--plan", 6, "-o", tmp_path / "poses.csv")
    assert said.code == 0
    poses = library.load_measurements(
        tmp_path / "poses.csv", library.load_robot(month / "model.yaml"), require_measured=False
    )
    assert len(poses) == 6
    assert len(np.unique(poses.q, axis=0)) == 6


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["staubli_rx160l", "held.csv"], "keeps no covariance of its parameters"),
        (["model.yaml"], "expected DATA, the measured poses, or --plan N"),
        (["model.yaml", "--plan", "8"], "expected -o FILE"),
        (["model.yaml", "held.csv", "--plan", "8", "-o", "p.csv"], "leave out DATA"),
        (["model.yaml", "nothing.csv"], "nothing.csv"),
        (["model.yaml", "held.csv", "-o", "held.csv"], "is an input of this command"),
        (["model.yaml", "held.csv", "--date", "31.1.2026"], "date must be YYYY-MM-DD, got '31.1.2026'"),
        (["model.yaml", "other.csv"], "do not fit"),
        (["model.yaml", "held.csv", "--tolerance-mm", "-1"], "tolerance-mm"),
    ],
)
def test_mistakes_are_one_line_and_write_nothing(month, fastcal, monkeypatch, arguments, said) -> None:
    monkeypatch.chdir(month)
    arm = library.load_robot("staubli_rx160l")
    other = library.simulate(arm, library.random_poses(arm, 8, seed=5))
    library.write_measurements(
        month / "other.csv", library.Dataset.from_arrays(other.q[::-1].copy(), position=other.position, robot=arm)
    )
    before = {path: path.read_bytes() for path in month.iterdir()}
    failed = fastcal("check", *arguments)
    assert failed.code == 2
    assert said in failed.error
    assert {path: path.read_bytes() for path in month.iterdir()} == before


def test_update_compare_and_history_write_what_the_contract_names(month, process, tmp_path) -> None:
    done = process("update", "model.yaml", "moved.csv", "-o", tmp_path / "new", "--date", "2026-03-01", cwd=month)
    assert done.code == 0, done.err
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"model.yaml", "result.json", "report.html"}
    assert "RMS" in done.out
    done = process("compare", "model.yaml", tmp_path / "new" / "model.yaml", "-o", tmp_path / "compared", cwd=month)
    assert done.code == 0, done.err
    found = json.loads((tmp_path / "compared" / "compare.json").read_text())
    significant = [(p["owner"], p["name"]) for p in found["parameters"] if p["significant"]]
    assert significant == [("joint3", "theta_deg")]
    assert set(found["at_tool_mm"]) == {"mean", "rms", "max"}
    folder = tmp_path / "arm"
    folder.mkdir()
    for date, file in (("2026-02-01", "held"), ("2026-03-01", "moved")):
        out = folder / f"{date}.json"
        process("check", "model.yaml", f"{file}.csv", "-o", out, "--date", date, cwd=month)
    done = process("history", folder, "-o", tmp_path / "history", cwd=month)
    assert done.code == 4, "the last check changed"
    assert "RX-7 (staubli_rx160l): changed, 2 checks" in done.out
    assert {path.name for path in (tmp_path / "history").iterdir()} == {"history.json", "report.html"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["update", "staubli_rx160l", "held.csv", "-o", "out"], "keeps no covariance"),
        (["update", "model.yaml", "nothing.csv", "-o", "out"], "nothing.csv"),
        (["update", "model.yaml", "held.csv", "-o", "held.csv"], "held.csv"),
        (["compare", "model.yaml", "kuka_kr500_3"], "expected two models of one arm"),
        (["compare", "model.yaml", "held.csv"], "held.csv"),
        (["history", "nowhere"], "expected a folder with checks and models"),
        (["history", "model.yaml"], "expected a folder with checks and models"),
    ],
)
def test_mistakes_of_the_months_after_are_one_line(month, fastcal, monkeypatch, arguments, said) -> None:
    monkeypatch.chdir(month)
    before = {path: path.read_bytes() for path in month.iterdir()}
    failed = fastcal(*arguments)
    assert failed.code == 2
    assert said in failed.error
    assert {path: path.read_bytes() for path in month.iterdir()} == before


def test_a_folder_of_arms_is_checked_at_once(month, fastcal, tmp_path) -> None:
    arms = tmp_path / "arms"
    for name, file in (("A", "held"), ("B", "moved")):
        (arms / name).mkdir(parents=True)
        (arms / name / "model.yaml").write_bytes((month / "model.yaml").read_bytes())
        (arms / name / "2026-11.csv").write_bytes((month / f"{file}.csv").read_bytes())
    said = fastcal("check", arms, "-o", tmp_path / "checks", "--date", "2026-11-02", "--page-language", "de")
    assert said.code == 4
    assert "2 Roboter: 1 verändert, 1 gültig" in said.out
    assert "B: verändert: Der Roboter hat sich verändert: Nullpunkt Gelenk 3" in said.out
    found = {path.name for path in (tmp_path / "checks").iterdir()}
    assert found == {"checks.csv", "report.html", "A_2026-11.json", "B_2026-11.json"}
    assert "1 von 2 Robotern hat sich verändert: B." in (tmp_path / "checks" / "report.html").read_text()
    assert fastcal("check", arms, "--files", "none*").code == 3
    for mistake, sentence in (
        ((arms, month / "held.csv"), "leave out DATA"),
        ((month / "model.yaml", month / "held.csv", "--files", "*"), "--files needs a folder of arms"),
        ((tmp_path / "checks",), "found none"),
    ):
        failed = fastcal("check", *mistake)
        assert (failed.code, sentence in failed.error) == (2, True), failed.error


def test_a_tracker_s_uncertainty_is_used(month, fastcal, tmp_path) -> None:
    """The options are the columns: the same check either way, and another one than without."""
    model = library.load_robot(month / "model.yaml")
    data = library.load_measurements(month / "moved.csv", model)
    library.write_measurements(tmp_path / "columns.csv", data.with_tracker(1e-5, 2e-5, [5.0, 0.0, 0.0]))
    options = ("--sigma-range-mm", "0.01", "--sigma-angle-mrad", "0.02", "--instrument-at-mm", "5000,0,0")
    found = []
    for k, given in enumerate(((month / "moved.csv", *options), (tmp_path / "columns.csv",), (month / "moved.csv",))):
        assert fastcal("check", month / "model.yaml", *given, "-o", tmp_path / f"{k}.json").code == 4
        found.append(json.loads((tmp_path / f"{k}.json").read_text())["tests"][0]["std"])
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert found[0] != pytest.approx(found[2], rel=0.01)
    done = fastcal("update", month / "model.yaml", month / "moved.csv", *options, "-o", tmp_path / "new")
    assert done.code == 0, done.error
    for mistake, said in (
        (("--sigma-range-mm", "0.01"), "go together"),
        (("--sigma-range-mm", "0", "--sigma-angle-mrad", "0.02"), "sigma_range must be a standard deviation above 0"),
        ((*options[:4], "--instrument-at-mm", "5000"), "takes three numbers"),
    ):
        failed = fastcal("check", month / "model.yaml", month / "moved.csv", *mistake)
        assert (failed.code, said in failed.error) == (2, True), failed.error


def test_a_killed_check_leaves_the_old_one_whole(month, tmp_path) -> None:
    """The history is these files: whenever a check is killed, each is there as it was or as it shall be."""
    out = tmp_path / "2026-02.json"
    command = [sys.executable, "-m", "fastcal", "check", "model.yaml", "held.csv", "-o", str(out)]
    subprocess.run(command, cwd=month, check=True, capture_output=True)
    whole = out.read_bytes()
    started = time.monotonic()
    subprocess.run(command, cwd=month, check=True, capture_output=True)
    lasts = time.monotonic() - started
    for share in (0.5, 0.8, 0.95, 1.0):
        running = subprocess.Popen(command, cwd=month, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(share * lasts)
        running.kill()
        running.wait()
        assert out.read_bytes() == whole
        assert len(library.history(tmp_path).arms[0].checks) == 1


def test_the_model_keeps_where_it_comes_from(month, fastcal, tmp_path) -> None:
    said = fastcal(
        "calibrate",
        "staubli_rx160l",
        month / "data.csv",
        "--serial",
        "RX-9",
        "--instrument",
        "AT960",
        "-o",
        tmp_path / "a",
    )
    assert said.code == 0
    model, result = (
        library.load_robot(tmp_path / "a" / "model.yaml"),
        json.loads((tmp_path / "a" / "result.json").read_text()),
    )
    made_by = model.spec["made_by"]
    assert made_by == result["made_by"]
    assert made_by | {"serial": "RX-9", "instrument": "AT960", "data": ["data.csv"], "rows": 60} == made_by
    again = library.calibrate("staubli_rx160l", library.load_measurements(month / "data.csv", model))
    assert again.model.spec["made_by"]["data_sha256"] == made_by["data_sha256"]
    assert again.model.spec["made_by"]["robot_sha256"] == made_by["robot_sha256"]
