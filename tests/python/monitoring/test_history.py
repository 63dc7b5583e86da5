# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal.history`: control charts, alarms, a fleet in one folder, files that are not of it."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import fastcal
from fastcal.errors import InvalidInput
from fastcal.monitoring.control import innovations, misfit_chart, number_chart


@pytest.fixture(scope="module")
def fleet(calibrated, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two arms, six checks each: RX-2's joint 3 moves at the fifth."""
    folder = tmp_path_factory.mktemp("fleet")
    for arm in (1, 2):
        (folder / f"arm{arm}").mkdir()
        for month in range(6):
            spec = calibrated.spec()
            spec["joints"][2]["theta_deg"] += 0.02 * (arm == 2 and month >= 4)
            who = {"serial": f"RX-{arm}", "date": f"2026-{month + 1:02d}-10"}
            found = fastcal.check(calibrated.model, calibrated.measured(spec, seed=100 * arm + month), who=who)
            found.save(folder / f"arm{arm}" / f"{month}.json")
    return folder


def test_arms_and_their_alarms(fleet) -> None:
    found = fastcal.history(fleet)
    assert [arm.name for arm in found.arms] == ["RX-1", "RX-2"]
    assert [arm.state for arm in found.arms] == ["holds", "changed"]
    assert [len(arm.checks) for arm in found.arms] == [6, 6]
    assert {alarm.arm for alarm in found.alarms} == {"RX-2"}
    assert min(alarm.date for alarm in found.alarms) == "2026-05-10"
    assert {alarm.by for alarm in found.alarms} == {"check", "ewma", "cusum"}
    assert found.arms[1].charts[1].name == "joint3 theta"
    assert found.notes == []


def test_history_is_only_read(fleet, tmp_path) -> None:
    before = {path: path.read_bytes() for path in fleet.rglob("*.json")}
    fastcal.history(fleet).save(tmp_path / "out")
    assert {path: path.read_bytes() for path in fleet.rglob("*.json")} == before
    content = json.loads((tmp_path / "out" / "history.json").read_text())
    assert [arm["state"] for arm in content["arms"]] == ["holds", "changed"]
    assert (tmp_path / "out" / "report.html").is_file()


def test_foreign_and_broken_files_are_left_out(fleet, tmp_path) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(fleet, folder)
    (folder / "arm1" / "notes.json").write_text('{"verdict": "good"}')
    (folder / "arm1" / "half.json").write_text('{"verdict": "holds", "rms')
    (folder / "arm1" / "odd.json").write_text('{"verdict": "holds", "tests": [1, {"kind": "zero"}], "rms_mm": "x"}')
    (folder / "arm1" / "robot.yaml").write_text("name: x\n")
    (folder / "arm1" / "broken.yaml").write_text("covariance_root: [")
    (folder / "arm1" / ".fastcal-1234.json").write_text("{")
    found = fastcal.history(folder)
    assert [len(arm.events) for arm in found.arms] == [6, 6]
    assert len([note for note in found.notes if note.startswith("left out: ")]) == 2


def test_files_without_a_date_take_their_own_time(calibrated, tmp_path) -> None:
    fastcal.check(calibrated.model, calibrated.measured(calibrated.spec())).save(tmp_path / "check.json")
    calibrated.model.save(tmp_path / "model.yaml")
    found = fastcal.history(tmp_path)
    assert [event.kind for event in found.arms[0].events] == ["model", "check"]
    assert found.notes[0].startswith("1 of 2 files have no date")


def test_what_history_refuses(tmp_path) -> None:
    with pytest.raises(InvalidInput, match="expected a folder"):
        fastcal.history(tmp_path / "none")
    with pytest.raises(InvalidInput, match="neither a check"):
        fastcal.history(tmp_path)


def test_innovations_are_independent_though_checks_share_the_models_error() -> None:
    random = np.random.default_rng(1)
    shared, noise = 2.0, np.array([1.0, 1.5, 0.7, 1.0, 1.0])
    std = np.sqrt(shared**2 + noise**2)
    x = shared * random.standard_normal((20_000, 1)) + noise * random.standard_normal((20_000, 5))
    u = np.array([innovations(row, std, noise) for row in x])
    np.testing.assert_allclose(np.cov(u.T), np.eye(5), atol=0.05)


def test_charts_alarm_at_a_step_and_a_drift_and_hardly_ever_else() -> None:
    random = np.random.default_rng(2)
    one, ones = np.full(12, 1.2), np.ones(12)
    quiet = [number_chart("x", random.standard_normal(12), one, ones).alarms for _ in range(500)]
    assert sum(bool(alarms) for alarms in quiet) <= 2
    drift = number_chart("x", 1.2 * np.arange(12) + random.standard_normal(12), one, ones)
    assert drift.alarms
    assert max(drift.value) > 7
    uniform = [misfit_chart(random.uniform(size=12)).alarms for _ in range(500)]
    assert sum(len(alarms) for alarms in uniform) / 6000 < 0.01
    assert misfit_chart([0.5, 0.4, 1e-9, 1e-12]).alarms == [2, 3]


def test_charts_by_hand() -> None:
    """EWMA of scores 0 and z(0.1); the CUSUM of a number that is known exactly: u = (0.7, 2.5, -3)."""
    chart = misfit_chart([0.5, 0.1])
    np.testing.assert_allclose(chart.value, [0.0, 0.3 * 1.2815515655], atol=1e-9)
    np.testing.assert_allclose(chart.limit, [3 * 0.3, 3 * 0.3 * (1 + 0.7**2) ** 0.5], atol=1e-12)
    found = number_chart("x", [0.7, 2.5, -3.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0])
    np.testing.assert_allclose(found.value, [0.2, 2.2, 0.0])
    np.testing.assert_allclose(found.low, [0.0, 0.0, -2.5])
