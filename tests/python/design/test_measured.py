# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What was measured already counts in a design by the numbers that it holds, of whatever kind."""

from dataclasses import replace

import numpy as np
import pytest

from fastcal.design import Instruments, design_poses
from fastcal.measurements.dataset import Dataset

from ..calibration.bench_arm import disturbed, postures, robot
from ..calibration.kind_sets import ALONE, NOISE, PAIRS, read

MORE = {"candidates": postures(80, 21), "targets": postures(25, 22), "sigma": NOISE["position"]}


def sigma(measured: Dataset | None, **options: object) -> float:
    return design_poses(robot(), 12, measured=measured, **{**MORE, **options}).sigma  # type: ignore[arg-type]


@pytest.mark.parametrize("kinds", [*ALONE, *PAIRS], ids="+".join)
def test_readings_of_every_kind_help_and_none_counts_as_points(kinds: tuple[str, ...]) -> None:
    """Lengths, inclinations and turns counted as measured points: a plan after them was of four more poses."""
    data = read(kinds, 60, 3)
    points = Dataset.from_arrays(data.q, position=read(("position",), 60, 3).position)
    alone, told = sigma(None), sigma(data)
    if kinds == ("orientation",):  # the design has no sigma of one
        assert told == pytest.approx(alone)
    else:
        assert told < alone
    if "position" in kinds:
        assert told <= sigma(points) * (1 + 1e-6)
    else:
        assert told > sigma(points)


def test_orientations_count_where_their_sigma_is_given() -> None:
    data = read(("position", "orientation"), 60, 3)
    bare = replace(data, rotation=None)
    found = design_poses(robot(), 12, measured=data, **MORE)  # type: ignore[arg-type]
    assert found.notes == [
        "orientations measured already are not counted: the design has no sigma of a measured orientation"
    ]
    turned = {"sigma_rotation": NOISE["orientation"]}
    assert sigma(data, **turned) < sigma(bare, **turned)


def test_lengths_predict_as_a_calibration_with_points_after_them() -> None:
    """The deviations of the plan are those of a calibration of 60 lengths and the points that were planned."""
    import fastcal

    lengths = read(("length",), 60, 4, truth=disturbed(4))
    found = design_poses(robot(), 40, measured=lengths, instruments=Instruments(), **MORE)  # type: ignore[arg-type]
    points = read(("position",), 40, 4, truth=disturbed(4), q=found.q)
    names = lengths.anchor_names
    assert points.position is not None
    assert lengths.distance is not None
    assert lengths.anchor is not None
    both = Dataset.from_arrays(
        np.concatenate([lengths.q, points.q]),
        position=np.concatenate([np.full((60, 3), np.nan), points.position]),
        distance=np.concatenate([lengths.distance, np.full(40, np.nan)]),
        anchor=[*(names[k] for k in lengths.anchor), *[""] * 40],
        sigma_position=np.full(100, NOISE["position"]),
        robot=robot(),
    )
    result = fastcal.calibrate(robot(), both, loss="none")
    identified = {f"{p.owner} {p.name.removesuffix(f'_{p.unit}')}": p for p in result.parameters}
    stated = np.sqrt(np.diag(result.covariance))
    std = {name: stated[k] for k, name in enumerate(identified)}
    predicted = dict(zip(found.parameters, found.deviations, strict=True))
    for name in ("joint2 theta", "joint2 a", "joint3 alpha", "joint4 theta"):
        assert predicted[name] == pytest.approx(std[name], rel=0.3), name


def test_too_few_readings_of_a_kind_are_said() -> None:
    few = read(("length",), 60, 3).select(slice(2))
    found = design_poses(robot(), 12, measured=few, **MORE)  # type: ignore[arg-type]
    assert found.sigma == pytest.approx(sigma(None))
    assert found.notes
    assert found.notes[0].startswith("lengths measured already are not counted: ")
