# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What controllers write, and that the poses that they compute are never taken for measurements."""

import numpy as np
import pytest

from fastcal import load_measurements, load_robot
from fastcal.errors import InvalidInput, ParseError

from .conftest import P, Q, Session, check, import_measurements

POINTS = ("Name,X [mm],Y [mm],Z [mm]", "{name}," + P)


def with_program(session: Session, name: str, text: str) -> list[str]:
    found = import_measurements([session.table(*POINTS)], joints=session.write(name, text))
    check(found, session)
    assert any("by name" in note for note in found.notes)
    return found.notes


def test_rapid(session: Session) -> None:
    rows = (
        f"  LOCAL CONST jointtarget {n} := [[{', '.join(map(str, q))}],[9E9,9E9,9E9,9E9,9E9,9E9]];"
        for n, q in zip(session.names, session.q, strict=True)
    )
    with_program(session, "poses.mod", "MODULE Poses\n" + "\n".join(rows) + "\nENDMODULE\n")


def test_krl(session: Session) -> None:
    rows = (
        f"DECL E6AXIS X{n}={{A1 {q[0]},A2 {q[1]},A3 {q[2]},A4 {q[3]},A5 {q[4]},A6 {q[5]},E1 0.0,E2 0.0}}"
        for n, q in zip(session.names, session.q, strict=True)
    )
    moves = "\n".join(f"PTP X{n}" for n in session.names)
    with_program(session, "calib.src", "DEF calib()\n" + "\n".join(rows) + f"\n{moves}\nEND\n")


def test_fanuc_names_are_the_comments_of_positions(session: Session) -> None:
    head = "/PROG  C\n/MN\n" + "\n".join(f"  {k}:J P[{k}] 20% FINE ;" for k in range(1, 31)) + "\n/POS\n"
    rows = (
        f'P[{k}:"{n}"]{{\n   GP1:\n\tUF : 0, UT : 1,\n\t'
        + ",\t".join(f"J{j}= {v:.4f} deg" for j, v in enumerate(q, 1))
        + "\n};"
        for k, (n, q) in enumerate(zip(session.names, session.q, strict=True), start=1)
    )
    notes = with_program(session, "C.LS", head + "\n".join(rows) + "\n/END\n")
    assert any("a FANUC shows joint 3 from the horizontal: --robot ROBOT" in note for note in notes)


def test_a_program_of_poses_holds_no_joints(session: Session) -> None:
    text = "MODULE M\nCONST robtarget P1:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nENDMODULE\n"
    with pytest.raises(InvalidInput, match="which a controller computes"):
        import_measurements([session.table(*POINTS)], joints=session.write("m.mod", text))


LOGS = {
    "KUKA": ("NAME A1 A2 A3 A4 A5 A6", "{name} " + Q.replace(",", " ")),
    "KUKA, variables": (
        "Name;$AXIS_ACT.A1;$AXIS_ACT.A2;$AXIS_ACT.A3;$AXIS_ACT.A4;$AXIS_ACT.A5;$AXIS_ACT.A6",
        "{name};" + Q.replace(",", ";"),
    ),
    "RTDE": (
        "name actual_q_0 actual_q_1 actual_q_2 actual_q_3 actual_q_4 actual_q_5",
        "{name} {r[0]:.9f} {r[1]:.9f} {r[2]:.9f} {r[3]:.9f} {r[4]:.9f} {r[5]:.9f}",
    ),
    "a row of units": (
        "Pose\tJoint 1\tJoint 2\tJoint 3\tJoint 4\tJoint 5\tJoint 6\n\t[rad]\t[rad]\t[rad]\t[rad]\t[rad]\t[rad]",
        "{name}\t{r[0]:.9f}\t{r[1]:.9f}\t{r[2]:.9f}\t{r[3]:.9f}\t{r[4]:.9f}\t{r[5]:.9f}",
    ),
    "French": ("Nom;Axe 1 [°];Axe 2 [°];Axe 3 [°];Axe 4 [°];Axe 5 [°];Axe 6 [°]", "{name};" + Q.replace(",", ";")),
    "no header": ("", "{name} " + Q.replace(",", " ")),
    "with velocities": (
        "name,j1,j2,j3,j4,j5,j6,j1_vel,j2_vel,current_j1 [A]",
        "{name}," + Q + ",1,2,0.3",
    ),
}


