# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What trackers and motion capture write, in more layouts than one each."""

import numpy as np
import pytest

from fastcal.errors import InvalidInput

from .conftest import P, Session, check, import_measurements

LISTS = {
    "SpatialAnalyzer, blanks, no comments": ("", "A Robot_SMR {name} {p[0]:.4f} {p[1]:.4f} {p[2]:.4f}"),
    "SpatialAnalyzer, metres": (
        "// SpatialAnalyzer 2019\n// Units: Meters\n// Collection, Group, Target, X, Y, Z",
        "A, SMR, {name}, {m[0]:.7f}, {m[1]:.7f}, {m[2]:.7f}",
    ),
    "SpatialAnalyzer, time stamps": (
        "// Working Frame: A::WORLD\n// Group, Target, X, Y, Z, Timestamp",
        "SMR, {name}, " + P + ", 2026/03/02 10:41:{k:02d}",
    ),
    "PolyWorks, decimal commas": (
        "PolyWorks|Inspector\n\nName;Nom X;Nom Y;Nom Z;Meas X;Meas Y;Meas Z;Dev X;Dev Y;Dev Z",
        "{name};1,0;2,0;3,0;{p[0]:.4f};{p[1]:.4f};{p[2]:.4f};0,1;0,1;0,1",
    ),
    "groups above": ("Point,Nominal,,,Measured,,\nName,X,Y,Z,X,Y,Z", "{name},1,2,3," + P),
    "Leica, a semicolon": (
        "Point ID;Easting;X [m];Y [m];Z [m];RMS Total [mm]",
        "{name};1;{m[0]:.7f};{m[1]:.7f};{m[2]:.7f};0.01",
    ),
    "API, millimetres": (
        "API Radian\nNo.\tName\tX(mm)\tY(mm)\tZ(mm)\tStd(mm)",
        "{k}\t{name}\t{p[0]:.4f}\t{p[1]:.4f}\t{p[2]:.4f}\t.01",
    ),
    "Metrolog, English": (
        "Name;Measured X;Measured Y;Measured Z;Theoretical X;Theoretical Y;Theoretical Z",
        "{name};" + P.replace(",", ";") + ";1;2;3",
    ),
    "German": (
        "Messpunkt;Ist X;Ist Y;Ist Z;Soll X;Soll Y;Soll Z;Abw X;Abw Y;Abw Z",
        "{name};" + P.replace(",", ";") + ";1;2;3;0;0;0",
    ),
    "inches": ("Point,X [in],Y [in],Z [in]", "{name},{i[0]:.7f},{i[1]:.7f},{i[2]:.7f}"),
    "centimetres": ("Point,X (cm),Y (cm),Z (cm)", "{name},{c[0]:.6f},{c[1]:.6f},{c[2]:.6f}"),
    "DIN": ("Point;X / mm;Y / mm;Z / mm", "{name};" + P.replace(",", ";")),
    "a comment as header": ("# name x_mm y_mm z_mm", "{name} " + P.replace(",", " ")),
}


@pytest.mark.parametrize("layout", LISTS)
def test_a_list_of_points_joins_the_joints_by_name(session: Session, layout: str) -> None:
    head, row = LISTS[layout]
    row = row.replace("{i[", "{p[").replace("{c[", "{p[") if "inches" not in layout and "centi" not in layout else row
    if "inches" in layout or "centi" in layout:
        scale, key = (25.4, "i") if "inches" in layout else (10.0, "c")
        lines = [row.format(name=n, **{key: p / scale}) for n, p in zip(session.names, session.points, strict=True)]
        path = session.write("points.csv", "\n".join([head, *lines]))
    else:
        path = session.table(head, row, "points.txt")
    if "decimal commas" in layout:
        path.write_text(path.read_text().replace(".", ","))
    found = import_measurements([path], joints=session.joints())
    check(found, session)
    assert any("by name" in note for note in found.notes)


@pytest.mark.parametrize(
    "titles", ["ACTUAL      NOMINAL     DEVIATION", "NOMINAL  ACTUAL  DEVIATION", "SOLL  IST  ABW"]
)
def test_a_report_by_feature_gives_what_was_measured(session: Session, titles: str) -> None:
    place = next(k for k, word in enumerate(titles.split()) if word in ("ACTUAL", "IST"))
    text = "FARO CAM2 Measure 10\nUnits: MM / DEG\n"
    for name, point in zip(session.names, session.points, strict=True):
        text += f"\nPoint: {name}\n   {titles}\n"
        for axis, value in zip("XYZ", point, strict=True):
            numbers = ["1.000", "2.000", "3.000"]
            numbers[place] = f"{value:.4f}"
            text += f"  {axis}   {'  '.join(numbers)}\n"
    check(import_measurements([session.write("report.txt", text)], joints=session.joints()), session)


