# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A study on a local Dask cluster finds what one core finds."""

import pytest

from fastcal.errors import InvalidInput
from fastcal_studies import run_study

distributed = pytest.importorskip("distributed")


@pytest.mark.full
@pytest.mark.filterwarnings("ignore")  # of Dask's own clean-up
def test_a_dask_cluster_finds_the_same() -> None:
    alone = run_study("kuka_kr500", arms=1)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        assert run_study("kuka_kr500", arms=1, cluster=cluster.scheduler_address) == alone


def test_an_invalid_address_is_refused() -> None:
    with pytest.raises(InvalidInput, match="nonsense://here: expected the address of a Dask scheduler"):
        run_study("kuka_kr500", arms=1, cluster="nonsense://here")
