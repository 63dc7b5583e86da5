# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A diagnosis in the words of the shop floor: verdicts, grades, names, what to do next."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from typing import TYPE_CHECKING

from fastcal.diagnosis import rules
from fastcal.diagnosis.reasons import HELD_ARM, NOMINAL_ARM, Because, BlockLabel, Label, Reason
from fastcal.diagnosis.words import effect_in_words, owner_in_words, reason_text, variables_in_words
from fastcal.effects.entries import traits_of
from fastcal.report.formatting import count, fixed, percent, plural
from fastcal.report.language import _, language
from fastcal.report.words import listed
from fastcal.said import said

if TYPE_CHECKING:
    from fastcal.diagnosis.result import Finding, Unexplained

VERDICTS = {  # word and tone
    "none": (said("Nothing missing"), "good"),
    "named": (said("Named"), "good"),
    "one_of": (said("One of these"), "caution"),
    "several": (said("Several"), "good"),
    "unexplained": (said("Something remains, unnamed"), "bad"),
}
TOO_FEW = said("Too few measurements"), "caution"
GRADES = {
    "A": said("it is certain: everything that could be mistaken for it was tested and rejected"),
    "B": said("the data are consistent with it, but something else could look the same"),
    "C": said("the place is known, the cause is not"),
    "D": said("something remains"),
}

_ARMS = {NOMINAL_ARM: said("base and tool alone"), HELD_ARM: said("geometry held near nominal")}
_SMALL = 0.01  # share of the misfit below which the unexplained part is not worth a search

_THE = {
    "base": said("the base"),
    "tool": said("the tool"),
    "payload": said("the payload"),
    "instrument": said("the instrument"),
    "workspace": said("the workspace"),
}
_VARIANTS = {  # other options are not shown
    "order": "order {value}",
    "at_s": "at {value} s",
    "at_row": "from row {value} on",
    "at_deg": "at {value} deg",
    "at_mm": "at {value} mm",
    "period_mm": "period {value} mm",
}


def short_name(effect: str, owner: str, variant: str = "") -> str:
    """("link_torsion", "link3") to "link 3 torsion", with the order of a wave behind it; "Glied 3: Verdrehung"."""
    behind = f", {variant}" if variant else ""
    if language.get() != "en":
        return f"{_(owner_in_words(owner))}: {_(effect_in_words(effect)).partition(' (')[0]}{behind}"
    words, place_words = effect.split("_"), str(owner_in_words(owner))
    if owner in ("base", "tool", "payload", "instrument") and len(words) > 1:  # base_drift says where it is
        place_words = ""
    elif words[0] == place_words.split()[0]:
        words = words[1:]
    return f"{place_words} {' '.join(words)}{behind}".strip()


def spoken_effect(effect: str) -> str:
    """An effect by its name in English, by its phrase in other languages."""
    return effect.replace("_", " ") if language.get() == "en" else _(effect_in_words(effect)).partition(" (")[0]


def name_in_model(finding: Finding) -> str:
    """EFFECT@OWNER as `fastcal drop` takes it; a wave with its order, a step with its moment."""
    return finding.label + "".join(f":{key}={value:.6g}" for key, value in finding.told_apart_by.items())


def drop_command(finding: Finding) -> str:
    """The command that takes a finding out of the model again."""
    return f"fastcal drop model.yaml {shlex.quote(name_in_model(finding))} -o without.yaml"


def stands_for_geometry(added: str | None) -> bool:
    """Is a step of the gap a model in place of the calibrated geometry?"""
    return added in _ARMS


