# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal calibrate`: what it writes belongs together, agrees with the library, and comes whole or not at all."""

import contextlib
import dataclasses
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import fastcal as library
from fastcal.calibration import calibrate as calibration
from fastcal.calibration.calibrate import LOSSES, METHODS
from fastcal.cli import options
from fastcal.selection.choose_parameters import RULES


def strict_json(path: Path) -> dict[str, Any]:
    """JSON as the standard has it: NaN and Infinity are no numbers."""

    def refuse(name: str) -> None:
        raise AssertionError(f"{path.name} holds {name}")

    return json.loads(path.read_text(), parse_constant=refuse)


def test_a_calibration_ends_with_the_path_of_its_report(demo, tmp_path, process) -> None:
    said = process(
        "calibrate",
        demo / "robot.yaml",
        demo / "measurements.csv",
        "--test",
        demo / "test.csv",
        "-o",
        "results/first",
        cwd=tmp_path,
    )
    assert said.code == 0, said.err
    assert said.out.splitlines()[-1] == "results/first/report.html"
    assert (tmp_path / "results/first/report.html").stat().st_size > 100_000
    assert sorted(path.name for path in (tmp_path / "results/first").iterdir()) == [
        "model.yaml",
        "report.html",
        "result.json",
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["results"]
    # Neither progress nor the codes of a terminal reach a pipe.
    lines = said.err.splitlines()
    assert len(lines) == 1
    assert "an effect is missing from the model" in lines[0]  # the demo hides one
    assert said.err.isascii()
    assert "\x1b" not in said.err
    assert all(letter.isprintable() or letter == "\n" for letter in said.out)


def test_result_json_holds_what_the_library_finds(demo, tmp_path, fastcal) -> None:
    data, test = demo / "measurements.csv", demo / "test.csv"
    assert fastcal("calibrate", demo / "robot.yaml", data, "--test", test, "-o", tmp_path / "out").code == 0
    written = strict_json(tmp_path / "out" / "result.json")
    robot = library.load_robot(demo / "robot.yaml")
    found = library.calibrate(
        robot, library.load_measurements(data, robot), test=library.load_measurements(test, robot)
    )
    assert written["status"] == "converged"
    assert [(p["name"], p["owner"]) for p in written["parameters"]] == [(p.name, p.owner) for p in found.parameters]
    assert [p["value"] for p in written["parameters"]] == [p.value for p in found.parameters]
    for name, part in (("train", found.train), ("test", found.test)):
        distance = np.linalg.norm(part.error_after, axis=1) * 1000
        expected = {
            "mean": distance.mean(),
            "std": distance.std(ddof=1),
            "max": distance.max(),
            "rms": math.sqrt(np.mean(distance**2)),
        }
        assert written[name]["count"] == len(distance)
        assert written[name]["after_mm"] == pytest.approx(expected, rel=1e-12)


def test_the_saved_model_predicts_bit_for_bit_what_the_result_predicts(demo, tmp_path, fastcal) -> None:
    robot = library.load_robot(demo / "robot.yaml")
    data = library.load_measurements(demo / "measurements.csv", robot)
    arguments = "calibrate", demo / "robot.yaml", demo / "measurements.csv", "--effects", "geometry,joint_compliance"
    assert fastcal(*arguments, "-o", tmp_path).code == 0
    result = library.calibrate(robot, data, effects="geometry,joint_compliance")
    q = library.random_poses(robot, 200, seed=5)
    payload = np.linspace(0.0, 10.0, 200)
    loaded = library.load_robot(tmp_path / "model.yaml")
    np.testing.assert_array_equal(loaded.forward(q, payload=payload), result.model.forward(q, payload=payload))
    np.testing.assert_array_equal(
        loaded.position_deviation(q, payload=payload), result.model.position_deviation(q, payload=payload)
    )


def test_test_poses_change_nothing_in_the_model(demo, tmp_path, fastcal, rewritten) -> None:
    """Not even where they are absurd."""

    def at_zero(rows: list[list[str]]) -> None:
        for row in rows[1:]:
            row[6] = "0"

    absurd = rewritten(demo / "test.csv", tmp_path / "absurd.csv", at_zero)
    arguments = "calibrate", demo / "robot.yaml", demo / "measurements.csv"
    assert fastcal(*arguments, "-o", tmp_path / "without").code == 0
    assert fastcal(*arguments, "-o", tmp_path / "with", "--test", absurd).code == 0
    with_test, without = (strict_json(tmp_path / name / "result.json") for name in ("with", "without"))
    assert with_test["test"]["after_mm"]["rms"] > 100.0
    assert without["test"] is None
    del with_test["test"], without["test"]
    assert with_test == without
    assert (tmp_path / "with/model.yaml").read_bytes() == (tmp_path / "without/model.yaml").read_bytes()


def test_two_cores_write_the_same_model_as_one(demo, tmp_path, fastcal) -> None:
    arguments = "calibrate", demo / "robot.yaml", demo / "measurements.csv"
    assert fastcal(*arguments, "-o", tmp_path / "one").code == 0
    assert fastcal(*arguments, "--threads", 2, "-o", tmp_path / "two").code == 0
    assert (tmp_path / "one/model.yaml").read_bytes() == (tmp_path / "two/model.yaml").read_bytes()


def test_read_back_joints_are_compared_and_not_fitted(demo, tmp_path, fastcal, rewritten) -> None:
    """Joint 2 is read back 0.002 deg off on average, 0.003 deg at most; the model is the same as without."""

    def add(rows: list[list[str]]) -> None:
        rows[0].append("q2_read_deg")
        for i, row in enumerate(rows[1:]):
            row.append(repr(float(row[1]) + (0.001 if i % 2 else 0.003)))

    read_back = rewritten(demo / "measurements.csv", tmp_path / "read_back.csv", add)
    assert fastcal("calibrate", demo / "robot.yaml", demo / "measurements.csv", "-o", tmp_path / "a").code == 0
    said = fastcal("calibrate", demo / "robot.yaml", read_back, "-o", tmp_path / "b")
    note = next(note for note in strict_json(tmp_path / "b/result.json")["notes"] if "read back" in note)
    assert note.startswith("joint 2 read back less commanded: 0.002 deg on average, 0.003 deg at most, in 150 rows")
    assert f"fastcal: warning: {note}" in said.err
    models = [yaml.safe_load((tmp_path / name / "model.yaml").read_text()) for name in "ab"]
    made_by = [model.pop("made_by", None) or model["calibration"].pop("made_by") for model in models]
    assert made_by[0] != made_by[1]  # the hash of another file
    assert models[0] == models[1]


@pytest.mark.parametrize("status", ["not_converged", "too_few_equations"])
def test_no_convergence_leaves_a_report_and_a_model_that_says_so(demo, tmp_path, fastcal, monkeypatch, status) -> None:
    out = tmp_path / "out"
    arguments = "calibrate", demo / "robot.yaml", demo / "measurements.csv", "-o", out
    assert fastcal(*arguments).code == 0
    (out / "mine.txt").write_text("kept")

    def fails(*args: Any, **options: Any) -> Any:
        return dataclasses.replace(whole(*args, **options), status=status, message="for this test")

    whole = calibration.calibrate
    monkeypatch.setattr(calibration, "calibrate", fails)
    said = fastcal(*arguments)
    assert said.code == 3
    words = "model.yaml is what could be fitted, not to be relied on"
    assert said.err.splitlines()[-1] == f"fastcal: error: {status.replace('_', ' ')}: for this test; {words}"
    assert strict_json(out / "result.json")["status"] == status
    head = (out / "model.yaml").read_text().splitlines()[0]
    assert head == f"# {status.replace('_', ' ').capitalize()}, measurements.csv: for this test"
    monkeypatch.setattr(
        calibration, "calibrate", lambda *args, **options: dataclasses.replace(fails(*args, **options), parameters=[])
    )
    assert fastcal(*arguments).err.splitlines()[-1].endswith("for this test; no model.yaml")
    # An older model would seem to belong to this result.
    assert sorted(path.name for path in out.iterdir()) == ["mine.txt", "report.html", "result.json"]


def test_a_folder_that_fails_on_the_way_leaves_the_older_one(demo, tmp_path, fastcal, monkeypatch) -> None:
    arguments = "calibrate", demo / "robot.yaml", demo / "measurements.csv", "-o", tmp_path / "out"
    assert fastcal(*arguments).code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}

    def disk_full(*args: Any, **options: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fastcal.report.calibration_files.calibration_page", disk_full)
    said = fastcal(*arguments, "--loss", "none")
    assert said.code == 2
    assert said.error.endswith("cannot be written: No space left on device")
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before


def test_the_choices_offered_are_those_of_the_library() -> None:
    assert options.Loss.__args__ == LOSSES
    assert options.Method.__args__ == METHODS
    assert options.Rule.__args__ == RULES


def test_parameters_are_chosen_where_it_is_asked_for(demo, tmp_path, fastcal) -> None:
    robot = library.load_robot(demo / "robot.yaml")
    few = (demo / "measurements.csv").read_text().splitlines()[:31]
    (tmp_path / "few.csv").write_text("\n".join(few) + "\n")
    said = fastcal(
        "calibrate", demo / "robot.yaml", tmp_path / "few.csv", "--choose", "one_standard_error", "-o", tmp_path / "out"
    )
    assert said.code == 0, said.err
    data = library.load_measurements(tmp_path / "few.csv", robot)
    choice = library.choose_parameters(robot, data, rule="one_standard_error")
    assert 0 < len(choice.parameters) < len(choice.full.parameters)
    result = strict_json(tmp_path / "out" / "result.json")
    assert result["choice"] == json.loads(json.dumps(choice.to_json_dict()))
    assert [p["value"] for p in result["parameters"]] == [p.value for p in choice.result.parameters]
    assert library.load_robot(tmp_path / "out" / "model.yaml").spec["joints"] == choice.result.model.spec["joints"]
    assert f"chosen: {len(choice.parameters)} of {len(choice.full.parameters)} parameters" in said.out
    assert ", ".join(choice.parameters) in said.out

    refused = fastcal(
        "calibrate", demo / "robot.yaml", tmp_path / "few.csv", "--choose", "least", "--priors", "-o", "no"
    )
    assert refused.code == 2
    assert "leave out --priors, --method and --solver" in refused.error


def test_progress_is_shown_on_a_terminal(demo, tmp_path) -> None:
    """With standard error on a terminal; standard output, a pipe, stays as it is."""
    try:
        ours, theirs = os.openpty()
    except OSError:
        pytest.skip("this system has no pseudo-terminals")
    arguments = "calibrate", demo / "robot.yaml", demo / "measurements.csv", "-o", tmp_path / "out"
    command = [sys.executable, "-m", "fastcal", *map(str, arguments)]
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "80"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs, text=True, env=environment) as running:
        os.close(theirs)
        shown = b""
        with contextlib.suppress(OSError):  # Linux ends a terminal whose other side has gone by an error
            while piece := os.read(ours, 4096):
                shown += piece
        out = running.communicate(timeout=60)[0]
    os.close(ours)
    assert running.returncode == 0
    assert b"identifying ..." in shown
    assert all(letter.isprintable() or letter == "\n" for letter in out)


def test_a_limit_is_judged_on_the_test_poses_and_signed(demo, tmp_path, fastcal) -> None:
    effects = "geometry,joint_compliance@joint2,joint_compliance@joint3"
    run = ("calibrate", demo / "robot.yaml", demo / "measurements.csv", "--effects", effects, "-o", tmp_path / "out")
    given = ("--limit-mm", 0.5, "--test", demo / "test.csv", "--customer", "Muster", "--page-language", "de")
    said = fastcal(*run, *given)
    assert said.code == 0
    assert "Grenze 0,5 mm: bestanden; 0 von 60 Posen (Prüfung) darüber" in said.out
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    assert found["acceptance"]["verdict"] == "pass"
    assert found["made_by"]["customer"] == "Muster"
    page = (tmp_path / "out" / "report.html").read_text()
    for text in ("Abnahmegrenze 0,5 mm: bestanden", "Muster", "Unterschrift", "Kalibrierbericht"):
        assert text in page
    assert "--limit-mm must be above 0" in fastcal(*run, "--limit-mm", 0).error
