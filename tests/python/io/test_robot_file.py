# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robot files: what is written loads back bit for bit, shipped arms, and no bytes that crash or hang."""

import copy
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fastcal import robots
from fastcal.conversion import convert
from fastcal.errors import FastcalError, InvalidInput, ParseError
from fastcal.io.robot_file import load_robot, read_spec, write_spec
from fastcal.io.robot_schema import check_spec
from fastcal.io.yaml_text import yaml_text

Spec = dict[str, Any]


def random_spec(seed: int) -> Spec:
    """A robot of each kind in turn, with numbers that have all their digits and every optional key."""
    rng = np.random.default_rng(seed)

    def numbers(count: int) -> list[float]:
        return [float(x) for x in rng.normal(size=count) * 10.0 ** rng.integers(-9, 9, count)]

    spec = convert(read_spec("spray_7dof"), ("dh", "mdh", "poe", "urdf")[seed % 4]).spec
    for joint in spec["joints"]:
        for key in ("theta_deg", "d_mm", "a_mm", "alpha_deg", "beta_deg"):
            if key in joint:
                joint[key] = numbers(1)[0]
        if "origin" in joint:
            joint["origin"]["rpy_deg"] = numbers(3)
        joint["motor_ratio"] = numbers(1)[0]
        joint["link"] |= {"com_mm": numbers(3), "inertia_kg_m2": [1e99, 1e-99, 0.1, *numbers(3)]}
    spec["tool"] = {"xyz_mm": numbers(3), "rpy_deg": [-0.0, 1e22, 1e16]}
    spec["coupling"] = [{"joint": 7, "source": 5, "ratio": numbers(1)[0]}]
    parameters = {"compliance_rad_nm": {"value": numbers(1)[0], "std": 1e-7}}
    spec["effects"] = [{"effect": "joint_compliance", "owner": "joint2", "parameters": parameters, "list": [1e-7, 3]}]
    spec["structure"] = copy.deepcopy(read_spec("spray_7dof")["structure"])
    table = spec["structure"]["tables"]["telescope"]
    table |= {key: table[key][:2] for key in ("angle_deg", "extension_mm")} | {"matrices_si": table["matrices_si"][:4]}
    table |= {"angle_degree": 1, "extension_degree": 1}
    spec["structure"]["nodes"][5] |= {"xyz_mm": numbers(3), "mass_kg": abs(numbers(1)[0]), "carries": ["link6"]}
    spec["calibration"] = {"parameters": ["joint1 d", "tool x"], "covariance_root": [numbers(1), numbers(2)]}
    spec["calibration"] |= {"sigma_mm": 0.03, "degrees_of_freedom": 12, "rows": [[0, 1], numbers(40)]}
    spec["calibration"] |= {"odd: key": "yes", "word": "a # b", "none": None, "flag": True}
    spec["notes"] = ["joint 'a' is \"odd\": \x07 \u2028 \U0001f600"]
    return check_spec(spec)


@pytest.mark.parametrize("seed", range(40))
def test_what_is_written_loads_back_bit_for_bit(seed: int, tmp_path: Path) -> None:
    spec = random_spec(seed)
    path = tmp_path / "model.yaml"
    write_spec(spec, path, comment="two\nlines")
    assert repr(read_spec(path)) == repr(spec)  # repr tells -0.0 from 0.0 and 3 from 3.0
    assert path.read_text().startswith("# two\n# lines\nname: spray_7dof\n")
    assert repr(check_spec(yaml.safe_load(path.read_text()))) == repr(spec)  # other readers of YAML see the same


def test_a_row_is_a_line_where_it_fits_in_120_columns() -> None:
    lines = yaml_text(read_spec("staubli_rx160l")).splitlines()
    assert lines[3:5] == [
        "  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 150, alpha_deg: -90, beta_deg: 0, "
        "min_deg: -160, max_deg: 160,",
        "     link: {mass_kg: 80, com_mm: [-75, 20, 0]}}",
    ]
    assert all(len(line) <= 120 for name in robots.available() for line in yaml_text(read_spec(name)).splitlines())


