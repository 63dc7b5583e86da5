# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Titles as shops of other countries and other makers write them, and titles that are no coordinates."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fastcal.errors import InvalidInput, ParseError

from .conftest import P, Q, Session, check, import_measurements

ROW = "{name}," + Q + "," + P
JOINTS = {
    "Italian": "Giunto {}",
    "Spanish": "Articulación {}",
    "French": "Articulation {} (°)",
    "Portuguese": "Junta {}",
    "Brazilian": "Eixo {}",
    "Czech": "Osa {}",
    "Polish": "Oś {}",
    "Chinese": "关节{}角度(°)",
    "Chinese axis": "轴{}",
    "Japanese": "関節{}",
    "Kawasaki": "JT{}",
    "ABB": "rax_{}",
}


@pytest.mark.parametrize("language", JOINTS)
def test_joints_have_their_name_in_each_language(session: Session, language: str) -> None:
    titles = ",".join(JOINTS[language].format(k) for k in range(1, 7))
    check(import_measurements([session.table(f"Name,{titles},X,Y,Z", ROW)]), session)


def test_the_axes_of_a_yaskawa_have_letters(session: Session) -> None:
    check(import_measurements([session.table("Name,S,L,U,R,B,T,X,Y,Z", ROW)]), session)


@pytest.mark.parametrize("titles", ["PosX [mm],PosY [mm],PosZ [mm]", "Xcoord,Ycoord,Zcoord", "X坐标,Y坐标,Z坐标"])
def test_coordinates_have_a_word_beside_their_letter(session: Session, titles: str) -> None:
    check(import_measurements([session.table(f"Name,J1,J2,J3,J4,J5,J6,{titles}", ROW)]), session)


def test_a_quaternion_may_begin_with_q0(session: Session) -> None:
    """As NDI's trackers write it: the scalar is no joint, and comes first."""
    scalar_first = "{w[3]:.8f},{w[0]:.8f},{w[1]:.8f},{w[2]:.8f}"
    path = session.table("Frame,Tool,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error", "{k},87,OK," + scalar_first + "," + P + ",0.1")
    check(import_measurements([path], joints=session.joints()), session, turned=True)


def test_q0_to_q3_of_length_1_are_a_quaternion(session: Session) -> None:
    """As Leica's Tracker Pilot exports a probe; the joints come from the controller."""
    turned = "{w[3]:.6f},{w[0]:.6f},{w[1]:.6f},{w[2]:.6f}"
    titles = "X  [mm],Y  [mm],Z  [mm],U(95)  [mm],Tilt  [deg],Q0 ,Q1 ,Q2 ,Q3 ,Temperature  [°C]"
    path = session.table(titles, P + ",0.01,29.9," + turned + ",22.8")
    check(import_measurements([path], joints=session.joints()), session, turned=True)


def test_four_joints_are_no_quaternion(session: Session) -> None:
    path = session.table(
        "Q0 [deg],Q1 [deg],Q2 [deg],Q3 [deg],X,Y,Z", "{q[0]:.3f},{q[1]:.3f},{q[2]:.3f},{q[3]:.3f}," + P
    )
    assert import_measurements([path]).joints == 4


@pytest.mark.parametrize("titles", ["Azimuth [deg],Elevation [deg],Distance [mm]", "Hz,V,SD"])
def test_the_angles_of_an_instrument_are_not_coordinates(session: Session, titles: str) -> None:
    path = session.table(f"Point,{titles}", "{name},12.5,-3.25,3000.1")
    with pytest.raises(InvalidInput, match=r"are angles of the instrument: export Cartesian coordinates"):
        import_measurements([path], joints=session.joints())


