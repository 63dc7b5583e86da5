# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tables as offices make them: encodings, decimal commas, titles, units, remarks, sheets; and what must be asked."""

import io

import numpy as np
import openpyxl
import pytest

from fastcal import load_robot
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers import loading, map_text, read_map, write_imported
from fastcal.importers.orientation import CONVENTIONS, converted
from fastcal.io.measurements import load_measurements

from .conftest import P, Q, Session, check, import_measurements

HEAD = "Point,J1,J2,J3,J4,J5,J6,X,Y,Z"
ROW = "{name}," + Q + "," + P


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("separator", [";", "\t", "  ", "|"])
def test_encodings_and_separators(session: Session, encoding: str, separator: str) -> None:
    path = session.table("Müller, Zelle 3\n\n" + HEAD.replace(",", separator), ROW.replace(",", separator))
    path.write_bytes(path.read_text(encoding="utf-8").replace(".", ",").encode(encoding))
    found = import_measurements([path])
    check(found, session)
    assert found.names == session.names
    assert any("taken as degrees" in note for note in found.notes)


def test_footers_are_left_out_and_named(session: Session) -> None:
    path = session.table(HEAD, ROW)
    numbers = ",".join(["1.5"] * 9)
    path.write_text(path.read_text() + f"\nMittelwert,{numbers}\nStabw.,{numbers}\nGeprüft: Müller\n")
    found = import_measurements([path])
    check(found, session)
    assert any("Mittelwert, Stabw., Geprüft: Müller" in note for note in found.notes)


def test_a_footer_without_a_name_is_known_by_its_numbers(session: Session) -> None:
    path = session.table("J1,J2,J3,J4,J5,J6,X,Y,Z", Q + "," + P)
    table = np.column_stack([session.q, session.points])
    footer = [table.mean(axis=0), table.std(axis=0, ddof=1), table.min(axis=0), table.max(axis=0)]
    path.write_text(path.read_text() + "\n" + "\n".join(",".join(f"{x:.3f}" for x in row) for row in footer))
    check(import_measurements([path]), session)
    # A pose measured last, behind an empty row, stays one.
    path.write_text(path.read_text().split("\n\n")[0].replace("\n", "\n\n"))
    check(import_measurements([path]), session)


def test_a_header_repeated_on_each_page_is_passed_over(session: Session) -> None:
    path = session.table(HEAD, ROW)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:10], "", lines[0], *lines[10:]]))
    check(import_measurements([path]), session)


def test_a_bad_cell_is_an_error_with_its_line(session: Session) -> None:
    path = session.table(HEAD, ROW)
    path.write_text(path.read_text().replace(f"{session.q[3, 1]:.4f}", "ten", 1))
    with pytest.raises(ParseError, match=r"export\.csv:5: column 'J2': expected a number, got 'ten'"):
        import_measurements([path])


def test_mixed_decimal_marks_are_refused(session: Session) -> None:
    path = session.table(HEAD.replace(",", ";"), ROW.replace(",", ";"))
    path.write_text(path.read_text().replace(f"{session.q[3, 1]:.4f}", f"{session.q[3, 1]:.4f}".replace(".", ","), 1))
    with pytest.raises(ParseError, match="mixes decimal commas and points"):
        import_measurements([path])


@pytest.mark.parametrize("row", [0, 3, 29])
def test_of_mixed_decimal_marks_the_slip_is_named_wherever_it_is(session: Session, row: int) -> None:
    """In the first row it was the second that was named: a cell like all others."""
    path = session.table(HEAD.replace(",", ";"), ROW.replace(",", ";"))
    cell = f"{session.q[row, 1]:.4f}"
    slip = cell.replace(".", ",")
    path.write_text(path.read_text().replace(cell, slip, 1))
    with pytest.raises(ParseError, match=rf":{row + 2}: column 'J2' .* as in '{slip}'$"):
        import_measurements([path])


def test_rows_that_are_not_valid_or_not_measured_are_left_out(session: Session) -> None:
    path = session.table("Valid," + HEAD, "1," + ROW)
    lines = path.read_text().splitlines()
    lines[4] = "0" + lines[4][1:]
    lines[8] = ",".join(lines[8].split(",")[:8]) + ",---,---,---"
    path.write_text("\n".join(lines))
    found = import_measurements([path])
    check(found, session, rows=[k for k in range(30) if k not in (3, 7)])
    assert [note for note in found.notes if "left out" in note] == [
        "1 rows that 'Valid' calls not valid are left out",
        "1 rows without a measured point are left out (lines 9)",
    ]


