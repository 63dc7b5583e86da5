# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Exports of every kind, whose right reading is known: `exports` beside the public measurement sets."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fastcal
from fastcal import Dataset
from fastcal.cli import main

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data" / "exports"
CASES = json.loads((FOLDER / "index.json").read_text()) if FOLDER.is_dir() else []


def loaded(path: Path) -> Dataset:
    return fastcal.load_measurements(path, fastcal.load_robot("ur5"))


def test_the_exports_are_there(shared_data: Path) -> None:
    assert (shared_data / "exports" / "index.json").is_file()


@pytest.mark.parametrize("case", [case for case in CASES if case["kind"] != "template"], ids=lambda case: case["name"])
def test_an_export_is_read_rightly_or_asked_about(
    case: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, out = FOLDER / case["name"], tmp_path / "measurements.csv"
    arguments = [str(folder / a) if (folder / a).is_file() else a for a in (*case["files"], *case["options"])]
    code = main(["import", *arguments, "-o", str(out)])
    said = capsys.readouterr()
    if "expected" not in case:
        assert code == 2
        assert not out.exists()
        assert said.err.count("\n") == 1
        assert all(re.search(pattern, said.err, re.I) for pattern in case["expect_error"])
        return
    assert code == 0, said.err
    assert all(re.search(pattern, said.out, re.I) for pattern in case.get("says", ()))
    got, wanted = loaded(out), loaded(folder / "expected.csv")
    a, b = (np.lexsort(np.round(np.degrees(data.q), 3).T) for data in (got, wanted))
    np.testing.assert_allclose(np.degrees(got.q[a]), np.degrees(wanted.q[b]), atol=case["tolerance"]["deg"])
    assert got.position is not None
    assert wanted.position is not None
    np.testing.assert_allclose(got.position[a] * 1000, wanted.position[b] * 1000, atol=case["tolerance"]["mm"])
    assert (got.rotation is None) == (wanted.rotation is None)
    if got.rotation is not None and wanted.rotation is not None:
        turns = [Rotation.from_quat(rotation[:, [1, 2, 3, 0]]) for rotation in (got.rotation[a], wanted.rotation[b])]
        assert np.degrees((turns[0].inv() * turns[1]).magnitude()).max() < 1e-5
