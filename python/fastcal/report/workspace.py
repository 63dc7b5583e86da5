# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The errors as arrows in the workspace, with the arm: one 3D scene with before and after, and flat views for paper.

An arrow starts at the measured point and is scale * error long, in mm like the axes; the scale is 1, 2 or 5 times a
power of ten, so that the 90th percentile of the arrows is near 8 % of the workspace's diagonal. Those of outliers,
which would leave the picture, are cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.report import figures
from fastcal.report.arm import Arm, Run, through_points
from fastcal.report.figures import FONT, INK, MUTED, Figure, Trace
from fastcal.report.formatting import count, significant
from fastcal.report.language import _

Array = NDArray[np.float64]

ARROW_LIMIT = 450  # so that the page of thousands of poses stays below 1.5 MB
FLAT_ARROW_LIMIT = 350
_ARROW_SHARE = 0.08
_LONGEST_SHARE = 0.3  # of the diagonal: longer arrows are cut
_MOST_TIMES = 3.0  # the 90th percentile: where the colours end, for the sake of all but outliers
_HEAD_SHARE = 0.012
_COLOURS = [[0.0, "#b9cbd6"], [0.35, "#5b9bc0"], [0.65, "#e09f3e"], [1.0, "#a11d1d"]]

_PARTS = [[0.0, "#ffffff"], [0.5, "#f4b860"], [1.0, "#a11d1d"]]
_EYE = {"x": 1.15, "y": -1.32, "z": 0.55}  # of the camera, in half-sides of the box
_JOINT = 9  # the size of a joint; one that contributes is larger, since others may stand where it is
_LOWER = 400  # how high on a narrow screen [CSS pixels]


@dataclass(frozen=True)
class Arrows:
    """Error vectors to draw.

    Attributes:
        label: Of which errors.
        scale: Their enlargement.
        vectors: (N, 3) the errors in mm.
        colour_end: The end of the colour scale in mm.
        longest: A drawn arrow in mm.
    """

    label: str
    scale: float
    vectors: Array
    colour_end: float
    longest: float

    @property
    def shafts(self) -> Array:
        """(N, 3) as they are drawn, in mm; those that are too long are cut."""
        length = self.scale * np.linalg.norm(self.vectors, axis=1, keepdims=True)
        return np.asarray(self.scale * self.vectors * np.minimum(1.0, self.longest / np.maximum(length, 1e-300)))

    @property
    def are_cut(self) -> bool:
        """Is any of them?"""
        return bool(np.any(self.scale * np.linalg.norm(self.vectors, axis=1) > self.longest))


def arrow_scale(positions: Array, vectors: Array) -> float:
    """The round factor that draws the vectors (N, 3) at a good size among the positions (N, 3), both in mm."""
    diagonal = float(np.linalg.norm(np.ptp(positions, axis=0)))
    length = float(np.quantile(np.linalg.norm(vectors, axis=1), 0.9))
    if not (length > 0.0 and diagonal > 0.0):
        return 1.0
    wanted = _ARROW_SHARE * diagonal / length
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in (1, 2, 5) if step * power <= wanted * (1 + 1e-12)))


def arrow_modes(positions: Array, before: Array, after: Array | None) -> list[Arrows]:
    """Before; after at the same scale, to compare; after enlarged on its own, to see the pattern of what is left.

    Without `after` the errors are those of now.
    """
    longest = _LONGEST_SHARE * float(np.linalg.norm(np.ptp(positions, axis=0))) or np.inf
    if after is None:
        return [Arrows(_("Now"), arrow_scale(positions, before), before, _colour_end(before), longest)]
    scale_before, scale_after = arrow_scale(positions, before), arrow_scale(positions, after)
    end_before = _colour_end(before)
    modes = [
        Arrows(_("Before"), scale_before, before, end_before, longest),
        Arrows(_("After, same scale"), scale_before, after, end_before, longest),
    ]
    if scale_after > scale_before:
        modes.append(Arrows(_("After, enlarged"), scale_after, after, _colour_end(after), longest))
    return modes


def _colour_end(vectors: Array) -> float:
    """The size that has the last colour, in mm."""
    usual, most = np.quantile(np.linalg.norm(vectors, axis=1), [0.9, 0.98])
    return float(min(most, _MOST_TIMES * usual) or most) or 1.0


