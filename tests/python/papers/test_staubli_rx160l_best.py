# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What fastcal's best leaves of the RX160L's rows, on few of them."""

import numpy as np
import pytest

pytest.importorskip("torch")

import fastcal
from fastcal.arrays import FloatArray
from fastcal.measurements.dataset import Dataset
from fastcal_studies import staubli_rx160l as study
from fastcal_studies import staubli_rx160l_best
from fastcal_studies.simulated import Unmodelled, measure
from fastcal_studies.staubli_rx160l_best import SHARES, best, with_process


def test_the_process_learns_the_gears_and_compliances_the_load(monkeypatch: pytest.MonkeyPatch) -> None:
    """More rows leave less; under another load the true compliances leave what they leave under the tool's."""
    monkeypatch.setattr(staubli_rx160l_best, "LIKELIHOOD_ROWS", 120)
    nominal, true = study.nominal_arm(), study.true_arm(0)
    still = Unmodelled((0.0,) * 6, 1.0, 0.0, 0)

    def at(q: FloatArray, load: float, number: int) -> Dataset:
        return measure(true, Dataset.from_arrays(q, payload=np.full(len(q), load)), still, 1e-5, number)

    q = fastcal.random_poses(nominal, 400, seed=1)
    few, many = (at(q[:90], 3.6, 0), at(q[90:130], 3.6, 1)), (at(q[130:330], 3.6, 2), at(q[330:], 3.6, 3))
    process = with_process(nominal, many[0], 0, SHARES)
    found = best(nominal, process, few, many, [at(q[330:], 9.95, 4)], true, 0)
    before, after = found["before"]["unseen"], found["unseen"]
    assert after["mean"] < 0.5 * before["mean"]
    assert list(found["by_rows"]) == ["200", "100", "50"]
    assert sorted(found["by_rows"].values()) == list(found["by_rows"].values())
    assert found["by_rows"]["200"] == pytest.approx(after["mean"])
    assert found["few_by_many"]["mean"] < found["few"]["mean"] < before["mean"]
    assert found["loads"]["9.95 kg"]["mean"] == pytest.approx(after["mean"], rel=0.2)
