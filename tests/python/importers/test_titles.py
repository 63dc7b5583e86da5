# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Titles as shops of other countries and other makers write them, and titles that are no coordinates."""

import pytest

from fastcal.errors import InvalidInput

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


@pytest.mark.parametrize("titles", ["Azimuth [deg],Elevation [deg],Distance [mm]", "Hz,V,SD"])
def test_the_angles_of_an_instrument_are_not_coordinates(session: Session, titles: str) -> None:
    path = session.table(f"Point,{titles}", "{name},12.5,-3.25,3000.1")
    with pytest.raises(InvalidInput, match=r"are angles of the instrument: export Cartesian coordinates"):
        import_measurements([path], joints=session.joints())
