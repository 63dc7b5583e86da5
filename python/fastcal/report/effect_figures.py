# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An effect in the data: its partial residual against its own variable, with the fitted curve and its 95 % band."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.diagnosis.words import owner_in_words
from fastcal.report import figures
from fastcal.report.figures import Figure, Key, Trace
from fastcal.report.formatting import plural
from fastcal.report.language import _
from fastcal.report.trends import binned_median
from fastcal.units import ShopUnit, from_si, shop_unit

if TYPE_CHECKING:
    from fastcal.diagnosis.partial_residuals import PartialResidual


CURVE = "#d55e00"
POINTS = 500
_FEW = 8  # distinct values from which on a variable is drawn as a line
_BINS = 80
_COVERAGE = 1.96
_DIVERGING = [[0.0, "#0b5f8a"], [0.5, "#f2f2f2"], [1.0, "#d55e00"]]


@dataclass(frozen=True)
class Axis:
    """A variable as it is drawn: its title, and values (K,) in its unit."""

    title: str
    values: FloatArray
    texts: dict[float, str]


def effect_key() -> list[Key]:
    """What the marks of these figures are."""
    return [
        Key(_("without it in the model"), figures.BEFORE, "point"),
        Key(_("median of those, with its 95 % band"), figures.INK, "point"),
        Key(_("the fitted effect with its 95 % band"), CURVE, "solid"),
        Key(_("with it in the model"), figures.AFTER, "point"),
    ]


def effect_figures(found: PartialResidual, owner: str, id_: str) -> list[Figure]:
    """One figure, or one each for x, y and z; a map where the effect depends on two variables or more."""
    reading = found.reading
    size = float(np.quantile(np.abs(reading.before), 0.98)) if reading.before.size else 0.0
    unit = shop_unit(found.unit, size)
    if found.x.shape[1] > 1:
        return [_map(found, owner, unit, id_)]
    axis = _axis(found, owner)
    count = reading.fitted.shape[1]
    parts = [""] if count == 1 else list("xyz")
    # One scale for all components, so that sizes can be compared.
    limit = max(float(np.quantile(np.abs(reading.before), 0.99)) * 1.15, 1.2 * float(np.abs(reading.fitted).max()))
    made = []
    for k, part in enumerate(parts):
        values = [unit.of(a[:, k]) for a in (reading.before, reading.after, reading.fitted, reading.deviation)]
        title = _quantity(found, owner)
        title = _("{quantity} along {axis}", quantity=title, axis=part) if part else title
        drawn = figures.layout(axis.title, f"{title if count == 1 else part} ({unit.text})")
        drawn["yaxis"]["range"] = [-unit.of(limit), unit.of(limit)]
        if found.quantity == "displacement":
            drawn["yaxis"]["range"][0] = -0.45 * unit.of(limit)
        if axis.texts:
            drawn["xaxis"] |= {"tickvals": list(axis.texts), "ticktext": list(axis.texts.values())}
        alt = _(
            "{quantity} against {variable}: what the data call for, the fitted effect, and the residual with it.",
            quantity=title,
            variable=axis.title,
        )
        against = _("{quantity} against {variable}", quantity=title, variable=axis.title.split(" (")[0])
        heading = against if count == 1 else title
        traces = _traces(axis, *values)
        columns, height = (4, 360) if count == 1 else (2, 270)
        made.append(Figure(f"{id_}{part}", heading, alt, traces, drawn, columns=columns, height=height))
    return made


def _traces(
    axis: Axis, before: FloatArray, after: FloatArray, fitted: FloatArray, deviation: FloatArray
) -> list[Trace]:
    x = axis.values
    shown = figures.spread_rows(len(x), POINTS)
    levels = np.unique(x)
    few = len(levels) <= _FEW
    # Points of the same level beside each other, before left and after right of it, in the order of their rows.
    step = float(np.diff(levels).min()) if few and len(levels) > 1 else 0.0
    spread = step * (0.06 + 0.3 * np.linspace(0, 1, len(x)))
    left, right = (x - spread, x + spread) if few else (x, x)
    traces = [
        figures.points(left[shown], before[shown], figures.BEFORE, 4, 0.55),
        figures.points(right[shown], after[shown], figures.AFTER, 4, 0.4),
    ]
    if few:
        curve = [(level, fitted[x == level].mean(), deviation[x == level].mean()) for level in levels]
        for level, value, error in curve:
            wide = [level - 0.42 * step, level + 0.42 * step]
            traces += _band(np.array(wide), np.full(2, value), np.full(2, error))
        return traces
    order = np.argsort(x, kind="stable")
    bins = np.array_split(order, min(_BINS, len(order)))
    means = [np.array([a[b].mean() for b in bins]) for a in (x, fitted, deviation)]
    traces += _band(*means)
    medians = binned_median(x, before)
    if len(medians.x):
        dots = figures.points(medians.x, medians.median, figures.INK, 6, hover=_("median %{{y:.3g}} at %{{x:.3g}}"))
        dots["error_y"] = {
            "type": "data", "symmetric": True, "array": medians.high - medians.median, "color": figures.INK,
            "thickness": 1.2, "width": 0,
        }  # fmt: skip
        traces.append(dots)
    return traces


