# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Exports in the encodings of Windows and Asia: asked for, marked, declared, or guessed and told."""

import pytest

from fastcal import load_robot
from fastcal.cli import main
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers import read_map
from fastcal.importers.loading import load_measurements
from fastcal.io.text_encoding import asked_codec, codec_of, decoded

from .conftest import P, Q, Session, check, import_measurements

TITLES = {
    "cp932": ("名前,関節{},測定X,測定Y,測定Z", "備考"),
    "euc_jp": ("名前,関節{},測定X,測定Y,測定Z", "備考"),
    "gb18030": ("名称,关节{},测量X,测量Y,测量Z", "备注"),
    "big5": ("名稱,關節{},測量X,測量Y,測量Z", "備註"),
    "cp949": ("이름,J{},X,Y,Z", "비고"),
    "cp1251": ("Имя,J{},X,Y,Z", "Примечание"),
    "cp1250": ("Název,J{},X,Y,Z", "Poznámka ř"),
    "cp1252": ("Größe,J{},X,Y,Z", "Prüfer"),
}


def export(session: Session, encoding: str, first: str = "") -> str:
    titles, more = TITLES[encoding]
    name, joint, *point = titles.split(",")
    head = ",".join([name, *(joint.format(k) for k in range(1, 7)), *point, more])
    lines = [
        f"{n},{Q.format(q=q)},{P.format(p=p)},ok"
        for n, q, p in zip(session.names, session.q, session.points, strict=True)
    ]
    return first + "\n".join([head, *lines]) + "\n"


@pytest.mark.parametrize("encoding", TITLES)
def test_an_encoding_is_asked_for_or_guessed_and_told(session: Session, encoding: str) -> None:
    path = session.write("export.csv", export(session, encoding).encode(encoding))
    asked = import_measurements([path], encoding=encoding)
    check(asked, session)
    assert not any("UTF-8" in note for note in asked.notes)
    guessed = import_measurements([path])
    check(guessed, session)
    assert guessed.names == asked.names
    assert any("the text is not UTF-8 and is taken as" in note for note in guessed.notes)
    assert TITLES[encoding][1] in "".join(guessed.unknown + guessed.notes)
    answer = session.write("map.yaml", f"encoding: {encoding}")
    check(import_measurements([path], mapping=read_map(answer)), session)


@pytest.mark.parametrize("mark", ["# -*- coding: cp932 -*-", "# charset=Shift_JIS", '# encoding: "windows-31j"'])
def test_a_text_may_declare_its_encoding(session: Session, mark: str) -> None:
    path = session.write("export.csv", export(session, "cp932", mark + "\n").encode("cp932"))
    found = import_measurements([path])
    check(found, session)
    assert not any("UTF-8" in note for note in found.notes)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_unicode_needs_no_asking(session: Session, encoding: str) -> None:
    path = session.write("export.csv", export(session, "gb18030").encode(encoding))
    found = import_measurements([path])
    check(found, session)
    assert found.names == session.names
    assert not any("UTF-8" in note for note in found.notes)


def test_a_measurement_file_has_any_encoding_too(session: Session) -> None:
    """And its notes say so; labels of text keep their letters."""
    head = ",".join(["Prüfer", *(f"q{k}_deg" for k in range(1, 7)), "x_mm", "y_mm", "z_mm"])
    path = session.table(head, "Jürgen," + Q + "," + P, encoding="cp1252")
    data = load_measurements(path, load_robot("ur5"))
    assert data.extra_labels["Prüfer"][0] == "Jürgen"
    assert any("taken as Windows-1252; fastcal import --encoding" in note for note in data.notes)
    again = load_measurements(path, load_robot("ur5"), encoding="cp1252")
    assert not any("taken as Windows" in note for note in again.notes)
    wide = session.table(head, "Jürgen," + Q + "," + P, name="wide.csv", encoding="utf-16")
    assert load_measurements(wide, load_robot("ur5")).extra_labels["Prüfer"][0] == "Jürgen"


def test_an_encoding_that_is_not_the_text_s_is_refused(session: Session, capsys: pytest.CaptureFixture[str]) -> None:
    path = session.write("export.csv", export(session, "cp932").encode("cp932"))
    with pytest.raises(ParseError, match=r"export.csv:1: is no UTF-8 text: byte 0x96"):
        import_measurements([path], encoding="utf-8")
    for name in ("klingon", "zlib", "unicode_escape", ""):
        if name:
            with pytest.raises(InvalidInput, match="expected an encoding such as utf-8, cp932"):
                import_measurements([path], encoding=name)
    with pytest.raises(ParseError, match=r"encoding: expected one such as utf-8"):
        read_map(session.write("map.yaml", "encoding: klingon"))
    out = session.folder / "out.csv"
    assert main(["import", str(path), "--encoding", "shift_jis", "-o", str(out)]) == 0
    assert out.read_text().startswith("name,q1_deg")
    assert main(["import", str(path), "--encoding", "utf-8", "-o", str(session.folder / "no.csv")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (session.folder / "no.csv").exists()


def test_a_map_is_printed_line_by_line(session: Session, capsys: pytest.CaptureFixture[str]) -> None:
    """It was one line with backslashes."""
    path = session.write("export.csv", export(session, "cp932").encode("cp932"))
    assert main(["import", str(path), "--print-map"]) == 0
    said = capsys.readouterr().out
    assert "\\n" not in said
    assert "\n  q1_deg: " in said
    check(import_measurements([path], mapping=read_map(session.write("map.yaml", said))), session)


@pytest.mark.parametrize("text", ["J1 [°],X [µm]", "Länge,Höhe", "Coordonnées mesurées", "“P1”,€", "ß", "Ä1;Ö2;Ü3"])
def test_western_letters_are_never_taken_for_others(text: str) -> None:
    assert decoded((text + "\n1,2\n").encode("cp1252"), "file")[0] == text + "\n1,2\n"


def test_names_of_encodings() -> None:
    assert codec_of("Windows-31J") == codec_of("x-sjis") == "cp932"
    assert codec_of("rot13") is codec_of("utf-7") is codec_of("no\0") is None
    assert asked_codec("UTF8") == "utf-8-sig"
