# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a controller shows and the joints of the chain."""

from __future__ import annotations

import numpy as np
import pytest

import fastcal
from fastcal.errors import ParseError
from fastcal.robot.pendant import controller_columns, relations

PRISMATIC = {"type": "prismatic", "theta_deg": 0, "d_mm": 0, "a_mm": 0, "alpha_deg": 0, "min_mm": 0, "max_mm": 900}


def arm(pendant: object, *, sliding: bool = False) -> fastcal.Robot:
    spec = fastcal.load_robot("fanuc_m20ia").spec
    joints = [*spec["joints"][:5], PRISMATIC] if sliding else spec["joints"]
    return fastcal.load_robot(spec | {"joints": joints, "pendant": pendant})


def test_fanuc_shows_joint_3_from_the_horizontal() -> None:
    """Pendant J2 = 31.325, J3 = -33.342; mechanism -2.017 (ros-industrial/fanuc issues 186 and 290)."""
    pendant = fastcal.load_robot("fanuc_m20ia").pendant
    shown = np.radians([0.0, 31.325, -33.342, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(np.degrees(pendant.chain(shown))[2], -2.017, atol=1e-12)
    np.testing.assert_allclose(pendant.shown(pendant.chain(shown)), shown, atol=1e-15)


def test_signs_zeros_and_sums_by_hand() -> None:
    """q2 = 90 - J2, q3 = J3 + J1 - J2, q4 = J3 - J4."""
    entries = [
        {"joint": 3, "minus": 2, "plus": [1]},
        {"joint": 2, "sign": -1, "zero_deg": 90},
        {"joint": 4, "sign": -1, "plus": 3},
    ]
    robot = arm(entries)
    shown = np.array([[10.0, 20.0, 30.0, 40.0, 50.0, 60.0], [-1.0, 2.0, -3.0, 4.0, -5.0, 6.0]])
    q = [[10.0, 70.0, 20.0, -10.0, 50.0, 60.0], [-1.0, 88.0, -6.0, -7.0, -5.0, 6.0]]
    np.testing.assert_allclose(np.degrees(robot.pendant.chain(np.radians(shown))), q, atol=1e-12)
    np.testing.assert_allclose(np.degrees(robot.pendant.shown(np.radians(q))), shown, atol=1e-12)
    assert relations(robot.description) == ["q3 = J3 + J1 - J2", "q2 = -J2 + 90 deg", "q4 = -J4 + J3"]
    columns = controller_columns(robot.description, np.radians(q))
    np.testing.assert_allclose(columns["j3_deg"], shown[:, 2], atol=1e-12)
    order = robot.pendant.order
    assert order.index(2) > max(order.index(0), order.index(1))
    assert order.index(3) > order.index(2)


def test_a_reading_that_is_missing_spoils_only_what_depends_on_it() -> None:
    shown = np.radians([[1.0, np.nan, 3.0, 4.0, 5.0, 6.0]])
    found = np.degrees(fastcal.load_robot("fanuc_m20ia").pendant.chain(shown))[0]
    assert np.isnan(found[[1, 2]]).all()
    np.testing.assert_allclose(found[[0, 3, 4, 5]], [1.0, 4.0, 5.0, 6.0], atol=1e-12)


def test_arms_without_the_key_show_the_chain_s_joints() -> None:
    robot = fastcal.load_robot("ur5")
    q = np.linspace(-1, 1, 6)[None]
    assert robot.pendant.is_chain
    assert relations(robot.description) == []
    np.testing.assert_array_equal(robot.pendant.chain(q), q)
    assert list(controller_columns(robot.description, q)) == [f"q{joint}_deg" for joint in range(1, 7)]


def test_a_file_keeps_it_and_so_do_conversions_and_models(tmp_path) -> None:
    robot = fastcal.load_robot("fanuc_m20ia")
    robot.save(tmp_path / "arm.yaml")
    assert fastcal.load_robot(tmp_path / "arm.yaml").spec == robot.spec
    for kind in ("mdh", "poe", "urdf"):
        assert fastcal.convert(robot, kind).spec["pendant"] == robot.spec["pendant"]


@pytest.mark.parametrize(
    ("pendant", "sentence"),
    [
        ([{"joint": 3, "plus": 7}], "pendant[0].plus: expected numbers of joints, 1 to 6, got 7"),
        ([{"joint": 9, "plus": 2}], "pendant[0].joint: expected a whole number from 1 to 6, got 9"),
        ([{"joint": 3, "plus": 3}], "pendant[0].plus: expected other joints than joint 3 itself, got 3"),
        ([{"joint": 3, "plus": [2, 2]}], "pendant[0].plus: expected each joint once, got a list of 2"),
        ([{"joint": 3, "plus": 2, "minus": 2}], "pendant[0]: joint 2 stands in plus and in minus"),
        ([{"joint": 3, "plus": 2}, {"joint": 3}], "pendant[1].joint: joint 3 is given twice"),
        ([{"joint": 3, "sign": 2}], "pendant[0].sign: expected 1 or -1, got 2.0"),
        ([{"joint": 3, "zero": 2}], "pendant[0].zero: needs its unit at the end of its name"),
        (
            [{"joint": 3, "plus": 2}, {"joint": 2, "plus": 3}],
            "pendant[0]: joints 2 and 3 are each counted from the other; expected one counted by itself",
        ),
        (
            [{"joint": 1, "minus": 2}, {"joint": 2, "plus": 3}, {"joint": 3, "plus": 1}],
            "pendant[0]: joints 1, 2 and 3 are each counted from the others; expected one counted by itself",
        ),
    ],
)
def test_relations_that_cannot_be_are_refused_in_a_sentence(pendant, sentence) -> None:
    with pytest.raises(ParseError) as caught:
        arm(pendant)
    assert sentence in str(caught.value)


def test_a_slide_is_not_counted_from_a_turn() -> None:
    with pytest.raises(ParseError, match=r"plus: joint 2 is revolute and joint 6 is not"):
        arm([{"joint": 6, "plus": 2}], sliding=True)
    robot = arm([{"joint": 6, "sign": -1, "zero_mm": 500}], sliding=True)
    np.testing.assert_allclose(robot.pendant.chain(np.array([0, 0, 0, 0, 0, 0.2]))[5], 0.3)