def _band(x: FloatArray, y: FloatArray, deviation: FloatArray) -> list[Trace]:
    reach = _COVERAGE * deviation
    around = np.concatenate([x, x[::-1]]), np.concatenate([y - reach, (y + reach)[::-1]])
    fill = {"fill": "toself", "fillcolor": figures.translucent(CURVE, 0.25), "line": {"width": 0}}
    return [figures.line(*around, CURVE) | fill, figures.line(x, y, CURVE, hover=_("fitted %{{y:.3g}} at %{{x:.3g}}"))]


def _map(found: PartialResidual, owner: str, unit: ShopUnit, id_: str) -> Figure:
    """The fitted value at the measured poses over the first two of its variables, as colour."""
    names = found.depends_on[:2]
    x, y = (_axis_of(name, found.x[:, k], found.x_units[k], owner) for k, name in enumerate(names))
    fitted = found.reading.fitted
    signed = fitted.shape[1] == 1
    value = unit.of(fitted[:, 0] if signed else np.linalg.norm(fitted, axis=1))
    end = float(np.quantile(np.abs(value), 0.98)) or 1.0
    shown = figures.spread_rows(len(value), 2 * POINTS)
    title = _quantity(found, owner)
    marker = {
        "cmin": -end if signed else 0.0, "cmax": end, "showscale": True, "line": {"width": 0.4, "color": figures.MUTED},
        "colorscale": _DIVERGING if signed else [[0.0, "#f2f2f2"], [1.0, "#d55e00"]],
        "colorbar": {"title": {"text": f"{title} ({unit.text})", "side": "right"}, "thickness": 12, "outlinewidth": 0},
    }  # fmt: skip
    trace = figures.points(x.values[shown], y.values[shown], "#000", 8, hover="%{marker.color:.3g} " + unit.text)
    trace["marker"] |= marker | {"color": value[shown]}
    drawn = figures.layout(x.title, y.title)
    alt = _("{quantity} as colour over {x} and {y}.", quantity=title, x=x.title, y=y.title)
    heading = _(
        "{quantity}, as it follows {x} and {y}",
        quantity=title,
        x=x.title.split(" (")[0],
        y=y.title.split(" (")[0],
    )
    note = _("Each dot is a measured pose, its colour the smooth function that explains most of what remains.")
    return Figure(id_, heading, alt, [trace], drawn, note, columns=4, height=380)


def _quantity(found: PartialResidual, owner: str) -> str:
    joint = owner.partition("<-")[0]
    if found.quantity == "joint":
        return _("error of {joint}", joint=owner_in_words(joint))
    along = found.depends_on == ("itself",)
    return {
        "growth": _("growth of the arm") if owner == "robot" else _("growth of {owner}", owner=owner_in_words(owner)),
        "motion": _("motion of the base"),
        "shift": _("shift of the target"),
        "displacement": _("measured along its direction") if along else _("displacement"),
    }[found.quantity]


def _axis(found: PartialResidual, owner: str) -> Axis:
    axis = _axis_of(found.depends_on[0], found.x[:, 0], found.x_units[0], owner)
    if found.labels:
        return Axis(axis.title, axis.values, {float(k): name for k, name in enumerate(found.labels)})
    return axis


def _axis_of(name: str, x: FloatArray, unit: str, owner: str) -> Axis:
    """A variable in the unit in common use; `unit` is that of x."""
    number = "".join(c for c in name if c.isdigit())
    if name == f"q{number}":
        turns = unit == "rad"
        title = _("position of joint {number} ({unit})", number=number, unit="°" if turns else "mm")
        return Axis(title, from_si(x, "deg" if turns else "mm"), {})
    if name.startswith("approach"):
        sides = {-1.0: _("from above (\N{MINUS SIGN})"), 1.0: _("from below (+)")}
        return Axis(_("approach direction of joint {number}", number=number), x, sides)
    if name == "itself":
        spoken = shop_unit("m", float(np.abs(x).max(initial=0.0)))
        return Axis(_("what the effect does in the pose ({unit})", unit=spoken.text), spoken.of(x), {})
    if name in ("x", "y", "z"):
        return Axis(f"{name} (mm)", from_si(x, "mm"), {})
    known = {
        "torque": (
            _("load about the axis of {joint} (N\N{NO-BREAK SPACE}m)", joint=owner_in_words(owner.partition("<-")[0])),
            x,
        ),
        "time_s": (_("time (s since the first pose)"), x - x.min(initial=np.inf)),
        "temperature_c": (_("temperature (°C)"), from_si(x, "c")),
        "payload_kg": (_("payload (kg)"), x),
        "order": (_("order of measurement"), x),
        f"current{number}_a": (_("current of motor {number} (A)", number=number), x),
    }
    return Axis(*known.get(name, (name, x)), {})


def left_out_note(found: PartialResidual) -> str:
    """How many poses are not drawn, and why."""
    if not found.left_out:
        return ""
    poses = plural(found.left_out, "pose")
    return _("{poses} in which the effect hardly moves the target not drawn.", poses=poses)