@pytest.mark.parametrize("name", robots.available())
def test_every_shipped_arm_loads_names_its_source_and_stays_in_its_limits(name: str) -> None:
    path = robots.path_of(name)
    assert path is not None
    head = path.read_text().splitlines()
    assert head[0].startswith("# ")
    # Numbers that are not a source's are said to be plausible; where no masses are published there are none.
    source = " ".join(line for line in head if line.startswith("#"))
    assert any(word in source for word in ("plausible", "maker's", "public", "paper"))
    robot = load_robot(name)
    assert robot.name == name
    masses = [joint.get("link", {}).get("mass_kg") for joint in robot.spec["joints"]]
    assert all(mass is None for mass in masses) or min(masses) > 0
    assert (masses[0] is None) == ("the file has none" in source.replace("# ", ""))
    assert np.isfinite(robot.forward(robot.limits.mean(axis=1))).all()


def test_the_arms_of_the_papers_are_there() -> None:
    assert set(robots.available()) >= {
        "siasun_sr210d", "kuka_kr500_3", "pmc6va030", "staubli_rx160l", "spray_7dof", "ur5", "ur10", "lbr_iiwa14",
    }  # fmt: skip
    types = "".join(joint["type"][0] for joint in read_spec("spray_7dof")["joints"])
    assert types == "prrrrpr"


def test_the_sr210d_has_the_screws_of_equation_1() -> None:
    """(v, omega) with L1 ... L4 = 312, 1075, 235, 1282 and the mended row of axis 6."""
    L1, L2, L3, L4 = 312.0, 1075.0, 235.0, 1282.0
    screws = [
        [0, 0, 0, 0, 0, 1], [0, 0, -L1, 0, -1, 0], [L2, 0, -L1, 0, -1, 0],
        [0, L2 + L3, 0, 1, 0, 0], [L2 + L3, 0, -L1 - L4, 0, -1, 0], [0, L2 + L3, 0, 1, 0, 0],
    ]  # fmt: skip
    joints = read_spec("siasun_sr210d")["joints"]
    np.testing.assert_array_equal([np.r_[-np.cross(j["omega"], j["point_mm"]), j["omega"]] for j in joints], screws)


def test_shared_sets_load_and_their_arms_are_the_shipped_ones(shared_data: Path) -> None:
    """The simulator's arms have the geometry and masses of the shipped files (the SR210D's as rows, not screws)."""
    for folder in sorted((shared_data / "hidden_effects").iterdir()):
        if not (folder / "robot.yaml").is_file():
            continue
        robot = load_robot(folder / "robot.yaml")
        shipped = load_robot(robot.name)
        q = np.random.default_rng(0).uniform(robot.limits[:, 0], robot.limits[:, 1], (20, robot.joint_count))
        np.testing.assert_allclose(robot.forward(q), shipped.forward(q), atol=1e-12)
        masses = [[joint["link"]["mass_kg"] for joint in r.spec["joints"]] for r in (robot, shipped)]
        assert masses[0] == masses[1]


def test_an_unknown_arm_is_answered_with_the_arms_there_are() -> None:
    with pytest.raises(
        ParseError, match=r"no shipped arm has that name; did you mean ur5 or ur5e\? \(fastcal robots lists them\)$"
    ):
        read_spec("ur55")


@pytest.mark.parametrize("repeats", range(3))
def test_rows_of_numbers_are_wrapped_and_come_back_bit_for_bit(repeats: int) -> None:
    # one, two ... lines; numbers that Python writes otherwise than YAML does
    rows = [[-1.0 / 3.0] * n + [150.0, -0.0, 1e-07, 1e22] * repeats for n in range(1, 30)]
    text = yaml_text({"rows": rows, "row": rows[-1]})
    assert all(len(line) <= 120 for line in text.splitlines())
    assert all("1e" not in line and "150.0" not in line for line in text.splitlines())
    found = yaml.safe_load(text)
    assert repr([[float(v) for v in row] for row in found["rows"]]) == repr(rows)
    # as many numbers as fit: no line is followed by one that begins with a number that had room
    lines = text[text.index("row:") :].splitlines()[1:]
    for line, following in itertools.pairwise(lines):
        assert len(line) + 1 + len(following.split()[0]) > 120


MUTANTS_OF = [robots.path_of(name).read_bytes() for name in ("ur5", "pmc6va030", "siasun_sr210d")]  # type: ignore[union-attr]
MUTANTS_OF += [yaml_text(random_spec(seed)).encode() for seed in range(4)]
PIECES = [
    b"{",
    b"[",
    b"*a",
    b"&a ",
    b": ",
    b"- ",
    b"\n",
    b"1e999",
    b".nan",
    b"!!set ",
    b"? ",
    b"'",
    b'"',
    b"null",
    b"#",
]
EDIT = st.tuples(st.integers(0, 10_000), st.integers(0, 8), st.one_of(st.binary(max_size=6), st.sampled_from(PIECES)))


