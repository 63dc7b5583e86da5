# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The RX160L study without networks: its hidden arm is tables 1 and 3, and its parts find them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration.payload_pairs import from_payload_pairs, rows_in_pairs
from fastcal.cli import main
from fastcal.io.measurements_out import write_measurements
from fastcal_studies import staubli_rx160l


def test_without_waves_tables_1_and_3_come_back(
    monkeypatch: pytest.MonkeyPatch, shown: Callable[..., dict[str, Any]]
) -> None:
    """What is left then is what the tool's 3.6 kg bend, which no row of the geometry can be."""
    monkeypatch.setattr(staubli_rx160l, "HAS_TORCH", False)
    monkeypatch.setattr(staubli_rx160l, "WAVES_RAD", (0.0,) * 6)
    monkeypatch.setattr(staubli_rx160l, "HARMONIC_RAD", 0.0)
    monkeypatch.setattr(staubli_rx160l, "CANDIDATES", 300)
    monkeypatch.setattr(staubli_rx160l, "LEARNT", 30)
    run = staubli_rx160l.one_arm(0, full=False)
    assert run["selection"]["held_out"]["mean"] < 0.12 < 2 < run["selection"]["before"]["mean"]
    joint, critical, low, high = staubli_rx160l.STIFFNESS[2]  # the corners of 2 and 3 are hardly reached
    for name, hidden in (("critical_nm", critical), ("low_rad_nm", 1 / low), ("high_rad_nm", 1 / high)):
        found = run["stiffness"][f"joint{joint} {name}"]
        assert found["value"] == pytest.approx(hidden, abs=4 * found["std"]), name
    least, most = run["torques"]["14.0 kg"]
    assert max(abs(least[4]), abs(most[4])) < 5 < max(abs(least[0]), abs(most[0]))  # joint 6 hardly bears any
    shown("staubli_rx160l", run)


def test_the_command_finds_row_by_row_what_payload_pairs_does_on_the_study(tmp_path: Path) -> None:
    """Through files: its model leaves of each row of the study what (12) leaves with the same joints bent."""
    nominal, measured, _, _ = staubli_rx160l.to_diagnose(0)
    nominal.save(tmp_path / "robot.yaml")
    write_measurements(tmp_path / "rows.csv", measured, nominal.joint_types)
    asked = ["--joints", "2,3,4,5", "--torque", "payload", "-o", str(tmp_path / "out")]
    assert main(["compliance", str(tmp_path / "robot.yaml"), str(tmp_path / "rows.csv"), *asked, "--quiet"]) == 0
    told = json.loads((tmp_path / "out" / "compliance.json").read_text())["joints"]
    kinds = {True: "joint_compliance_nonlinear@{}:torque=payload", False: "joint_compliance@{}"}
    effects = [kinds[joint["corner"]].format(joint["owner"]) for joint in told]
    assert {joint["corner"] for joint in told} == {True, False}
    arm, model = (fastcal.load_robot(tmp_path / name) for name in ("robot.yaml", "out/model.yaml"))
    rows, position, posture = rows_in_pairs(fastcal.load_measurements(tmp_path / "rows.csv", arm))
    same = from_payload_pairs(arm, rows, effects=effects)
    assert [(p.owner, p.name, p.value, p.std) for p in same.parameters] == [
        (joint["owner"], name, value["value"], value["std"])
        for joint in told
        for name, value in joint["parameters"].items()
    ]
    off = model.poses(rows)[:, :3, 3] - position
    off -= np.array([off[posture == k].mean(axis=0) for k in posture])
    assert len(off) == 50 * 6
    np.testing.assert_allclose(off, same.after, atol=1e-12)