UNSAID = {
    "joints in radians": (
        "J1,J2,J3,J4,J5,J6,X,Y,Z",
        "{r[0]},{r[1]},{r[2]},{r[3]},{r[4]},{r[5]}," + P,
        "'J1'.*no unit.*--map",
    ),
    "points in metres": (HEAD, "{name}," + Q + ",{m[0]},{m[1]},{m[2]}", "'X'.*no unit.*--map"),
    "two points": (HEAD + ",SMR1 X,SMR1 Y,SMR1 Z,SMR2 X,SMR2 Y,SMR2 Z", ROW + ",1,2,3,4,5,6", "'SMR1 X' and 'SMR2 X'"),
    "a joint is missing": ("J1,J2,J4,J5,J6,X,Y,Z", "1,2,3,4,5," + P, "numbered without a gap"),
    "angles": (HEAD + ",Rx,Ry,Rz", ROW + ",10,20,30", "'Rx', 'Ry', 'Rz' may be .*--orientation.*--map"),
    "A B C of nobody": (HEAD + ",A,B,C", ROW + ",10,20,30", "'A', 'B', 'C' may be .*--orientation"),
    "a quaternion": (
        HEAD + ",q1,q2,q3,q4",
        ROW + ",{w[0]},{w[1]},{w[2]},{w[3]}",
        "--orientation wxyz or --orientation xyzw",
    ),
    "no header": ("", Q + "," + P, "has no header.*--map"),
    "only nominal": (HEAD.replace("X,Y,Z", "Nom X,Nom Y,Nom Z"), ROW, "no measured points"),
}


@pytest.mark.parametrize("case", UNSAID)
def test_what_a_file_leaves_open_is_asked_for_in_one_line(session: Session, case: str) -> None:
    head, row, asked = UNSAID[case]
    with pytest.raises(InvalidInput, match=asked) as raised:
        import_measurements([session.table(head, row)])
    assert "\n" not in str(raised.value)


def test_the_given_order_of_a_quaternion_is_used(session: Session) -> None:
    path = session.table(HEAD + ",q1,q2,q3,q4", ROW + ",{w[0]:.9f},{w[1]:.9f},{w[2]:.9f},{w[3]:.9f}")
    check(import_measurements([path], orientation="xyzw"), session, turned=True)


@pytest.mark.parametrize(
    ("convention", "letters"), [("rpy", "xyz"), ("wpr", "xyz"), ("abc", "ZYX"), ("zyz", "ZYZ"), ("xyz_moving", "XYZ")]
)
def test_angles_are_turned_as_scipy_turns_them(session: Session, convention: str, letters: str) -> None:
    angles = session.euler(letters)
    lines = [
        f"{Q},{P},{{a[0]:.9f}},{{a[1]:.9f}},{{a[2]:.9f}}".format(q=q, p=p, a=a)
        for q, p, a in zip(session.q, session.points, angles, strict=True)
    ]
    path = session.write("export.csv", "\n".join(["J1,J2,J3,J4,J5,J6,X,Y,Z,Rx,Ry,Rz", *lines]))
    check(import_measurements([path], orientation=convention), session, turned=True)


def test_a_matrix_that_is_not_a_rotation_is_refused() -> None:
    skewed = np.eye(3) + 0.01
    with pytest.raises(ValueError, match="1"):
        converted("matrix", np.array([np.eye(3).ravel(), skewed.ravel()]), ("1", 1.0))


def book(sheets: dict[str, list[list[object]]]) -> bytes:
    made = openpyxl.Workbook()
    made.remove(made.worksheets[0])
    for title, rows in sheets.items():
        sheet = made.create_sheet(title)
        for row in rows:
            sheet.append(row)
    out = io.BytesIO()
    made.save(out)
    return out.getvalue()


def test_joints_and_points_of_two_sheets_are_joined(session: Session) -> None:
    joints = [
        ["Name", *(f"Achse {k}" for k in range(1, 7))],
        *([n, *q] for n, q in zip(session.names, session.q.tolist(), strict=True)),
    ]
    points = [
        ["Tracker"],
        [],
        ["Name", "X", "Y", "Z"],
        ["", "mm", "mm", "mm"],
        *([n, *p] for n, p in zip(session.names, session.points.tolist(), strict=True)),
    ]
    path = session.write("book.xlsx", book({"Info": [["Customer", "ACME"]], "Roboter": joints, "Messung": points[::1]}))
    found = import_measurements([path])
    check(found, session)
    assert any("by name" in note for note in found.notes)


