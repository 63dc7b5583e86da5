# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal drop`: what its file holds, what it says, what it refuses."""

import json
from pathlib import Path

import pytest

import fastcal as library

GONE = "joint_compliance@joint2"


def test_the_file_lacks_the_effect_and_says_so(fastcal, demo: Path, tmp_path: Path) -> None:
    out = tmp_path / "bare.yaml"
    said = fastcal("drop", demo / "model.yaml", GONE, "-o", out)
    assert (said.code, said.err) == (0, "")
    assert said.out == f"{out}: staubli_rx160l without {GONE}\n"
    before, after = library.load_robot(demo / "model.yaml"), library.load_robot(out)
    owners = [entry["owner"] for entry in before.spec["effects"]]
    assert [entry["owner"] for entry in after.spec["effects"]] == [owner for owner in owners if owner != "joint2"]
    assert out.read_text().startswith(f"# Without {GONE}; ")


def test_json_and_all_owners_of_a_name(fastcal, demo: Path, tmp_path: Path) -> None:
    said = fastcal("drop", demo / "model.yaml", "joint_compliance", "-o", tmp_path / "bare.yaml", "--json")
    summary = json.loads(said.out)
    assert GONE in summary["dropped"]
    assert summary["effects"] == []
    # The model is still one of `check`, which asks for its uncertainty.
    assert fastcal("predict", tmp_path / "bare.yaml", demo / "test.csv", "-o", tmp_path / "p.csv").code == 0


@pytest.mark.parametrize("effect", ["backlash@joint3", "correction"])
def test_what_is_not_there_is_refused_and_nothing_is_written(fastcal, demo: Path, tmp_path: Path, effect: str) -> None:
    said = fastcal("drop", demo / "model.yaml", effect, "-o", tmp_path / "bare.yaml")
    assert said.code == 2
    assert effect in said.error
    assert GONE in said.error
    assert not (tmp_path / "bare.yaml").exists()


def test_the_model_itself_is_not_overwritten(fastcal, demo: Path) -> None:
    before = (demo / "model.yaml").read_bytes()
    said = fastcal("drop", demo / "model.yaml", GONE, "-o", demo / "model.yaml")
    assert said.code == 2
    assert (demo / "model.yaml").read_bytes() == before
