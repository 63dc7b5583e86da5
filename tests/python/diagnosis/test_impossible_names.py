# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A name whose value no arm can have is a symptom of something else, and never told as a cause."""

from pathlib import Path

from fastcal import diagnose, load_measurements, load_robot


def test_a_negative_compliance_is_no_cause(shared_data: Path) -> None:
    """A cable pulls the arm up: joints that give the wrong way describe it, which is no proof of compliance."""
    folder = shared_data / "hidden_effects" / "31_unknown_cable"
    robot = load_robot(folder / "robot.yaml")
    found = diagnose(robot, load_measurements(folder / "measurements.csv", robot))
    grades = {
        (f.effect, f.owner): f.grade
        for f in found.effects
        if f.effect == "joint_compliance" and any(p.value < 0 for p in f.parameters.values())
    }
    assert set(grades.values()) <= {"C"}, grades
    assert found.verdict == "unexplained"
