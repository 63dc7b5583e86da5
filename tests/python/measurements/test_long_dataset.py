# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows in files are those of the data set in memory, whatever part of them is read."""

from __future__ import annotations

import gc
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.measurements import long_dataset
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LongDataset
from fastcal.robot.made_by import data_hash

ROWS = 500


@pytest.fixture(autouse=True)
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_dataset, "PART_ROWS", 64)


def data(**changes: Any) -> Dataset:
    """Rows with every kind of column; joints that often stand still."""
    random = np.random.default_rng(1)
    q = np.cumsum(random.choice([-0.1, 0.0, 0.0, 0.1], (ROWS, 6)), axis=0)
    given: dict[str, Any] = {
        "position": random.normal(size=(ROWS, 3)),
        "rotation": np.tile([0.5, -0.5, 0.5, 0.5], (ROWS, 1)),
        "distance": np.where(np.arange(ROWS) % 3, random.uniform(1, 2, ROWS), np.nan),
        "anchor": ["c"] * 200 + ["a", "b"] * 150,
        "sigma_position": random.uniform(1e-5, 1e-4, (ROWS, 3)),
        "payload": random.uniform(0, 5, ROWS),
        "temperature": random.uniform(290, 300, ROWS),
        "time": np.arange(float(ROWS)),
        "station": ["west"] * 250 + ["east"] * 250,
        "observed": {"tilt@link2": random.normal(0, 1e-3, (ROWS, 2))},
        "observed_labels": {"plane": [""] * 100 + ["floor"] * 200 + ["wall", ""] * 100},
        "extra": {"humidity": random.uniform(0, 1, ROWS)},
    }
    return Dataset.from_arrays(q, **given | changes)


def long(whole: Dataset, *cuts: int) -> LongDataset:
    rows = LongDataset(source=whole.source, joint_types=whole.joint_types)
    rows.notes = whole.notes
    for begin, end in zip((0, *cuts), (*cuts, len(whole)), strict=True):
        rows.append(renamed(whole[begin:end]))
    return rows


def renamed(part: Dataset) -> Dataset:
    """As a file is read part by part: names are counted from the part's own first rows."""
    changes: dict[str, Any] = {}
    for field in ("anchor", "station", "mount"):
        codes, names = part.label_codes(field)
        if len(codes):
            seen = list(dict.fromkeys(code for code in codes.tolist() if code >= 0))
            places = {code: place for place, code in enumerate(seen)} | {-1: -1}
            changes[field] = np.array([places[code] for code in codes.tolist()])
            changes[f"{field}_names"] = tuple(names[code] for code in seen)
    return replace(part, **changes)


def expect_same(found: Dataset, expected: Dataset, *, but: tuple[str, ...] = ()) -> None:
    for field in fields(Dataset):
        a, b = getattr(found, field.name), getattr(expected, field.name)
        if field.name in ("direction_before", "observed_label_names", *but):
            continue
        if isinstance(b, np.ndarray):
            np.testing.assert_array_equal(a, b, err_msg=field.name)
        elif field.name in ("observed", "extra"):
            assert a.keys() == b.keys()
            for name in b:
                np.testing.assert_array_equal(a[name], b[name], err_msg=name)
        else:
            assert a == b, field.name


def test_parts_are_slices_of_the_whole() -> None:
    whole = data()
    rows = long(whole, 3, 130, 131, 400)
    assert len(rows) == ROWS
    for begin, end in [(0, 64), (64, 128), (60, 300), (499, 500), (0, ROWS)]:
        part = rows.read(begin, end)
        expect_same(part, whole[begin:end])
        # How the joints moved last, also where that was in a part before.
        assert whole.directions is not None
        np.testing.assert_array_equal(part.directions, whole.directions[begin:end])
        assert rows.read(begin, end, moves=False).move is None
    assert [len(part) for part in rows.parts()] == [64] * 7 + [52]


def test_labels_keep_their_numbers_in_every_part() -> None:
    whole = data()
    rows = long(whole, 250)
    for field in ("anchor", "station", "plane"):
        codes, names = whole.label_codes(field)
        part_codes, part_names = rows.read(300, 320).label_codes(field)
        assert part_names == names
        np.testing.assert_array_equal(part_codes, codes[300:320])


def test_rows_are_picked_from_all_parts() -> None:
    whole = data(approach=np.random.default_rng(2).choice([-1.0, 0.0, 1.0], (ROWS, 6)))
    picked = [0, 63, 64, 65, 200, 498, 499]
    expect_same(long(whole, 100).pick(picked), whole[picked])


def test_the_hash_is_that_of_the_same_rows_in_memory() -> None:
    whole = data()
    assert data_hash(long(whole, 77, 333)) == data_hash(whole)
    assert data_hash(long(whole[:-1], 77)) != data_hash(whole)


def test_a_column_that_is_text_in_some_rows_is_no_number() -> None:
    whole = data()
    rows = LongDataset()
    rows.append(whole[:100])
    rows.append(replace(whole[100:200], extra={}, extra_labels={"humidity": ["?"] * 100}))
    rows.append(whole[200:])
    assert rows.read(0, ROWS).extra == {}


def test_parts_must_have_the_same_columns() -> None:
    whole = data()
    rows = LongDataset()
    rows.append(whole[:100])
    with pytest.raises(fastcal.InvalidInput, match="expected the same columns in all rows, got temperature, time"):
        rows.append(replace(whole[100:], temperature=None, time=None))


def test_a_full_disk_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Any, values: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(long_dataset.ColumnOnDisk, "append", full)
    with pytest.raises(fastcal.InvalidInput, match=r"its rows do not fit into .* \(No space left on device\); TMPDIR"):
        LongDataset().append(data())


def test_the_files_go_with_the_rows() -> None:
    rows = long(data(), 100)
    assert repr(rows) == "<LongDataset: arrays, 500 poses>"
    files = [column._file for column in rows._columns.values()]
    with rows:
        assert not any(file.closed for file in files)
    assert all(file.closed for file in files)
    rows = long(data(), 100)
    files = [column._file for column in rows._columns.values()]
    del rows
    gc.collect()
    assert all(file.closed for file in files)
