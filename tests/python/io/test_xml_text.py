# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""URDFs in other encodings than UTF-8: read as they declare, and written back byte by byte."""

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from fastcal.errors import ParseError
from fastcal.io.robot_file import load_robot, read_spec, write_spec
from fastcal.io.xml_text import read_xml, xml_bytes

# A joint by its letters, one by a reference to a character, and a comment.
ARM = """<?xml version="1.0" encoding="{encoding}"?>
<robot name="Größe 3">
  <!-- für die Zelle Süd -->
  <link name="base"/><link name="a"/><link name="tool"/>
  <joint name="Säule" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.4"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="T&#252;r" type="revolute"><parent link="a"/><child link="tool"/><origin xyz="0.3 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"""


def written(folder: Path, encoding: str, name: str = "arm.urdf") -> Path:
    path = folder / name
    path.write_bytes(ARM.format(encoding=encoding).encode(encoding))
    return path


@pytest.mark.parametrize("encoding", ["ISO-8859-1", "windows-1252", "latin-1", "iso-8859-15", "UTF-8"])
def test_a_urdf_is_read_as_it_declares_and_comes_back_in_place(encoding: str, tmp_path: Path) -> None:
    path = written(tmp_path, encoding)
    load_robot(path).save(tmp_path / "model.yaml")
    spec = read_spec(tmp_path / "model.yaml")
    assert spec["name"] == "Größe 3"
    assert [joint["name"] for joint in spec["joints"]] == ["Säule", "Tür"]
    write_spec(spec, tmp_path / "same.urdf")
    assert (tmp_path / "same.urdf").read_bytes() == path.read_bytes()
    spec["joints"][1]["origin"]["xyz_mm"][0] = 300.5
    write_spec(spec, tmp_path / "moved.urdf")
    new = (tmp_path / "moved.urdf").read_bytes()
    assert new == path.read_bytes().replace(
        b'<origin xyz="0.3 0 0"/>', b'<origin rpy="0.0 0.0 0.0" xyz="0.3005 0.0 0.0"/>'
    )
    assert [joint.get("name") for joint in ET.fromstring(new).iterfind("joint")] == ["Säule", "Tür"]  # noqa: S314


def test_bytes_that_no_editor_shows_survive(tmp_path: Path) -> None:
    """0x85 is a line end to Python's text files, and 0x80 to 0x9f are control characters of ISO 8859-1."""
    path = written(tmp_path, "ISO-8859-1")
    path.write_bytes(path.read_bytes().replace(b"Zelle", bytes(range(0x80, 0xA0)) + b"\r\n"))
    load_robot(path).save(tmp_path / "model.yaml")
    write_spec(read_spec(tmp_path / "model.yaml"), tmp_path / "same.urdf")
    assert (tmp_path / "same.urdf").read_bytes() == path.read_bytes()


def test_text_in_another_encoding_than_declared_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(ARM.replace(' encoding="{encoding}"', "").encode("latin-1"))
    with pytest.raises(
        ParseError, match=r"expected UTF-8 text, got the byte 0xf6; .* <\?xml encoding='ISO-8859-1'\?>$"
    ):
        load_robot(path)
    path.write_bytes(ARM.format(encoding="us-ascii").encode("latin-1"))
    with pytest.raises(ParseError, match=r"expected ascii text, got the byte 0xf6$"):
        load_robot(path)


@pytest.mark.parametrize("encoding", ["zlib_codec", "utf-7", "unicode_escape", "iso-8859-99", "utf-16", "no-such"])
def test_no_other_codec_is_asked(encoding: str, tmp_path: Path) -> None:
    """A declaration that is no encoding of text, or not true, changes nothing: the text is UTF-8."""
    path = tmp_path / "arm.urdf"
    text = ARM.format(encoding=encoding) + "<!-- +AGE- \\x41 -->"
    path.write_bytes(text.encode())
    assert read_xml(path) == text
    assert xml_bytes(text) == path.read_bytes()


def test_a_letter_that_the_encoding_lacks_becomes_a_reference() -> None:
    text = ARM.format(encoding="us-ascii")
    assert ET.fromstring(xml_bytes(text)).get("name") == "Größe 3"  # noqa: S314
