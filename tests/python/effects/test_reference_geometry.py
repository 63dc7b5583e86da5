# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A model that is written is the one that was fitted, also where an effect's numbers count from the geometry."""

from pathlib import Path

import numpy as np

import fastcal
from fastcal.measurements.dataset import Dataset
from fastcal_studies import siasun_sr210d as study
from fastcal_studies.simulated import Unmodelled

SEED = 2
EFFECTS = [
    *study.TRANSMISSION,
    *(f"joint_compliance@joint{j}" for j in study.SOFT),
    *(f"gravity_sag@joint{j}" for j in (2, 3)),
]


def test_identified_sag_survives_the_file(tmp_path: Path) -> None:
    """On these screws even links have no part along one axis of joint 2: its sign is that of the errors found."""
    nominal, true = study.nominal_arm(), study.true_arm(SEED)
    outside = Unmodelled(study.WAVES_RAD, study.LOAD_KG, study.GROWTH, SEED)
    q = study.poses(nominal, 100, SEED)
    empty = study.measured(true, outside, q[:50], 0.0, 20)
    loaded = study.measured(true, outside, q[50:], study.LOAD_KG, 22)
    data = Dataset.concatenate([empty, loaded])
    found = fastcal.calibrate(nominal, data, effects=EFFECTS, loss="none")
    assert found.status == "converged"
    found.save(tmp_path / "out")
    written = fastcal.load_robot(tmp_path / "out" / "model.yaml")
    left = written.poses(data)[:, :3, 3] - np.asarray(data.position)
    assert np.sqrt(np.mean(left**2)) < found.sigma  # which divides by fewer than all rows
