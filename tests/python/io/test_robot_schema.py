# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robot files: what is refused and in which words, and the canonical form of what is read."""

import copy
import math
from typing import Any

import pytest

from fastcal.errors import ParseError
from fastcal.io.robot_schema import check_spec

Spec = dict[str, Any]
CALIBRATION = {"parameters": ["a"], "covariance_root": [[1]], "sigma_mm": 0.1, "degrees_of_freedom": 9}
NOMINAL = {"theta_deg": 0, "d_mm": 1, "a_mm": 2, "alpha_deg": 3, "beta_deg": 0}


def plain(kind: str = "dh") -> Spec:
    """The shortest robot of a kind that is accepted, as a person would write it."""
    joint: Spec = {"type": "revolute", "min_deg": -90, "max_deg": 90}
    if kind in ("dh", "mdh"):
        return {
            "name": "arm",
            "kinematics": kind,
            "joints": [joint | {"theta_deg": 0, "d_mm": 1, "a_mm": 2, "alpha_deg": 3}],
        }
    if kind == "poe":
        axis = {"omega": [0, 0, 1], "point_mm": [0, 0, 0]}
        return {"name": "arm", "kinematics": "poe", "joints": [joint | axis], "home": {"xyz_mm": [1, 0, 0]}}
    return {"name": "arm", "kinematics": "urdf", "joints": [joint | {"name": "j", "axis": [0, 0, 1]}]}


def changed(spec: Spec, place: str, value: Any) -> Spec:
    """A copy with the value at a place such as `joints.0.d_mm` set, or the key deleted where it is `...`."""
    spec = copy.deepcopy(spec)
    *path, last = place.split(".")
    target: Any = spec
    for key in path:
        target = target[int(key)] if isinstance(target, list) else target.setdefault(key, {})
    if value is ...:
        del target[last]
    else:
        target[int(last) if isinstance(target, list) else last] = value
    return spec


def refusal(spec: Spec) -> str:
    """What a spec is refused with, without the name of its file."""
    with pytest.raises(ParseError) as caught:
        check_spec(spec, "arm.yaml")
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("arm.yaml: ")
    return str(caught.value).removeprefix("arm.yaml: ")