@pytest.mark.parametrize(
    ("titles", "by_columns"),
    [
        ("nx,ny,nz,ox,oy,oz,ax,ay,az,px,py,pz", True),
        ("m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23", False),
    ],
)
def test_a_pose_may_be_the_top_of_a_matrix(session: Session, titles: str, by_columns: bool) -> None:
    """Of four rows and columns, the points in millimetres: written column by column, or row by row."""
    R = Rotation.from_quat(session.xyzw).as_matrix()
    top = np.concatenate([R, session.points[:, :, np.newaxis]], axis=2)
    lines = [
        ",".join(f"{v:.8f}" for v in [*q, *(pose.T if by_columns else pose).ravel()])
        for q, pose in zip(session.q, top, strict=True)
    ]
    path = session.write("poses.csv", "\n".join([f"J1,J2,J3,J4,J5,J6,{titles}", *lines]))
    check(import_measurements([path]), session, turned=True)


def test_german_angles_are_roll_pitch_and_yaw(session: Session) -> None:
    lines = [
        ",".join(f"{v:.6f}" for v in [*q, *p, *turn])
        for q, p, turn in zip(session.q, session.points, session.euler("ZYX"), strict=True)
    ]
    head = "A1,A2,A3,A4,A5,A6,X,Y,Z,Gierwinkel [°],Nickwinkel [°],Rollwinkel [°]"
    check(import_measurements([session.write("p.csv", "\n".join([head, *lines]))]), session, turned=True)


def test_temperature_and_payload_are_known_by_word_and_unit(session: Session) -> None:
    path = session.table("J1,J2,J3,J4,J5,J6,X,Y,Z,Temperatur [°C],Traglast [kg]", Q + "," + P + ",22.5,{k}")
    columns = import_measurements([path]).columns
    np.testing.assert_array_equal(columns["temperature_c"], 22.5)
    np.testing.assert_array_equal(columns["payload_kg"], np.arange(1.0, 31))


def test_columns_that_are_not_known_are_named(session: Session) -> None:
    """Phi, theta and psi could be an orientation."""
    path = session.table("J1,J2,J3,J4,J5,J6,X,Y,Z,phi,theta,psi,remark", Q + "," + P + ",1,2,3,fine")
    (said,) = [note for note in import_measurements([path]).notes if "left out" in note]
    assert said == f"columns of {path} that are not known are left out: 'phi', 'theta', 'psi', 'remark'"


LOGS = {
    "KUKA": "P{k:03d} {{A1 {q[0]:.4f},A2 {q[1]:.4f},A3 {q[2]:.4f},A4 {q[3]:.4f},A5 {q[4]:.4f},A6 {q[5]:.4f}}} "
    "{{X {p[0]:.4f},Y {p[1]:.4f},Z {p[2]:.4f}}}",
    "equal signs": "P{k:03d} J1={q[0]:.4f} J2={q[1]:.4f} J3={q[2]:.4f} J4={q[3]:.4f} J5={q[4]:.4f} J6={q[5]:.4f} "
    "X={p[0]:.4f} Y={p[1]:.4f} Z={p[2]:.4f}",
    "colons, no name": "J1: {q[0]:.4f}; J2: {q[1]:.4f}; J3: {q[2]:.4f}; J4: {q[3]:.4f}; J5: {q[4]:.4f}; "
    "J6: {q[5]:.4f}; X: {p[0]:.4f}; Y: {p[1]:.4f}; Z: {p[2]:.4f}",
}


@pytest.mark.parametrize("log", LOGS)
def test_every_value_may_stand_behind_its_name(session: Session, log: str) -> None:
    found = import_measurements([session.table("", LOGS[log], "poses.log")])
    check(found, session)
    assert (found.names is None) == (log == "colons, no name")


def test_a_line_with_other_values_is_an_error(session: Session) -> None:
    path = session.table("", LOGS["equal signs"], "poses.log")
    path.write_text(path.read_text().replace("J4=", "E1=", 25).replace("E1=", "J4=", 24))
    with pytest.raises(ParseError, match=r"poses.log:25: expected the values J1, .*, got .*E1"):
        import_measurements([path])


def test_a_convention_that_is_not_known_is_refused(session: Session) -> None:
    with pytest.raises(InvalidInput, match=r"expected rpy, .*, got 'XYZ'"):
        import_measurements([session.table("J1,J2,J3,J4,J5,J6,X,Y,Z", Q + "," + P)], orientation="XYZ")
