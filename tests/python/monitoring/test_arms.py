# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal.check_arms`: all arms in a folder, which files are checked, and what one arm lacks."""

import json
import os
from pathlib import Path

import pytest

import fastcal
from fastcal.errors import InvalidInput


@pytest.fixture(scope="module")
def arms(calibrated, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four arms: one holds, one has a softer joint 2, one has no measurements, one a model that is damaged."""
    folder = tmp_path_factory.mktemp("arms")
    for name, softer in (("A1", 1.0), ("A2", 1.2), ("A3", 1.0), ("A4", 1.0)):
        place = folder / name / "results"
        place.mkdir(parents=True)
        calibrated.model.save(place / "model.yaml")
        spec = calibrated.spec()
        spec["effects"][0]["parameters"]["compliance_rad_nm"]["value"] *= softer
        for month in (10, 11):
            if name in ("A1", "A2"):
                found = calibrated.measured(spec if month == 11 else calibrated.spec(), seed=month)
                file = folder / name / f"2026-{month}.csv"
                fastcal.write_measurements(file, found)
                os.utime(file, (month * 1e6, month * 1e6))
    fastcal.write_measurements(
        folder / "A1" / "poses.csv", fastcal.Dataset.from_arrays(found.q, robot=calibrated.model)
    )
    (folder / "A4" / "results" / "model.yaml").write_text("covariance_root: [")
    (folder / "notes").mkdir()
    return folder


def test_each_arm_is_checked_on_its_newest_measurements(arms, tmp_path) -> None:
    found = fastcal.check_arms(arms, who={"date": "2026-11-02"})
    assert [(arm.name, arm.state) for arm in found.arms] == [
        ("A2", "changed"), ("A3", "unchecked"), ("A4", "unchecked"), ("A1", "holds"),
    ]  # fmt: skip
    assert [arm.files for arm in found.of("changed", "holds")] == [("2026-11.csv",)] * 2
    assert "joint 2" in found.arms[0].sentence
    assert found.arms[1].message == "nothing was measured since the model was made"
    assert "model.yaml" in found.arms[2].message
    before = sorted(path for path in arms.rglob("*"))
    found.save(tmp_path / "checks")
    assert sorted(path for path in arms.rglob("*")) == before
    names = {path.name for path in (tmp_path / "checks").iterdir()}
    assert names == {"checks.csv", "report.html", "A1_2026-11.json", "A2_2026-11.json"}
    kept = json.loads((tmp_path / "checks" / "A2_2026-11.json").read_text())
    assert (kept["verdict"], kept["made_by"]["serial"]) == ("changed", "RX-0042")
    assert "4 arms: 1 changed, 2 unchecked, 1 holds" in found.summary()
    assert list(found.to_frame()["state"]) == ["changed", "unchecked", "unchecked", "holds"]


def test_a_month_after_the_other_into_one_folder_is_their_history(arms, tmp_path) -> None:
    out = tmp_path / "checks"
    for month in (10, 11):
        fastcal.check_arms(arms, files=f"2026-{month}.csv", who={"date": f"2026-{month}-02"}).save(out)
    assert len(list(out.glob("*.json"))) == 4
    (arm,) = fastcal.history(out).arms  # the four models are one, of one serial number
    assert [event.verdict for event in arm.events] == ["holds", "holds", "holds", "changed"]


def test_several_files_of_a_pattern_are_set_ups_of_one_check(arms) -> None:
    found = fastcal.check_arms(arms, files="2026-*.csv")
    (first,) = (arm for arm in found.arms if arm.name == "A1")
    assert first.files == ("2026-10.csv", "2026-11.csv")
    assert first.found is not None
    assert len(first.found.places) == 2
    (without,) = (arm for arm in found.arms if arm.name == "A3")
    assert without.message == "there is no file of this name"


def test_what_it_refuses(arms, tmp_path) -> None:
    with pytest.raises(InvalidInput, match="expected a folder with a folder an arm"):
        fastcal.check_arms(tmp_path / "none")
    with pytest.raises(InvalidInput, match="each with a calibrated model; found none"):
        fastcal.check_arms(arms / "A1" / "results")
    with pytest.raises(InvalidInput, match="a serial number is one arm's"):
        fastcal.check_arms(arms, who={"serial": "7"})
