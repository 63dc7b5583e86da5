# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""YAML in: plain data or one sentence, whatever the bytes; and numbers as YAML 1.2 has them."""

from pathlib import Path

import pytest

from fastcal.errors import ParseError
from fastcal.io.yaml_file import read_yaml


def read(text: str, tmp_path: Path) -> object:
    path = tmp_path / "file.yaml"
    path.write_text(text, encoding="utf-8")
    return read_yaml(path)


HOSTILE = {
    "empty": ("", "is empty"),
    "two documents": ("a: 1\n---\nb: 2\n", "expected one document, got a second one"),
    "a duplicate": ("name: a\nname: b\n", "the key 'name' is given twice in one mapping"),
    "an object": ("name: !!python/object/apply:os.system [ls]\n", "is not read: robot files hold plain data only"),
    "a timestamp": ("name: !!timestamp 2020-01-01\n", "is not read: robot files hold plain data only"),
    "a broken line": ("name: [1, 2\n", "is not valid YAML"),
    "a tab": ("a:\n\t- b\n", "is not valid YAML"),
    "a control character": ("name: a\x01b\n", "is not valid YAML"),
    "a ring": ("name: &a [*a]\n", "the alias *a refers to nothing that is complete before it"),
    "a number as key": ("1: 2\n", "expected a name as key, got 1"),
    "a list as key": ("[1]: 2\n", "expected a name as key, got [1]"),
    "depth": ("[" * 100_000, "is nested more than 32 deep"),
    "an alias bomb": (
        "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n"
        + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12)),
        "holds more than 500000 values",
    ),
    "an alias ladder": (
        "a0: &a0 []\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 2000)),
        "is nested more than 32 deep",
    ),
    "many values": ("a: [" + "1," * 600_000 + "]\n", "holds more than 500000 values"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_yaml_ends_in_a_sentence(case: str, tmp_path: Path) -> None:
    text, sentence = HOSTILE[case]
    with pytest.raises(ParseError) as caught:
        read(text, tmp_path)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_error_names_file_and_line(tmp_path: Path) -> None:
    with pytest.raises(ParseError) as caught:
        read("name: a\nkinematics: dh\nname: b\n", tmp_path)
    assert str(caught.value) == f"{tmp_path / 'file.yaml'}:3: the key 'name' is given twice in one mapping"
    assert caught.value.line == 3


def test_files_that_are_none(tmp_path: Path) -> None:
    large = tmp_path / "large.yaml"
    with large.open("wb") as file:
        file.truncate(64_000_001)
    latin = tmp_path / "latin.yaml"
    latin.write_bytes(b"name: caf\xe9\n")
    for source, sentence in (
        (tmp_path / "none.yaml", "there is no such file"),
        (tmp_path, "is not a file that can be read, but a folder"),
        (large, "expected a file of at most 64000000 bytes, got 64000001"),
        (latin, "expected UTF-8 text, got the byte 0xe9"),
    ):
        with pytest.raises(ParseError) as caught:
            read_yaml(source)
        assert str(caught.value) == f"{source}: {sentence}"


def test_numbers_are_those_of_yaml_1_2(tmp_path: Path) -> None:
    text = "{a: 1e-7, b: 010, c: 1:30, d: no, e: +.5, f: 0x1F, g: 1., h: '1', i: -3, j: 1_000, k: null, l: True}"
    value = read(text, tmp_path)
    assert repr(value) == repr(
        {"a": 1e-7, "b": 10, "c": "1:30", "d": "no", "e": 0.5, "f": "0x1F", "g": 1.0, "h": "1", "i": -3, "j": "1_000",
         "k": None, "l": True}
    )  # fmt: skip


def test_an_alias_is_what_it_stands_for(tmp_path: Path) -> None:
    assert read("a: &zero [0, 0, 0]\nb: *zero\n", tmp_path) == {"a": [0, 0, 0], "b": [0, 0, 0]}


def test_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    assert read("\ufeffa: 1\n", tmp_path) == {"a": 1}


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-32"])
def test_a_text_may_have_its_mark(tmp_path: Path, encoding: str) -> None:
    """A shell of Windows writes UTF-16 where the output of a command goes into a file."""
    (tmp_path / "map.yaml").write_bytes("name: Größe\n".encode(encoding))
    assert read_yaml(tmp_path / "map.yaml") == {"name": "Größe"}
    (tmp_path / "map.yaml").write_bytes("name: Größe\n".encode("utf-16")[:-1])
    with pytest.raises(ParseError, match="expected UTF-16 text, got the byte 0x0a"):
        read_yaml(tmp_path / "map.yaml")
