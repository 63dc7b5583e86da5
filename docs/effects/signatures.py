# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Signatures of gears, temperature, base, tool and instrument, as fastcal simulates them."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from drawing import Figure, FloatArray

from fastcal import _core
from fastcal.io.robot_file import load_robot
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

POINTS = 121


def arm() -> Robot:
    """The RX160L; its joint 3 turns the forearm from -150 to 150 degrees."""
    return load_robot("staubli_rx160l")


def having(effect: str, owner: str, parameters: dict[str, float], **options: Any) -> Robot:
    """The arm with one effect."""
    spec = copy.deepcopy(arm().spec)
    spec["effects"] = [{"effect": effect, "owner": owner, "parameters": parameters, **options}]
    return Robot(spec)


def postures(joint: int | None = None, values: FloatArray | None = None) -> FloatArray:
    """(POINTS, 6) one posture, in which one joint goes through `values` [rad]."""
    q = np.tile(to_si(np.array([20.0, -40.0, 70.0, 30.0, 50.0, 10.0]), "deg"), (POINTS, 1))
    if joint is not None:
        q[:, joint - 1] = values
    return q


def joint_error(model: Robot, joint: int, q: FloatArray, **conditions: Any) -> FloatArray:
    """Turn of a joint against the arm without the effect [mrad]."""
    step = np.zeros_like(q)
    step[:, joint - 1] = 1e-4
    nominal, further = arm().forward(q)[:, :3, :3], arm().forward(q + step)[:, :3, :3]
    there = model.forward(q, **conditions)[:, :3, :3]
    axis = [np.asarray(_core.log_so3(a.T @ b)) / 1e-4 for a, b in zip(nominal, further, strict=True)]
    turn = [np.asarray(_core.log_so3(a.T @ b)) for a, b in zip(nominal, there, strict=True)]
    return from_si(np.einsum("ni,ni->n", turn, axis), "mrad")


def shift(model: Robot, q: FloatArray, **conditions: Any) -> FloatArray:
    """(POINTS, 3) motion of the tool against the arm without the effect [mm]."""
    return from_si(model.forward(q, **conditions)[:, :3, 3] - arm().forward(q)[:, :3, 3], "mm")


