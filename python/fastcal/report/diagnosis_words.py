# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A diagnosis in the words of the shop floor: verdicts, grades, names, what to do next."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from typing import TYPE_CHECKING

from fastcal.diagnosis import rules
from fastcal.diagnosis.reasons import HELD_ARM, NOMINAL_ARM, Because, BlockLabel, Label, Reason
from fastcal.diagnosis.words import owner_in_words, reason_text, variables_in_words
from fastcal.effects.entries import traits_of
from fastcal.report.formatting import count, percent, plural
from fastcal.report.words import listed

if TYPE_CHECKING:
    from fastcal.diagnosis.result import Finding, Unexplained

VERDICTS = {  # word and tone
    "none": ("Nothing missing", "good"),
    "named": ("Named", "good"),
    "one_of": ("One of these", "caution"),
    "several": ("Several", "good"),
    "unexplained": ("Something remains, unnamed", "bad"),
}
GRADES = {
    "A": "it is this: everything that could be mistaken for it was tried and rejected",
    "B": "the data are consistent with it, but something else could do the same",
    "C": "the place is known, the cause is not",
    "D": "something remains",
}

_ARMS = {NOMINAL_ARM: "base and tool alone", HELD_ARM: "geometry held near nominal"}
_SMALL = 0.01  # share of the misfit below which the unexplained part is not worth a search

_VARIANTS = {  # other options are not shown
    "order": "order {}",
    "at_s": "at {} s",
    "at_row": "from row {} on",
    "period_mm": "period {} mm",
}


def short_name(effect: str, owner: str, variant: str = "") -> str:
    """("link_torsion", "link3") to "link 3 torsion", with the order of a wave behind it."""
    words, place_words = effect.split("_"), owner_in_words(owner)
    if owner in ("base", "tool", "payload", "instrument") and len(words) > 1:  # base_drift says where it is
        place_words = ""
    elif words[0] == place_words.split()[0]:
        words = words[1:]
    return f"{place_words} {' '.join(words)}{f', {variant}' if variant else ''}".strip()


def name_in_model(finding: Finding) -> str:
    """EFFECT@OWNER as `fastcal drop` takes it; a wave with its order, since a joint may have several."""
    order = finding.parameters.get("order")
    return finding.label + (f":order={order.value:.6g}" if order else "")


def drop_command(finding: Finding) -> str:
    """The command that takes a finding out of the model again."""
    return f"fastcal drop model.yaml {shlex.quote(name_in_model(finding))} -o without.yaml"


def stands_for_geometry(added: str | None) -> bool:
    """Is a step of the gap a model in place of the calibrated geometry?"""
    return added in _ARMS


def step_name(added: str | None) -> str:
    """What one step of the gap adds, "backlash@joint4,..." as a file has it, by short names."""
    if added is None:
        return "geometry alone"
    if added in _ARMS:
        return _ARMS[added]
    owners: dict[str, list[str]] = {}
    for effect, _, owner in (part.partition("@") for part in added.split(",")):
        owners.setdefault(effect, []).append(owner)
    names = []
    for effect, own in owners.items():
        many = "curves" if traits_of(effect).role == "curve" else effect.replace("_", " ")
        names += [short_name(effect, o) for o in own] if len(own) <= 2 else [f"the {many} of {len(own)} joints"]
    return listed(names)


def spoken(label: Label) -> str:
    """A hypothesis by its short name; something without a name by its place and what it depends on."""
    if isinstance(label, BlockLabel):
        return f"something at {place(label.owner)} that depends on {depends(label.depends_on)}"
    option, _, value = label.variant.partition("=")
    return short_name(label.effect, label.owner, _VARIANTS.get(option, "").format(value))


def place(owner: str) -> str:
    """An owner of something without a name, with its article where it has one."""
    return owner_in_words(owner) if owner.startswith(("joint", "link")) else f"the {owner}"


def depends(names: Iterable[str]) -> str:
    """("q4", "q6") to "the positions of joint 4 and joint 6"."""
    return listed(variables_in_words(names))


def reason_sentence(because: Because) -> str:
    """Why a hypothesis is, or is not, given, as the ranking has it."""
    if because.reason is Reason.GIVEN:
        return "This is the one that is given."
    if because.reason is Reason.LEAVES_MORE:
        (left,) = because.subjects
        return f"With it in the model, {spoken(left)} is still there; noise would look so {chance(because.value)}."
    text = reason_text(because, spoken)
    return text[:1].upper() + text[1:] + "."


def reason_in_brief(because: Because) -> str:
    """The same in a few words, as a figure has them."""
    if because.reason is Reason.GIVEN:
        return "named"
    if because.reason is Reason.LEAVES_MORE:
        (left,) = because.subjects
        return f"ruled out: leaves {spoken(left)}"
    return reason_text(because, spoken)


def chance(p: float) -> str:
    """How often noise alone would look like this: "in less than 1 of 10 000 data sets"."""
    if p > 0.01:
        return f"in {percent(min(p, 1.0))} of data sets"
    power = min(int(f"{1 / max(p, 1e-12):e}".split("e")[1]), 6)
    return f"in less than 1 of {count(10**power)} data sets"


def sureness(finding: Finding) -> list[str]:
    """What speaks for a finding, a sentence each."""
    if finding.snr <= 0:
        return []
    gain, error = finding.gain
    better = "not clearly better" if gain < rules.GRADE_A_GAIN * error else "clearly better"
    return [
        f"Signal-to-noise ratio {finding.snr:.0f}; noise alone would look like this {chance(finding.p_value)}.",
        f"Held-out poses are predicted {better} with it in the model.",
        f"In cross-validation it ranked first in {percent(finding.stability)} of the folds.",
    ]


def unexplained_sentence(remaining: Unexplained, names: int) -> str:
    """Where the unexplained part is best located, and how large it is."""
    share = "less than 1\N{NARROW NO-BREAK SPACE}%" if remaining.share < _SMALL else percent(remaining.share)
    where = f"{'in' if remaining.owner == 'workspace' else 'at'} {place(remaining.owner)}"
    return (
        f"{share} of the misfit that geometry alone leaves is explained by none of the {plural(names, 'cause')} "
        f"that were tried. It fits best {where}, as something that depends on {depends(remaining.depends_on)}."
    )
