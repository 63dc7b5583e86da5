# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every figure of ISO 9283 on visits whose results can be worked out on paper, one test a symbol."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.acceptance import accept
from fastcal.acceptance.acceptance import Acceptance
from fastcal.acceptance.propagation import lower_roots
from fastcal.measurements.dataset import Dataset

Array = NDArray[np.float64]
MM = 1e-3

# Visits about the commanded point in mm: mean (1, 0, 0); distances from it 2, 2, 1, 1, 0, mean 1.2; S^2 = 2.8 / 4.
VISITS = np.array([[3.0, 0, 0], [-1, 0, 0], [1, 1, 0], [1, -1, 0], [1, 0, 0]])
L_MEAN = 1.2
S_L = math.sqrt((0.8**2 * 2 + 0.2**2 * 2 + 1.2**2) / 4)
UPRIGHT = Rotation.identity()
# The tool's x, y, z along the base's y, z, x: what turns about the base's x, y, z turns about the tool's z, x, y.
LYING = Rotation.from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
COMMANDED = np.array([[0.0, 0, 0], [600, 0, 0], [0, 800, 0]])  # mm; P1, P2, P4: apart by 600, 800 and 1000


def about(axis: str, angles: Array) -> Rotation:
    """Turns [rad] about an axis of the base."""
    return Rotation.from_euler(axis, np.atleast_1d(angles)[:, np.newaxis])


def judged_visits(
    errors: list[Array],
    names: list[str],
    *,
    directions: list[str] | None = None,
    attained: list[Rotation] | None = None,
    orientation: Rotation = UPRIGHT,
    times: list[Array] | None = None,
    commanded: Array = COMMANDED,
) -> Acceptance:
    """An acceptance without alignment: errors [mm] and attained orientations of the visits of each station."""
    robot = fastcal.load_robot("ur5")
    counts = [len(e) for e in errors]
    at = {name: commanded[i] for i, name in enumerate(dict.fromkeys(names))}
    targets = np.repeat([at[name] for name in names], counts, axis=0)
    extra = {f"target_{axis}_mm": targets[:, i] for i, axis in enumerate("xyz")}
    turned = orientation.as_quat(scalar_first=True)
    extra |= {f"target_q{a}": np.full(sum(counts), turned[i]) for i, a in enumerate("wxyz")}
    labels = {"pose": np.repeat(names, counts).tolist()}
    if directions:
        labels["direction"] = np.repeat(directions, counts).tolist()
    data = Dataset.from_arrays(
        np.repeat(0.1 * np.arange(len(names))[:, np.newaxis] * np.ones(6), counts, axis=0),
        position=MM * (targets + np.concatenate(errors)),
        rotation=None if attained is None else Rotation.concatenate(attained).as_quat(scalar_first=True),
        time=None if times is None else np.concatenate(times),
        extra=extra,
        extra_labels=labels,
    )
    return accept(robot, data, align=False, draws=0)


def value(found: Acceptance, symbol: str, where: str) -> float:
    (figure,) = [e.figure for e in found.figures if (e.figure.symbol, e.figure.where) == (symbol, where)]
    return figure.value


def test_ap_is_the_distance_of_the_mean_and_its_parts_are_along_the_base() -> None:
    found = judged_visits([VISITS + np.array([2.0, 4, 0])], ["P1"])
    assert value(found, "AP", "P1") == pytest.approx(5 * MM)  # mean (3, 4, 0)
    assert [value(found, f"AP_{axis}", "P1") for axis in "xyz"] == pytest.approx([3 * MM, 4 * MM, 0], abs=1e-15)


def test_rp_is_the_mean_distance_and_three_deviations() -> None:
    assert value(judged_visits([VISITS + np.array([2.0, 4, 0])], ["P1"]), "RP", "P1") == pytest.approx(
        MM * (L_MEAN + 3 * S_L)
    )


def test_vap_is_the_greatest_distance_between_the_means_from_several_sides() -> None:
    """Means (1, 0, 0), (1, 3, 0) and (1, 3, 4): apart by 3, 4 and 5."""
    found = judged_visits(
        [VISITS, VISITS + np.array([0.0, 3, 0]), VISITS + np.array([0.0, 3, 4])], ["P1"] * 3, directions=["x", "y", "z"]
    )
    assert value(found, "vAP", "P1") == pytest.approx(5 * MM)