def test_sheets_that_could_each_be_it_are_asked_about(session: Session) -> None:
    rows = [
        HEAD.split(","),
        *([n, *q, *p] for n, q, p in zip(session.names, session.q.tolist(), session.points.tolist(), strict=True)),
    ]
    path = session.write("book.xlsx", book({"Before": rows, "After": rows}))
    with pytest.raises(InvalidInput, match=r"'Before', 'After'.*--sheet"):
        import_measurements([path])
    check(import_measurements([path], sheet="after"), session)
    with pytest.raises(ParseError, match="has no sheet 'Later'"):
        import_measurements([path], sheet="Later")


def test_a_map_that_was_printed_reads_the_same(session: Session) -> None:
    path = session.table(HEAD + ",Roll,Pitch,Yaw", ROW + ",10,20,30")
    written = session.write("map.yaml", map_text([path]))
    plain, mapped = import_measurements([path]), import_measurements([path], mapping=read_map(written))
    assert {*plain.columns} == {*mapped.columns}
    for name, values in plain.columns.items():
        assert np.array_equal(values, mapped.columns[name])


def test_a_map_names_columns_by_number_and_by_header(session: Session) -> None:
    path = session.table("", "{k} {m[0]:.7f} {m[1]:.7f} {m[2]:.7f} " + Q.replace(",", " "), "poses.dat")
    columns = {f"q{j}_deg": 4 + j for j in range(1, 7)} | {"x_m": 2, "y_m": 3, "z_m": 4}
    written = session.write("map.yaml", f"columns: {columns}".replace("'", ""))
    check(import_measurements([path], mapping=read_map(written)), session)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("columns: {q1: J1}", "columns.q1: expected a column of a measurement file with its unit"),
        ("columns: {q1_deg: [1]}", "expected a header or a number"),
        ("orientation: euler", "orientation: expected rpy"),
        ("skip_rows: -1", "skip_rows: expected"),
        ("colums: {}", "did you mean 'columns'"),
        ("columns: {q1_deg: Nonsense}", "no file has the column 'Nonsense'"),
        ("columns: {q1_deg: 99}", "expected a number from 1 to 10"),
    ],
)
def test_an_invalid_map_is_refused(session: Session, text: str, said: str) -> None:
    path = session.table(HEAD, ROW)
    with pytest.raises(InvalidInput, match=said):
        import_measurements([path], mapping=read_map(session.write("map.yaml", text)))


def test_conventions_are_listed_once() -> None:
    assert {"rpy", "abc", "wpr", "rotation_vector", "zyz", "matrix"} <= CONVENTIONS.keys()


def test_what_is_written_has_the_digits_of_the_export(session: Session) -> None:
    path = session.table(HEAD, ROW)
    out = session.folder / "measurements.csv"
    write_imported(out, import_measurements([path]), None)
    first = out.read_text().splitlines()[1].split(",")
    assert first[0] == "P001"
    assert [float(cell) for cell in first[1:]] == [*session.q[0], *session.points[0]]
    data = load_measurements(out, load_robot("ur5"))
    assert data.notes == ()
    assert data.extra_labels["name"] == session.names


@pytest.mark.parametrize("german", [True, False])
def test_thousands_are_separated_in_either_way(session: Session, german: bool) -> None:
    def said(value: float) -> str:
        text = f"{value:,.4f}"
        return text.translate(str.maketrans(".,", ",.")) if german else text

    far = session.points + np.array([5000.0, -3000.0, 2000.0])
    lines = [";".join([n, *map(said, point)]) for n, point in zip(session.names, far, strict=True)]
    path = session.write("far.csv", "\n".join(["Name;X (mm);Y (mm);Z (mm)", *lines]))
    read = import_measurements([path], joints=session.joints())
    np.testing.assert_allclose(np.column_stack([read.columns[f"{a}_mm"] for a in "xyz"]), far, atol=1e-9)


def test_the_pendant_of_a_ur_names_its_joints(session: Session) -> None:
    path = session.table("Base,Shoulder,Elbow,Wrist 1,Wrist 2,Wrist 3,X,Y,Z", Q + "," + P)
    read = import_measurements([path])
    np.testing.assert_allclose(np.column_stack([read.columns[f"q{j}_deg"] for j in range(1, 7)]), session.q, atol=1e-9)


def test_the_sheet_with_the_table_says_what_is_wrong_and_not_the_cover(session: Session) -> None:
    path = session.folder / "book.xlsx"
    book = openpyxl.Workbook()
    book.active.append(["Vermessung Roboter 4711"])  # a cover sheet, which holds no table
    sheet = book.create_sheet("Messwerte")
    sheet.append(HEAD.split(","))
    for name, q, point in zip(session.names, session.q, session.points, strict=True):
        sheet.append([name, *map(float, q), *map(float, point)])
    sheet["C5"] = "zehn"
    book.save(path)
    with pytest.raises(ParseError, match=r":5: sheet 'Messwerte': column 'J2': expected a number, got 'zehn'"):
        import_measurements([path])


