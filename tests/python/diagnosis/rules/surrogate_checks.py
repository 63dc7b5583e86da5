# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""When what remains is added to the model as a function without a name."""

from functools import cache
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np

from fastcal import calibrate
from fastcal.calibration.alignment import measurements
from fastcal.diagnosis import remaining_surrogate
from fastcal.diagnosis.problem import Noise
from fastcal.diagnosis.remaining_surrogate import with_surrogate
from fastcal.diagnosis.result import Unexplained
from fastcal.measurements.dataset import Dataset

from .mutants import falls_with
from .small_arm import SIGMA, arm, measured

UNEXPLAINED = Unexplained("joint1", 0.1, (), None, ())


@cache
def calibrated(curves: bool) -> tuple[Any, Dataset]:
    """The arm's geometry, fitted where joints 2 and 3 err along curves, and where nothing is missing."""
    data = measured([], rows=120)
    if curves:
        J = arm().joint_jacobian(data.q)[:, :3]
        turned = 5e-4 * np.exp(np.sin(data.q[:, 1])), 3e-4 * np.exp(np.sin(2 * data.q[:, 2]))
        assert data.position is not None
        data.position[:] += J[:, :, 1] * turned[0][:, None] + J[:, :, 2] * turned[1][:, None]
    return calibrate(arm(), data, loss="none").model, data


def added(curves: bool) -> tuple[str, Unexplained | None]:
    """The surrogates that are added, and what remains."""
    model, data = calibrated(curves)
    fit: Any = SimpleNamespace(
        problem=SimpleNamespace(
            noise=Noise((SIGMA, 1e-4, SIGMA)), data=data, measured=measurements(data, arm()), repeatability=None
        ),
        theta=np.zeros(0),
        unknowns={},
        model=SimpleNamespace(parameters=[]),
    )
    judge: Any = SimpleNamespace(threads=1, of=lambda model, *_: model)
    last: Any = SimpleNamespace(model=model)
    before: Any = SimpleNamespace(main=SimpleNamespace(train_rms=1.0, held_out_rms=1.0))
    with (
        mock.patch.object(remaining_surrogate, "nominal", return_value=None),
        mock.patch.object(remaining_surrogate, "unknowns_by_owner", return_value={}),
        mock.patch.object(remaining_surrogate, "gap_step", _step),
    ):
        _, step, unexplained = with_surrogate(last, before, fit, np.ones(len(data), dtype=bool), judge, UNEXPLAINED)
    return "" if step is None else step.added or "", unexplained


def _step(added: str | None, *_: Any) -> Any:
    """A surrogate halves what is left."""
    return SimpleNamespace(added=added, main=SimpleNamespace(train_rms=0.5, held_out_rms=None))


@falls_with(SURROGATE_EVIDENCE=1e9)
@falls_with(FURTHER_SURROGATE_EVIDENCE=1e9)
@falls_with(SURROGATE_HELD_OUT=0.0)
@falls_with(UNNAMED_LEAD=1e9)
@falls_with(MAX_SURROGATES=1)
def curves_of_two_joints_are_added() -> None:
    assert set(added(True)[0].split(",")) == {"surrogate@joint2", "surrogate@joint3"}


@falls_with(SURROGATE_EVIDENCE=-1.0)
def noise_leaves_nothing_unexplained() -> None:
    with mock.patch.object(remaining_surrogate, "SURROGATE_HELD_OUT", 2.0):  # nor by poses left out
        names, unexplained = added(False)
    assert names == ""
    assert unexplained is UNEXPLAINED
