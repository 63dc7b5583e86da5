# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Signatures of what jumps, comes to rest, or follows heat and distance, as fastcal simulates them."""

from __future__ import annotations

import numpy as np
from drawing import Figure, FloatArray
from signatures import POINTS, arm, having, joint_error, over_joint, postures, shift

from fastcal.units import from_si, to_si

TIME = np.linspace(0, 14400, POINTS)
KELVIN = np.linspace(288.15, 313.15, POINTS)


def tool_step() -> Figure:
    """A step that turns with the tool."""
    way, q = over_joint(6, -180, 180)
    moved = shift(having("tool_step", "tool", {"step_x_mm": 0.1, "step_z_mm": 0.04}, at_s=0.0), q, time=TIME)
    return Figure("q6 [deg], after the step", "tool [mm]", way, list(zip("xyz", moved.T, strict=True)))


def zero_step() -> Figure:
    """A step in time."""
    error = joint_error(having("zero_step", "joint3", {"step_rad": 5e-4}, at_s=6000.0), 3, postures(), time=TIME)
    return Figure("time [s]", "joint 3 [mrad]", TIME, [("5e-4 rad at 6000 s", error)])


def posture_backlash() -> Figure:
    """A step over another joint's position."""
    way, q = over_joint(2, -127, 142)
    model = having("posture_backlash", "joint1<-joint2", {"gap_rad": 1e-3}, at_deg=-72.0)
    return Figure("q2 [deg]", "joint 1 [mrad]", way, [("gap 1e-3 rad at -72 deg", joint_error(model, 1, q))])


def encoder_jump() -> Figure:
    """A step over the joint's own position."""
    way, q = over_joint(2, -127, 142)
    model = having("encoder_jump", "joint2", {"jump_rad": 1e-3}, at_deg=-72.0)
    return Figure("q2 [deg]", "joint 2 [mrad]", way, [("jump 1e-3 rad at -72 deg", joint_error(model, 2, q))])


def range_step() -> Figure:
    """A step in time along the line of sight."""
    model = having("range_step", "instrument", {"step_mm": 0.05}, at_s=6000.0)
    return Figure("time [s]", "tool [mm]", TIME, list(zip("xyz", shift(model, postures(), time=TIME).T, strict=True)))


def range_wave() -> Figure:
    """Waves over the distance."""
    distance, order, q = _distances()
    curves = []
    for period in (300.0, 80.0):
        moved = shift(having("range_wave", "instrument", {"sine_mm": 0.02, "cosine_mm": 0.0}, period_mm=period), q)
        outward = arm().forward(q)[:, :3, 3] / distance[:, np.newaxis]
        curves.append((f"period {period:g} mm", np.einsum("ni,ni->n", moved, outward)[order]))
    return Figure("distance from the instrument [m]", "length [mm]", distance[order], curves)


def _distances() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distances of postures from the instrument, their order, the postures."""
    _, q = over_joint(3, -150, 150)
    distance = np.linalg.norm(arm().forward(q)[:, :3, 3], axis=1)
    return distance, np.argsort(distance), q


def thermal_spring() -> Figure:
    """Waves over the joint, larger with the temperature."""
    way, q = over_joint(3, -150, 150)
    parts = {"offset_rad_k": 5e-6, "sine_rad_k": 2e-5, "cosine_rad_k": -1e-5}
    model = having("thermal_spring", "joint3", parts, t0_c=20.0)
    curves = [(f"{c:g} deg C", joint_error(model, 3, q, temperature=to_si(c, "c"))) for c in (15.0, 25.0, 35.0)]
    return Figure("q3 [deg]", "joint 3 [mrad]", way, curves)


def thermal_bending() -> Figure:
    """A line over the temperature between the sides."""
    model = having("thermal_bending", "link2", {"turn_rz_rad_k": 1e-5}, t0_c=20.0)
    moved = shift(model, postures(), temperature=KELVIN)
    return Figure("temperature [deg C]", "tool [mm]", from_si(KELVIN, "c"), list(zip("xyz", moved.T, strict=True)))


def thermal_base() -> Figure:
    """Lines over the temperature."""
    model = having("thermal_base", "base", {"rate_x_m_k": 4e-6, "rate_z_m_k": 1e-5, "rate_ry_rad_k": 3e-6}, t0_c=20.0)
    moved = shift(model, postures(), temperature=KELVIN)
    return Figure("temperature [deg C]", "tool [mm]", from_si(KELVIN, "c"), list(zip("xyz", moved.T, strict=True)))


def base_settling() -> Figure:
    """Curves over time that come to rest."""
    ways = {"way_x_mm": 0.1, "way_z_mm": -0.06}
    moved = shift(having("base_settling", "base", ways, begins_s=0.0, tau_s=1800.0), postures(), time=TIME)
    return Figure("time [s]", "tool [mm]", TIME, list(zip("xyz", moved.T, strict=True)))