def scene(
    positions: Array,
    before: Array,
    after: Array | None,
    base: Array | None,
    frame: str,
    arm: Arm | None = None,
    always: Sequence[int] = (),
    told: str = "",
    title: str = "",
    of: NDArray[np.intp] | None = None,
) -> Figure:
    """The 3D view; positions and errors (N, 3) in mm in `frame`, base (3,) in mm, drawn where it is near.

    Args:
        positions: Where arrows begin.
        before: Errors before the calibration.
        after: Errors after it; None: `before` are those of now.
        base: Of the robot; an arm is always drawn from it.
        frame: In words.
        arm: The arm in these N postures, or in those that `of` names; a slider goes through them.
        always: Rows (of N) that are drawn however many there are.
        told: What an arrow is, where it goes not from the measured to the predicted point.
        title: Of the figure, where arrows are no errors.
        of: (N,) the posture of the arm that each arrow is of; None: each has its own.
    """
    row_count = len(positions)
    shown = np.union1d(figures.spread_rows(row_count, ARROW_LIMIT), np.asarray(always, dtype=np.intp)[:ARROW_LIMIT])
    shown = shown if of is None else np.arange(row_count)
    modes = arrow_modes(positions, before, after) if row_count else []
    traces: list[Trace] = []
    controls = []
    for place, mode in enumerate(modes):
        first = len(traces)
        traces += _arrows_3d(positions, mode, shown, visible=place == 0)
        label = f"{mode.label} {_times(mode.scale)}"
        controls.append({"label": label, "traces": [first, first + 1], "selected": place == 0})
    shown_base = base if base is not None and (arm is not None or _is_near(base, positions)) else None
    if shown_base is not None:
        traces.append(_base(shown_base, named=arm is None))
    postures: dict[str, Any] = {}
    inside = shown_base
    if arm is not None:
        drawn_arm = arm if of is not None else arm.pick(shown).with_measured(positions[shown])
        left = np.linalg.norm((before if after is None else after)[shown], axis=1)
        worst = 0 if not len(left) else int(np.argmax(left)) if of is None else int(of[np.argmax(left)])
        postures = _postures(drawn_arm, worst, len(traces)) | {"of": of}
        traces += [trace for trace, _through in _moving(drawn_arm, worst)]
        inside = drawn_arm.points.reshape(-1, 3) if of is not None or shown_base is not None else None
    limits = _limits(positions, inside)
    figure_layout: dict[str, Any] = {
        "font": {"family": FONT, "size": 12, "color": INK},
        "paper_bgcolor": "#fff",
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "showlegend": False,
        "uirevision": "kept",
        "scene": {
            "aspectmode": "data",
            "camera": {"eye": _EYE, "center": {"x": 0, "y": 0, "z": -0.15}},
            **{f"{name}axis": _axis_3d(f"{name} (mm)", limits[k]) for k, name in enumerate("xyz")},
        },
    }
    title = title or _("Errors in the workspace")
    if len(modes) < 2:
        title, controls = " ".join([title, *(_times(mode.scale) for mode in modes)]), []
        how = _(
            "Each arrow points from the measured towards the predicted point in {frame}, magnified as stated in the "
            "heading.",
            frame=frame,
        )
    else:
        how = _(
            "Each arrow points from the measured towards the predicted point in {frame}, magnified as stated on the "
            "button.",
            frame=frame,
        )
    note = told or how
    if any(mode.are_cut for mode in modes):
        note += " " + _("Arrows that would leave the picture are cut.")
    if len(shown) < row_count:
        note += " " + _(
            "{some} of {all} poses are drawn, spread evenly over the rows.",
            some=count(len(shown)),
            all=count(row_count),
        )
    if arm is not None:
        note += " " + _("The slider, or a click on a point, moves the arm to a pose.")
        if arm.contributions is not None:
            note += _contributions_note(arm, arm.contributions, now=after is None)
    alt = _(
        "Three-dimensional view of the workspace with an arrow for the error of each pose; "
        "drag it or use the arrow keys to turn it."
    )
    return Figure(
        "workspace", title, alt, traces, figure_layout, note,
        height=560, kind="scene", controls=controls, postures=postures, narrow={"height": _LOWER},
    )  # fmt: skip


