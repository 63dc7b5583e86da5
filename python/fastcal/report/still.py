# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Figures of the report as still pictures (SVG): what a notebook shows that is saved or read without JavaScript.

What the report's figures are made of is drawn: lines, points with error bars, bars, fields of colour, and scenes in
three dimensions as they first appear on the page.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.report.figures import FONT, GRID, INK, MUTED, Figure, Key, Trace
from fastcal.report.language import decimal_sign
from fastcal.report.tables import capitalised

Array = NDArray[np.float64]

WIDTH = 860  # CSS pixels
_TITLE, _KEY, _ROOM = 30, 24, {"l": 70, "r": 16, "t": 10, "b": 46}
_DASHES = {"dash": "8 4", "dot": "2 3", "dashdot": "8 3 2 3"}
_LETTER = 6.4  # how wide one is at 12 pixels


def still(drawn: Sequence[Figure], width: int = WIDTH) -> str:
    """Figures side by side as one SVG drawing, their key below."""
    height = max(max(figure.height, 320) for figure in drawn)
    each = width / len(drawn)
    parts = [
        part
        for k, figure in enumerate(drawn)
        for part in [_text(k * each + 4, 19, capitalised(figure.title), INK, 15, weight=600)]
    ]
    for k, figure in enumerate(drawn):
        place = (k * each, _TITLE, each, float(height))
        parts += _scene(figure, place) if figure.kind == "scene" else _panel(figure, place)
    parts += _key(drawn[0].key, _TITLE + height + 16)
    total = _TITLE + height + _KEY * bool(drawn[0].key)
    alt = escape(" ".join(figure.alt for figure in drawn), quote=True)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{alt}" viewBox="0 0 {width} {total}" '
        f'width="{width}" height="{total}" font-family="{escape(FONT, quote=True)}">'
        f'<rect width="{width}" height="{total}" fill="#fff"/>{"".join(parts)}</svg>'
    )


class _Axis:
    """Where values are along an axis, from `start` to `end` [pixels]."""

    def __init__(self, layout: dict[str, Any], values: list[Any], start: float, end: float) -> None:
        self.layout, self.start, self.end = layout, start, end
        self.is_log = layout.get("type") == "log"
        words = [value for part in values for value in _listed(part) if isinstance(value, str)]
        named = layout.get("type") == "category" or bool(words)
        self.names = list(dict.fromkeys([*layout.get("categoryarray", []), *words])) if named else []
        known = np.concatenate([self.numbers(part) for part in values] or [np.zeros(1)])
        known = known[np.isfinite(known)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
        if named:
            low, high = -0.5, max(0.5, len(self.names) - 0.5)
        elif "range" in layout and None not in layout["range"]:
            low, high = (float(value) for value in layout["range"])
        else:
            pad = 0.05 * (high - low) or 0.5
            rises_from_zero = layout.get("rangemode") == "tozero" and low >= 0
            low, high = 0.0 if rises_from_zero else low - pad, high + pad
        self.low, self.high = (high, low) if layout.get("autorange") == "reversed" else (low, high)

    def numbers(self, values: Any) -> Array:
        """Values as numbers along the axis: places of names, exponents of a logarithmic axis."""
        listed = _listed(values)
        if self.names and any(isinstance(value, str) for value in listed):
            return np.array([self.names.index(value) for value in listed], dtype=float)
        found = np.array([np.nan if value is None else value for value in listed], dtype=float)
        if not self.is_log:
            return found
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.log10(found), dtype=float)

    def at(self, values: Any) -> Array:
        """Pixels."""
        share = (self.numbers(values) - self.low) / (self.high - self.low)
        return np.asarray(self.start + share * (self.end - self.start), dtype=float)

    def ticks(self) -> list[tuple[float, str]]:
        """Pixels and texts."""
        if "tickvals" in self.layout:
            texts = self.layout.get("ticktext") or [_number(value) for value in self.layout["tickvals"]]
            found = list(zip(self.at(self.layout["tickvals"]), texts, strict=True))
        elif self.names:
            found = list(zip(self.at(list(range(len(self.names)))), self.names, strict=True))
        elif self.is_log:
            powers = range(math.ceil(min(self.low, self.high)), math.floor(max(self.low, self.high)) + 1)
            found = [(float(self.at([10.0**power])[0]), _number(10.0**power)) for power in powers]
        else:
            values = _nice(min(self.low, self.high), max(self.low, self.high))
            found = [(float(self.at([value])[0]), _number(value)) for value in values]
        ends = sorted((self.start, self.end))
        return [(float(at), str(text)) for at, text in found if ends[0] - 1 <= at <= ends[1] + 1]