@settings(max_examples=200, deadline=5000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.sampled_from(MUTANTS_OF), edits=st.lists(EDIT, min_size=1, max_size=6))
def test_mutated_files_are_read_or_refused(content: bytes, edits: list[tuple[int, int, bytes]], tmp_path: Path) -> None:
    for place, length, insert in edits:
        at = place % (len(content) + 1)
        content = content[:at] + insert + content[at + length :]
    path = tmp_path / "mutant.yaml"
    path.write_bytes(content)
    try:
        spec = load_robot(path).spec
    except FastcalError as error:
        message = str(error)
    else:
        message = ""
        write_spec(spec, path)
        assert repr(read_spec(path)) == repr(spec)
    assert "\n" not in message


def test_a_robot_that_was_saved_predicts_the_same(tmp_path: Path) -> None:
    robot = load_robot("staubli_rx160l")
    robot.save(tmp_path / "again.yaml")
    q = np.random.default_rng(1).uniform(-1, 1, (50, 6))
    np.testing.assert_array_equal(load_robot(tmp_path / "again.yaml").forward(q), robot.forward(q))


def test_nothing_is_left_of_a_file_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="cannot be written"):
        write_spec(read_spec("ur5"), tmp_path / "no" / "such" / "folder.yaml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("spelled", "name"),
    [
        ("UR5", "ur5"),
        ("ur-5", "ur5"),
        ("Ur 10", "ur10"),
        ("kr500", "kuka_kr500_3"),
        ("RX160L", "staubli_rx160l"),
        ("IRB 6700", "abb_irb6700_200_260"),
        ("Panda", "franka_panda"),
        ("LR Mate 200iD", "fanuc_lrmate200id"),
    ],
)
def test_a_shipped_arm_by_a_likely_spelling(spelled: str, name: str) -> None:
    assert load_robot(spelled).name == name


def test_no_folder_or_file_shadows_a_shipped_arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`fastcal calibrate ur5 data.csv -o ur5` twice: the second run must mean the same arm."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ur5").mkdir()
    (tmp_path / "ur10").write_text("nothing", encoding="utf-8")
    assert (load_robot("ur5").name, load_robot("ur10").name) == ("ur5", "ur10")
    with pytest.raises(ParseError, match="is a folder; expected a robot file"):
        load_robot("./ur5")
    load_robot("ur5").save(tmp_path / "ur5" / "model.yaml")
    with pytest.raises(ParseError, match=r"did you mean .*model\.yaml"):
        load_robot("./ur5")


def test_a_mapping_is_a_robot() -> None:
    content = {"name": "two", "kinematics": "dh", "joints": [
        {"type": "revolute", "theta_deg": 0, "d_mm": 0, "a_mm": 300, "alpha_deg": 0},
        {"type": "revolute", "theta_deg": 0, "d_mm": 0, "a_mm": 200, "alpha_deg": 0},
    ]}  # fmt: skip
    robot = load_robot(content)
    np.testing.assert_allclose(robot.forward([0.0, np.pi / 2])[0, :3, 3], [0.3, 0.2, 0.0], atol=1e-15)
    assert "min_deg" not in content["joints"][0]
    with pytest.raises(ParseError, match="kinematics"):
        load_robot({"name": "two", "joints": []})


def test_a_name_that_may_be_several_arms_lists_them() -> None:
    with pytest.raises(
        ParseError, match="several shipped arms have that name; they are kuka_kr210_r2700, kuka_kr500_3"
    ):
        load_robot("kuka")


def test_what_rounding_leaves_of_nothing_is_written_as_nothing(tmp_path: Path) -> None:
    """A model with -4e-142 degrees was written and could not be read again."""
    robot = load_robot("ur5").with_(tool={"xyz_mm": [0, 0, 1e-99], "rpy_deg": [0, -3.5e-142, 0]})
    robot.save(tmp_path / "model.yaml")
    again = load_robot(tmp_path / "model.yaml")
    assert again.spec["tool"] == {"xyz_mm": [0, 0, 1e-99], "rpy_deg": [0, 0, 0]}
    assert np.array_equal(again.forward(np.ones(6)), robot.forward(np.ones(6)))
