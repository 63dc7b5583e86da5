# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Charts of the screens, as Plotly takes them; lengths in mm in the measuring frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.simulation import random_poses
from fastcal.errors import FastcalError
from fastcal.report.arm import posed, skeleton, through_points
from fastcal.report.cell_scene import with_own_rig
from fastcal.report.figures import log_ticks
from fastcal.report.formatting import significant
from fastcal.report.language import _, decimal_sign
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]
Figure = dict[str, Any]

BLUE, GREEN, RED, GREY, AMBER = "#1f5f8b", "#2e7d4f", "#b3261e", "#8a8f98", "#c77700"
_CAMERA = {"eye": {"x": 1.55, "y": 1.55, "z": 0.85}, "center": {"x": 0.0, "y": 0.0, "z": -0.1}}
_POSTURES = 256  # of which the space that an arm needs is found
_CONFIG = {"displaylogo": False, "responsive": True, "displayModeBar": False}


def scene(traces: Sequence[dict[str, Any]], box_mm: FloatArray | None = None) -> Figure:
    """Traces in space in a cube around them, or in the cube (3, 2) that is given; the view stays as it was turned."""
    ranges = _cube(traces) if box_mm is None else box_mm
    axis = {"showbackground": False, "zeroline": False, "gridcolor": "#b9bec6", "color": GREY, "nticks": 5}
    axes = {
        f"{name}axis": {**axis, "title": {"text": f"{name} mm"}, "range": ranges[k].tolist()}
        for k, name in enumerate("xyz")
    }
    layout = {
        "scene": {"aspectmode": "cube", "uirevision": "kept", "camera": _CAMERA, **axes},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "showlegend": False,
        "height": 420,
        "uirevision": "kept",
    }
    return {"data": list(traces), "layout": layout, "config": _CONFIG}


def _cube(traces: Sequence[dict[str, Any]]) -> FloatArray:
    """(3, 2) around all points of the traces."""
    given = [[value for trace in traces for value in trace[axis] if value is not None] for axis in "xyz"]
    if not given[0]:
        return np.tile([-1000.0, 1000.0], (3, 1))
    low, high = (np.array([limit(values) for values in given]) for limit in (min, max))
    return _around((low + high) / 2, float(np.max(high - low)) / 2)


def reach_of(robot: Robot) -> FloatArray:
    """(3, 2) a cube around what the arm takes up in its postures, or around what it could reach at most [mm]."""
    try:
        points = skeleton(robot, random_poses(robot, _POSTURES, seed=1))[0].reshape(-1, 3)
    except FastcalError:  # a rail without limits
        points = np.zeros((0, 3))
    if len(points):
        low, high = points.min(axis=0), points.max(axis=0)
        return _around((low + high) / 2, float(np.max(high - low)) / 2)
    T_world_base = robot.core.base_and_tool(robot.core.nominal)[0]
    return _around(np.asarray(from_si(T_world_base[:3, 3], "mm")), float(from_si(robot.reach, "mm")))


def _around(middle: FloatArray, half: float) -> FloatArray:
    return np.stack([middle - 1.05 * half, middle + 1.05 * half], axis=1)


def arm(robot: Robot, q: FloatArray, colour: str = BLUE, name: str = "") -> list[dict[str, Any]]:
    """The skeleton at q (n,), and its joints."""
    points, joints, through = skeleton(robot, q[np.newaxis])
    line = _trace(through_points(points[0], through), "lines", name or _("arm")) | {
        "line": {"width": 9, "color": colour}
    }
    dots = _trace(points[0][joints], "markers+text", name or _("arm")) | {
        "marker": {"size": 6, "color": "#ffffff", "line": {"color": colour, "width": 3}},
        "text": [f"J{k + 1}" for k in range(len(joints))],
        "textfont": {"color": GREY, "size": 11},
    }
    tool = _trace(points[0][-1:], "markers", _("tool")) | {"marker": {"size": 5, "color": AMBER, "symbol": "diamond"}}
    return [line, dots, tool]


def standing(robot: Robot, q: FloatArray) -> list[dict[str, Any]]:
    """The skeleton at q (n,), with the cameras and boards that its file names."""
    bare = posed(robot, q[np.newaxis], None, [(0, 0)], [""])
    traces = arm(robot, q)
    whole = with_own_rig(bare, robot, q[np.newaxis])
    for run in whole.runs[len(bare.runs) :]:
        points = through_points(whole.points[0], run.through)
        if run.width:
            traces.append(_trace(points, "lines", _("arm")) | {"line": {"width": run.width, "color": run.colour}})
        else:
            marker = {"size": 4, "color": run.colour}
            text = {"text": list(run.names), "textfont": {"color": GREY, "size": 11}}
            traces.append(_trace(points, "markers+text", ", ".join(run.names)) | {"marker": marker} | text)
    return traces