def flat_views(positions: Array, before: Array, after: Array) -> list[Figure]:
    """Top, front and side view of the arrows before and after, each at its own scale, for paper."""
    shown = figures.spread_rows(len(positions), FLAT_ARROW_LIMIT)
    modes = arrow_modes(positions, before, after)
    limits = _limits(positions)
    views = []
    for state, mode in (("before", modes[0]), ("after", modes[-1])):
        colour = figures.AFTER if state == "after" else figures.MUTED
        state_text = _("after") if state == "after" else _("before")
        for id_, view, (a, b) in (
            ("top", _("Top"), (0, 1)),
            ("front", _("Front"), (0, 2)),
            ("side", _("Side"), (1, 2)),
        ):
            start, end = positions[shown], positions[shown] + mode.shafts[shown]
            x, y = (np.column_stack([start[:, k], end[:, k], np.full(len(shown), np.nan)]).ravel() for k in (a, b))
            shafts = figures.line(x, y, colour) | {"line": {"width": 1, "color": colour}}
            traces = [shafts, figures.points(start[:, a], start[:, b], colour, 2.4)]
            drawn = figures.layout(f"{'xyz'[a]} (mm)", f"{'xyz'[b]} (mm)", margin={"l": 60, "t": 12})
            for name, k, ticks in (("xaxis", a, 4), ("yaxis", b, 6)):
                drawn[name] |= {"range": limits[k].tolist(), "nticks": ticks, "constrain": "domain", "zeroline": False}
            drawn["yaxis"]["scaleanchor"] = "x"
            title = f"{view}, {state_text} {_times(mode.scale)}"
            alt = _("Flat view of the error arrows: {title}.", title=title)
            views.append(
                Figure(f"flat-{id_}-{state}", title, alt, traces, drawn, columns=2, height=270, paper_height=190)
            )
    return views


def _times(scale: float) -> str:
    return f"×\N{NARROW NO-BREAK SPACE}{significant(scale, 1)}"


def _arrows_3d(positions: Array, mode: Arrows, shown: NDArray[np.intp], *, visible: bool) -> list[Trace]:
    start, size = positions[shown], np.linalg.norm(mode.vectors[shown], axis=1)
    scale = {"colorscale": _COLOURS, "cmin": 0.0, "cmax": mode.colour_end}
    drawn = _arrow_lines(start, mode.shafts[shown])
    bar = {
        "title": {"text": _("error (mm)"), "side": "right"},
        "thickness": 12,
        "len": 0.6,
        "outlinewidth": 0,
        "x": 0.98,
    }
    return [
        {
            "type": "scatter3d", "mode": "lines", **_coordinates(drawn.reshape(-1, 3)), "visible": visible,
            "hoverinfo": "skip", "line": {"width": 3, "color": np.repeat(size, drawn.shape[1]), **scale},
        },
        {
            "type": "scatter3d", "mode": "markers", **_coordinates(start), "visible": visible, "customdata": size,
            "hovertemplate": f"{_('error')} %{{customdata:.3f}} mm<extra></extra>",
            "marker": {"size": 2, "color": size, **scale, "showscale": True, "colorbar": bar},
        },
    ]  # fmt: skip


def _arrow_lines(start: Array, shaft: Array) -> Array:
    """Shaft and two barbs of each arrow as one broken line (N, 7, 3): start, end, gap, barb, end, barb, gap."""
    length = np.linalg.norm(shaft, axis=1, keepdims=True)
    along = np.divide(shaft, length, out=np.zeros_like(shaft), where=length > 0.0)
    least = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    across = np.cross(along, least)
    size = np.minimum(_HEAD_SHARE * float(np.linalg.norm(np.ptp(start, axis=0))), 0.4 * length)
    end, back, side = start + shaft, -size * along, 0.45 * size * across
    gap = np.full_like(start, np.nan)
    return np.stack([start, end, gap, end + back + side, end, end + back - side, gap], axis=1)


def _coordinates(points: Array) -> dict[str, Array]:
    return {name: points[:, k] for k, name in enumerate("xyz")}


def _moving(arm: Arm, k: int) -> list[tuple[Trace, list[int]]]:
    """What the slider moves, in posture k, and the points that each goes through: lines and marks, joints, readings."""
    known = np.zeros(len(arm.joints)) if arm.contributions is None else arm.contributions
    end = float(known.max(initial=0.0)) or 1.0
    texts = arm.names if arm.contributions is None else [
        f"{name}: {significant(float(size), 2)} mm" for name, size in zip(arm.names, known, strict=True)
    ]  # fmt: skip
    joints = {
        "mode": "markers", "text": texts, "hovertemplate": "%{text}<extra></extra>",
        "marker": {
            "size": _JOINT * (1 + 0.6 * known / end), "color": known, "colorscale": _PARTS, "cmin": 0.0, "cmax": end,
            "line": {"color": INK, "width": 1},
        },
    }  # fmt: skip
    ring = {"size": 8, "color": figures.ALERT, "symbol": "circle-open", "line": {"width": 2}}
    drawn = [(_run(run), run.through) for run in arm.runs]
    drawn += [(joints, arm.joints)] if arm.joints else []
    drawn += [({"mode": "markers", "marker": ring, "hoverinfo": "skip"}, arm.measured)] if arm.measured else []
    return [
        ({"type": "scatter3d", **trace, **_coordinates(through_points(arm.points[k], through))}, through)
        for trace, through in drawn
    ]


