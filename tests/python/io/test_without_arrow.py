# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where pyarrow is not installed CSV files are read as ever, and a Parquet file is refused with what it needs."""

import sys
from pathlib import Path

import numpy as np
import pytest

import fastcal
from fastcal.errors import ParseError
from fastcal.importers.sources import read_grids
from fastcal.io.tables import read_table

NEEDS = r"is a Parquet file, which needs the package pyarrow: pip install 'fastcal\[parquet\]'"
HEADER = ",".join([*(f"q{joint}_deg" for joint in range(1, 7)), "x_mm", "y_mm", "z_mm", "name"])


@pytest.fixture
def without_arrow(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "pyarrow" or name == "fastcal.io.arrow"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pyarrow", None)


def quoted_csv(path: Path) -> Path:
    """As many rows as are read by Arrow where it is there."""
    rows = (f'{i % 90},1,2,3,4,5,"{i / 7}",6,7,"P{i}"' for i in range(30_000))
    path.write_text("\n".join([HEADER, *rows]) + "\n")
    return path


def test_a_large_quoted_csv_is_the_same_table(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    path = quoted_csv(tmp_path / "rows.csv")
    with_arrow = read_table(path)
    request.getfixturevalue("without_arrow")
    alone = read_table(path)
    assert alone.names == with_arrow.names
    for one, other in zip(alone.columns, with_arrow.columns, strict=True):
        if isinstance(other, np.ndarray):
            np.testing.assert_array_equal(np.asarray(one, dtype=float), other)
        else:
            assert list(one) == list(other)


def test_a_parquet_file_says_what_it_needs(tmp_path: Path, without_arrow: None) -> None:
    path = tmp_path / "rows.parquet"
    path.write_bytes(b"PAR1" + bytes(40) + b"PAR1")
    robot = fastcal.load_robot("ur5")
    with pytest.raises(ParseError, match=NEEDS):
        read_table(path)
    with pytest.raises(ParseError, match=NEEDS):
        read_grids(path)
    with pytest.raises(ParseError, match=NEEDS):
        fastcal.load_measurements(path, robot)
    with pytest.raises(ParseError, match=NEEDS):
        fastcal.open_measurements(path, robot)
