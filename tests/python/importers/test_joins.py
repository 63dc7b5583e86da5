# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joins of joints and points: names, orders, and the robot that finds rows that are missing, extra or swapped."""

import os
from dataclasses import dataclass

import numpy as np
import pytest

from fastcal import load_robot, robots, simulate
from fastcal.calibration.simulation import perturbed, random_poses
from fastcal.errors import InvalidInput
from fastcal.importers.names import pairs_by_name
from fastcal.importers.pairing import pair_by_robot
from fastcal.importers.sequence import matched

from .conftest import P, Q, Session, check, import_measurements

IN_ORDER = [(0, 0), (1, 1), (2, 2)]


@pytest.mark.parametrize(
    ("poses", "points", "expected"),
    [
        (["P001", "P002", "P003"], ["p1", "P 2", "p_003"], IN_ORDER),
        (["P1", "P2", "P3"], ["SMR_3", "SMR_1", "SMR_2"], [(0, 1), (1, 2), (2, 0)]),
        (["P1", "P2", "P3"], ["1", "2", "3"], IN_ORDER),
        (["P1", "P2", "P3"], ["0", "1", "2"], None),  # where a counter begins says nothing
        (["P1", "P2", "P3", "P4"], ["Point 1", "Point 2", "Point 3"], None),  # a counter does not know what is missing
        (["P1", "P2", "P4"], ["Point 1", "Point 2", "Point 4"], IN_ORDER),
        (["a", "b", "c"], ["x", "y", "z"], None),
        (["P1", "P2"], ["P1", "P1", "P2", "P2"], [(0, 0), (0, 1), (1, 2), (1, 3)]),  # measured twice
        (["P1", "P1", "P2"], ["P1", "P1", "P2"], IN_ORDER),  # visited twice
    ],
)
def test_names(poses: list[str], points: list[str], expected: list[tuple[int, int]] | None) -> None:
    found = pairs_by_name(poses, points)
    assert (None if found is None else found.pairs) == expected


def test_sequences_are_matched_at_the_least_cost() -> None:
    """Against all ways of pairing five with four entries in order."""
    from itertools import combinations

    rng = np.random.default_rng(0)
    for _ in range(20):
        distance = rng.uniform(0, 2, (5, 4))
        costs = {
            tuple(zip(rows, columns, strict=True)): sum(
                (distance[i, j]) ** 2 for i, j in zip(rows, columns, strict=True)
            )
            + 0.6 * (9 - 2 * size)
            for size in range(5)
            for rows in combinations(range(5), size)
            for columns in combinations(range(4), size)
            if all(distance[i, j] <= 1 for i, j in zip(rows, columns, strict=True))
        }
        assert tuple(matched(distance, 1.0)) == min(costs, key=lambda pairs: costs[pairs])


@dataclass(frozen=True)
class Joined:
    """How a simulated join ended: rows that were joined wrongly, rightly, and those that could be right."""

    wrong: int
    right: int
    possible: int
    refused: bool


def simulated_join(seed: int) -> Joined:
    """0 to 3 rows missing from either list, extra, measured twice or swapped; an arm that is not quite nominal."""
    rng = np.random.default_rng(seed)
    names = robots.serial()
    robot = load_robot(names[seed % len(names)])
    count = int(rng.choice([20, 40, 60, 120]))
    q = random_poses(robot, count, seed=seed)
    position = simulate(perturbed(robot, seed=seed), q, noise=5e-5, seed=seed).position
    assert position is not None
    poses, owner, points = list(range(count)), list(range(count)), list(position)
    for _ in range(int(rng.integers(0, 4))):
        k = int(rng.integers(0, len(points) - 1))
        kind = rng.choice(["point missing", "pose missing", "extra", "twice", "swapped"])
        if kind == "point missing":
            del points[k], owner[k]
        elif kind == "pose missing":
            del poses[min(k, len(poses) - 1)]
        elif kind == "swapped":
            points[k : k + 2], owner[k : k + 2] = points[k : k + 2][::-1], owner[k : k + 2][::-1]
        else:
            points.insert(
                k, points[k] + rng.normal(0, 5e-5, 3) if kind == "twice" else position.mean(0) + rng.normal(0, 0.2, 3)
            )
            owner.insert(k, owner[k] if kind == "twice" else -1)
    expected = [(i, i) for i in range(len(points))] if len(points) == len(poses) else None
    found = pair_by_robot(robot, q[poses], np.array(points), expected)
    possible = len(set(owner) & set(poses))
    if found is None:
        return Joined(0, 0, possible, refused=True)
    wrong = sum(owner[j] != poses[i] for i, j in found.pairs)
    return Joined(wrong, len(found.pairs) - wrong, possible, refused=False)


