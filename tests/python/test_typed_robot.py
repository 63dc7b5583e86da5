# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a robot file says is read by its typed description, and names of places are made and read in one module."""

import copy
import re
from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest

from fastcal import Robot, load_robot, robots
from fastcal.place import Place, joint_column, joint_name, joint_position, place_of
from fastcal.robot.robot_spec import RobotSpec, content, structured

PACKAGE = Path(__file__).parents[2] / "python" / "fastcal"

# What reads and writes files, or makes the content of one; all else reads `Robot.description`.
OF_FILES = {
    "io/",
    "importers/",
    "conversion/",  # one kind of robot file to another
    "cli/convert.py",
    "robot/described_robot.py",  # keeps the content
    "robot/robot_spec.py",
    "robot/structure.py",  # of the key `structure`
    "robot/calibration_record.py",  # of the key `calibration`
    "robot/controller_robot.py",  # of the key `nominal`
    "robot/identified_spec.py",  # the file of an identified model
    "diagnosis/adaptation.py",
    "robot/loops.py",  # of the key `loops`
    "studio/screens/places.py",  # changes what the file says of places
    "diagnosis/rig_library.py",  # changes what the file says of a camera
    "calibration/problem.py",  # the file of the start
    "calibration/setups.py",
}
CONTENT = re.compile(r"\bspec(\[|\.get\(|\.items\(|\.pop\()|\.spec \||\*\*[\w.]+\.spec\b|\bin [\w.]+\.spec\b")

# Modules of tables and of what formulas are written in, which have their own words for a joint's column.
OF_TABLES = {"io/", "importers/", "report/use_frames.py", "report/effect_figures.py", "surrogate/candidates.py"}
NAMES = re.compile(r"""removeprefix\(["'](joint|link)["']\)|f"q\{\w+ \+ 1\}|f"joint\{\w+ \+ 1\}["]""")


def found(pattern: re.Pattern[str], allowed: set[str]) -> list[str]:
    lines = []
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name != "place.py" and not name.startswith(tuple(allowed)):
            text = path.read_text(encoding="utf-8").splitlines()
            lines += [f"{name}:{k}: {line.strip()}" for k, line in enumerate(text, start=1) if pattern.search(line)]
    return lines


def test_only_what_reads_and_writes_files_looks_into_their_content() -> None:
    assert found(CONTENT, OF_FILES) == []


def test_names_of_places_are_taken_apart_in_one_module() -> None:
    assert found(NAMES, OF_TABLES) == []


@pytest.mark.parametrize(
    "line", ['pose(robot.spec["base"])', 'spec.get("effects")', 'Robot(robot.spec | {"effects": []})']
)
def test_the_fence_sees_the_content_of_a_file(line: str) -> None:
    assert CONTENT.search(line)


@pytest.mark.parametrize("line", ['int(owner.removeprefix("joint")) - 1', 'f"q{i + 1}_{unit}"', 'f"joint{k + 1}"'])
def test_the_fence_sees_names_of_places(line: str) -> None:
    assert NAMES.search(line)


@pytest.mark.parametrize("name", robots.available())
def test_a_description_has_all_that_the_file_says(name: str) -> None:
    said = load_robot(name).spec
    again = content(structured(RobotSpec, said))
    assert {key: again[key] for key in said} == said
    assert all(not again[key] or again[key] is True for key in again.keys() - said.keys())


def test_a_description_is_frozen() -> None:
    robot = load_robot("ur10")
    with pytest.raises(FrozenInstanceError):
        robot.description.name = "another"  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError):
        robot.joints[0].d_mm = 0.0  # type: ignore[misc]


@pytest.mark.parametrize(
    "changes",
    [
        {"base": {"xyz_mm": [100.0, -20.0, 3.0], "rpy_deg": [1.0, 2.0, 30.0]}},
        {"effects": [{"effect": "joint_compliance", "owner": "joint2", "parameters": {}}]},
        {"gravity_m_s2": [0.0, 9.81, 0.0]},
        {"equilibrium": False},
    ],
)
def test_a_robot_with_other_values_is_the_robot_of_such_a_file(changes: dict[str, object]) -> None:
    robot = load_robot("kuka_kr500_3")
    other, built = robot.with_(**changes), Robot(copy.deepcopy(robot.spec) | changes)
    assert other.spec == built.spec
    q = robot.limits.mean(axis=1) + 0.2
    assert other.forward(q, payload=300.0).tobytes() == built.forward(q, payload=300.0).tobytes()
    J, built_J = (r.parameter_jacobian(q, payload=300.0) for r in (other, built))
    assert J.tobytes() == built_J.tobytes()


def test_a_key_of_none_is_left_out() -> None:
    robot = load_robot("ur10").with_(made_by={"serial": "7"})
    assert robot.made_by == {"serial": "7"}
    assert "made_by" not in robot.with_(made_by=None).spec


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("joint3", Place("", "joint", 3)),
        ("left.joint12", Place("left", "joint", 12)),
        ("arm2.link1", Place("arm2", "link", 1)),
        ("base", Place("", "base", 0)),
        ("a.b.c", Place("", "a.b.c", 0)),
    ],
)
def test_a_place_comes_back_from_its_name(name: str, place: Place) -> None:
    assert place_of(name) == place
    assert str(place) == name


def test_joints_count_from_one_in_names() -> None:
    assert (joint_name(0), joint_position(4), joint_column(4, "deg")) == ("joint1", "q5", "q5_deg")
    assert place_of(joint_name(7)).index == 7
    assert [place_of(name).position for name in ("joint3", "link3", "base")] == ["q3", "", ""]
    with pytest.raises(ValueError, match="expected a joint or a link, got tool"):
        _ = place_of("tool").index
