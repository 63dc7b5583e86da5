# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal accept`: from the program to the verdict, as a shop would run it, and the mistakes it could make there."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fastcal as library

BUDGET = (
    "inputs:\n  - {name: scale, kind: range, half_width_um_m: 5}\n  - {name: nest, kind: target, half_width_um: 4}\n"
)


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A UR10, its test, and what a tracker that stands askew said of it: 0.1 mm off along x at P3."""
    from fastcal.cli import main

    folder = tmp_path_factory.mktemp("shop")
    arm = library.load_robot("ur10")
    arm.save(folder / "arm.yaml")
    made = ["--plan", "--language", "krl", "-o", str(folder / "iso.src"), "--directions"]
    assert main(["accept", str(folder / "arm.yaml"), *made]) == 0
    plan = library.load_measurements(folder / "iso_plan.csv", arm, require_measured=False)
    stands = library.Robot(arm.spec | {"base": {"xyz_mm": [3000.0, 400, -800], "rpy_deg": [2.0, -1, 70]}})
    said = library.simulate(stands, replace(plan, extra={}, extra_labels={}), noise=1e-5, seed=1)
    off = np.array([pose == "P3" for pose in plan.extra_labels["pose"]])
    R = stands.core.base_and_tool(stands.core.nominal)[0][:3, :3]
    said = replace(said, position=np.asarray(said.position) + np.outer(off, R @ [1e-4, 0, 0]))
    library.write_measurements(folder / "measured.csv", said, arm.joint_types)
    (folder / "budget.yaml").write_text(BUDGET)
    return folder


def test_the_program_and_its_visits_are_written(shop: Path) -> None:
    assert {"iso.src", "iso.dat", "iso_plan.csv"} <= {path.name for path in shop.iterdir()}
    lines = (shop / "iso_plan.csv").read_text().splitlines()
    assert lines[0].startswith("pose,direction,cycle,q1_deg")
    assert len(lines) == 1 + 30 * 5 + 30 * 9
    assert [line.split(",")[0] for line in lines[1:6]] == ["P5", "P4", "P3", "P2", "P1"]


@pytest.mark.parametrize(("tolerance", "code", "verdict"), [(0.2, 0, "pass"), (0.02, 4, "fail"), (None, 0, None)])
def test_the_exit_code_is_the_verdict(shop: Path, tmp_path: Path, fastcal, tolerance, code: int, verdict) -> None:
    limit = () if tolerance is None else ("--tolerance-mm", tolerance)
    options = ("--targets", shop / "iso_plan.csv", "--budget", shop / "budget.yaml", *limit)
    said = fastcal("accept", shop / "arm.yaml", shop / "measured.csv", *options, "-o", tmp_path / "out")
    assert said.code == code, said.err
    found = json.loads((tmp_path / "out" / "accept.json").read_text())
    assert found["verdict"] == verdict
    assert found["iso_9283"] is True
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert 'id="figure-workspace"' in page
    assert "from the commanded point towards the mean of the attained points" in page
    values = {(f["symbol"], f["where"]): f for f in found["figures"]}
    # A rigid motion of five poses takes a part of what one of them is off.
    assert 0.05 < values["AP", "P3"]["value"] < 0.1
    assert values["AP", "P3"]["value"] == max(f["value"] for f in found["figures"] if f["symbol"] == "AP")
    assert values["AP", "P3"]["contributions"].keys() == {"scale", "nest"}
    assert values["vAP", "P1"]["value"] < 0.02
    assert values["AP", "P3"]["expanded_by_draws"] == pytest.approx(values["AP", "P3"]["expanded"], rel=0.05)
    assert (tmp_path / "out" / "report.html").read_text().startswith("<!DOCTYPE html>")


def test_what_is_near_the_limit_is_not_decided(shop: Path, tmp_path: Path, fastcal) -> None:
    options = ("--targets", shop / "iso_plan.csv", "-o", tmp_path / "out")
    fastcal("accept", shop / "arm.yaml", shop / "measured.csv", *options)
    found = json.loads((tmp_path / "out" / "accept.json").read_text())
    worst = max(f["value"] for f in found["figures"] if f["symbol"] == "AP")
    limits = ("--tolerance-mm", repr(worst), "--limit", "rp_mm=1")
    said = fastcal("accept", shop / "arm.yaml", shop / "measured.csv", *options, *limits)
    assert said.code == 3
    assert "cannot tell" in said.out


def test_a_lost_point_costs_one_visit_and_no_more(shop: Path, tmp_path: Path, fastcal) -> None:
    rows = (shop / "measured.csv").read_text().splitlines()
    (tmp_path / "lost.csv").write_text("\n".join([*rows[:40], *rows[41:300], *rows[301:]]) + "\n")
    options = ("--targets", shop / "iso_plan.csv", "-o", tmp_path / "out")
    assert fastcal("accept", shop / "arm.yaml", tmp_path / "lost.csv", *options).code == 0
    found = json.loads((tmp_path / "out" / "accept.json").read_text())
    visits = {(p["pose"], p["direction"]): p["visits"] for p in found["poses"]}
    assert sorted(visits.values()) == [29, 29] + [30] * 12
    assert max(f["value"] for f in found["figures"] if f["symbol"] == "vAP") < 0.02


def test_without_a_plan_the_model_says_what_was_commanded(shop: Path, tmp_path: Path, fastcal) -> None:
    said = fastcal("accept", shop / "arm.yaml", shop / "measured.csv", "-o", tmp_path / "out")
    assert said.code == 0
    found = json.loads((tmp_path / "out" / "accept.json").read_text())
    worst = max(f["value"] for f in found["figures"] if f["symbol"] == "AP")
    assert 0.05 < worst < 0.1
    said = fastcal("accept", shop / "arm.yaml", shop / "measured.csv", "--align", "model", "-o", tmp_path / "out")
    assert "AP: at most 3" in said.out  # the instrument stands three metres away, as the model does not know


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("-o", "o"), "expected DATA to judge, or --plan to write the program"),
        (("--plan", "-o", "iso.mod"), "--plan needs --language"),
        (("--plan", "--language", "rapid", "-o", "iso.src"), "ends in .mod"),
        (("measured.csv", "--plan", "--language", "krl", "-o", "iso.src"), "--plan takes no DATA"),
        (("--plan", "--language", "krl", "--centre-mm", "1,2", "-o", "iso.src"), "takes three numbers"),
        (("--plan", "--language", "krl", "--edge-mm", "4000", "-o", "iso.src"), "reaches no test cube"),
        (("measured.csv", "--limit", "rp=0.1", "-o", "o"), "unknown limit 'rp'"),
        (("measured.csv", "--limit", "rp_mm", "-o", "o"), "--limit takes NAME=VALUE"),
        (("measured.csv", "--tolerance-mm", "-1", "-o", "o"), "a limit must be above 0"),
        (("measured.csv", "--targets", "measured.csv", "-o", "o"), "has no column target_x_mm"),
        (("other.csv", "--targets", "iso_plan.csv", "-o", "o"), "data row 0 is not a visit of iso_plan.csv"),
        (("once.csv", "--targets", "iso_plan.csv", "-o", "o"), "no pose was visited twice"),
        (("two.csv", "--targets", "iso_plan.csv", "-o", "o"), "three poses that are not on one line, got 2"),
        (("iso_plan.csv", "-o", "o"), "measured"),
        (("measured.csv", "--budget", "iso_plan.csv", "-o", "o"), "iso_plan.csv"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_sentence_and_leaves_nothing(shop, tmp_path, fastcal, monkeypatch, arguments, said) -> None:
    rows = (shop / "measured.csv").read_text().splitlines()
    for name in ("measured.csv", "iso_plan.csv", "arm.yaml"):
        (tmp_path / name).write_text((shop / name).read_text())
    moved = rows[1].split(",")
    moved[0] = str(float(moved[0]) + 0.1)
    (tmp_path / "other.csv").write_text("\n".join([rows[0], ",".join(moved)]) + "\n")
    (tmp_path / "once.csv").write_text("\n".join(rows[:6]) + "\n")
    (tmp_path / "two.csv").write_text("\n".join([rows[0], *rows[1:3], *rows[6:8]]) + "\n")
    before = {path.name for path in tmp_path.iterdir()}
    monkeypatch.chdir(tmp_path)
    done = fastcal("accept", "arm.yaml", *arguments)
    assert done.code == 2
    assert said in done.error
    assert {path.name for path in tmp_path.iterdir()} == before


def test_a_page_is_a_document_in_the_language_that_was_asked_for(shop, tmp_path, fastcal, monkeypatch) -> None:
    who = ("--serial", "F-0815", "--customer", "Muster & Söhne", "--operator", "A. Meier", "--date", "2026-11-20")
    options = ("--targets", shop / "iso_plan.csv", "--tolerance-mm", 0.2, "-o", tmp_path / "out", *who)
    options = (*options, "--budget", shop / "budget.yaml")
    assert fastcal("accept", shop / "arm.yaml", shop / "measured.csv", *options, "--page-language", "de").code == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert '<html lang="de">' in page
    for text in (
        "Bestanden",
        "F-0815",
        "Muster &amp; Söhne",
        "Unterschrift",
        "2026-11-20",
        "Prüfplan der ISO 9283",
        ">Länge<",
    ):
        assert text in page
    found = json.loads((tmp_path / "out" / "accept.json").read_text())
    assert found["made_by"]["customer"] == "Muster & Söhne"
    assert found["made_by"]["data_sha256"] in page
    monkeypatch.setenv("FASTCAL_LANGUAGE", "de")
    assert fastcal("accept", shop / "arm.yaml", shop / "measured.csv", *options).code == 0
    assert '<html lang="de">' in (tmp_path / "out" / "report.html").read_text()
    said = fastcal("accept", shop / "arm.yaml", shop / "measured.csv", *options, "--page-language", "fr")
    assert said.code == 2
    monkeypatch.delenv("FASTCAL_LANGUAGE")
    said = fastcal("accept", shop / "arm.yaml", shop / "measured.csv", *options, "--date", "20.11.2026")
    assert "date must be YYYY-MM-DD" in said.error


def test_an_arm_without_six_axes_is_refused_before_the_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from fastcal.cli import main

    monkeypatch.setattr("fastcal.acceptance.plan_acceptance", lambda *_, **__: pytest.fail("the cube was searched for"))
    assert main(["accept", "lbr_iiwa14", "--plan", "--language", "krl", "-o", str(tmp_path / "iso.src")]) == 2
    assert "a program of 6 axes can be written, and this robot has 7 joints" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_plan_is_simulated_without_warnings(shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from fastcal.cli import main

    arguments = ["simulate", str(shop / "arm.yaml"), str(shop / "iso_plan.csv"), "--noise-mm", "0.02"]
    assert main([*arguments, "-o", str(tmp_path / "measured.csv")]) == 0
    assert "warning" not in capsys.readouterr().err


def test_recorded_paths_give_their_accuracy_and_repeatability(fastcal, tmp_path: Path) -> None:
    """Runs 0.3 mm beside the path, by 0.1 mm to either side of that in turns."""
    head, pose = "x_mm,y_mm,z_mm,qw,qx,qy,qz\n", ",300,1,0,0,0\n"
    (tmp_path / "corners.csv").write_text(head + f"400,0{pose}600,0{pose}600,200{pose}")
    files = []
    for k, side in enumerate((0.2, 0.4, 0.2, 0.4)):
        points = [(x, side) for x in range(400, 601)] + [(600 - side, y) for y in range(1, 202)]
        files.append(tmp_path / f"run{k}.csv")
        files[-1].write_text(head + "".join(f"{x},{y}{pose}" for x, y in points))
    done = fastcal("accept", "ur5", *files, "--path", tmp_path / "corners.csv", "-o", tmp_path / "out")
    assert done.code == 0, done.err
    found = json.loads((tmp_path / "out" / "path.json").read_text())
    assert found["AT_mm"] == pytest.approx(0.3, abs=1e-9)
    assert found["RT_mm"] == pytest.approx(0.1, abs=1e-9)  # every l is 0.1, their S is 0
    assert found["AT_rz_deg"] == pytest.approx(0, abs=1e-9)
    assert [corner["corner"] for corner in found["corners"]] == [2]
    assert found["length_mm"] == pytest.approx(400)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Measured path" in page
    assert "The mean path is up to 0.300 mm from the commanded one" in page
    assert "ISO 9283 asks for 10 runs; these are 4." in page
    german = ["--path", tmp_path / "corners.csv", "--page-language", "de", "-o", tmp_path / "out"]
    assert fastcal("accept", "ur5", *files, *german).code == 0
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for word in (
        "Gemessene Bahn",
        "Die mittlere Bahn liegt bis zu 0,300 mm neben",
        "Bahnwiederholgenauigkeit",
        "4 Läufe",
    ):
        assert word in page
    (tmp_path / "points.csv").write_text("x_mm,y_mm,z_mm\n400,0,300\n600,0,300\n600,200,300\n")
    done = fastcal("accept", "ur5", *files, "--path", tmp_path / "points.csv", "-o", tmp_path / "out")
    assert done.code == 0, done.err
    plain = json.loads((tmp_path / "out" / "path.json").read_text())
    assert plain == {key: value for key, value in found.items() if not key.endswith("_deg")}
    (tmp_path / "gap.csv").write_text("x_mm,y_mm,z_mm\n400,0,300\n600,,300\n600,200,300\n")
    said = fastcal("accept", "ur5", *files, "--path", tmp_path / "gap.csv", "-o", tmp_path / "other")
    assert said.code == 2
    assert "gap.csv: data row 1 holds no pose; expected the corners of the path" in said.err
    said = fastcal("accept", "ur5", files[0], "--path", tmp_path / "corners.csv", "-o", tmp_path / "other")
    assert said.code == 2
    assert "at least 2 points and at least 2 runs of it, got 3 points and 1 run" in said.err
