# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots, data and results as pandas tables: `to_frame()`."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

import numpy as np
import pandas as pd

from fastcal.calibration.evaluation import Evaluation
from fastcal.calibration.result import CalibrationResult
from fastcal.diagnosis.result import Diagnosis
from fastcal.io.measurements_out import frame_of
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_name
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import content
from fastcal.units import from_si


@singledispatch
def frame(shown: Any) -> pd.DataFrame:
    """One row a joint, a pose, a parameter or a cause."""
    import fastcal.report.monitoring_frames
    import fastcal.report.use_frames  # noqa: F401  they register themselves

    found = frame.dispatch(type(shown))
    if found is frame.dispatch(object):
        raise TypeError(f"{type(shown).__name__} has no table")
    table: pd.DataFrame = found(shown)
    return table


@frame.register
def _(robot: Robot) -> pd.DataFrame:
    """The joints' rows of the robot file."""
    rows = [{key: value for key, value in content(joint).items() if key != "link"} for joint in robot.joints]
    masses = [np.nan if joint.link is None else joint.link.mass_kg for joint in robot.joints]
    index = pd.Index([joint_name(i) for i in range(len(rows))], name="joint")
    return pd.DataFrame(rows, index=index).assign(link_mass_kg=masses)


@frame.register
def _(data: Dataset) -> pd.DataFrame:
    return frame_of(data)


@frame.register
def _(found: Evaluation) -> pd.DataFrame:
    """Predicted less measured, a row a pose."""
    columns: dict[str, Any] = dict(zip(("dx_mm", "dy_mm", "dz_mm"), from_si(found.error_after, "mm").T, strict=True))
    columns["error_mm"] = from_si(np.linalg.norm(found.error_after, axis=1), "mm")
    if found.length_after is not None:
        columns["length_error_mm"] = from_si(found.length_after, "mm")
    if found.turn_after is not None:
        columns["rotation_error_deg"] = from_si(found.turn_after, "deg")
    return pd.DataFrame(columns).rename_axis("row")


@frame.register
def _(result: CalibrationResult) -> pd.DataFrame:
    """The identified parameters, in the units of their names, with 95 % confidence intervals."""
    low, high = result.interval().T if result.parameters else np.zeros((2, 0))
    columns = ["owner", "name", "unit", "nominal", "value", "std"]
    return pd.DataFrame([vars(p) for p in result.parameters], columns=columns).assign(low_95=low, high_95=high)


@frame.register
def _(found: Diagnosis) -> pd.DataFrame:
    """A row a parameter of each cause that was found."""
    rows = [
        {
            "effect": f.effect, "owner": f.owner, "grade": f.grade, "parameter": name, "value": v.value,
            "std": np.nan if v.std is None else v.std, "snr": f.snr,
            "or": ", ".join(f"{effect}@{owner}" for effect, owner in f.equivalents),
        }
        for f in found.effects
        for name, v in f.parameters.items()
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=["effect", "owner", "grade", "parameter", "value", "std", "snr", "or"])
