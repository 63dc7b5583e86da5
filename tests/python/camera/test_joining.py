# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which row of the poses a picture belongs to."""

from pathlib import Path

import pytest

from fastcal.camera.joining import camera_of, joined, picture_files
from fastcal.errors import InvalidInput
from fastcal.io.table import Table
from fastcal.io.tables import read_table


def poses(folder: Path, text: str) -> Table:
    path = folder / "poses.csv"
    path.write_text(text)
    return read_table(path)


def names(*given: str) -> list[Path]:
    return [Path(name) for name in given]


@pytest.mark.parametrize("column", ["picture", "Bild", "file"])
def test_by_a_column_of_names(tmp_path: Path, column: str) -> None:
    table = poses(tmp_path, f"q1_deg,{column}\n1,shots/b.png\n2,shots/a.png\n3,shots/c.png\n")
    found = joined(names("x/a.png", "x/b.png", "x/d.png"), table)
    assert found.rows == (1, 0, None)
    assert column in found.how


def test_a_number_is_not_named_by_what_is_before_its_point(tmp_path: Path) -> None:
    table = poses(tmp_path, "q1_deg,picture\n2.5,0.png\n0.25,1.png\n1.75,2.png\n")
    found = joined(names("0.png", "1.png", "2.png"), table)
    assert found.rows == (0, 1, 2)
    assert "picture" in found.how


def test_by_numbers_from_none_or_one(tmp_path: Path) -> None:
    table = poses(tmp_path, "q1_deg\n1\n2\n3\n")
    assert joined(names("p0.png", "p2.png", "p1.png"), table).rows == (0, 2, 1)
    assert joined(names("p1.png", "p2.png", "p3.png"), table).rows == (0, 1, 2)
    assert joined(names("p2.png", "p3.png"), table).rows == (1, 2)  # three rows, and one is the third
    assert joined(names("img_010.png", "img_002.png", "img_000.png"), None).rows == (10, 2, 0)


def test_by_times(tmp_path: Path) -> None:
    table = poses(tmp_path, "q1_deg,time_s\n1,1700000000.0\n2,1700000005.0\n3,1700000010.0\n")
    found = joined(names("cam_1700000005020.png", "cam_1700000000010.png", "cam_1700000007600.png"), table)
    assert found.rows == (1, 0, 2)  # milliseconds
    assert joined(names("1700000009900000000.png"), table).rows == (2,)
    with pytest.raises(InvalidInput, match="other times"):
        joined(names("1600000009.png", "1600000011.png"), table)


def test_by_order_where_nothing_else_says_it(tmp_path: Path) -> None:
    table = poses(tmp_path, "q1_deg\n1\n2\n3\n")
    found = joined(names("p20.png", "p9.png", "p100.png"), table)
    assert found.rows == (1, 0, 2)
    assert "order" in found.how
    with pytest.raises(InvalidInput, match=r"2 pictures and 3 poses"):
        joined(names("p20.png", "p9.png"), table)


def test_the_camera_is_the_one_that_the_name_or_the_folder_names() -> None:
    assert camera_of(Path("a/b.png"), ["wrist"]) == "wrist"
    assert camera_of(Path("left/1.png"), ["left", "right"]) == "left"
    assert camera_of(Path("shots/1_right.png"), ["left", "right"]) == "right"
    with pytest.raises(InvalidInput, match="which camera took it"):
        camera_of(Path("shots/1.png"), ["left", "right"])


def test_folders_give_their_pictures_in_order(tmp_path: Path) -> None:
    for name in ("p10.png", "p9.JPG", "notes.txt"):
        (tmp_path / name).write_text("")
    assert [path.name for path in picture_files([tmp_path])] == ["p9.JPG", "p10.png"]
    with pytest.raises(InvalidInput, match="there is no such picture"):
        picture_files([tmp_path / "p11.png"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(InvalidInput, match="holds no pictures"):
        picture_files([tmp_path / "empty"])
