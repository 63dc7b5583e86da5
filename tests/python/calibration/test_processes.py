# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Work side by side: how it is shared out."""

from __future__ import annotations

import pytest

from fastcal import InvalidInput
from fastcal.calibration import processes
from fastcal.calibration.processes import SideBySide, workers


@pytest.mark.parametrize("count", [1, 2, 7, 64])
@pytest.mark.parametrize("items", [0, 1, 4, 23, 1000])
def test_shares_are_all_items_in_order_and_ever_smaller(items: int, count: int) -> None:
    parts = SideBySide(count, map).shares(range(items), 60)
    assert [item for part in parts for item in part] == list(range(items))
    sizes = [len(part) for part in parts]
    assert sizes == sorted(sizes, reverse=True)
    assert max(sizes, default=0) <= 60


def test_the_last_shares_are_small_so_that_all_end_together() -> None:
    parts = SideBySide(2, map).shares(range(1000), 60)
    assert [len(part) for part in parts[:3]] == [60, 60, 60]
    assert sum(map(len, parts[-2:])) <= 10
    assert len(parts) < 40


def test_shares_of_many_workers_leave_none_idle() -> None:
    assert len(SideBySide(40, map).shares(range(1000), 60)) >= 40


def test_one_at_a_time_where_that_is_the_most() -> None:
    assert [list(part) for part in SideBySide(2, map).shares([1, 2, 3], 1)] == [[1], [2], [3]]


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_are_in_the_order_of_the_arguments(jobs: int) -> None:
    with workers(jobs, None) as side_by_side:
        assert side_by_side.count == jobs
        assert list(side_by_side.results(abs, [-3, 2, -1])) == [3, 2, 1]


def test_no_process_is_refused() -> None:
    with pytest.raises(InvalidInput, match="jobs must be at least 1, got 0"), workers(0, None):
        pass


def test_a_cluster_gets_large_arguments_in_messages_that_it_does_not_warn_of(recwarn: pytest.WarningsRecorder) -> None:
    distributed = pytest.importorskip("distributed")
    assert processes._MESSAGE < 10**7
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster,
        workers(1, cluster.scheduler_address) as side_by_side,
    ):
        assert side_by_side.count == 1
        parts = [bytes([k]) * 2**20 for k in range(20)]
        assert list(side_by_side.results(_first, parts)) == list(range(20))
        assert list(side_by_side.results(_first, [])) == []
    assert not [str(w.message) for w in recwarn if "large graph" in str(w.message)]


def _first(part: bytes) -> int:
    return part[0]