@pytest.mark.parametrize("layout", LOGS)
def test_a_log_of_joints(session: Session, layout: str) -> None:
    check(import_measurements([session.table(*POINTS)], joints=session.table(*LOGS[layout], "log.txt")), session)


def test_commanded_and_read_positions_are_distinguished(session: Session) -> None:
    head = ",".join([f"target_q_{k}" for k in range(6)] + [f"actual_q_{k}" for k in range(6)])
    row = ",".join([f"{{r[{k}]:.9f}}" for k in range(6)] * 2)
    found = import_measurements([session.table("X [mm],Y [mm],Z [mm]", P)], joints=session.table(head, row, "rtde.csv"))
    check(found, session)
    assert "q6_read_rad" in found.columns


COMPUTED = {
    "RTDE": (
        "actual_q_0,actual_q_1,actual_q_2,actual_q_3,actual_q_4,actual_q_5,actual_TCP_pose_0,actual_TCP_pose_1,actual_TCP_pose_2",
        "{r[0]},{r[1]},{r[2]},{r[3]},{r[4]},{r[5]},{m[0]},{m[1]},{m[2]}",
        "actual_TCP_pose_0",
    ),
    "TCP": ("J1,J2,J3,J4,J5,J6,TCP X [mm],TCP Y [mm],TCP Z [mm]", Q + "," + P, "TCP X"),
    "KUKA": (
        "; $AXIS_ACT, $POS_ACT\nA1 A2 A3 A4 A5 A6 X Y Z A B C",
        Q.replace(",", " ") + " " + P.replace(",", " ") + " 1 2 3",
        "X",
    ),
    "Robot": (
        "Joint 1;Joint 2;Joint 3;Joint 4;Joint 5;Joint 6;Robot X;Robot Y;Robot Z",
        (Q + "," + P).replace(",", ";"),
        "Robot X",
    ),
}


@pytest.mark.parametrize("layout", COMPUTED)
def test_a_pose_of_the_controller_is_no_measurement(session: Session, layout: str) -> None:
    head, row, named = COMPUTED[layout]
    path = session.table(head, row)
    with pytest.raises(InvalidInput, match=named):
        import_measurements([path])
    check(import_measurements([session.table("X [mm],Y [mm],Z [mm]", P, "points.csv")], joints=path), session)


def test_actual_beside_joints_is_asked_about(session: Session) -> None:
    path = session.table("J1,J2,J3,J4,J5,J6,X_act,Y_act,Z_act", Q + "," + P)
    with pytest.raises(InvalidInput, match=r"may be what the controller computes.*--map"):
        import_measurements([path])


def record(session: Session) -> list[tuple[float, np.ndarray]]:
    """Time and joints [rad] at 25 Hz: two seconds at each pose, half a second between."""
    rows: list[tuple[float, np.ndarray]] = []
    for here, there in zip(session.q, [*session.q[1:], session.q[-1]], strict=True):
        stretch = [here] * 50 + [here + (there - here) * part for part in np.linspace(0.05, 0.95, 12)]
        rows += [(1.7e9 + 0.04 * (len(rows) + k), np.radians(q)) for k, q in enumerate(stretch)]
    return rows


UR_JOINTS = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
]
ALPHABETICAL = sorted(range(6), key=lambda k: UR_JOINTS[k])


def plotjuggler(session: Session) -> str:
    head = ",".join(["__time", *(f"/joint_states/{UR_JOINTS[k]}/position" for k in ALPHABETICAL)])
    return "\n".join(
        [head, *(",".join([f"{t:.6f}", *(f"{q[k]:.9f}" for k in ALPHABETICAL)]) for t, q in record(session))]
    )


def echoed(session: Session) -> str:
    out = ""
    for t, q in record(session):
        out += f"header:\n  stamp:\n    sec: {int(t)}\n    nanosec: {round((t % 1) * 1e9)}\n  frame_id: ''\nname:\n"
        out += "".join(f"- {UR_JOINTS[k]}\n" for k in ALPHABETICAL) + "position:\n"
        out += "".join(f"- {q[k]:.9f}\n" for k in ALPHABETICAL) + "velocity: []\neffort: []\n---\n"
    return out


