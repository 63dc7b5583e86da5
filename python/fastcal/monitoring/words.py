# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The sentences of a check; `_` translates them where a page asks for it, and fills their placeholders."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any

from fastcal.effects.entries import traits_of
from fastcal.errors import FastcalError
from fastcal.monitoring.result import FEWEST_DEGREES, Cause, Change, KindFit
from fastcal.monitoring.setups import SetUp
from fastcal.units import from_si, to_si

Translate = Callable[..., str]
_CHANGE = tuple(field.name for field in fields(Change))
LEAST_P = 1e-4  # smaller p-values are shown as less than this


def plain(message: str, /, **values: Any) -> str:
    """The message in English."""
    return message.format(**values)


def sentence(
    verdict: str,
    causes: Sequence[Cause],
    within: bool | None,
    tolerance: float | None,
    largest: float,
    enough: bool,
    _: Translate = plain,
) -> str:
    """The verdict in a sentence, and a second one where there is a tolerance [m] for the largest error [m]."""
    if verdict == "holds":
        text = _("The model still holds: its errors are those of the measurement and of its own uncertainty.")
    elif verdict == "changed":
        text = _("The arm has changed: {what}.", what="; ".join(cause_text(cause, _) for cause in causes))
    elif not enough:
        text = _("Too few poses to decide: the residuals left after fitting the base could hide any change.")
    elif any(cause.kind != "row" for cause in causes):
        text = _(
            "Cannot tell: {what} may be new, or missing since the calibration, whose residuals depended on the "
            "posture.",
            what="; ".join(cause_text(cause, _) for cause in causes),
        )
    elif causes:
        rows = ", ".join(spoken(cause.label, _) for cause in causes)
        text = _("Cannot tell: everything fits except {rows}; measure that pose again.", rows=rows)
    else:
        text = _("Cannot tell: the largest error is too close to the tolerance.")
    if tolerance is None:
        return text
    sizes = {"found": f"{from_si(largest, 'mm'):.3f}", "limit": f"{from_si(tolerance, 'mm'):g}"}
    if within is None:
        more = _("The largest error, {found} mm, is too close to the tolerance of {limit} mm to decide.", **sizes)
    elif within:
        more = _("The largest error, {found} mm, is within the tolerance of {limit} mm.", **sizes)
    else:
        more = _("The largest error, {found} mm, is beyond the tolerance of {limit} mm.", **sizes)
    return f"{text} {more}"


def kept_sentence(content: Mapping[str, Any], _: Translate = plain) -> str:
    """The verdict of a check.json in a sentence; as it was kept where the file says too little of what changed."""
    try:
        causes = [
            Cause(
                cause["kind"],
                cause["label"],
                cause["probability"],
                tuple(cause["equivalents"]),
                tuple(Change(**{key: change[key] for key in _CHANGE}) for change in cause["changes"]),
            )
            for cause in content["causes"]
        ]
        limit = content["tolerance_mm"]
        return sentence(
            content["verdict"],
            causes,
            content["within_tolerance"],
            None if limit is None else to_si(limit, "mm"),
            0.0 if content["max_mm"] is None else to_si(content["max_mm"], "mm"),
            content["degrees_of_freedom"] >= FEWEST_DEGREES,
            _,
        )
    except (FastcalError, KeyError, TypeError, ValueError, AttributeError):  # of another version, or damaged
        return str(content.get("sentence") or "")


def next_act(
    verdict: str, causes: Sequence[Cause], within: bool | None, has_next_poses: bool, _: Translate = plain
) -> str:
    """What to do now, in a sentence; "" where the model holds and nothing is asked of it."""
    if verdict == "changed" and has_next_poses:
        return _("Next: measure the poses listed below; they distinguish the causes that these poses cannot.")
    if verdict == "changed":
        acts = list(dict.fromkeys(_act(cause, _) for cause in causes))
        return _("Next: {acts}; or bring the model up to date with `fastcal update`.", acts="; ".join(acts))
    if verdict == "cannot_tell":
        if any(cause.kind != "row" for cause in causes):
            return _("Next: find what the model lacks: `fastcal diagnose` with the measurements of the calibration.")
        if has_next_poses:
            return _("Next: measure the poses listed below and check again with all rows.")
        return _("Next: measure more poses, or choose a tolerance that can be decided at this noise level.")
    if within is False:
        return _(
            "Next: the model is as good as it was, but that does not meet the tolerance: recalibrate with more poses."
        )
    return ""


def _act(cause: Cause, _: Translate) -> str:
    """What undoes a change at the arm."""
    owner = _place(cause.label.partition(" ")[0], _)
    if cause.kind == "zero":
        (change,) = cause.changes
        return _("re-master {joint}, whose zero moved by {size}", joint=owner, size=size_text(change))
    if cause.kind == "tool":
        return _("check whether the tool is bent, loose or has been exchanged, and measure it again")
    if cause.kind == "link":
        return _("check {link} and its bolts for collision damage", link=owner)
    if cause.kind == "noise":
        return _(
            "check the instrument, the target's seat and the arm's brakes for vibration; after a collision calibrate "
            "again"
        )
    if cause.kind == "row":
        return _("measure that pose again")
    return _("check the gear and bearings of {owner}", owner=_place(cause.label.partition("@")[2], _))


