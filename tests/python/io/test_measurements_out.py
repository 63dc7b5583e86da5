# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is written is read back: every field, empty cells and labels too."""

from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fastcal.io.measurements import load_measurements
from fastcal.io.measurements_out import write_measurements
from fastcal.measurements.dataset import Dataset

ARM = SimpleNamespace(
    joint_types=["revolute", "prismatic"],
    limits=np.array([[-3.2, 3.2], [-1.0, 1.0]]),
    mimics=(),
    passive=(),
    follow=lambda q: q,
    reach=1.5,
    joint_count=2,
)


def same(first: object, second: object) -> None:
    if isinstance(first, np.ndarray):
        np.testing.assert_allclose(second, first, rtol=1e-15, atol=1e-18)
    else:
        assert second == first


def full() -> dict[str, object]:
    rng = np.random.default_rng(0)
    holes = np.array([[1.0, 1.0, 1.0], [np.nan, 1.0, np.nan], [1.0, 1.0, 1.0], [np.nan] * 3])
    turned = rng.normal(size=(4, 4))
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    turned[1] = np.nan
    return {
        "q": rng.uniform(-1, 1, (4, 2)),
        "q_read": rng.uniform(-1, 1, (4, 2)) * [[1.0, np.nan]],
        "position": rng.normal(size=(4, 3)) * holes,
        "rotation": turned,
        "sigma_position": rng.uniform(1e-5, 2e-5, (4, 3)),
        "sigma_rotation": rng.uniform(1e-5, 2e-5, 4),
        "payload": rng.uniform(0, 5, 4),
        "wrench": rng.normal(size=(4, 6)),
        "current": rng.normal(size=(4, 2)),
        "temperature": rng.uniform(280, 300, 4),
        "time": rng.uniform(0, 100, 4),
        "station": ["B", "A", "B", "C"],
        "mount": ["1", "1", "2", "1"],
        "approach": [[1, -1], [0, 1], [-1, -1], [1, 0]],
        "extra": {"order": [1.0, np.nan, 3.0, 4.0]},
        "extra_labels": {"who": ["Jo, Bo", "", "x", 'y"z']},
    }


@pytest.mark.parametrize("with_lengths", [False, True])
def test_every_field_comes_back(tmp_path: Path, with_lengths: bool) -> None:
    arrays = full()
    if with_lengths:
        arrays |= {"distance": [1.0, np.nan, 0.5, 2.0], "anchor": ["w", "", "v", "w"]}
        arrays["sigma_position"] = [1e-5, 2e-5, 3e-5, 4e-5]
    data = Dataset.from_arrays(**arrays, robot=ARM)
    write_measurements(tmp_path / "data.csv", data, ARM.joint_types)
    back = load_measurements(tmp_path / "data.csv", ARM)
    for field in fields(Dataset):
        if field.name not in ("extra", "extra_labels", "notes", "source"):
            same(getattr(data, field.name), getattr(back, field.name))
    same(data.extra["order"], back.extra["order"])
    assert data.extra_labels == back.extra_labels


def test_what_is_absent_is_not_written(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    data = Dataset.from_arrays([[np.pi / 2, 0.25]], position=[[0.001, np.nan, 1.0]], sigma_position=4e-5)
    write_measurements(path, data, ARM.joint_types)
    assert path.read_text() == "q1_deg,q2_mm,x_mm,y_mm,z_mm,sigma_mm\n90.0,250.0,1.0,,1000.0,0.04\n"
