# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Data sets put one after the other: what some lack is empty, labels keep apart what belongs to different set-ups."""

import numpy as np
import pytest

from fastcal import Dataset
from fastcal.errors import InvalidInput

Q = np.arange(6.0).reshape(3, 2) / 10


def test_rows_keep_their_order_and_what_is_missing_is_empty() -> None:
    first = Dataset.from_arrays(Q, position=np.ones((3, 3)), payload=2.0, source="a", extra={"humidity": [1, 2, 3]})
    turned = np.tile([1.0, 0, 0, 0], (3, 1))
    second = Dataset.from_arrays(
        -Q, rotation=turned, approach=np.ones((3, 2)), source="b", extra_labels={"name": list("xyz")}
    )
    both = Dataset.concatenate([first, second])
    np.testing.assert_array_equal(both.q, np.concatenate([Q, -Q]))
    np.testing.assert_array_equal(both.payload, [2, 2, 2, 0, 0, 0])
    assert both.position is not None
    assert np.isnan(both.position[3:]).all()
    assert (both.position[:3] == 1).all()
    assert both.rotation is not None
    assert np.isnan(both.rotation[:3]).all()
    np.testing.assert_array_equal(both.rotation[3:], turned)
    assert both.approach is not None
    np.testing.assert_array_equal(both.approach, [[0, 0]] * 3 + [[1, 1]] * 3)
    np.testing.assert_array_equal(both.extra["humidity"], [1, 2, 3, np.nan, np.nan, np.nan])
    assert both.extra_labels["name"] == ["", "", "", "x", "y", "z"]
    assert both.source == "a, b"
    assert both.station is None
    assert both.measured.all()


def test_a_condition_that_some_lack_is_left_out_and_reported() -> None:
    first = Dataset.from_arrays(Q, temperature=300.0, time=[1, 2, 3], source="a")
    second = Dataset.from_arrays(Q, time=[4, 5, 6], source="b")
    both = Dataset.concatenate([first, second])
    assert both.temperature is None
    assert both.time is not None
    np.testing.assert_array_equal(both.time, [1, 2, 3, 4, 5, 6])
    assert both.notes == ("temperature is left out, as b does not have it",)


def test_labels_are_kept_merged_and_given_where_there_are_none() -> None:
    first = Dataset.from_arrays(Q, station=["north", "south", "north"])
    second = Dataset.from_arrays(Q, station=["south", "south", "east"])
    third = Dataset.from_arrays(Q, source="c")
    both = Dataset.concatenate([first, second, third], labels=["1", "2", "3"])
    assert both.station is not None
    assert [both.station_names[code] for code in both.station] == [
        "north",
        "south",
        "north",
        "south",
        "south",
        "east",
    ] + ["3"] * 3
    assert both.mount_names == ("1", "2", "3")


def test_anchors_of_one_name_are_one() -> None:
    sets = [
        Dataset.from_arrays(Q, distance=[1.0, 2.0, 3.0], anchor=names) for names in (["a", "b", "b"], ["b", "a", "c"])
    ]
    both = Dataset.concatenate(sets)
    assert both.anchor is not None
    assert [both.anchor_names[code] for code in both.anchor] == ["a", "b", "b", "b", "a", "c"]


def test_what_cannot_be_put_together_is_refused() -> None:
    with pytest.raises(InvalidInput, match="at least one"):
        Dataset.concatenate([])
    with pytest.raises(InvalidInput, match="different numbers of joints: 2 in a, 3 in b"):
        Dataset.concatenate([Dataset.from_arrays(Q, source="a"), Dataset.from_arrays(np.zeros((3, 3)), source="b")])
    with pytest.raises(InvalidInput, match="expected 2 labels"):
        Dataset.concatenate([Dataset.from_arrays(Q)] * 2, labels=["a"])
