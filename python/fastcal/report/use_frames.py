# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a model is used for, as tables: predictions, inverse kinematics, commands, designs, paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from fastcal.arrays import FloatArray
from fastcal.calibration.prediction import Prediction
from fastcal.compensation import Compensation, PathAccuracy
from fastcal.design.result import PoseDesign
from fastcal.ik.inverse_kinematics import InverseKinematics
from fastcal.measurements.targets import Targets
from fastcal.report.frames import frame
from fastcal.units import from_si


def _joints(q: FloatArray, joint_types: Sequence[str]) -> dict[str, Any]:
    """Columns q1_deg (q1_mm) ..., as a measurement file has them."""
    units = ["mm" if kind == "prismatic" else "deg" for kind in joint_types]
    return {
        f"q{joint}_{unit}": from_si(column, unit)
        for joint, (unit, column) in enumerate(zip(units, np.asarray(q).T, strict=True), start=1)
    }


def _left(found: InverseKinematics | Compensation) -> dict[str, Any]:
    """What is left at each target."""
    return {
        "status": found.status,
        "residual_mm": from_si(found.position_error, "mm"),
        "residual_deg": from_si(found.rotation_error, "deg"),
    }


@frame.register
def _(found: Prediction) -> pd.DataFrame:
    """A row a pose, as `fastcal predict` writes it."""
    return pd.DataFrame(found.columns()).rename_axis("row")


@frame.register
def _(found: InverseKinematics) -> pd.DataFrame:
    """A row a target."""
    return pd.DataFrame(_joints(found.q, found.robot.joint_types) | _left(found)).rename_axis("row")


@frame.register
def _(found: Compensation) -> pd.DataFrame:
    """A row a target, as `fastcal compensate` writes it."""
    columns = _joints(found.q, found.joint_types) | _left(found) | {"sigma_mm": from_si(found.sigma, "mm")}
    if found.correction_weight is not None:
        columns["correction_weight"] = found.correction_weight
    return pd.DataFrame(columns).rename_axis("row")


@frame.register
def _(found: PoseDesign) -> pd.DataFrame:
    """A row a pose in the order of visiting, as `fastcal design` writes it."""
    columns = _joints(found.q, found.joint_types) | {"payload_kg": found.payload}
    columns |= {f"approach{joint}": column for joint, column in enumerate(found.approach.T.astype(int), start=1)}
    columns |= {} if found.plane is None else {"plane": found.plane}
    return pd.DataFrame(columns, index=pd.RangeIndex(1, len(found) + 1, name="order"))


@frame.register
def _(found: PathAccuracy) -> pd.DataFrame:
    """A row a place along the path."""
    columns = {"along_mm": found.along} | {"error_before_mm": found.before, "error_after_mm": found.after}
    columns |= {"across_before_mm": found.off_before, "across_after_mm": found.off_after, "sigma_mm": found.sigma}
    return pd.DataFrame({name: from_si(values, "mm") for name, values in columns.items()})


@frame.register
def _(targets: Targets) -> pd.DataFrame:
    """A row a pose: the point, and its rotation matrix row by row."""
    names = [f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)]
    rotations = targets.poses[:, :3, :3].reshape(len(targets), 9).T
    columns = dict(zip(("x_mm", "y_mm", "z_mm"), from_si(targets.poses[:, :3, 3], "mm").T, strict=True))
    return pd.DataFrame(columns | dict(zip(names, rotations, strict=True))).rename_axis("row")
