# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows that are wrong are told at once, right ones are not; the uncertainty falls and is honest; nothing is lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.errors import InvalidInput, ParseError
from fastcal.live import LiveSession


def fed(session: LiveSession, header: str, rows: list[str]) -> list[str]:
    session.begin(header)
    return [session.add(row).text for row in rows]


def test_a_dropped_beam_and_a_slip_are_told_at_once(simulated: Any, shift: Any, tmp_path: Path) -> None:
    session = LiveSession(simulated.robot, tmp_path, goal=1e-4)
    said = fed(session, *simulated.text(shift))
    assert said[15].startswith("dropped beam: no point was measured")
    assert said[25].startswith("slip: 1.14 mm off where 0.2")
    assert [k for k, text in enumerate(said) if text != "ok"] == [15, 25]
    assert session.kept == [k for k in range(40) if k not in (15, 25)]
    assert len((tmp_path / "measurements.csv").read_text().splitlines()) == 39
    kept = fastcal.load_measurements(tmp_path / "measurements.csv", simulated.robot)
    assert np.allclose(kept.position, simulated.data.position[session.kept], atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_right_rows_are_not_refused(seed: int, lines_of: Any, tmp_path: Path) -> None:
    lines = lines_of(["ur5", "staubli_rx160l", "kuka_kr6_r900", "lbr_iiwa7"][seed], seed)
    session = LiveSession(lines.robot, tmp_path)
    assert [text for text in fed(session, *lines.text()) if text != "ok"] == []


def test_the_sigma_falls_and_is_as_large_as_the_error(simulated: Any, tmp_path: Path) -> None:
    """Held against the true arm over the workspace; 30 parameters of one draw scatter, so within a factor of two."""
    session = LiveSession(simulated.robot, tmp_path, goal=1e-4, sigma=3e-5)
    header, rows = simulated.text()
    fed(session, header, rows)
    deviations = [value for _, value in session.history]
    assert deviations[-1] < deviations[10] / 1.5 < deviations[3] / 10
    assert session.is_enough
    assert session.rows_to_go == 0
    assert session.belief is not None
    true = fastcal.perturbed(simulated.robot, seed=3)
    pool = session.workspace.pool
    off = session.belief.predicted(pool)[0] - true.forward(pool.q)[:, :3, 3]
    assert 0.5 < np.sqrt(np.mean(off**2)) / deviations[-1] < 2.0


def test_of_a_few_rows_it_is_not_said_how_many_are_missing(simulated: Any, tmp_path: Path) -> None:
    """Their variance falls much faster than with one over their number: 4 rows asked for more than 20,000."""
    session = LiveSession(simulated.robot, tmp_path, goal=1e-4, sigma=3e-5)
    header, rows = simulated.text()
    fed(session, header, rows[:4])
    assert session.deviation is not None
    assert 4 * ((session.deviation / 1e-4) ** 2 - 1) > 1000
    assert session.rows_to_go is None


def test_the_next_pose_is_worth_more_than_others(simulated: Any, tmp_path: Path) -> None:
    session = LiveSession(simulated.robot, tmp_path)
    header, rows = simulated.text()
    fed(session, header, rows[:12])
    named = session.next_pose()
    assert named is not None
    assert named.after is not None
    assert named.after < session.history[-1][1]
    assert session.belief is not None
    targets = session.belief.derivatives(session.workspace.pool)
    gains = session.belief.gains(targets, targets)
    own = session.belief.gains(session.belief.derivatives(fastcal.Dataset.from_arrays(named.q[np.newaxis])), targets)
    assert own[0] == pytest.approx(gains.max())
    assert gains.max() > 1.5 * np.median(gains)
    # The gain is what measuring there does to the variance that the belief reports.
    assert named.after == pytest.approx(np.sqrt(session.belief.deviation(targets) ** 2 - own[0]))


def test_the_gain_is_the_fall_of_the_variance(simulated: Any, tmp_path: Path) -> None:
    session = LiveSession(simulated.robot, tmp_path)
    header, rows = simulated.text()
    fed(session, header, rows[:12])
    belief = session.belief
    assert belief is not None
    targets = belief.derivatives(session.workspace.pool)
    J = belief.derivatives(belief.data).reshape(-1, targets.shape[2])
    more = np.vstack([J, targets[7]])
    B = targets.reshape(-1, targets.shape[2])

    def variance(rows: Any) -> float:
        C = np.linalg.inv(rows.T @ rows + np.diag(belief.known))
        return float((belief.scale * belief.sigma) ** 2 * np.trace(C @ B.T @ B) / len(B))

    fall = variance(J) - variance(more)
    assert belief.gains(targets[7:8], targets)[0] == pytest.approx(fall, rel=1e-6)
    assert belief.deviation(targets) ** 2 == pytest.approx(variance(J), rel=1e-9)


def test_joints_of_another_pose_are_told(simulated: Any, tmp_path: Path) -> None:
    q = simulated.data.q.copy()
    q[20] = q[12] + 0.0  # the controller's log was read one program line too early
    session = LiveSession(simulated.robot, tmp_path)
    said = fed(session, *simulated.text(q=q))
    assert said[20].startswith("wrong pose")
    assert [k for k, text in enumerate(said) if text != "ok"] == [20]


def test_joints_that_were_not_read_again_are_told(simulated: Any, tmp_path: Path) -> None:
    q = simulated.data.q.copy()
    q[20] = q[19]
    said = fed(LiveSession(simulated.robot, tmp_path), *simulated.text(q=q))
    assert said[20].startswith("wrong pose: the joints are those of row 19")


def test_a_point_of_a_planned_pose_is_named(simulated: Any, tmp_path: Path) -> None:
    q = simulated.data.q.copy()
    plan = fastcal.Dataset.from_arrays(q)
    swapped = q.copy()
    swapped[20] = q[30] + 0.3  # joints that are none of the plan; the point is that of planned pose 21
    said = fed(LiveSession(simulated.robot, tmp_path, plan=plan), *simulated.text(q=swapped))
    assert said[20].startswith("wrong pose: the point lies where planned pose 21 is")


def test_a_point_that_is_repeated_is_a_dropped_beam(simulated: Any, tmp_path: Path) -> None:
    header, rows = simulated.text()
    cells = rows[9].split(",")
    cells[6:9] = rows[8].split(",")[6:9]
    session = LiveSession(simulated.robot, tmp_path)
    said = fed(session, header, [*rows[:9], ",".join(cells)])
    assert said[-1].startswith("dropped beam: the point is still that of row 8")


def test_an_early_row_that_was_wrong_is_found_by_those_that_follow(simulated: Any, tmp_path: Path) -> None:
    shift = np.zeros((40, 3))
    shift[2] = [0.02, 0.0, -0.01]
    session = LiveSession(simulated.robot, tmp_path)
    said = fed(session, *simulated.text(shift))
    assert any("row 2: slip, seen later" in text for text in said)
    assert 2 not in session.kept
    assert len(session.kept) >= 38


def test_a_session_goes_on_where_it_ended(simulated: Any, shift: Any, tmp_path: Path) -> None:
    header, rows = simulated.text(shift)
    first = LiveSession(simulated.robot, tmp_path)
    fed(first, header, rows[:30])
    first.decide(25, "keep")
    with (tmp_path / "arrived.csv").open("a") as file:
        file.write(rows[30][:20])  # the program was killed amid a row that was never answered
    again = LiveSession(simulated.robot, tmp_path)
    assert again.kept == first.kept
    assert 25 in again.kept
    assert fed(again, header, rows[30:]) == ["ok"] * 10
    assert (tmp_path / "arrived.csv").read_text().splitlines() == [header, *rows]


def test_a_person_has_the_last_word(simulated: Any, shift: Any, tmp_path: Path) -> None:
    session = LiveSession(simulated.robot, tmp_path)
    header, rows = simulated.text(shift)
    fed(session, header, rows)
    session.decide(3, "leave")
    session.decide(25, "keep")
    assert 3 not in session.kept
    assert 25 in session.kept
    with pytest.raises(InvalidInput, match="expected keep or leave"):
        session.decide(99, "keep")


def test_a_plan_that_is_done_names_no_pose(simulated: Any, tmp_path: Path) -> None:
    header, rows = simulated.text()
    session = LiveSession(simulated.robot, tmp_path, plan=fastcal.Dataset.from_arrays(simulated.data.q[:8]))
    first = session.next_pose()
    assert first is not None
    assert first.planned == 0
    fed(session, header, rows[:8])
    assert session.next_pose() is None


@pytest.mark.parametrize(
    ("header", "error"),
    [
        ("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg", "expected measured points"),
        ("x_mm,y_mm,z_mm", "expected joint positions"),
        ("q1,x_mm,y_mm,z_mm", "q1"),
    ],
)
def test_a_header_that_will_not_do_is_refused(simulated: Any, tmp_path: Path, header: str, error: str) -> None:
    with pytest.raises(ParseError, match=error):
        LiveSession(simulated.robot, tmp_path).begin(header)


def test_a_row_that_cannot_be_read_is_told_and_kept_as_it_came(simulated: Any, tmp_path: Path) -> None:
    header, rows = simulated.text()
    session = LiveSession(simulated.robot, tmp_path)
    said = fed(session, header, [rows[0], "1,2,3", rows[1].replace(".", "x", 1)])
    assert said[0] == "ok"
    assert said[1].startswith("expected 9 cells as the header has, got 3")
    assert "expected a number" in said[2]
    assert len((tmp_path / "arrived.csv").read_text().splitlines()) == 4
    assert len((tmp_path / "measurements.csv").read_text().splitlines()) == 2
    with pytest.raises(InvalidInput, match="expected the header of this session"):
        session.begin(header.replace("x_mm", "x_m"))