def _run(run: Run) -> Trace:
    if run.width:
        return {"mode": "lines", "hoverinfo": "skip", "line": {"width": run.width, "color": run.colour}}
    return {
        "mode": "markers+text" if any(run.names) else "markers", "text": list(run.names), "hoverinfo": "skip",
        "textposition": "bottom center", "textfont": {"color": INK},
        "marker": {"size": 6, "color": run.colour, "symbol": run.symbol},
    }  # fmt: skip


def _postures(arm: Arm, worst: int, first: int) -> dict[str, Any]:
    """What the slider shows: coordinates of all postures one after the other, and what each is called.

    `first`: the place of the first trace that it moves.
    """
    moving = [through for _trace, through in _moving(arm, worst)]
    return {
        "shown": worst,
        "width": arm.points.shape[1],
        "parts": [{"trace": first + k, "through": through} for k, through in enumerate(moving)],
        "points": {name: arm.points[:, :, k].ravel() for k, name in enumerate("xyz")},
        "labels": arm.labels,
        "rows": [f"{of}:{row}" for of, row in arm.rows],
        "filters": [
            {"label": v.label, "values": v.values, "texts": list(arm.stations) if v.name == "station" else []}
            for v in arm.variables
        ],
    }


def _contributions_note(arm: Arm, contributions: Array, *, now: bool) -> str:
    """What the colours of the joints say, with the largest: "joint 2 0.41 mm, joint 3 0.22 mm"; nothing of none."""
    order = [int(i) for i in np.argsort(-contributions)[:3] if contributions[i] > 0]
    sizes = [f"{arm.names[i]} {significant(float(contributions[i]), 2)} mm" for i in order]
    if not sizes:
        return ""
    if now:
        text = _("Joints are coloured by how far their change moves the tool (RMS): {joints}.", joints=", ".join(sizes))
    else:
        text = _(
            "Joints are coloured by how far the tool would be off (RMS) if the joint alone were left as it was: "
            "{joints}.",
            joints=", ".join(sizes),
        )
    return f" {text}"


def _base(base: Array, *, named: bool) -> Trace:
    """Where the robot stands; an arm that is drawn from there says so itself."""
    x, y, z = ([float(value)] for value in base)
    return {
        "type": "scatter3d", "mode": "markers+text" if named else "markers", "x": x, "y": y, "z": z,
        "text": [_("robot base")], "textposition": "bottom center", "hoverinfo": "skip", "textfont": {"color": MUTED},
        "marker": {"size": 6, "color": INK, "symbol": "diamond"},
    }  # fmt: skip


def _limits(positions: Array, base: Array | None = None) -> Array:
    """The box (3, 2) around the positions with room for arrows, and around the base where one is given."""
    inside = positions if base is None else np.vstack([positions, base])
    far = positions if len(positions) else inside
    far = far[np.isfinite(far).all(axis=1)]  # a line of sight is none where nothing was read
    margin = 0.6 * _ARROW_SHARE * (float(np.linalg.norm(np.ptp(far, axis=0))) or 1.0)
    return np.column_stack([np.nanmin(inside, axis=0) - margin, np.nanmax(inside, axis=0) + margin])


def _is_near(base: Array, positions: Array) -> bool:
    """False for a base so far away that showing it would make the arrows small."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    return bool(np.all(np.abs(base - (low + high) / 2) < 0.5 * np.linalg.norm(high - low)))


def _axis_3d(title: str, limits: Array) -> dict[str, Any]:
    kept = {key: value for key, value in figures.axis(title).items() if key in ("gridcolor", "linecolor", "nticks")}
    plain = {"showbackground": False, "zeroline": False, "color": MUTED}
    return kept | plain | {"title": {"text": title}, "range": limits.tolist()}