def over_joint(joint: int, low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """A joint's way in degrees and the postures along it."""
    way = np.linspace(low, high, POINTS)
    return way, postures(joint, to_si(way, "deg"))


def reduction_ratio() -> Figure:
    """A line through zero."""
    way, q = over_joint(3, -150, 150)
    model = having("reduction_ratio", "joint3", {"error": 5e-4})
    return Figure("q3 [deg]", "joint 3 [mrad]", way, [("error 5e-4", joint_error(model, 3, q))])


def coupling_ratio() -> Figure:
    """A line over another joint's position."""
    way, q = over_joint(5, -105, 120)
    model = having("coupling_ratio", "joint6<-joint5", {"ratio": 2e-3})
    return Figure("q5 [deg]", "joint 6 [mrad]", way, [("ratio 2e-3", joint_error(model, 6, q))])


def gear_harmonic() -> Figure:
    """Waves over the joint, of any order."""
    way, q = over_joint(3, -150, 150)
    curves = [
        (
            f"order {order}",
            joint_error(
                having("gear_harmonic", "joint3", {"amplitude_rad": size, "phase_rad": 0.6}, order=order), 3, q
            ),
        )
        for order, size in ((1, 4e-4), (2, 2e-4), (7, 1e-4))
    ]
    return Figure("q3 [deg]", "joint 3 [mrad]", way, curves)


def joint_profile() -> Figure:
    """Any smooth curve, and how it fades at its ends."""
    way, q = over_joint(3, -150, 150)
    parts = {"curve1_rad": 1e-4, "curve2_rad": -8e-5, "curve4_rad": 1.2e-4, "curve7_rad": 5e-5}
    model = having("joint_profile", "joint3", parts, low_deg=-110, high_deg=110)
    return Figure("q3 [deg]", "joint 3 [mrad]", way, [("fitted from -110 to 110", joint_error(model, 3, q))])


def backlash() -> Figure:
    """Two levels: by the approach, or by the load."""
    way, q = over_joint(3, -150, 150)
    model = having("backlash", "joint3", {"gap_rad": 4e-4})
    loaded = having("backlash", "joint3", {"load_gap_rad": 4e-4}, side="load", width_nm=10.0)
    curves = [
        (f"approach {side:+d}", joint_error(model, 3, q, approach=side * np.ones((POINTS, 6)))) for side in (1, -1)
    ]
    return Figure("q3 [deg]", "joint 3 [mrad]", way, [*curves, ("side=load", joint_error(loaded, 3, q))])


def thermal_expansion() -> Figure:
    """Growth with the temperature."""
    kelvin = np.linspace(288.15, 313.15, POINTS)
    curves = []
    for owner in ("robot", "link2", "link4"):
        model = having("thermal_expansion", owner, {"coefficient_1_k": 1.2e-5}, t0_c=20.0)
        moved = shift(model, postures(), temperature=kelvin)
        curves.append((owner, np.sign(kelvin - 293.15) * np.linalg.norm(moved, axis=1)))
    return Figure("temperature [deg C]", "tool [mm]", from_si(kelvin, "c"), curves)


def thermal_offset() -> Figure:
    """A zero that follows the temperature."""
    kelvin = np.linspace(288.15, 313.15, POINTS)
    model = having("thermal_offset", "joint3", {"rad_k": 1e-5}, t0_c=20.0)
    error = joint_error(model, 3, postures(), temperature=kelvin)
    return Figure("temperature [deg C]", "joint 3 [mrad]", from_si(kelvin, "c"), [("1e-5 rad/K", error)])


def base_drift() -> Figure:
    """Lines over time."""
    time = np.linspace(0, 14400, POINTS)
    rates = {"rate_x_mm_s": 8e-6, "rate_z_mm_s": -1e-5, "rate_ry_rad_s": 6e-9}
    moved = shift(having("base_drift", "base", rates, t0_s=7200.0), postures(), time=time)
    return Figure("time [s]", "tool [mm]", time, list(zip("xyz", moved.T, strict=True)))


def base_step() -> Figure:
    """A step in time."""
    time = np.linspace(0, 14400, POINTS)
    steps = {"step_x_mm": 0.1, "step_y_mm": -0.05, "step_rz_rad": 5e-5}
    moved = shift(having("base_step", "base", steps, at_s=6000.0), postures(), time=time)
    return Figure("time [s]", "tool [mm]", time, list(zip("xyz", moved.T, strict=True)))


def station_offset() -> Figure:
    """A level for each station."""
    row = np.arange(POINTS, dtype=float)
    labels = np.array(["A", "B", "C"])[(np.arange(POINTS) // 20) % 3]
    offsets = {"station2_x_mm": 0.06, "station2_z_mm": -0.03, "station3_y_mm": 0.05}
    model = having("station_offset", "base", offsets, stations=["A", "B", "C"])
    return Figure(
        "row, 20 from each station",
        "tool [mm]",
        row,
        list(zip("xyz", shift(model, postures(), station=labels).T, strict=True)),
    )


def tool_shift() -> Figure:
    """A shift that turns with the tool."""
    way, q = over_joint(6, -180, 180)
    model = having("tool_shift", "tool", {"mount2_x_mm": 0.05}, mounts=["1", "2"])
    return Figure(
        "q6 [deg]", "tool, second mount [mm]", way, list(zip("xyz", shift(model, q, mount="2").T, strict=True))
    )


def measurement_scale() -> Figure:
    """A line over the distance."""
    _, q = over_joint(3, -150, 150)
    distance = np.linalg.norm(arm().forward(q)[:, :3, 3], axis=1)
    order = np.argsort(distance)
    moved = np.linalg.norm(shift(having("measurement_scale", "instrument", {"error": 2e-5}), q), axis=1)
    return Figure("distance from the instrument [m]", "tool [mm]", distance[order], [("error 2e-5", moved[order])])


def regressor() -> Figure:
    """A line over a column of the user's own."""
    tilt = np.linspace(-3, 3, POINTS)
    model = having("regressor", "base", {"tilt_rx_rad": 5e-5}, column="tilt", axis="rx")
    moved = shift(model, postures(), extra={"tilt": tilt})
    return Figure("tilt (the user's own column)", "tool [mm]", tilt, list(zip("xyz", moved.T, strict=True)))


def tracker_range() -> Figure:
    """A constant and a line over the distance."""
    _, q = over_joint(3, -150, 150)
    distance = np.linalg.norm(arm().forward(q)[:, :3, 3], axis=1)
    order = np.argsort(distance)
    curves = []
    for name, parameters in (("offset 20 um", {"offset_mm": 0.02}), ("scale 2e-5", {"scale": 2e-5})):
        moved = np.linalg.norm(shift(having("tracker_range", "instrument", parameters), q), axis=1)
        curves.append((name, moved[order]))
    return Figure("distance from the instrument [m]", "tool [mm]", distance[order], curves)


def tracker_angle() -> Figure:
    """A wave over the azimuth."""
    way, q = over_joint(1, -180, 180)
    curves = []
    for part in ("azimuth_sine", "azimuth_cosine"):
        model = having("tracker_angle", "instrument", {f"{part}_rad": 2e-5})
        p, moved = arm().forward(q)[:, :3, 3], shift(model, q)
        around = np.column_stack([-p[:, 1], p[:, 0], 0 * p[:, 0]]) / np.hypot(p[:, 0], p[:, 1])[:, np.newaxis]
        curves.append((part, np.einsum("ni,ni->n", moved, around)))
    return Figure("q1 [deg], instrument below the robot", "tool, sideways [mm]", way, curves)


def settling() -> Figure:
    """A line over the last move."""
    move = np.linspace(-2, 2, POINTS)
    moves = np.zeros((POINTS, 6))
    moves[:, 2] = move
    error = joint_error(having("settling", "joint3", {"rad_rad": -2e-4}), 3, postures(), move=moves)
    return Figure("last move of joint 3 [deg]", "joint 3 [mrad]", from_si(move, "deg"), [("-2e-4", error)])


def surrogate() -> Figure:
    """A smooth curve that ends with its data."""
    way, q = over_joint(3, -150, 150)
    nodes = to_si(np.array([-90.0, -45.0, 0.0, 45.0, 90.0]), "deg")
    model = having(
        "surrogate",
        "joint3",
        {"amount": 1.0},
        inputs="q3",
        low=[float(nodes[0])],
        high=[float(nodes[-1])],
        width=[0.5],
        nodes=nodes.tolist(),
        weights=[1e-4, -2e-4, 1e-4, 2e-4, -5e-5],
    )
    return Figure("q3 [deg]", "joint 3 [mrad]", way, [("data from -90 to 90", joint_error(model, 3, q))])