WRONG = [
    ("dh", "joints.0.d_mm", "abc", "joints[0].d_mm: expected a finite number, got 'abc'"),
    ("dh", "joints.0.d_mm", "12", "joints[0].d_mm: expected a finite number, got '12'"),
    ("dh", "joints.0.d_mm", True, "joints[0].d_mm: expected a finite number, got true"),
    ("dh", "joints.0.d_mm", None, "joints[0].d_mm: expected a finite number, got nothing"),
    ("dh", "joints.0.d_mm", math.nan, "joints[0].d_mm: expected a finite number, got nan"),
    ("dh", "joints.0.d_mm", -math.inf, "joints[0].d_mm: expected a finite number, got -inf"),
    ("dh", "joints.0.d_mm", [1], "joints[0].d_mm: expected a finite number, got a list of 1"),
    ("dh", "joints.0.d_mm", ..., "joints[0]: d_mm is missing"),
    ("dh", "joints.0.d_kg", 1, "joints[0]: d_mm and d_kg give the same value twice"),
    ("dh", "joints.0.motor_ration", 1, "joints[0]: the key 'motor_ration' is not known; did you mean 'motor_ratio'?"),
    ("dh", "joints.0.type", "hinge", "joints[0].type: expected revolute or prismatic, got 'hinge'"),
    ("dh", "joints.0.min_deg", 90, "joints[0]: min_deg must be below max_deg, got 90.0 and 90.0"),
    ("dh", "joints.0.motor_ratio", 0, "joints[0].motor_ratio: expected a number other than 0, got 0"),
    ("dh", "joints.0.link", {"com_mm": [0, 0, 0]}, "joints[0].link: mass_kg is missing"),
    ("dh", "joints.0.link", {"mass_kg": -1}, "joints[0].link.mass_kg: expected a mass that is not negative, got -1.0"),
    ("dh", "joints.0.link", {"mass_kg": 1, "com_mm": [0, 0]}, "joints[0].link.com_mm: expected a list of 3 numbers"),
    ("dh", "joints.0.link", {"mass_kg": 1, "com_mm": [0, "x", 0]},
     "joints[0].link.com_mm[1]: expected a finite number"),
    ("dh", "joints.0.link", {"mass_kg": 1, "inertia_kg_m2": [-1, 0, 0, 0, 0, 0]},
     "moments xx, yy, zz that are not negative"),
    ("dh", "joints", [], "joints: expected a list of 1 to 100 entries, got a list of 0"),
    ("dh", "joints", {"a": 1}, "joints: expected a list of 1 to 100 entries, got a mapping of 1 keys"),
    ("dh", "joints", [3], "joints[0]: expected a mapping of names to values, got 3"),
    ("dh", "kinematics", "dhh", "kinematics: expected dh, mdh, poe or urdf, got 'dhh'"),
    ("dh", "name", "two\nlines", "name: expected a line of text, got 'two\\nlines'"),
    ("dh", "gravity", [0, 0, -9.8], "gravity: needs its unit at the end of its name; gravity_m_s2 would do"),
    ("dh", "gravity_frame", "world", "gravity_frame: expected base or measuring, got 'world'"),
    ("dh", "tool.xyz", [0, 0, 0],
     "tool.xyz: needs its unit at the end of its name; xyz_m, xyz_mm, xyz_um or xyz_in would do"),
    ("dh", "tool.rpy_grad", [0, 0, 0],
     "tool.rpy_grad: does not end in a unit of angle; rpy_rad, rpy_mrad or rpy_deg would do"),
    ("dh", "tools", {}, "the key 'tools' is not known; did you mean 'tool'?"),
    ("dh", "xyzzy", 1, "the key 'xyzzy' is not known; known here are name, kinematics, joints"),
    ("dh", "pendent", [], "the key 'pendent' is not known; did you mean 'pendant'?"),
    ("dh", "known_distance", [], "the key 'known_distance' is not known; did you mean 'known_distances'?"),
    ("dh", "coupling", [{"joint": 1, "source": 2, "ratio": 1}],
     "coupling[0].source: expected a whole number from 1 to 1, got 2"),
    ("dh", "coupling", [{"joint": 1, "source": 1, "ratio": 1}],
     "coupling[0].source: expected another joint than joint 1 itself"),
    ("dh", "effects", [{"owner": "joint1"}], "effects[0]: effect is missing"),
    ("dh", "effects", [{"effect": "backlash", "owner": "joint1", "parameters": {"gap_rad": {"std": 1}}}],
     "effects[0].parameters.gap_rad: value is missing"),
    ("dh", "effects", [{"effect": "backlash", "owner": "joint1", "order": math.inf}],
     "effects[0].order: expected a finite number"),
    ("dh", "structure", 3, "structure: expected a mapping of names to values, got 3"),
    ("dh", "compensator", {"joint": 2}, "compensator.joint: expected a whole number from 1 to 1, got 2"),
    ("dh", "calibration", CALIBRATION | {"held": {"parameters": ["a"], "directions": [[1.0], [-1e18]]}},
     "calibration.held.directions[1]: expected numbers up to 1e+06, got -1e+18"),
    ("dh", "calibration", CALIBRATION | {"nominal": {"joints": []}},
     "calibration.nominal.joints: expected a list of 1 entries, got a list of 0"),
    ("dh", "calibration", CALIBRATION | {"nominal": {"joints": [{"d_mm": 1}]}},
     "calibration.nominal.joints[0]: theta_deg is missing"),
    ("dh", "calibration", CALIBRATION | {"nominal": {"joints": [NOMINAL | {"a_mm": "long"}]}},
     "calibration.nominal.joints[0].a_mm: expected a finite number, got 'long'"),
    ("dh", "calibration", CALIBRATION | {"nominal": {"joints": [NOMINAL | {"mass": 1}]}},
     "calibration.nominal.joints[0]: the key 'mass' is not known"),
    ("dh", "calibration", {"parameters": ["a"], "covariance_root": [[1, 2]]},
     "calibration.covariance_root[0]: expected a list of 1"),
    ("dh", "calibration", {"parameters": ["a", "b"], "covariance_root": "AAAAAAAA8D8="},
     "calibration.covariance_root: expected 3 numbers of 8 bytes below 1e100 in base64, got '12 characters'"),
    ("dh", "calibration", {"parameters": ["a"], "covariance_root": "AAAAAAAA8H8="},
     "calibration.covariance_root: expected 1 numbers of 8 bytes below 1e100 in base64, got '12 characters'"),
    ("dh", "calibration", {"parameters": ["a"], "covariance_root": "no base64!"},
     "calibration.covariance_root: expected 1 numbers of 8 bytes below 1e100 in base64, got '10 characters'"),
    ("poe", "joints.0.omega", [0, 0, 1.1], "joints[0].omega: expected a vector of length 1, got one of length 1.1"),
    ("poe", "joints.0.v_mm", [0, 0, 0], "joints[0]: expected point_mm or v_mm, got both"),
    ("poe", "joints.0.point_mm", ..., "joints[0]: point_mm is missing"),
    ("poe", "home", ..., "home is missing"),
    ("poe", "joints.0.d_mm", 1, "joints[0]: the key 'd_mm' is not known"),
    ("urdf", "joints.0.axis", [0, 0, 0], "joints[0].axis: expected a vector of length 1, got one of length 0"),
    ("urdf", "joints.0.name", ..., "joints[0]: name is missing"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "place", "value", "sentence"), WRONG)