def test_ad_and_rd_are_of_the_distances_between_p2_and_p4() -> None:
    """The first visits of P2 lie 0, 1, 2, 3, 4 mm further out along the line to P4: AD 2, S^2 = 10 / 4."""
    along = np.array([600.0, -800, 0]) / 1000
    out = np.arange(5.0)[:, np.newaxis] * along
    found = judged_visits([VISITS, out, np.zeros((5, 3))], ["P1", "P2", "P4"])
    assert value(found, "AD", "P2\N{EN DASH}P4") == pytest.approx(2 * MM, rel=1e-9)
    assert value(found, "RD", "P2\N{EN DASH}P4") == pytest.approx(3 * MM * math.sqrt(2.5), rel=1e-9)


TURNS = 1e-3 * np.arange(1.0, 6)  # rad: mean 3 mrad, S^2 = 10 / 4


@pytest.mark.parametrize(("of_the_base", "of_the_tool"), [("x", "z"), ("y", "x"), ("z", "y")])
def test_orientation_has_a_mean_and_three_deviations_about_each_axis(of_the_base: str, of_the_tool: str) -> None:
    """A tool that lies, turned about one axis of the base: about one of its own axes, and none of the others."""
    found = judged_visits([VISITS], ["P1"], attained=[about(of_the_base, TURNS) * LYING], orientation=LYING)
    for axis in "xyz":
        share = float(axis == of_the_tool)
        assert value(found, f"AP_r{axis}", "P1") == pytest.approx(share * 3e-3, rel=1e-9, abs=1e-12)
        assert value(found, f"RP_r{axis}", "P1") == pytest.approx(share * 3e-3 * math.sqrt(2.5), rel=1e-9, abs=1e-12)


def test_a_turn_about_a_slanting_axis_has_a_part_about_each() -> None:
    """4 mrad about (2, 1, 2) / 3."""
    slanting = Rotation.from_rotvec(np.tile(4e-3 * np.array([2.0, 1, 2]) / 3, (5, 1)))
    found = judged_visits([VISITS], ["P1"], attained=[slanting])
    parts = [value(found, f"AP_r{axis}", "P1") for axis in "xyz"]
    assert parts == pytest.approx([8e-3 / 3, 4e-3 / 3, 8e-3 / 3], rel=1e-9)


@pytest.mark.parametrize("axis", "xyz")
def test_orientations_differ_by_side_by_pose_and_in_time(axis: str) -> None:
    """Means from three sides of 3, 4 and 1 mrad: vAP 3. P2 less P4: mean 3 - 0 mrad. Blocks of 3 and 5 mrad: dAP 2."""
    sides = [about(axis, TURNS), about(axis, TURNS + 1e-3), about(axis, TURNS - 2e-3)]
    found = judged_visits([VISITS] * 3, ["P1"] * 3, directions=["x", "y", "z"], attained=sides)
    assert value(found, f"vAP_r{axis}", "P1") == pytest.approx(3e-3, rel=1e-9)
    still = about(axis, np.zeros(5))
    found = judged_visits([VISITS] * 3, ["P1", "P2", "P4"], attained=[still, about(axis, TURNS), still])
    assert value(found, f"AD_r{axis}", "P2\N{EN DASH}P4") == pytest.approx(3e-3, rel=1e-9)
    assert value(found, f"RD_r{axis}", "P2\N{EN DASH}P4") == pytest.approx(3e-3 * math.sqrt(2.5), rel=1e-9)
    times = np.concatenate([10 * np.arange(5.0), 3600 + 10 * np.arange(5.0)])
    blocks = about(axis, np.concatenate([TURNS, 2 * TURNS - 1e-3]))
    found = judged_visits([np.vstack([VISITS, VISITS])], ["P1"], attained=[blocks], times=[times])
    assert value(found, f"dAP_r{axis}", "P1") == pytest.approx(2e-3, rel=1e-9)
    assert value(found, f"dRP_r{axis}", "P1") == pytest.approx(3e-3 * math.sqrt(2.5), rel=1e-9)