def step_name(added: str | None) -> str:
    """What one step of the gap adds, "backlash@joint4,..." as a file has it, by short names."""
    if added is None:
        return _("geometry alone")
    if added in _ARMS:
        return _(_ARMS[added])
    owners: dict[str, list[str]] = {}
    for effect, _at, owner in (part.partition("@") for part in added.split(",")):
        owners.setdefault(effect, []).append(owner)
    names = []
    for effect, own in owners.items():
        traits = traits_of(effect)
        if (traits.role, traits.place) == ("curve", "anywhere"):
            names.append(_("a smooth function of the remaining error"))
        elif len(own) <= 2:
            names += [short_name(effect, o) for o in own]
        else:
            many = _("curves") if traits.role == "curve" else spoken_effect(effect)
            names.append(_("the {effect} of {count} joints", effect=many, count=len(own)))
    return listed(names)


def spoken(label: Label) -> str:
    """A hypothesis by its short name; something without a name by its place and what it depends on."""
    if isinstance(label, BlockLabel):
        return _(
            "something {where} that depends on {variables}",
            where=where(label.owner),
            variables=depends(label.depends_on),
        )
    option, _equals, value = label.variant.partition("=")
    variant = _(_VARIANTS[option], value=value) if option in _VARIANTS else ""
    return short_name(label.effect, label.owner, variant)


def place(owner: str) -> str:
    """An owner of something without a name, with its article where it has one."""
    return _(owner_in_words(owner)) if owner.startswith(("joint", "link")) else _(_THE.get(owner, f"the {owner}"))


def where(owner: str) -> str:
    """At which owner something without a name is."""
    return _("in the workspace") if owner == "workspace" else _("at {place}", place=place(owner))


def depends(names: Iterable[str]) -> str:
    """("q4", "q6") to "the positions of joint 4 and joint 6"."""
    return listed([_(name) for name in variables_in_words(names)])


def reason_sentence(because: Because) -> str:
    """Why a hypothesis is, or is not, given, as the ranking has it."""
    if because.reason is Reason.GIVEN:
        return _("This is the reported cause.")
    if because.reason is Reason.LEAVES_MORE:
        (left,) = because.subjects
        return _(
            "With it in the model, {other} is still significant; noise alone would look like this {chance}.",
            other=spoken(left),
            chance=chance(because.value),
        )
    text = _(reason_text(because, spoken))
    return text[:1].upper() + text[1:] + "."


def reason_in_brief(because: Because) -> str:
    """The same in a few words, as a figure has them."""
    if because.reason is Reason.GIVEN:
        return _("named")
    if because.reason is Reason.LEAVES_MORE:
        (left,) = because.subjects
        return _("ruled out: leaves {other} unexplained", other=spoken(left))
    return _(reason_text(because, spoken))


def chance(p: float) -> str:
    """How often noise alone would look like this: "in less than 1 of 10 000 data sets"."""
    if p > 0.01:
        return _("in {share} of data sets", share=percent(min(p, 1.0)))
    power = min(int(f"{1 / max(p, 1e-12):e}".split("e")[1]), 6)
    return _("in less than 1 of {count} data sets", count=count(10**power))


def sureness(finding: Finding) -> list[str]:
    """What speaks for a finding, a sentence each."""
    if finding.snr <= 0:
        return []
    gain, error = finding.gain
    if gain < rules.GRADE_A_GAIN * error:
        held_out = _("Held-out poses are not predicted clearly better with it in the model.")
    else:
        held_out = _("Held-out poses are predicted clearly better with it in the model.")
    return [
        _(
            "Signal-to-noise ratio {ratio}; noise alone would look like this {chance}.",
            ratio=fixed(finding.snr, 0),
            chance=chance(finding.p_value),
        ),
        held_out,
        _("In cross-validation it ranked first in {share} of the folds.", share=percent(finding.stability)),
    ]


def unexplained_sentence(remaining: Unexplained, names: int) -> str:
    """Where the unexplained part is best located, and how large it is."""
    least = percent(_SMALL)
    return _(
        "{share} of the misfit that geometry alone leaves is explained by none of the {causes} tested. It fits best "
        "{where}, as something that depends on {variables}.",
        share=_("less than {share}", share=least) if remaining.share < _SMALL else percent(remaining.share),
        causes=plural(names, "cause"),
        where=where(remaining.owner),
        variables=depends(remaining.depends_on),
    )