def cause_text(cause: Cause, _: Translate = plain) -> str:
    """What changed and by how much, as in: joint 3 zero by +0.018 +- 0.002 deg."""
    if cause.kind == "noise":
        (change,) = cause.changes
        was, now = f"{change.was:.3f}", f"{change.value:.3f}"
        text = _(
            "the errors have grown from {was} to {now} {unit} like noise: no single change of the arm explains them",
            was=was,
            now=now,
            unit=change.unit,
        )
    elif len(cause.changes) == 1:
        text = _("{what} by {size}", what=spoken(cause.label, _), size=size_text(cause.changes[0]))
    else:
        known = [c for c in cause.changes if c.std < math.inf] or cause.changes
        sizes = ", ".join(f"{c.name.removesuffix(f'_{c.unit}')} {size_text(c)}" for c in known)
        if len(known) < len(cause.changes):
            sizes = _("{sizes}; {count} others undetermined", sizes=sizes, count=len(cause.changes) - len(known))
        text = f"{spoken(cause.label, _)} ({sizes})"
    if not cause.equivalents:
        return text
    others = _(" or ").join(spoken(label, _) for label in cause.equivalents[:4])
    return _("{what}, or {others}", what=text, others=others)


def size_text(change: Change) -> str:
    """As in: +0.018 +- 0.002 deg; what has no common unit as a share of what it was: +10.2 +- 0.6 %."""
    if change.unit not in ("mm", "deg") and change.was != 0:
        share, std = (100 * size / abs(change.was) for size in (change.change, change.std))
        return f"{share:+.1f} +- {std:.1f} %"
    digits = max(0, 1 - math.floor(math.log10(change.std))) if 0 < change.std < math.inf else 3
    if change.std == math.inf:
        size = f"{change.change:+.{digits}f}"
    elif digits <= 6:
        size = f"{change.change:+.{digits}f} +- {change.std:.{digits}f}"
    else:
        size = f"{change.change:+.3g} +- {change.std:.1g}"
    return size if change.unit == "1" else f"{size} {change.unit}"


def spoken(label: str, _: Translate = plain) -> str:
    """A label as spoken: joint 3 zero, compliance of joint 2."""
    effect, at, owner = label.partition("@")
    if at:
        return _("{effect} of {owner}", effect=_(phrase(effect)), owner=_place(owner, _))
    head, _space, kind = label.rpartition(" ")
    if kind == "zero":
        return _("{joint} zero", joint=_place(head, _))
    if kind == "geometry":
        return _("{joint} geometry", joint=_place(head, _))
    if head == "row":
        return _("row {number}", number=kind)
    return _("noise") if label == "noise" else _("tool")


def phrase(effect: str) -> str:
    """An effect in words, without what explains it, as a message of the catalogue."""
    return traits_of(effect).phrase.partition(" (")[0].replace("{", "{{").replace("}", "}}")


def _place(owner: str, _: Translate) -> str:
    """joint3 -> joint 3."""
    known = {"joint": _("joint"), "link": _("link")}
    return re.sub(r"\b(joint|link)(\d)", lambda found: f"{known[found[1]]} {found[2]}", owner)


def listed_numbers(values: Sequence[float], digits: int) -> str:
    """Numbers with so many digits after the point; one that rounds to 0 has no sign."""
    return ", ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in values)


def reasons(
    fits: Sequence[KindFit],
    p_value: float,
    degrees: int,
    places: Sequence[SetUp],
    causes: Sequence[Cause],
    _: Translate = plain,
) -> list[str]:
    """The evidence, a sentence each."""
    main, *others = fits
    digits = 3 if main.kind.unit == "mm" else 4
    out = [
        _(
            "RMS {found} after fitting the base, {wanted} expected from noise and the model's uncertainty "
            "({degrees} degrees of freedom, p {p})",
            found=main.kind.text(main.found.rms, digits),
            wanted=main.kind.text(main.expected_rms, digits),
            degrees=degrees,
            p=f"= {p_value:.2g}" if p_value >= LEAST_P else f"< {LEAST_P:.4f}",
        )
    ]
    for fit in others:
        found, wanted = (fit.kind.text(size) for size in (fit.found.rms, fit.expected_rms))
        out.append(_("{kind}: RMS {found}, {wanted} expected", kind=_(fit.kind.plural), found=found, wanted=wanted))
    for place in places:
        motion = place.to_json_dict()
        xyz, rpy = listed_numbers(motion["xyz_mm"], 2), listed_numbers(motion["rpy_deg"], 3)
        where = _("station {name}", name=place.name) if place.name else _("the instrument")
        out.append(
            _(
                "{where}: the base has moved by xyz {xyz} mm, rpy {rpy} deg in the measuring frame; refitted",
                where=where, xyz=xyz, rpy=rpy,
            )
        )  # fmt: skip
    for cause in causes:
        if cause.equivalents:
            names = ", ".join(spoken(label, _) for label in cause.equivalents)
            out.append(
                _("these poses cannot distinguish {cause} from {names}", cause=spoken(cause.label, _), names=names)
            )
    return out