def echoed_csv(session: Session) -> str:
    return "\n".join(
        ",".join(
            [
                str(int(t)),
                str(round((t % 1) * 1e9)),
                "",
                *(UR_JOINTS[k] for k in ALPHABETICAL),
                *(f"{q[k]:.9f}" for k in ALPHABETICAL),
                *["0.0"] * 12,
            ]
        )
        for t, q in record(session)
    )


def rostopic(session: Session) -> str:
    head = ",".join(["%time", *(f"field.name{k}" for k in range(6)), *(f"field.position{k}" for k in range(6))])
    rows = (
        ",".join([f"{t * 1e9:.0f}", *(UR_JOINTS[k] for k in ALPHABETICAL), *(f"{q[k]:.9f}" for k in ALPHABETICAL)])
        for t, q in record(session)
    )
    return "\n".join([head, *rows])


@pytest.mark.parametrize("writer", [plotjuggler, echoed, echoed_csv, rostopic])
def test_ros_joint_states_join_by_time(session: Session, writer) -> None:
    # 62 samples of 0.04 s a pose; one second into each standstill.
    row = "{name}," + P
    lines = [
        row.format(name=n, p=p) + f",{1.7e9 + 2.48 * k + 1.0:.3f}"
        for k, (n, p) in enumerate(zip(session.names, session.points, strict=True))
    ]
    points = session.write("points.csv", "\n".join(["Name,X [mm],Y [mm],Z [mm],Time", *lines]))
    found = import_measurements([points], joints=session.write("joint_states.csv", writer(session)))
    check(found, session)
    assert any("by time" in note for note in found.notes)


def test_a_point_taken_while_the_arm_moved_is_left_out_and_named(session: Session) -> None:
    times = [1.7e9 + 2.48 * k + (2.2 if k == 6 else 1.0) for k in range(30)]
    lines = [f"{n},{p[0]},{p[1]},{p[2]},{t:.3f}" for n, p, t in zip(session.names, session.points, times, strict=True)]
    points = session.write("points.csv", "\n".join(["Name,X [mm],Y [mm],Z [mm],Time", *lines]))
    found = import_measurements([points], joints=session.write("j.csv", plotjuggler(session)))
    check(found, session, rows=[k for k in range(30) if k != 6])
    assert any("while the arm moved" in note and "P007" in note for note in found.notes)


def test_a_clock_of_another_zone_is_corrected_and_reported(session: Session) -> None:
    times = [1.7e9 + 3600 + 2.48 * k + 1.0 for k in range(30)]
    lines = [f"{n},{p[0]},{p[1]},{p[2]},{t:.3f}" for n, p, t in zip(session.names, session.points, times, strict=True)]
    points = session.write("points.csv", "\n".join(["Name,X [mm],Y [mm],Z [mm],Time", *lines]))
    found = import_measurements([points], joints=session.write("j.csv", plotjuggler(session)))
    check(found, session)
    assert any("-1 h" in note for note in found.notes)


def test_a_record_without_a_common_clock_is_reduced_to_standstills(session: Session) -> None:
    points = session.table("Name,X [mm],Y [mm],Z [mm]", "{name}," + P)
    found = import_measurements([points], joints=session.write("j.csv", plotjuggler(session)), robot=load_robot("ur5"))
    check(found, session)
    assert any("30 standstills" in note for note in found.notes)
    assert any("no row has slipped" in note for note in found.notes)


def test_an_export_that_names_joints_as_fastcal_does_is_read_by_calibrate_too(session: Session) -> None:
    head = ",".join([f"j{k}_deg" for k in range(1, 7)]) + ",tx_m,ty_m,tz_m"
    path = session.table(head, Q + ",{m[0]},{m[1]},{m[2]}", "poses.csv")
    data = load_measurements(path, load_robot("ur5"))
    assert data.position is not None
    assert np.isfinite(data.position).all()
    spoilt = session.table(head.replace("m,", "furlong,"), Q + ",{m[0]},{m[1]},{m[2]}", "spoilt.csv")
    with pytest.raises(ParseError, match="holds nothing measured"):
        load_measurements(spoilt, load_robot("ur5"))