def test_no_join_is_wrong_and_right_rows_are_kept() -> None:
    count = 200 if os.environ.get("FASTCAL_TEST_FULL") else 12
    joins = [simulated_join(seed) for seed in range(count)]
    assert sum(join.wrong for join in joins) == 0
    assert sum(join.right for join in joins) >= 0.95 * sum(join.possible for join in joins)
    assert sum(join.refused for join in joins) <= 0.05 * count


def points_of(session: Session, rows: list[int], names: bool = False) -> str:
    lines = [(f"{session.names[k]}," if names else "") + P.format(p=session.points[k]) for k in rows]
    return "\n".join([("Name," if names else "") + "X [mm],Y [mm],Z [mm]", *lines])


def bare_joints(session: Session):
    return session.table("J1 [deg],J2 [deg],J3 [deg],J4 [deg],J5 [deg],J6 [deg]", Q, "joints.csv")


def test_different_counts_without_names_need_the_robot(session: Session) -> None:
    rows = [k for k in range(30) if k not in (4, 17)]
    points = session.write("points.csv", points_of(session, rows))
    with pytest.raises(InvalidInput, match=r"28 points and 30 poses.*--robot"):
        import_measurements([points], joints=bare_joints(session))
    found = import_measurements([points], joints=bare_joints(session), robot=load_robot("ur5"))
    check(found, session, rows=rows)
    assert any("poses missing a point that fits: row 5, row 18" in note for note in found.notes)


def test_a_slip_under_equal_counts_is_corrected_and_reported(session: Session) -> None:
    rows = [k for k in range(30) if k != 11]
    extra = P.format(p=[1.0, 2.0, 3.0])
    points = session.write("points.csv", points_of(session, rows) + "\n" + extra)
    found = import_measurements([points], joints=bare_joints(session), robot=load_robot("ur5"))
    check(found, session, rows=rows)
    assert any("slipped, mended" in note and "row 12" in note and "row 30" in note for note in found.notes)


def test_swapped_names_are_found_by_the_robot(session: Session) -> None:
    rows = [0, 1, 3, 2, *range(4, 30)]
    lines = [f"{session.names[k]},{P.format(p=session.points[row])}" for k, row in enumerate(rows)]
    points = session.write("points.csv", "\n".join(["Name,X [mm],Y [mm],Z [mm]", *lines]))
    found = import_measurements([points], joints=session.joints(), robot=load_robot("ur5"))
    check(found, session)
    assert any("swapped" in note for note in found.notes)


def test_a_join_that_fits_is_reported_to_fit(session: Session) -> None:
    points = session.write("points.csv", points_of(session, list(range(30)), names=True))
    found = import_measurements([points], joints=session.joints(), robot=load_robot("ur5"))
    check(found, session)
    assert any("no row has slipped" in note for note in found.notes)


def test_another_robot_is_refused(session: Session) -> None:
    points = session.write("points.csv", points_of(session, list(range(30))))
    with pytest.raises(InvalidInput, match="do not fit this robot"):
        import_measurements([points], joints=bare_joints(session), robot=load_robot("staubli_rx160l"))


def test_names_in_one_list_only_are_left_out_and_named(session: Session) -> None:
    points = session.write("points.csv", points_of(session, [*range(5), *range(6, 30)], names=True) + "\nDRIFT_1,1,2,3")
    found = import_measurements([points], joints=session.joints())
    check(found, session, rows=[*range(5), *range(6, 30)])
    said = "; ".join(found.notes)
    assert "DRIFT_1" in said
    assert "P006" in said


def test_joints_and_points_may_both_be_exports(session: Session) -> None:
    points = session.write("points.csv", points_of(session, list(range(30)), names=True))
    check(import_measurements([points, session.joints()]), session)


def test_points_alone_ask_for_the_joints(session: Session) -> None:
    with pytest.raises(InvalidInput, match=r"30 measured points and no joints.*--joints"):
        import_measurements([session.write("points.csv", points_of(session, list(range(30))))])
