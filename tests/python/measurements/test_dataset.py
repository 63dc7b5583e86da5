# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Data sets from arrays: what is kept, what is refused and with which sentence."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset

ARM = SimpleNamespace(
    joint_types=["revolute", "prismatic"],
    limits=np.array([[-1.0, 1.0], [0.0, 0.5]]),
    mimics=(),
    passive=(),
    follow=lambda q: q,
    reach=1.2,
    joint_count=2,
)
Q = [[0.1, 0.2], [0.3, 0.4], [0.5, 0.1]]
POINTS = [[1.0, 2.0, 3.0], [np.nan, 5.0, 6.0], [np.nan, np.nan, np.nan]]


def test_arrays_become_c_order_doubles_that_are_copies() -> None:
    q = np.asfortranarray(np.array(Q, dtype=np.float32))
    data = Dataset.from_arrays(q, position=POINTS, payload=[1, 2, 3])
    assert data.q.dtype == np.float64
    assert data.q.flags.c_contiguous
    assert data.payload.tolist() == [1.0, 2.0, 3.0]
    q[:] = 7.0
    np.testing.assert_array_equal(data.q, np.float32(Q))


def test_what_is_absent_is_none_and_the_payload_is_zero() -> None:
    data = Dataset.from_arrays(Q)
    assert data.position is data.rotation is data.distance is data.temperature is data.approach is None
    assert data.payload.tolist() == [0.0, 0.0, 0.0]
    assert len(data) == 3
    assert not data.measured.any()


def test_one_number_applies_to_all_rows() -> None:
    data = Dataset.from_arrays(
        Q, position=POINTS, sigma_position=2e-5, sigma_rotation=1e-4, payload=3, temperature=293.0, time=5
    )
    assert data.sigma_position is not None
    np.testing.assert_array_equal(data.sigma_position, np.full((3, 3), 2e-5))
    assert [data.payload[2], data.temperature[1], data.time[0], data.sigma_rotation[2]] == [3.0, 293.0, 5.0, 1e-4]


def test_one_sigma_a_row_applies_to_its_coordinates() -> None:
    data = Dataset.from_arrays(Q, position=POINTS, sigma_position=[1e-5, 2e-5, np.nan])
    np.testing.assert_array_equal(data.sigma_position[:2], [[1e-5] * 3, [2e-5] * 3])


def test_quaternions_come_out_with_length_one() -> None:
    turned = np.array([[1.001, 0, 0, 0], [np.nan] * 4, [0.6, 0.0, -0.8, 0.0]])
    data = Dataset.from_arrays(Q, rotation=turned)
    np.testing.assert_allclose(data.rotation, [[1, 0, 0, 0], [np.nan] * 4, [0.6, 0, -0.8, 0]], rtol=1e-15)
    assert data.measured.tolist() == [True, False, True]


def test_labels_become_indices_in_the_order_of_first_appearance() -> None:
    data = Dataset.from_arrays(Q, distance=[1.0, np.nan, 2.0], anchor=["b", "", "a"], station=[7, 3, 7])
    assert data.anchor_names == ("b", "a")
    assert data.anchor.tolist() == [0, -1, 1]
    assert data.station_names == ("7", "3")
    assert data.station.tolist() == [0, 1, 0]
    assert Dataset.from_arrays(Q, distance=[1.0, np.nan, 2.0]).anchor.tolist() == [0, 0, 0]


def test_rows_are_selected_by_index_mask_and_slice() -> None:
    data = Dataset.from_arrays(
        Q, position=POINTS, station=["a", "b", "a"], extra={"order": [5, 6, 7]}, extra_labels={"by": ["x", "y", "z"]}
    )
    for rows in ([2, 0], np.array([2, 0])):
        part = data.select(rows)
        np.testing.assert_array_equal(part.q, [Q[2], Q[0]])
        assert part.extra["order"].tolist() == [7.0, 5.0]
        assert part.extra_labels["by"] == ["z", "x"]
        assert (part.station.tolist(), part.station_names) == ([0, 0], ("a", "b"))
    assert data.select(np.array([False, True, False])).extra["order"].tolist() == [6.0]
    assert data.select(slice(1, None)).extra["order"].tolist() == [6.0, 7.0]
    assert len(data.select(np.zeros(3, dtype=bool))) == 0


