# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Geometry beside joint profiles: what both can explain is geometry's.

Over the joints' ranges in the data smooth curves of every joint's error do much of what lengths and angles do. Fitted
together, what the model lacks moves the two far apart, in opposite directions that nobody notices until a joint leaves
its range, the curve fades and the geometry stands alone. So the solver pulls geometry to where it would be without
profiles: curves take what geometry can't. Where the data tell the two apart, they outvote the pull.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.parameter_limits import parameter_limits
from fastcal.effects.entries import curve_of
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

PULL_SIZES = 0.05  # plausible sizes: 0.05 mm and 0.05 mrad


def pull_deviations(robot: Robot, model: _core.ErrorModel) -> FloatArray:
    """(P,) how far each parameter may lie from its fit without profiles at the cost of one deviation; inf: anywhere."""
    out = np.full(len(model.parameters), np.inf)
    if any(_curves(robot)):
        for i, parameter in enumerate(model.robot.parameters):
            if parameter.owner not in ("base", "tool"):
                out[i] = PULL_SIZES * parameter.sigma
    return out


def pulls(
    robot: Robot,
    model: _core.ErrorModel,
    samples: _core.Samples,
    measured: _core.Measurements,
    asked: list[int],
    anchors: FloatArray,
    *,
    loss: str,
    threads: int = 1,
) -> dict[str, FloatArray]:
    """Keyword arguments of the core's `identify` that pull geometry to its fit without profiles; none without profiles.

    Args:
        robot: With the effects to identify, their origins and curvatures set.
        model: Its model with base and tool fitted to the data.
        samples: Conditions of the rows.
        measured: What was measured.
        asked: Indices of the parameters to identify.
        anchors: (anchors, 3) starting places.
        loss: Robust loss.
        threads: Cores to use.
    """
    sigma = pull_deviations(robot, model)
    if not np.isfinite(sigma[asked]).any():
        return {}
    curves: set[int] = set()
    at = len(model.robot.parameters)
    for effect, curve in zip(robot.effects, _curves(robot), strict=True):
        own = range(at, at + len(effect.parameters))
        curves.update(own if curve else ())
        at = own.stop
    limits: dict[str, Any] = parameter_limits(robot, model, len(anchors), priors=False)
    moving = [i for i in asked if i not in curves]
    alone = _core.identify(
        model, samples, measured, asked=moving, anchors=anchors, loss=loss, threads=threads, **limits
    )
    return {"pull_mean": np.asarray(alone.theta), "pull_sigma": np.append(sigma, np.full(3 * len(anchors), np.inf))}


def _curves(robot: Robot) -> list[bool]:
    """Which effects are curves of joints, and no cause: a cause is fitted with the geometry from the start."""
    return [entry["effect"] == curve_of("joint") for entry in robot.spec.get("effects") or []]