def _panel(figure: Figure, place: tuple[float, float, float, float]) -> list[str]:
    """A flat figure within x, y, width, height."""
    left, top, width, height = place
    traces = [trace for trace in figure.traces if trace.get("visible", True) is True]
    across = [trace.get("orientation") == "h" for trace in traces]
    xs = [part for trace, lies in zip(traces, across, strict=True) for part in _extent(trace, "x", along=lies)]
    ys = [part for trace, lies in zip(traces, across, strict=True) for part in _extent(trace, "y", along=not lies)]
    upright = figure.layout["yaxis"]
    names = [str(name) for part in ys for name in _listed(part) if isinstance(name, str)]
    wide = _ROOM["l"] + (min(_LETTER * max(map(len, names)), 0.4 * width) - 30 if names else 0)
    x0, x1 = left + wide, left + width - _ROOM["r"]
    y0, y1 = top + height - _ROOM["b"], top + _ROOM["t"]
    x, y = _Axis(figure.layout["xaxis"], xs, x0, x1), _Axis(upright, ys, y0, y1)
    parts = []
    for at, text in x.ticks():
        parts += [_line(at, y0, at, y1, GRID), _text(at, y0 + 17, text, MUTED, 11, "middle")]
    for at, text in y.ticks() if upright.get("showticklabels", True) else []:
        parts += [_line(x0, at, x1, at, GRID), _text(x0 - 7, at + 4, text, MUTED, 11, "end")]
    parts += [_line(x0, y0, x1, y0, MUTED), _line(x0, y0, x0, y1, MUTED)]
    parts.append(_text((x0 + x1) / 2, y0 + 36, _title(figure.layout["xaxis"]), MUTED, 12, "middle"))
    upwards = f"rotate(-90 {left + 14:.1f} {(y0 + y1) / 2:.1f})"
    parts.append(_text(left + 14, (y0 + y1) / 2, _title(upright), MUTED, 12, "middle", turned=upwards))
    clip = f"c{abs(hash((figure.id, place))) % 10**8}"
    parts.append(f'<clipPath id="{clip}"><rect x="{x0}" y="{y1}" width="{x1 - x0}" height="{y0 - y1}"/></clipPath>')
    parts.append(f'<g clip-path="url(#{clip})">{"".join(_part(trace, x, y) for trace in traces)}</g>')
    for shape in figure.layout.get("shapes", []):
        parts.append(_shape(shape, x, y))
    for note in figure.layout.get("annotations", []):
        px = x.at([note["x"]])[0] if note.get("xref", "x") == "x" else x0 + note["x"] * (x1 - x0)
        py = y.at([note["y"]])[0] if note.get("yref", "y") == "y" else y0 + note["y"] * (y1 - y0)
        anchor = {"left": "start", "right": "end"}.get(note.get("xanchor", "center"), "middle")
        parts.append(_text(px, py - note.get("yshift", 0) + 4, _plain(note["text"]), INK, 12, anchor))
    return parts


def _extent(trace: Trace, axis: str, *, along: bool) -> list[Any]:
    """What of a trace an axis must hold."""
    values = trace.get(axis)
    if values is None:
        return []
    if trace["type"] == "bar" and along:
        base = np.broadcast_to(np.asarray(trace.get("base", 0.0), dtype=float), np.shape(values))
        return [base, base + np.asarray(values, dtype=float)]
    return [values, [0.0]] if axis == "y" and trace.get("fill") == "tozeroy" else [values]


def _part(trace: Trace, x: _Axis, y: _Axis) -> str:
    """What is drawn of a flat trace."""
    if trace["type"] == "bar":
        return _bars(trace, x, y)
    if trace["type"] == "heatmap":
        return _field(trace, x, y)
    px, py = x.at(trace["x"]), y.at(trace["y"])
    mode, parts = trace.get("mode", "lines"), []
    if "lines" in mode or trace.get("fill"):
        parts += _lines(trace, px, py, float(y.at([10.0**y.low if y.is_log else 0.0])[0]))
    if "markers" in mode:
        parts += _error_bars(trace, x, y, px, py) + _points(trace["marker"], px, py)
    if "text" in mode:
        colours = trace.get("textfont", {}).get("color", INK)
        given = colours if isinstance(colours, list) else [colours] * len(px)
        texts = _listed(trace["text"])
        parts += [_text(a, b + 4, str(t), c, 11, "middle") for a, b, t, c in zip(px, py, texts, given, strict=True)]
    return "".join(parts)