@pytest.mark.parametrize("filled", [True, False])
def test_a_table_with_a_row_a_coordinate_is_read_by_feature(session: Session, filled: bool) -> None:
    lines = ["Inspection report", "Name\tControl\tNom\tMeas [mm]\tTol\tDev"]
    for name, point in zip(session.names, session.points, strict=True):
        for axis, value in zip("XYZ", point, strict=True):
            lines.append(f"{name if filled or axis == 'X' else ''}\t{axis}\t1.0\t{value:.4f}\t0.1\t0.2")
    path = session.write("report.txt", "\n".join([*lines, "C1\tD\t1.0\t2.0\t0.1\t0.2"]))
    check(import_measurements([path], joints=session.joints()), session)


def motive(session: Session, *, rotation: str = "Quaternion", units: str = "Millimeters", bodies: int = 1) -> str:
    names = ["Flange", "Base"][:bodies]
    kinds = [*["Rigid Body"] * 8, *["Rigid Body Marker"] * 3] * bodies
    owner = [each for name in names for each in [*[name] * 8, *[f"{name}:Marker1"] * 3]]
    parts = [*["Rotation"] * 4, *["Position"] * 3, "Mean Marker Error", *["Position"] * 3] * bodies
    axes = [*"XYZW", *"XYZ", "", *"XYZ"] * bodies
    head = [
        f"Format Version,1.23,Take Name,T,Rotation Type,{rotation},Length Units,{units},Coordinate Space,Global",
        "",
        ",Type," + ",".join(kinds),
        ",Name," + ",".join(owner),
        ",ID," + ",".join(owner),
        ",," + ",".join(parts),
        "Frame,Time (Seconds)," + ",".join(axes),
    ]
    rows = []
    for k, (w, p) in enumerate(zip(session.xyzw, session.points, strict=True)):
        cells = [*(f"{x:.9f}" for x in w), *(f"{x:.4f}" for x in p), "0.1", "1", "2", "3"]
        rows.append(",".join([str(k), f"{k / 120:.6f}", *cells * bodies]))
    return "\n".join([*head, *rows])


def test_motive_gives_the_rigid_body_and_not_its_markers(session: Session) -> None:
    found = import_measurements([session.write("Take.csv", motive(session))], joints=session.joints())
    check(found, session, turned=True)
    # Its frames count from 0 and the poses from 1: a number of a frame is no name.
    assert any("by order" in note for note in found.notes)


def test_motive_with_two_bodies_is_asked_about(session: Session) -> None:
    with pytest.raises(InvalidInput, match=r"2 bodies \('Flange', 'Base'\).*--map"):
        import_measurements([session.write("Take.csv", motive(session, bodies=2))], joints=session.joints())


def vicon(session: Session, *, quaternion: bool = True) -> str:
    axes = "RX,RY,RZ,RW,TX,TY,TZ" if quaternion else "RX,RY,RZ,TX,TY,TZ"
    units = ",,,,,,mm,mm,mm" if quaternion else ",,deg,deg,deg,mm,mm,mm"
    head = ["Segments", "100", ",,Flange:Flange,,,,,,", f"Frame,Sub Frame,{axes}", units]
    turns = session.xyzw if quaternion else session.euler("XYZ")
    rows = [
        ",".join([str(k), "0", *(f"{x:.9f}" for x in turn), *(f"{x:.4f}" for x in p)])
        for k, (turn, p) in enumerate(zip(turns, session.points, strict=True), start=1)
    ]
    return "\n".join([*head, *rows])


def test_vicon_s_quaternion_is_x_y_z_w(session: Session) -> None:
    path = session.write("vicon.csv", vicon(session))
    joints = session.table("J1,J2,J3,J4,J5,J6", "{q[0]},{q[1]},{q[2]},{q[3]},{q[4]},{q[5]}", "joints.csv")
    check(import_measurements([path], joints=joints), session, turned=True)


def test_the_convention_of_vicon_s_angles_is_asked_for_and_used(session: Session) -> None:
    path = session.write("vicon.csv", vicon(session, quaternion=False))
    with pytest.raises(InvalidInput, match=r"'RX', 'RY', 'RZ' may be .*--orientation"):
        import_measurements([path], joints=session.joints())
    check(import_measurements([path], joints=session.joints(), orientation="xyz_moving"), session, turned=True)


def test_a_take_at_rate_is_reduced_to_where_the_target_stood(session: Session) -> None:
    rng = np.random.default_rng(1)
    rows = []
    for here, there in zip(session.points, [*session.points[1:], session.points[-1] + 50], strict=True):
        rows += [here + rng.normal(0, 0.02, 3) for _ in range(40)]
        rows += [here + (there - here) * part for part in np.linspace(0.05, 0.95, 15)]
    text = "Frame,X [mm],Y [mm],Z [mm]\n" + "\n".join(
        f"{k},{x:.4f},{y:.4f},{z:.4f}" for k, (x, y, z) in enumerate(rows)
    )
    found = import_measurements([session.write("take.csv", text)], joints=session.joints())
    assert any("30 standstills" in note for note in found.notes)
    assert np.abs(np.column_stack([found.columns[f"{a}_mm"] for a in "xyz"]) - session.points).max() < 0.03
