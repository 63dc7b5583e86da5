# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arms that no maker ships in a file of ours: a SCARA, a gantry, shipped arms on a rail."""

from __future__ import annotations

import copy
from typing import Any

from diagnosis_arms import complete_arm

from fastcal import Robot, load_robot
from fastcal.robot.given import as_robot

# payload [kg] that they carry
MADE = {"scara": 6.0, "gantry": 25.0, "kuka_kr210_r2700 on a rail": 210.0, "lbr_iiwa14 on a rail": 14.0}


def _row(
    a: float, alpha: float, d: float, low: float, high: float, *, slides: bool = False, theta: float = 0.0
) -> dict[str, Any]:
    """A row of Craig's parameters [mm, deg] with its limits."""
    kind, unit = ("prismatic", "mm") if slides else ("revolute", "deg")
    row = {"type": kind, "theta_deg": theta, "d_mm": d, "a_mm": a, "alpha_deg": alpha}
    return row | {f"min_{unit}": low, f"max_{unit}": high}


def _made(name: str, rows: list[dict[str, Any]], most: float) -> Robot:
    spec = {
        "name": name,
        "kinematics": "mdh",
        "joints": rows,
        "tool": {"xyz_mm": [60.0, 0.0, 110.0]},
        "payload": {"com_mm": [20.0, 10.0, 80.0]},
    }
    return complete_arm(as_robot(spec), most)


def scara() -> Robot:
    """Four joints: two links, a stroke, the turn of the quill."""
    rows = [
        _row(0, 0, 340, -150, 150),
        _row(325, 0, 60, -145, 145),
        _row(275, 180, 0, 0, 200, slides=True),
        _row(0, 0, 50, -180, 180),
    ]
    return _made("scara", rows, MADE["scara"])


def gantry() -> Robot:
    """Three slides and a wrist."""
    rows = [
        _row(0, -90, 300, 0, 2000, slides=True),
        _row(0, 90, 900, 0, 1500, slides=True, theta=90),
        _row(0, 90, 150, 0, 1200, slides=True),
        _row(0, 90, 120, -170, 170),
        _row(0, 90, 0, -110, 110),
        _row(0, -90, 90, -170, 170),
    ]
    return _made("gantry", rows, MADE["gantry"])


def _on_a_rail(name: str) -> Robot:
    """A shipped arm that a rail of three metres moves along the y axis of its base."""
    most = MADE[f"{name} on a rail"]
    spec = copy.deepcopy(dict(complete_arm(load_robot(name), most).spec))
    spec["joints"][0]["alpha_deg"] += 90.0
    rail = _row(0, -90, 0, -1500, 1500, slides=True)
    rail["link"] = {"mass_kg": 10.0 * most, "com_mm": [0.0, 0.0, 0.0]}
    return as_robot(spec | {"name": f"{name}_rail", "joints": [rail, *spec["joints"]]})


MADE_ARMS = {
    "scara": scara,
    "gantry": gantry,
    "kuka_kr210_r2700 on a rail": lambda: _on_a_rail("kuka_kr210_r2700"),
    "lbr_iiwa14 on a rail": lambda: _on_a_rail("lbr_iiwa14"),
}