def test_ad_and_rd_have_parts_along_the_base() -> None:
    """P2 is commanded at x 600, y 0, P4 at x 0, y 800. P2 lies 0, 1, 2, 3, 4 mm further out along x, and 1 along y.

    Distances along x are too long by 2 mm on average with S^2 = 10 / 4, along y too short by 1 mm.
    """
    out = np.column_stack([np.arange(5.0), np.ones(5), np.zeros(5)])
    found = judged_visits([VISITS, out, np.zeros((5, 3))], ["P1", "P2", "P4"])
    pair = "P2\N{EN DASH}P4"
    assert [value(found, f"AD_{axis}", pair) for axis in "xyz"] == pytest.approx([2 * MM, -MM, 0], abs=1e-15)
    deviations = [value(found, f"RD_{axis}", pair) for axis in "xyz"]
    assert deviations == pytest.approx([3 * MM * math.sqrt(2.5), 0, 0], abs=1e-15)


def test_drift_is_the_largest_change_from_the_first_block() -> None:
    """Blocks an hour apart: means (1, 0, 0), (4, 0, 0), (3, 0, 0), the last spread twice as wide."""
    blocks = np.concatenate([VISITS, VISITS + np.array([3.0, 0, 0]), 2 * VISITS + np.array([1.0, 0, 0])])
    time = np.concatenate([3600.0 * block + 10 * np.arange(5.0) for block in range(3)])
    found = judged_visits([blocks], ["P1"], times=[time])
    assert value(found, "dAP", "P1") == pytest.approx(3 * MM, rel=1e-9)
    assert value(found, "dRP", "P1") == pytest.approx(MM * (L_MEAN + 3 * S_L), rel=1e-9)


def test_a_moved_instrument_is_aligned_and_leaves_what_no_motion_explains() -> None:
    """Four means at the corners of a square, alternately 1 mm above and below it: no motion mends that."""
    square = np.array([[0.0, 0, 0], [600, 0, 0], [600, 600, 0], [0, 600, 0]])
    names = ["P1", "P2", "P3", "P4"]
    errors = [VISITS - VISITS.mean(axis=0) + np.array([0, 0, sign]) for sign in (1, -1, 1, -1)]
    still = judged_visits(errors, names, commanded=square)
    turned = Rotation.from_euler("xyz", [3, -8, 50], degrees=True).as_matrix()
    data = still.campaign.data
    from dataclasses import replace

    moved = replace(data, position=np.asarray(data.position) @ turned.T + [1.0, -2, 0.5])
    found = accept(still.model, moved, draws=0)
    for name in names:
        assert value(found, "AP", name) == pytest.approx(MM, rel=1e-9)
    np.testing.assert_allclose(found.campaign.T_base_world[:3, :3], turned.T, atol=1e-12)


def test_thirty_visits_of_five_poses_are_the_standards_plan() -> None:
    rng = np.random.default_rng(1)
    places = np.vstack([COMMANDED, [[300.0, 300, 300], [600, 600, 0]]])
    names = ["P1", "P2", "P4", "P3", "P5"]
    found = judged_visits([rng.normal(0, 0.01, (30, 3)) for _ in names], names, commanded=places)
    assert found.is_iso_9283
    assert not any("not the plan" in note for note in found.notes)
    few = judged_visits([rng.normal(0, 0.01, (29, 3)) for _ in names], names, commanded=places)
    assert not few.is_iso_9283
    assert any("29 visits" in note for note in few.notes)


def test_the_scatter_of_two_visits_has_a_root_though_it_is_singular() -> None:
    one = np.array([[4.0, 2, 0], [2, 1, 0], [0, 0, 0]])  # of two visits apart along (2, 1, 0)
    many = np.array([[4.0, 2, 0], [2, 5, 6], [0, 6, 25]])
    one_root, many_root = lower_roots(np.array([one, many]))
    np.testing.assert_allclose(one_root @ one_root.T, one, atol=1e-14)
    np.testing.assert_allclose(many_root, [[2, 0, 0], [1, 2, 0], [0, 3, 4]], atol=1e-14)
