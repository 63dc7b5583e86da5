# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A search on a local Dask cluster finds what one core finds."""

import numpy as np
import pytest

pytest.importorskip("torch")
distributed = pytest.importorskip("distributed")

import joblib  # noqa: E402 - what is asked for first decides whether the file is skipped

from fastcal.measurements.dataset import Dataset  # noqa: E402
from fastcal.networks.options import Options  # noqa: E402
from fastcal.networks.problem import problem_of  # noqa: E402
from fastcal.robot.robot import Robot  # noqa: E402
from fastcal_studies.networks import ga_dnn  # noqa: E402


@pytest.mark.filterwarnings("ignore")  # of Dask's own clean-up
def test_a_dask_cluster_finds_the_same(arm: Robot, data: Dataset) -> None:
    problem = problem_of(arm, data.select(slice(100)), folds=2)
    genes = np.random.default_rng(0).random((24, ga_dnn.GENES))
    budget = ga_dnn.Budget(population=24, generations=1, rungs=(2,))
    alone = ga_dnn.fitness(problem, genes, Options(), budget)
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster,
        distributed.Client(cluster),
        joblib.parallel_backend("dask"),
    ):
        together = ga_dnn.fitness(problem, genes, Options(), budget)
    assert together.tolist() == alone.tolist()
