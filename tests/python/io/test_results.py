# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Results are strict JSON, and folders of results come whole or not at all."""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

from fastcal.errors import InvalidInput, ParseError
from fastcal.io.folder import atomic_folder, check_folder
from fastcal.io.results import json_text, read_json, write_json


def test_numbers_come_back_and_what_is_not_finite_is_null(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    write_json(
        path,
        {"a": np.float64(0.1), "b": np.array([1.5, np.nan]), "c": (math.inf, -math.inf, np.int64(3)), "d": {1: None}},
    )
    assert json.loads(path.read_text(), parse_constant=pytest.fail) == read_json(path)
    assert read_json(path) == {"a": 0.1, "b": [1.5, None], "c": [None, None, 3], "d": {"1": None}}


def test_text_is_that_of_the_standard_library() -> None:
    content = {
        "numbers": [0.1, -0.0, 1e22, 1e-07, 3, -4],
        "none": [None, True, False, {}, [], ""],
        "nested": [{"a b": {'é\n"': ["\u2028", [1.5]]}}, [[]]],
    }
    assert json_text(content) == json.dumps(content, indent=2, ensure_ascii=False) + "\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [("{", r"bad.json:1: is not JSON"), ("[1]", "expected a JSON object, got list"), (None, "there is no such file")],
)
def test_anything_but_a_result_is_refused(tmp_path: Path, text: str | None, message: str) -> None:
    if text is not None:
        (tmp_path / "bad.json").write_text(text)
    with pytest.raises(ParseError, match=message):
        read_json(tmp_path / "bad.json")


def test_a_folder_appears_whole_with_its_parents(tmp_path: Path) -> None:
    with atomic_folder(tmp_path / "a/b") as folder:
        (folder / "one").write_text("1")
        assert not (tmp_path / "a").exists()
    assert (tmp_path / "a/b/one").read_text() == "1"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert [path.name for path in (tmp_path / "a/b").iterdir()] == ["one"]


def test_what_an_older_result_owned_goes_and_other_files_stay(tmp_path: Path) -> None:
    for name in ("one", "two", "mine"):
        (tmp_path / name).write_text("older")
    with atomic_folder(tmp_path, owned=["one", "two", "three"]) as folder:
        (folder / "one").write_text("newer")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"one": "newer", "mine": "older"}


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_a_failure_leaves_the_older_folder_and_nothing_else(tmp_path: Path, error: type[BaseException]) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old/one").write_text("older")

    def fail(target: Path) -> None:
        with atomic_folder(target, owned=["one"]) as folder:
            (folder / "one").write_text("newer")
            raise error

    for target in ("old", "new/er"):
        with pytest.raises(error):
            fail(tmp_path / target)
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert {path.name: path.read_text() for path in (tmp_path / "old").iterdir()} == {"one": "older"}


def test_a_place_that_takes_no_folder_is_refused_beforehand(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInput, match="file is not a folder"):
        check_folder(tmp_path / "file/in")
    if os.geteuid() != 0:  # root may write anywhere
        (tmp_path / "locked").mkdir(mode=0o500)
        with pytest.raises(InvalidInput, match="does not allow it"):
            check_folder(tmp_path / "locked/in")