def _lines(trace: Trace, px: Array, py: Array, zero: float) -> list[str]:
    """A broken line, with what it fills."""
    found, style = [], trace.get("line", {})
    for run in _runs(px, py):
        path = _path(px, py, run)
        if trace.get("fill"):
            closed = f"L{px[run][-1]:.1f} {zero:.1f}L{px[run][0]:.1f} {zero:.1f}" if trace["fill"] == "tozeroy" else ""
            found.append(f'<path d="{path}{closed}Z" fill="{trace.get("fillcolor", "none")}"/>')
        if style.get("width", 2) and "lines" in trace.get("mode", "lines"):
            dash = _DASHES.get(style.get("dash", "solid"))
            dashed = f' stroke-dasharray="{dash}"' if dash else ""
            colour, width = style.get("color", INK), style.get("width", 2)
            found.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}"{dashed}/>')
    return found


def _runs(px: Array, py: Array) -> list[slice]:
    """The parts of a line between its gaps."""
    known = np.concatenate([[False], np.isfinite(px) & np.isfinite(py), [False]])
    edges = np.flatnonzero(np.diff(known.astype(int)))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _error_bars(trace: Trace, x: _Axis, y: _Axis, px: Array, py: Array) -> list[str]:
    found = []
    for name, axis in (("error_x", x), ("error_y", y)):
        bars = trace.get(name)
        if not bars:
            continue
        values, size = np.asarray(_listed(trace[name[-1]]), dtype=float), np.asarray(bars["array"], dtype=float)
        for a, b, low, high in zip(px, py, axis.at(values - size), axis.at(values + size), strict=True):
            ends = (low, b, high, b) if axis is x else (a, low, a, high)
            found.append(_line(*ends, bars.get("color", INK), 1.5))
    return found


def _points(marker: dict[str, Any], px: Array, py: Array, depth: Array | None = None) -> list[str]:
    sizes = np.broadcast_to(np.asarray(marker.get("size", 6), dtype=float), px.shape)
    colours = _colours(marker, len(px))
    opacity = f' opacity="{marker["opacity"]}"' if marker.get("opacity", 1) != 1 else ""
    edge = marker.get("line", {})
    drawn = []
    for k in np.arange(len(px)) if depth is None else np.argsort(-depth):
        if not (np.isfinite(px[k]) and np.isfinite(py[k])):
            continue
        fill, stroke = colours[k], edge.get("color")
        if marker.get("symbol") == "circle-open":
            fill, stroke = "none", colours[k]
        ring = f' stroke="{stroke}" stroke-width="{edge.get("width", 1)}"' if stroke else ""
        drawn.append(f'<circle cx="{px[k]:.1f}" cy="{py[k]:.1f}" r="{sizes[k] / 2:.1f}" fill="{fill}"{ring}{opacity}/>')
    return drawn


def _bars(trace: Trace, x: _Axis, y: _Axis) -> str:
    lies = trace.get("orientation") == "h"
    along, across = (x, y) if lies else (y, x)
    values = np.asarray(_listed(trace["x" if lies else "y"]), dtype=float)
    places = across.numbers(trace["y" if lies else "x"])
    base = np.broadcast_to(np.asarray(trace.get("base", 0.0), dtype=float), values.shape)
    colours = _colours(trace.get("marker", {}), len(values))
    half = trace.get("width", 0.8) / 2
    parts = []
    for k, place in enumerate(places):
        a, b = sorted(along.at([base[k], base[k] + values[k]]))
        c, d = sorted(across.start + (np.array([place - half, place + half]) - across.low) / (across.high - across.low)
                      * (across.end - across.start))  # fmt: skip
        box = (a, c, b - a, d - c) if lies else (c, a, d - c, b - a)
        size = " ".join(f'{name}="{value:.1f}"' for name, value in zip(("x", "y", "width", "height"), box, strict=True))
        parts.append(f'<rect {size} fill="{colours[k]}"/>')
        if trace.get("text") is not None and lies:
            parts.append(_text(b + 5, (c + d) / 2 + 4, str(_listed(trace["text"])[k]), INK, 11))
    return "".join(parts)


