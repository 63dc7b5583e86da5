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
COMMANDED = np.array([[0.0, 0, 0], [600, 0, 0], [0, 800, 0]])  # mm; P1, P2, P4: apart by 600, 800 and 1000


def rotation_z(angles: Array) -> Array:
    half = np.atleast_1d(angles) / 2
    return np.column_stack([np.cos(half), 0 * half, 0 * half, np.sin(half)])


def judged_visits(
    errors: list[Array],
    names: list[str],
    *,
    directions: list[str] | None = None,
    turns: list[Array] | None = None,
    times: list[Array] | None = None,
    commanded: Array = COMMANDED,
) -> Acceptance:
    """An acceptance without alignment: errors [mm] of the visits of each station, turns about z [rad]."""
    robot = fastcal.load_robot("ur5")
    counts = [len(e) for e in errors]
    at = {name: commanded[i] for i, name in enumerate(dict.fromkeys(names))}
    targets = np.repeat([at[name] for name in names], counts, axis=0)
    extra = {f"target_{axis}_mm": targets[:, i] for i, axis in enumerate("xyz")}
    extra |= {"target_qw": np.ones(sum(counts))} | {f"target_q{a}": np.zeros(sum(counts)) for a in "xyz"}
    labels = {"pose": np.repeat(names, counts).tolist()}
    if directions:
        labels["direction"] = np.repeat(directions, counts).tolist()
    data = Dataset.from_arrays(
        np.repeat(0.1 * np.arange(len(names))[:, np.newaxis] * np.ones(6), counts, axis=0),
        position=MM * (targets + np.concatenate(errors)),
        rotation=None if turns is None else rotation_z(np.concatenate(turns)),
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


def test_orientation_has_a_mean_and_three_deviations() -> None:
    """Turns about z of 1, 2, 3, 4, 5 mrad: mean 3, S^2 = 10 / 4."""
    found = judged_visits([VISITS], ["P1"], turns=[1e-3 * np.arange(1.0, 6)])
    assert value(found, "AP_rz", "P1") == pytest.approx(3e-3, rel=1e-9)
    assert value(found, "RP_rz", "P1") == pytest.approx(3e-3 * math.sqrt(2.5), rel=1e-9)
    assert value(found, "AP_rx", "P1") == pytest.approx(0, abs=1e-12)


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
