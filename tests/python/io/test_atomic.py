# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A file is written whole or not at all."""

import os
import pickle
import stat
from pathlib import Path

import pytest

from fastcal.errors import FastcalError, InvalidInput, ParseError
from fastcal.io.atomic import atomic_path, write_bytes, write_text


def test_text_and_bytes_are_written(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "10 °C\nb\n")
    write_bytes(tmp_path / "b.bin", b"\x00\r\n")
    assert (tmp_path / "a.txt").read_bytes() == "10 °C\nb\n".encode()
    assert (tmp_path / "b.bin").read_bytes() == b"\x00\r\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt", "b.bin"]


def test_a_failure_keeps_the_older_file_and_leaves_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "model.yaml"
    target.write_text("old")

    def write_half() -> None:
        with atomic_path(target) as temporary:
            temporary.write_text("new, but half")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        write_half()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_the_new_file_is_not_seen_before_it_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "model.yaml"
    with atomic_path(target) as temporary:
        temporary.write_text("new")
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".yaml"
        assert not target.exists()
    assert target.read_text() == "new"


def test_permissions_are_those_of_a_plain_write(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("x")
    write_text(tmp_path / "ours", "x")
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("ours", "plain")]
    assert modes[0] == modes[1]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


@pytest.mark.parametrize(("name", "why"), [("absent/a", "No such file"), (".", "regular file"), ("n" * 300, "name")])
def test_a_place_that_cannot_be_written_is_one_clear_error(tmp_path: Path, name: str, why: str) -> None:
    with pytest.raises(InvalidInput, match=why):
        write_text(tmp_path / name, "x")
    assert list(tmp_path.iterdir()) == []


def test_a_device_is_refused_and_not_replaced() -> None:
    with pytest.raises(InvalidInput, match="not a regular file"):
        write_text(os.devnull, "x")
    assert not Path(os.devnull).is_file()


def test_parse_errors_say_where_and_survive_pickling() -> None:
    error = pickle.loads(pickle.dumps(ParseError("no rows", "data.csv", 7)))  # noqa: S301
    assert str(error) == "data.csv:7: no rows"
    assert (error.path, error.line) == ("data.csv", 7)
    assert str(ParseError("no rows", "data.csv")) == "data.csv: no rows"
    assert str(ParseError("no rows")) == "no rows"
    assert [isinstance(error, kind) for kind in (InvalidInput, ValueError, FastcalError)] == [True] * 3