def _field(trace: Trace, x: _Axis, y: _Axis) -> str:
    z = np.asarray(trace["z"], dtype=float)
    low, high = trace.get("zmin", np.nanmin(z)), trace.get("zmax", np.nanmax(z))
    px, py = x.at(trace["x"]), y.at(trace["y"])
    wide, tall = (abs(float(p[1] - p[0])) if len(p) > 1 else 20.0 for p in (px, py))
    return "".join(
        f'<rect x="{px[k] - wide / 2 + 1:.1f}" y="{py[i] - tall / 2 + 1:.1f}" width="{wide - 2:.1f}" '
        f'height="{tall - 2:.1f}" fill="{_mixed(trace["colorscale"], (z[i, k] - low) / ((high - low) or 1.0))}"/>'
        for i, k in np.argwhere(np.isfinite(z))
    )


def _shape(shape: dict[str, Any], x: _Axis, y: _Axis) -> str:
    ends = []
    for name, axis in (("x", x), ("y", y)):
        given = [shape[f"{name}0"], shape[f"{name}1"]]
        onto = shape.get(f"{name}ref", name)
        ends.append(axis.at(given) if onto == name else axis.start + np.asarray(given) * (axis.end - axis.start))
    (a, b), (c, d) = ends
    style = shape.get("line", {})
    if shape["type"] == "line":
        return _line(a, c, b, d, style.get("color", INK), style.get("width", 1), style.get("dash", "solid"))
    fill, stroke = shape.get("fillcolor", "none"), style.get("color", "none")
    return (
        f'<rect x="{min(a, b):.1f}" y="{min(c, d):.1f}" width="{abs(b - a):.1f}" height="{abs(d - c):.1f}" '
        f'fill="{fill}" stroke="{stroke}"/>'
    )


@dataclass(frozen=True)
class _View:
    """From far away: rows right, up and towards the eye; the box's limits (3, 2); pixels a mm and of its middle."""

    turn: Array
    box: Array
    scale: float
    centre: Array

    def at(self, points: Array) -> tuple[Array, Array, Array]:
        """X and y [pixels] and depth of points (N, 3)."""
        flat = points @ self.turn.T
        x, y = self.centre[0] + self.scale * flat[:, 0], self.centre[1] - self.scale * flat[:, 1]
        return x, y, -flat[:, 2]


def _corners(box: Array) -> Array:
    return np.array([[box[k][(c >> k) & 1] for k in range(3)] for c in range(8)])


def _view(scene: dict[str, Any], place: tuple[float, float, float, float]) -> _View:
    left, top, width, height = place
    box = np.array([scene[f"{name}axis"]["range"] for name in "xyz"], dtype=float)
    eye = np.array([scene["camera"]["eye"][name] for name in "xyz"])
    back = eye / np.linalg.norm(eye)
    right = np.array([-back[1], back[0], 0.0]) / np.hypot(back[0], back[1])
    turn = np.array([right, np.cross(back, right), back])
    flat = (_corners(box) @ turn.T)[:, :2]
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = float(min((width - 150) / (high - low)[0], (height - 70) / (high - low)[1]))
    middle = scale * (low + high) / 2
    return _View(turn, box, scale, np.array([left + width / 2 - middle[0], top + height / 2 + middle[1]]))


def _scene(figure: Figure, place: tuple[float, float, float, float]) -> list[str]:
    """A scene as its camera sees it at first."""
    view = _view(figure.layout["scene"], place)
    parts = _room(view, [_title(figure.layout["scene"][f"{name}axis"]) for name in "xyz"])
    for trace in figure.traces:
        if trace.get("visible", True) is not True:
            continue
        px, py, depth = view.at(np.column_stack([np.asarray(trace[name], dtype=float) for name in "xyz"]))
        if trace["mode"] != "lines":
            parts += _points(trace["marker"], px, py, depth)
            for x, y, name in zip(px, py, trace.get("text", []), strict=False) if "text" in trace["mode"] else []:
                parts += [_text(x, y + 17, str(name), INK, 11, "middle")] if np.isfinite(x) else []
            continue
        colours, wide = _colours(trace["line"], len(px)), 0.5 * trace["line"]["width"]
        style = f'fill="none" stroke-width="{wide}" stroke-linecap="round" stroke-linejoin="round"'
        parts += [f'<path d="{_path(px, py, run)}" stroke="{colours[run.start]}" {style}/>' for run in _runs(px, py)]
    return parts


