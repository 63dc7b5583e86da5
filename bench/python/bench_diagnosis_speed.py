# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a diagnosis takes: 300 and 20,000 rows of a loaded KR 500 with lost motion in one joint, one thread.

PYTHONPATH=bench/python pytest bench/python/bench_diagnosis_speed.py [--benchmark-timer=time.process_time]
"""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_arms import setting
from diagnosis_sets import drawable, measured, scaled
from pytest_benchmark.fixture import BenchmarkFixture

from fastcal import diagnose


@pytest.mark.parametrize(("rows", "rounds"), [(300, 5), (20_000, 1)])
def test_diagnose(benchmark: BenchmarkFixture, rows: int, rounds: int) -> None:
    random = np.random.default_rng(5)
    at = setting(random, "kuka_kr500_3", rows)
    truth = scaled(at, next(n for n in drawable(at) if n.key == ("backlash", "joint4")), 25.0, random)
    assert truth is not None
    data = measured(at, [truth], random)
    found = benchmark.pedantic(
        diagnose, (at.nominal, data), {"sigma": at.sigma}, rounds=rounds, warmup_rounds=int(rounds > 1)
    )
    assert [f.label for f in found.effects] == ["backlash@joint4"]
