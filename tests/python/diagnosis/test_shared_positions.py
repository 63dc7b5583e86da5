# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows that share positions of their joints, and what is wrong with them: neither a gear nor a curve of a joint is."""

import json

import numpy as np
import pytest

from fastcal import diagnose, load_robot, perturbed, simulate
from fastcal.measurements.dataset import Dataset

ARM = load_robot("pmc6va030")
ANCHOR = np.array([0.1, 0.9, -0.1])  # [m]
HOOKED, READ = 1e-3, 2e-4  # standard deviations [m]


def lengths(batches: int, rows: int, seed: int, hooked: float, read: float) -> Dataset:
    """Of a wire from an anchor; joints 3 to 6 hold still in a batch, and the wire is hooked anew before each."""
    random = np.random.default_rng(seed)
    held = random.uniform([-0.7, -0.25, 1.2, -1.2], [0.2, -0.15, 1.4, 1.1], (batches, 4))
    free = random.uniform([-1.7, -0.1], [-0.7, 0.9], (batches * rows, 2))
    poses = Dataset.from_arrays(np.column_stack([free, np.repeat(held, rows, axis=0)]), robot=ARM)
    point = perturbed(ARM, seed=3).poses(poses)[:, :3, 3]
    offset = np.repeat(hooked * random.standard_normal(batches), rows)
    distance = np.linalg.norm(point - ANCHOR, axis=1) + offset + read * random.standard_normal(len(poses))
    return Dataset.from_arrays(poses.q, robot=ARM, distance=distance)


@pytest.mark.parametrize(
    ("batches", "rows", "seed"),
    [
        pytest.param(40, 10, 1, id="curves"),  # of four joints: 0.49 mm became 1.65
        pytest.param(90, 5, 35, id="a curve and a surrogate"),  # of joints 6 and 5: 0.30 mm became 0.57
        pytest.param(60, 10, 4, id="surrogates"),  # of joint 5 and link 3: 0.38 mm became 1.29
    ],
)
def test_what_batches_of_rows_share_is_not_named_and_makes_nothing_worse(batches: int, rows: int, seed: int) -> None:
    data = lengths(batches, rows, seed, HOOKED, READ)
    found = diagnose(ARM, data, test=lengths(20, 5, seed + 1000, 0.0, 0.0))
    assert found.verdict == "unexplained"
    assert [f for f in found.effects if f.grade in "AB"] == []
    assert found.unexplained is not None
    assert found.unexplained.formulas == ()
    before, after = found.gap[0].kinds["length"].test_rms, found.gap[-1].kinds["length"].test_rms
    assert before is not None
    assert after is not None
    assert after <= 1.02 * before


def test_a_wave_that_hides_in_its_phase_is_promised_at_no_size() -> None:
    """At two positions of a joint the cosine of any wave is a constant, which its zero takes up."""
    q = np.random.default_rng(2).uniform([-1.7, -0.3, -0.7, 0.2, 0.6, -1.2], [0.3, 0.9, 0.2, 1.2, 1.4, 1.2], (120, 6))
    q[:, 0] = np.where(np.arange(120) % 2, 0.5, -0.5)
    found = diagnose(ARM, simulate(perturbed(ARM, seed=3), Dataset.from_arrays(q, robot=ARM), noise=5e-5, seed=3))
    json.dumps(found.to_json_dict(), allow_nan=False)
    waves = {s.owner for s in found.smallest if s.effect == "gear_harmonic"}
    assert "joint1" not in waves
    assert "joint2" in waves