def _room(view: _View, titles: list[str]) -> list[str]:
    """The far edges of the box, and along its lower and left ones the ends of the axes."""
    cx, cy, depth = view.at(_corners(view.box))
    pairs = [(c, c ^ (1 << k)) for c in range(8) for k in range(3) if not (c >> k) & 1]
    far = np.sort(depth)[3]
    parts = [_line(cx[c], cy[c], cx[d], cy[d], GRID) for c, d in pairs if max(depth[c], depth[d]) > far]
    for k, title in enumerate(titles):
        ends = np.full((2, 3), view.box[:, 0], dtype=float)
        ends[:, k] = view.box[k]
        if k < 2:
            ends[:, 1 - k] = view.box[1 - k][int(view.turn[2, 1 - k] > 0)]
        x, y, _depth = view.at(ends)
        sizes = [_number(float(np.round(value))) for value in view.box[k]]
        within = (0.06, 0.94) if k < 2 else (0.0, 1.0)  # two axes end in the near corner
        for at, size in zip(within, sizes, strict=True):
            px, py = (float(of[0] + at * (of[1] - of[0])) for of in (x, y))
            parts.append(
                _text(px, py + 15, size, MUTED, 11, "middle") if k < 2 else _text(px - 6, py, size, MUTED, 11, "end")
            )
        parts.append(_text(x.mean(), y.mean() + 22, title, MUTED, 12, "middle"))
    return parts


def _path(px: Array, py: Array, run: slice) -> str:
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(px[run], py[run], strict=True))


def _key(entries: list[Key], y: float) -> list[str]:
    parts, x = [], 20.0
    for entry in entries:
        if entry.mark in ("point", "cross"):
            parts.append(f'<circle cx="{x + 12:.1f}" cy="{y - 4:.1f}" r="3.5" fill="{entry.colour}"/>')
        else:
            parts.append(_line(x, y - 4, x + 24, y - 4, entry.colour, 2, entry.mark))
        parts.append(_text(x + 30, y, entry.label, INK, 12))
        x += 48 + _LETTER * len(entry.label)
    return parts


def _colours(style: dict[str, Any], count: int) -> list[str]:
    """The colour of each point: one for all, each its own, or along a scale."""
    given = style.get("color", INK)
    if isinstance(given, str):
        return [given] * count
    listed = _listed(given)
    if listed and isinstance(listed[0], str):
        return [str(colour) for colour in listed]
    values = np.asarray(given, dtype=float)
    low, high = float(style.get("cmin", np.nanmin(values))), float(style.get("cmax", np.nanmax(values)))
    return [_mixed(style["colorscale"], (value - low) / ((high - low) or 1.0)) for value in values]


def _mixed(scale: Iterable[Any], at: float) -> str:
    """The colour of a scale [[place, "#rrggbb"], ...] at a place from 0 to 1."""
    places, colours = zip(*scale, strict=True)
    parts = np.array([[int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in colours], dtype=float)
    return "#" + "".join(f"{round(float(np.interp(at, places, parts[:, k]))):02x}" for k in range(3))


def _nice(low: float, high: float) -> Array:
    """Four to seven round numbers within a range."""
    wanted = (high - low) / 5 or 1.0
    power = 10.0 ** math.floor(math.log10(wanted))
    step = power * next(each for each in (1, 2, 5, 10) if each * power >= wanted * (1 - 1e-12))
    return np.asarray(np.arange(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1) * step, dtype=float)


def _number(value: float) -> str:
    return f"{value:.6g}".replace("-", "\N{MINUS SIGN}").replace(".", decimal_sign())


def _title(axis: dict[str, Any]) -> str:
    title = axis.get("title", "")
    return _plain(str(title.get("text", "") if isinstance(title, dict) else title))


def _plain(text: str) -> str:
    """A text of Plotly without its marks."""
    return text.replace("<br>", " ").replace("<b>", "").replace("</b>", "")


def _listed(values: Any) -> list[Any]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def _line(x0: float, y0: float, x1: float, y1: float, colour: str, width: float = 1.0, dash: str = "solid") -> str:
    dashed = f' stroke-dasharray="{_DASHES[dash]}"' if dash in _DASHES else ""
    ends = f'x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}"'
    return f'<line {ends} stroke="{colour}" stroke-width="{width}"{dashed}/>'


def _text(
    x: float, y: float, text: str, colour: str, size: int, anchor: str = "start", *, weight: int = 400, turned: str = ""
) -> str:
    turn = f' transform="{turned}"' if turned else ""
    style = f'fill="{colour}" font-size="{size}" text-anchor="{anchor}" font-weight="{weight}"{turn}'
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(text)}</text>'