def test_invalid_input_is_refused_in_a_sentence(kind: str, place: str, value: Any, sentence: str) -> None:
    assert sentence in refusal(changed(plain(kind), place, value))


def test_a_wrong_unit_says_which_would_do() -> None:
    without = changed(plain(), "joints.0.d_mm", ...)
    for key, wrong in (
        ("d", "needs its unit at the end of its name"),
        ("d_kg", "does not end in a unit of length"),
        ("d_cm", "does not end in a unit of length"),
    ):
        assert (
            refusal(changed(without, f"joints.0.{key}", 1))
            == f"joints[0].{key}: {wrong}; d_m, d_mm, d_um or d_in would do"
        )
    prismatic = changed(plain(), "joints.0.type", "prismatic")
    expected = "joints[0].min_deg: does not end in a unit of length; min_m, min_mm, min_um or min_in would do"
    assert refusal(prismatic) == expected


def test_a_misspelt_key_that_is_needed_is_recognised() -> None:
    spec = changed(changed(plain(), "joints.0.theta_deg", ...), "joints.0.tetha_deg", 1)
    assert refusal(spec) == "joints[0]: theta_deg is missing; did you mean 'tetha_deg'?"


def test_other_units_of_the_kind_are_read() -> None:
    lengths = {"theta_rad": math.pi / 2, "d_m": 0.15, "a_in": 10, "alpha_mrad": 0}
    link = {"mass_g": 250, "com_m": [0.1, 0, 0]}
    joint = check_spec({"name": "a", "kinematics": "dh", "joints": [{"type": "revolute", "link": link} | lengths]})[
        "joints"
    ][0]
    assert (joint["theta_deg"], joint["d_mm"], joint["a_mm"], joint["alpha_deg"]) == (90.0, 150.0, 254.0, 0.0)
    assert joint["link"] == {"mass_kg": 0.25, "com_mm": [100.0, 0.0, 0.0]}


def test_defaults_are_filled_in_and_the_canonical_form_is_kept() -> None:
    spec = check_spec(plain())
    assert list(spec) == [
        "name", "kinematics", "joints", "coupling", "base", "tool", "payload", "gravity_m_s2", "gravity_frame",
        "wrench_frame", "effects", "structure",
    ]  # fmt: skip
    assert spec["joints"][0]["beta_deg"] == 0.0
    assert spec["gravity_m_s2"] == [0.0, 0.0, -9.80665]
    assert spec["base"] == spec["tool"] == {"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]}
    assert check_spec(spec) == spec


def test_a_direction_of_few_digits_gets_length_one_and_an_exact_one_is_not_touched() -> None:
    spec = check_spec(changed(plain("poe"), "joints.0.omega", [0.7071068, 0.7071068, 0]))
    assert math.hypot(*spec["joints"][0]["omega"]) == pytest.approx(1.0, abs=1e-15)
    exact = [0.6, 0.0, 0.8]
    assert check_spec(changed(plain("poe"), "joints.0.omega", exact))["joints"][0]["omega"] == exact


def test_moments_that_rounding_left_below_0_are_0() -> None:
    link = {"mass_kg": 0, "inertia_kg_m2": [-5.42e-20, 0.5, 0, 0, 0, 0]}
    spec = check_spec(changed(plain(), "joints.0.link", link))
    assert spec["joints"][0]["link"]["inertia_kg_m2"] == [0, 0.5, 0, 0, 0, 0]


def test_a_hinge_has_no_pitch() -> None:
    spec = changed(changed(plain("poe"), "joints.0.point_mm", ...), "joints.0.v_mm", [10, 0, 1])
    assert "joints[0].v_mm: must be perpendicular to omega" in refusal(spec)
    kept = check_spec(changed(spec, "joints.0.v_mm", [10, 0, 1e-9]))["joints"][0]["v_mm"]
    assert kept == [10.0, 0.0, 0.0]


def test_a_slide_has_limits_and_a_direction() -> None:
    slide = {"name": "s", "kinematics": "poe", "joints": [{"type": "prismatic", "v": [0, 1, 0]}], "home": {}}
    assert refusal(slide) == "joints[0]: min_mm is missing"
    slide["joints"][0] |= {"min_m": 0, "max_m": 2}
    assert check_spec(slide)["joints"] == [
        {"type": "prismatic", "omega": [0.0] * 3, "v": [0.0, 1.0, 0.0], "d_mm": 0.0, "min_mm": 0.0, "max_mm": 2000.0}
    ]
    slide["joints"][0]["omega"] = [0, 0, 1]
    assert "joints[0].omega: expected [0, 0, 0] for a prismatic joint" in refusal(slide)
