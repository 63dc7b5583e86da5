# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal diagnose` as a user runs it: files, exclusions, noise that is given, errors that leave nothing behind."""

import json
from pathlib import Path

import numpy as np
import pytest

from fastcal.io.measurements import load_measurements
from fastcal.io.measurements_out import write_measurements
from fastcal.io.robot_file import load_robot
from fastcal.units import from_si

VERDICTS = ("none", "named", "one_of", "several", "unexplained")


@pytest.fixture(scope="module")
def files(hidden_backlash, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("backlash")
    hidden_backlash.robot.save(folder / "robot.yaml")
    for name, data in (("measurements.csv", hidden_backlash.data), ("test.csv", hidden_backlash.test)):
        write_measurements(folder / name, data, hidden_backlash.robot.joint_types)
    return folder


def test_a_process_names_the_backlash_and_writes_all_files(files, process, hidden_backlash) -> None:
    said = process(
        "diagnose", "robot.yaml", "measurements.csv", "--test", "test.csv", "--serial", "F-7", "-o", "out", cwd=files
    )
    assert (said.code, said.err) == (0, "")
    assert said.out.splitlines()[-1] == "out/report.html"
    assert {path.name for path in (files / "out").iterdir()} == {
        "model.yaml", "diagnosis.json", "report.html"
    }  # fmt: skip
    found = json.loads((files / "out" / "diagnosis.json").read_text())
    check_schema(found)
    assert found["made_by"]["serial"] == "F-7"
    assert found["made_by"]["data_sha256"] in (files / "out" / "report.html").read_text()
    assert "serial: F-7" in (files / "out" / "model.yaml").read_text()
    assert found["verdict"] == "named"
    (effect,) = found["effects"]
    assert (effect["effect"], effect["owner"], effect["equivalents"]) == ("backlash", "joint3", [])
    gap = effect["parameters"]["gap_rad"]
    assert abs(gap["value"] - hidden_backlash.gap) < 4 * gap["std"]
    assert [step["added"] for step in found["gap"]] == [None, "backlash@joint3"]
    assert found["gap"][1]["test_rms_mm"] < found["gap"][0]["test_rms_mm"]


def check_schema(found: dict) -> None:
    """The keys and types that a program may count on."""
    assert found["status"] == "converged"
    assert found["verdict"] in VERDICTS
    for effect in found["effects"]:
        assert {"effect", "owner", "grade", "parameters", "snr", "p_value", "equivalents"} <= set(effect)
        assert effect["grade"] in "ABCD"
        assert not (effect["grade"] == "A" and effect["equivalents"])
        for value in effect["parameters"].values():
            assert set(value) == {"value", "std"}
        for other in effect["equivalents"]:
            assert set(other) == {"effect", "owner"}
    if found["unexplained"] is not None:
        assert set(found["unexplained"]) == {"owner", "share", "depends_on", "added", "formulas"}
        assert 0 <= found["unexplained"]["share"] <= 1
    assert all({"effect", "owner", "needs"} <= set(item) for item in found["untestable"])
    assert all(isinstance(row, int) for row in found["outliers"])
    assert found["sigma_mm"]["source"] in ("repeats", "column", "option", "residual")
    assert found["sigma_mm"]["value"] > 0
    keys = {"added", "train_rms_mm", "held_out_rms_mm", "test_rms_mm", "kinds"}
    assert all(set(step) == keys for step in found["gap"])
    assert found["gap"][0]["added"] is None


def test_an_excluded_name_is_given_nowhere(files, fastcal, tmp_path) -> None:
    out = tmp_path / "out"
    said = fastcal(
        "diagnose", files / "robot.yaml", files / "measurements.csv", "--exclude", "backlash@joint3", "-o", out
    )
    assert said.code == 0
    found = json.loads((out / "diagnosis.json").read_text())
    check_schema(found)
    assert found["verdict"] != "none"
    given = [(e["effect"], e["owner"]) for e in found["effects"]]
    given += [(o["effect"], o["owner"]) for e in found["effects"] for o in e["equivalents"]]
    assert ("backlash", "joint3") not in given
    for part in ("ranking", "smallest", "untestable", "confusion"):
        assert "backlash@joint3" not in json.dumps(found[part])
    assert all(step["test_rms_mm"] is None for step in found["gap"])


def test_the_given_noise_is_used_and_reported(files, fastcal, tmp_path, hidden_backlash) -> None:
    out = tmp_path / "out"
    sigma = from_si(hidden_backlash.sigma, "mm")
    said = fastcal("diagnose", files / "robot.yaml", files / "measurements.csv", "--sigma-mm", sigma, "-o", out)
    assert said.code == 0
    found = json.loads((out / "diagnosis.json").read_text())
    assert found["sigma_mm"]["source"] == "option"
    assert found["sigma_mm"]["value"] == pytest.approx(sigma)
    assert [(e["effect"], e["owner"]) for e in found["effects"]] == [("backlash", "joint3")]


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--exclude", "backlash@joint9"), "backlash has no owner 'joint9' on this robot; there are joint1"),
        (("--exclude", "blacklash"), "no effect is called 'blacklash'"),
        (("--sigma-mm", "-1"), "--sigma-mm"),
    ],
)
def test_a_bad_option_ends_with_2_and_leaves_the_old_result(files, fastcal, tmp_path, option, said) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "diagnosis.json").write_text("old")
    answer = fastcal("diagnose", files / "robot.yaml", files / "measurements.csv", *option, "-o", out)
    assert answer.code == 2
    assert said in answer.err
    assert "Traceback" not in answer.err
    assert [(path.name, path.read_text()) for path in out.iterdir()] == [("diagnosis.json", "old")]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.full
def test_the_model_of_a_large_real_set_can_be_read_again(process, shared_data: Path, tmp_path: Path) -> None:
    """UR10: hundreds of knots, whose covariance fills megabytes of YAML; claims of the instrument alone."""
    robot, rows = (shared_data / "ur10_tmac" / name for name in ("robot.yaml", "campaign_b.csv"))
    said = process("diagnose", robot, rows, "-o", "out", cwd=tmp_path)
    assert said.code == 0
    (warning,) = said.err.splitlines()
    assert "times the stated value: either that is too small, or a missing effect passes for noise" in warning
    rms = json.loads((tmp_path / "out" / "diagnosis.json").read_text())["gap"][-1]["train_rms_mm"]
    assert (tmp_path / "out" / "model.yaml").stat().st_size > 2e6
    model = load_robot(tmp_path / "out" / "model.yaml")
    read = load_measurements(rows, model)
    off = np.linalg.norm(model.forward(read.q)[:, :3, 3] - read.position, axis=1)
    assert 1e3 * np.median(off) < rms