def cloud(points: FloatArray, colours: str | Sequence[str], texts: Sequence[str], size: int = 4) -> dict[str, Any]:
    """Points (N, 3) [mm] with a text each."""
    marker = {"size": size, "color": colours if isinstance(colours, str) else list(colours)}
    return _trace(points, "markers", _("points")) | {"marker": marker, "hovertext": list(texts), "hoverinfo": "text"}


def arrows(start: FloatArray, shift: FloatArray, times: float, colour: str) -> dict[str, Any]:
    """Lines from (N, 3) along (N, 3) [mm], drawn so many times as long."""
    ends = np.stack([start, start + times * shift, np.full_like(start, np.nan)], axis=1).reshape(-1, 3)
    return _trace(ends, "lines", _("shift")) | {"line": {"width": 4, "color": colour}}


def falling(counts: Sequence[float], values_mm: Sequence[float], goal_mm: float | None, x: str) -> Figure:
    """A predicted deviation that falls with the number of poses, and where it is to be."""
    axis = {"gridcolor": "rgba(127,127,127,.25)", "color": GREY}
    shown = [*values_mm, *([goal_mm] if goal_mm else [])]
    line = {
        "type": "scatter", "x": list(counts), "y": list(values_mm), "mode": "lines+markers",
        "line": {"color": BLUE, "width": 2}, "marker": {"size": 5}, "hovertemplate": "%{x}: %{y:.3g} mm<extra></extra>",
    }  # fmt: skip
    layout: dict[str, Any] = {
        "xaxis": {**axis, "title": {"text": x}, "rangemode": "tozero"},
        "yaxis": {**axis, "title": {"text": _("predicted σ, mm")}, "type": "log", **log_ticks(shown)},
        "margin": {"l": 60, "r": 10, "t": 10, "b": 45}, "height": 260,
        "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)", "uirevision": "kept",
    }  # fmt: skip
    if not values_mm:  # nothing to find a range from
        layout["xaxis"]["range"] = [0, 10]
        layout["yaxis"]["range"] = [float(np.log10(goal_mm or 0.1)) + end for end in (-0.5, 1.5)]
    if goal_mm:
        layout["shapes"] = [{"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": goal_mm, "y1": goal_mm,
                             "line": {"color": GREEN, "dash": "dash"}}]  # fmt: skip
        layout["annotations"] = [{"xref": "paper", "x": 1, "y": float(np.log10(goal_mm)), "text": _("goal"),
                                  "showarrow": False, "yshift": 9, "font": {"color": GREEN}}]  # fmt: skip
    return {"data": [line], "layout": layout | {"separators": f"{decimal_sign()} "}, "config": _CONFIG}


def bars(names: Sequence[str], values: Sequence[float], colours: Sequence[str], unit: str) -> Figure:
    """Horizontal bars, the first on top."""
    axis = {"gridcolor": "rgba(127,127,127,.25)", "color": GREY}
    trace = {
        "type": "bar", "orientation": "h", "y": list(names), "x": list(values), "marker": {"color": list(colours)},
        "text": [significant(value) for value in values], "textposition": "auto", "hoverinfo": "skip",
    }  # fmt: skip
    layout = {
        "xaxis": {**axis, "title": {"text": unit}, "rangemode": "tozero"},
        "yaxis": {**axis, "autorange": "reversed", "automargin": True},
        "margin": {"l": 10, "r": 10, "t": 10, "b": 45}, "height": 90 + 34 * len(names),
        "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)",
    }  # fmt: skip
    return {"data": [trace], "layout": layout | {"separators": f"{decimal_sign()} "}, "config": _CONFIG}


def millimetres(metres: FloatArray) -> FloatArray:
    """The same in mm."""
    return np.asarray(from_si(metres, "mm"))


def _trace(points: FloatArray, mode: str, name: str) -> dict[str, Any]:
    x, y, z = (([None if np.isnan(v) else round(float(v), 3) for v in column]) for column in np.asarray(points).T)
    return {"type": "scatter3d", "mode": mode, "x": x, "y": y, "z": z, "name": name, "hoverinfo": "name"}
