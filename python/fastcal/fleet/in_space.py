# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where the tools of a fleet's arms are off in common, and which joints bring it about: a scene for its page.

With p_a (R, 3) [m] the tool of arm a's model in R postures and n_a that of its nominal arm, which has the same base and
tool, both in the axes of the base, the arm is off by e_a = p_a - n_a less what another base and tool explain to first
order: e_a - A A^+ e_a, A with three rows [I, -[n_a]x, R_a] a posture, R_a the orientation of the flange. Drawn is the
mean of e_a over the arms.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.simulation import random_poses
from fastcal.errors import FastcalError
from fastcal.fleet.result import Fleet
from fastcal.measurements.dataset import Dataset
from fastcal.report import workspace
from fastcal.report.arm import contributions, in_base, posed
from fastcal.report.figures import Figure, spread_rows
from fastcal.report.language import _
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot
from fastcal.units import from_si

_POSTURES, _SEED = 60, 1
_MOST = 100  # arms, spread over the fleet: more change little, and each takes 10 ms


def shared_errors(found: Fleet) -> Figure | None:
    """The scene of the most frequent kind of arm; None where no two arms of a kind have a model."""
    models = [arm.model for arm in found if arm.model is not None and not arm.model.of_poses and not arm.model.passive]
    kinds = Counter((model.name, model.kinematics, tuple(model.joint_types)) for model in models)
    if not kinds or (most := kinds.most_common(1)[0])[1] < 2:
        return None
    models = [m for m in models if (m.name, m.kinematics, tuple(m.joint_types)) == most[0]]
    models = [models[k] for k in spread_rows(len(models), _MOST)]
    try:
        data = Dataset.from_arrays(random_poses(models[0], _POSTURES, seed=_SEED))
        off = [error_of(model, data) for model in models]
        own = [contributions(model, nominal_robot(model), data) for model in models]
    except FastcalError:  # a joint without limits, a model that does not keep what it was before
        return None
    first = models[0]
    known = [each for each in own if each is not None]
    share = np.median(known, axis=0) if len(known) == len(models) else None
    labels = [_("posture {number}", number=k + 1) for k in range(len(data))]
    arm = posed(first, data.q, None, [(0, k) for k in range(len(data))], labels)
    arm = replace(in_base(arm, first), contributions=share)
    told = _(
        "Each arrow points from the tool of the nominal arm towards the mean of {count} arms of the kind {name}, bases "
        "and tools aligned, magnified as stated in the heading. The joints' numbers are medians over these arms.",
        count=len(models),
        name=first.name,
    )
    points, mean = np.asarray(from_si(_tool(nominal_robot(first), data), "mm")), from_si(np.mean(off, axis=0), "mm")
    title = _("What the arms have in common")
    return workspace.scene(points, np.asarray(mean), None, np.zeros(3), _("the base"), arm, told=told, title=title)


def error_of(model: Robot, data: Dataset) -> FloatArray:
    """(R, 3) [m] how far a model's tool is from its nominal arm's, as above, in the axes of its base."""
    nominal = nominal_robot(model)
    n = _tool(nominal, data)
    error = _tool(model, data) - n
    base = np.asarray(nominal.core.base_and_tool(nominal.core.nominal)[0])
    R = base[:3, :3].T @ nominal.poses(data)[:, :3, :3]
    x, y, z, none = *n.T, np.zeros(len(n))
    turned = np.array([[none, z, -y], [-z, none, x], [y, -x, none]]).transpose(2, 0, 1)  # -[n]x
    A = np.concatenate([np.tile(np.eye(3), (len(n), 1, 1)), turned, R], axis=2).reshape(-1, 9)
    return np.asarray((error.ravel() - A @ np.linalg.lstsq(A, error.ravel(), rcond=None)[0]).reshape(-1, 3))


def _tool(robot: Robot, data: Dataset) -> FloatArray:
    """(R, 3) [m] the tool in the axes of the base."""
    base = np.asarray(robot.core.base_and_tool(robot.core.nominal)[0])
    return np.asarray((robot.poses(data)[:, :3, 3] - base[:3, 3]) @ base[:3, :3])