WRONG = [
    ({"q": [0.1, 0.2]}, r"q must have shape \(N, n\), got \(2,\)"),
    ({"q": np.zeros((6, 120)), "robot": ARM}, r"q must have shape \(N, 2\), got \(6, 120\)"),
    ({"q": np.zeros((0, 2))}, r"q must hold at least one row and one joint, got shape \(0, 2\)"),
    ({"q": [["a", "b"]]}, r"q must hold real numbers, got <U1"),
    ({"q": [[1j, 0]]}, r"q must hold real numbers, got complex128"),
    ({"q": [[0.1, np.nan]]}, r"q, row 0, entry 1: expected a finite number, got nan"),
    ({"position": np.zeros((3, 2))}, r"position must have shape \(3, 3\), got \(3, 2\)"),
    ({"position": np.full((3, 3), np.inf)}, r"position, row 0, entry 0: expected a finite number, or nothing"),
    ({"payload": [1.0, 2.0]}, r"payload must have shape \(3,\), got \(2,\)"),
    ({"payload": [1.0, -2.0, 0.0]}, r"payload, row 1, entry 0: expected a mass of at least 0, got -2"),
    ({"temperature": [290.0, np.nan, 290.0]}, r"temperature, row 1, .* finite number in every row, got nan"),
    ({"temperature": -3.0}, r"temperature, row 0, .*above absolute zero, got -3"),
    ({"approach": np.full((3, 2), 0.5)}, r"approach, row 0, entry 0: expected \+1 or -1 .*, got 0.5"),
    ({"rotation": [[1, 0, 0, 0], [1, 1, 0, 0], [1, 0, 0, 0]]}, r"rotation, row 1, .*length 1 \(here it is 1.41421\)"),
    ({"rotation": [[1, 0, 0, np.nan]] * 3}, r"rotation, row 0, entry 3: expected the whole orientation"),
    ({"rotation": np.full((3, 4), 1e200)}, r"rotation, row 0, .*length 1 \(here it is inf\)"),
    ({"distance": [1.0, 0.0, 1.0]}, r"distance, row 1, .*greater than 0, got 0"),
    ({"distance": [1.0] * 3, "anchor": ["a", "", "a"]}, r"anchor, row 1, .*label of this length's anchor, got -1"),
    ({"station": ["a", "b"]}, r"station must hold 3 labels, one a row, got 2"),
    ({"station": ["a", "", "b"]}, r"station, row 1, entry 0: expected a label, got ''"),
    ({"position": POINTS, "sigma_position": 0.0}, r"sigma_position, row 0, .*greater than 0, got 0"),
    ({"position": POINTS, "sigma_position": [1, np.nan, 1]}, r"sigma_position, row 1, entry 1: .*, got nan"),
    ({"distance": [1.0] * 3, "sigma_position": [1, -1, 1]}, r"sigma_position, row 1, entry 0: .*, got -1"),
    ({"rotation": [[1, 0, 0, 0]] * 3, "sigma_rotation": np.nan}, r"sigma_rotation, row 0, .*got nan"),
    ({"robot": ARM, "q": [[0.0, 0.1], [8.0, 0.1]]}, r"q, row 1, entry 0: .*360 deg outside joint 1's limits of -57"),
    ({"robot": ARM, "q": [[0.0, 2.0], [0.0, 0.1]]}, r"q, row 0, .*1200 mm outside joint 2's limits of 0 to 500 mm"),
    ({"robot": ARM, "position": [[0, 0, 1], [0, 300, 0], [0, 0, 0]]}, r"position, row 1, entry 1: .*1200 mm"),
    ({"robot": ARM, "distance": [1.0, 1.0, 300.0]}, r"distance, row 2, .*reach of 1200 mm \(is its unit right\?\)"),
]


@pytest.mark.parametrize(("arrays", "message"), WRONG)
def test_invalid_input_is_refused_with_its_place(arrays: dict, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        Dataset.from_arrays(**{"q": Q, **arrays})


def test_a_full_turn_beyond_a_limit_and_a_far_base_are_no_error() -> None:
    data = Dataset.from_arrays([[1.0 + 2 * math.pi - 1e-9, 1.69]], position=[[10.0, 0.0, 0.0]], robot=ARM)
    assert data.q[0, 0] == 1.0 + 2 * math.pi - 1e-9