@pytest.mark.parametrize("word", ["n. gemessen", "not measured", "#NV", "fehlt"])
def test_words_in_place_of_a_point_leave_its_row_out(session: Session, word: str) -> None:
    path = session.table(HEAD, ROW)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:4], ",".join([*lines[4].split(",")[:7], word, "", ""]), *lines[5:]]))
    found = import_measurements([path])
    assert len(found) == len(session.q) - 1
    assert any("a measured point" in note and "5" in note for note in found.notes)


def test_a_table_may_stand_on_its_side(session: Session) -> None:
    """A row a quantity and a column a pose, with the names of the poses above or without."""
    rows = [[f"J{j + 1} [deg]", *(f"{v:.4f}" for v in session.q[:, j])] for j in range(6)]
    rows += [[f"{axis} [mm]", *(f"{v:.4f}" for v in session.points[:, k])] for k, axis in enumerate("XYZ")]
    for named in (False, True):
        lines = [["Pose", *session.names], *rows] if named else rows
        text = "Session of Monday\n\n" * named + "\n".join(";".join(line) for line in lines) + "\n"
        found = import_measurements([session.write("poses.csv", text)])
        check(found, session)
        assert (found.names == session.names) == named
        assert any("the table stands on its side, a column a pose" in note for note in found.notes)


@pytest.mark.parametrize("name", ["A", "J", "X", "P"])
def test_names_of_points_are_no_titles_of_rows(session: Session, name: str) -> None:
    """A list without a header, whose points are called A1, A2 ..."""
    lines = [f"{name}{k};" + P.format(p=p).replace(",", ";") for k, p in enumerate(session.points, start=1)]
    path = session.write("points.txt", "\n".join(lines))
    joints = session.table("Name;J1;J2;J3;J4;J5;J6", f"{name}{{k}};" + Q.replace(",", ";"), "joints.csv")
    check(import_measurements([path], joints=joints), session)


def test_the_error_is_that_of_the_sheet_with_the_data(session: Session) -> None:
    """And not that of a cover sheet, whatever stands on it."""
    book = openpyxl.Workbook()
    for row in (["Report 12"], ["Customer", "ACME"], [1, 2, 3], ["X and Y"]):
        book.active.append(row)
    sheet = book.create_sheet("Data")
    sheet.append(["J1", "J2", "J3", "J4", "J5", "J6", "X", "Y", "Z"])
    for q, p in zip(session.q, session.points, strict=True):
        sheet.append([*q, *p])
    for cell, message in (("oops", "'J2': expected a number, got 'oops'"), (None, "'q2_deg': expected a finite")):
        sheet["B4"] = cell
        book.save(session.folder / "book.xlsx")
        with pytest.raises(InvalidInput, match=rf"book.xlsx:4: sheet 'Data': .*{message}"):
            loading.load_measurements(session.folder / "book.xlsx", load_robot("ur5"))


@pytest.mark.parametrize("mark", ["# ", "% ", "// ", "! "])
def test_a_header_may_stand_behind_a_mark(session: Session, mark: str) -> None:
    row = f"{Q} {P}".replace(",", " ")
    check(import_measurements([session.table(f"{mark}J1 J2 J3 J4 J5 J6 X Y Z", row)]), session)


def test_names_may_begin_with_a_mark(session: Session) -> None:
    """All of them: where some do, these lines are left out, and counted."""
    path = session.table("Name;J1;J2;J3;J4;J5;J6;X;Y;Z", "#{k};" + Q.replace(",", ";") + ";" + P.replace(",", ";"))
    check(import_measurements([path]), session)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([line.removeprefix("#") if k not in (5, 9) else line for k, line in enumerate(lines)]))
    found = import_measurements([path])
    check(found, session, rows=[k for k in range(30) if k not in (4, 8)])
    assert any("2 rows behind the mark of a remark are left out (lines 6, 10)" in note for note in found.notes)


def test_a_table_may_be_drawn_with_bars(session: Session) -> None:
    head = "| Name | J1 | J2 | J3 | J4 | J5 | J6 | X | Y | Z |\n" + "|---" * 10 + "|"
    row = "| {name} | " + Q.replace(",", " | ") + " | " + P.replace(",", " | ") + " |"
    check(import_measurements([session.table(head, row)]), session)
    ruler = "+-----" * 10 + "+"
    check(import_measurements([session.table(f"{ruler}\n{head.splitlines()[0]}\n{ruler}", row)]), session)
