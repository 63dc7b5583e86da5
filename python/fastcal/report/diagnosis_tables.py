# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The tables of a diagnosis: the ranking, the smallest effects that would have shown, what the data can't show."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING

from fastcal.diagnosis.words import effect_in_words, owner_in_words
from fastcal.effects.entries import build_effects, edge_name, traits_of
from fastcal.effects.traits import filled
from fastcal.report import shop
from fastcal.report.diagnosis_words import reason_sentence, spoken, spoken_effect
from fastcal.report.formatting import fixed, percent
from fastcal.report.language import _
from fastcal.report.tables import Cell, Column, Group, Table, capitalised, number_cell
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.diagnosis.result import DetectableEffect, Diagnosis


def ranking_table(found: Diagnosis) -> Table:
    """Each name that explains much: what it would be alone, its signal, its share of the misfit, why it isn't given."""
    columns = [
        Column(_("Cause"), numeric=False),
        Column(_("Alone it would be"), numeric=False),
        Column(_("Times the noise")),
    ]
    columns += [Column(_("Of the misfit")), Column(_("Why it is, or is not, reported"), numeric=False)]
    rows = [
        [
            Cell(capitalised(spoken(r.label))),
            Cell(shop.estimate_text(r.estimate)),
            number_cell(fixed(r.snr, 0 if r.snr >= 10 else 1), r.snr),
            number_cell(percent(r.share), r.share),
            Cell(reason_sentence(r.because)),
        ]
        for r in found.ranking
    ]
    return Table(_("Causes by what each alone explains"), columns, [Group(rows)], is_sortable=True)


@dataclass(frozen=True)
class Smallest:
    """What would have shown of one number of an effect, over the places that it may have.

    Attributes:
        effect: Its name; kind: the number, in words.
        members: The smallest size at each place.
        unit: Of these sizes.
        typical: The largest usual size; None where none is known.
        usual: The usual size at each place, None where none is known.
    """

    effect: str
    kind: str
    members: list[DetectableEffect]
    unit: str
    typical: float | None
    usual: list[float | None]

    @property
    def ratios(self) -> list[float]:
        """The smallest size that shows over the usual one, at each place that has one."""
        return [s.value / usual for s, usual in zip(self.members, self.usual, strict=True) if usual]

    @property
    def hidden(self) -> list[str]:
        """Places where even a usual size could hide."""
        return [s.owner for s, usual in zip(self.members, self.usual, strict=True) if usual and s.value > usual]

    @property
    def name(self) -> str:
        """Effect and number, as they are printed; the effect alone where the number says nothing more."""
        effect = capitalised(spoken_effect(self.effect))
        return effect if self.kind.lower() in effect.lower() else f"{effect}, {self.kind}"


def smallest_by_kind(found: Diagnosis) -> list[Smallest]:
    """The smallest effects that would have shown, by effect and number."""
    usual = _usual_sizes(found)
    out = []
    for (effect, kind), group in groupby(sorted(found.smallest, key=_kind), key=_kind):
        members = list(group)
        unit = shop.split_name(members[0].parameter.partition(" of ")[0])[1]
        sizes = [usual.get((s.effect, s.owner, _plain(s))) for s in members]
        known = [size for size in sizes if size is not None]
        out.append(Smallest(effect, kind, members, unit, max(known, default=None), sizes))
    return out


def smallest_table(kinds: list[Smallest]) -> Table:
    """By effect: the smallest size that would have shown, where it shows best and worst, and a usual size."""
    columns = [Column(_("Effect"), numeric=False), Column(_("Number"), numeric=False), Column(_("Easiest to detect"))]
    columns += [
        Column(_("Hardest to detect")),
        Column(_("Usual size")),
        Column(_("A usual size could go undetected at"), numeric=False),
    ]
    rows = []
    for of in kinds:
        best, worst = (pick(of.members, key=lambda s: s.value) for pick in (min, max))
        several = len({s.owner for s in of.members}) > 1
        rows.append(
            [
                Cell(capitalised(spoken_effect(of.effect))),
                Cell(of.kind),
                Cell(_at(best, of.unit, several)),
                Cell(_at(worst, of.unit, True) if worst.owner != best.owner else ""),
                Cell("" if of.typical is None else shop.size_text(of.unit, of.typical)),
                Cell(owners_text(of.hidden)),
            ]
        )
    return Table(_("Smallest effects that these data could have detected"), columns, [Group(rows)])


def _at(found: DetectableEffect, unit: str, is_one_of_many: bool) -> str:
    size = shop.size_text(unit, found.value)
    place = re.sub(r" (?=\d)", "\u00a0", _(owner_in_words(found.owner)))  # no number alone on the next line
    return f"{size} ({place})" if is_one_of_many else size


def _plain(found: DetectableEffect) -> str:
    return found.parameter.partition(" of ")[0]


def _kind(found: DetectableEffect) -> tuple[str, str]:
    return found.effect, shop.kind_in_words(found.effect, shop.split_name(_plain(found))[0])


def _usual_sizes(found: Diagnosis) -> dict[tuple[str, str, str], float]:
    """The plausible size of each parameter in the unit of its name, as the effects state it."""
    problem = found.state.fit.problem
    out: dict[tuple[str, str, str], float] = {}
    for name in problem.names:
        entry = {key: value for key, value in name.entry.items() if key != "corner"}
        for parameter in build_effects([entry], problem.start.model.robot)[0].parameters:
            label = edge_name(parameter, geometry=False)
            if parameter.sigma < float("inf"):
                unit = shop.split_name(label)[1]
                out[(*name.key, label)] = from_si(parameter.sigma, unit)
                if name.traits.is_wave:
                    out[(*name.key, "amplitude_rad")] = parameter.sigma
    return out


def untestable_table(found: Diagnosis) -> Table | None:
    """What the data can't show, a row for each effect, and what would show it."""
    seen = {(s.effect, s.owner) for s in found.smallest}  # with what was found in the model
    items = [item for item in found.untestable if (item.effect, item.owner) not in seen]
    if not items:
        return None
    groups: dict[tuple[str, str], list[str]] = {}
    for item in items:
        needs = _of_any(item.needs)
        needs = _("the column {name}", name=needs) if re.fullmatch(r"\w+", needs) else _(needs)
        groups.setdefault((item.effect, needs), []).append(item.owner)
    rows = [
        [Cell(capitalised(_(effect_in_words(effect)))), Cell(owners_text(owners)), Cell(needs)]
        for (effect, needs), owners in groups.items()
    ]
    columns = [Column(title, numeric=False) for title in (_("Cause"), _("Where"), _("It would show with"))]
    return Table(_("Causes that these data cannot detect"), columns, [Group(rows)])


def _of_any(needs: str) -> str:
    """What shows an effect, N in place of the number of its joint or link."""
    return re.sub(r"(approach|joint|current|link|motor) ?\d+", lambda of: re.sub(r"\d+", "N", of[0]), needs)


def needs_of(effect: str) -> set[str]:
    """All that the table may say would show an effect, as messages to translate."""
    traits = traits_of(effect)
    texts = (traits.needs_data, traits.shown_by)
    owner = (
        "link1" if traits.place == "link" else "joint2<-joint1" if any("{m}" in text for text in texts) else "joint1"
    )
    every = {_of_any(filled(text, owner)) for text in texts}
    return {needs for needs in every if not re.fullmatch(r"\w*", needs)}


def owners_text(owners: list[str]) -> str:
    """["joint1", "joint2", "joint3"] to "joints 1 to 3"."""
    owners = list(dict.fromkeys(owners))
    plain = [re.fullmatch(r"(joint|link)(\d+)", owner) for owner in owners]
    parts = [_(owner_in_words(o)) for o, m in zip(owners, plain, strict=True) if m is None]
    for kind in ("joint", "link"):
        numbers = [int(m[2]) for m in plain if m and m[1] == kind]
        if len(numbers) == 1:
            parts.append(_(owner_in_words(f"{kind}{numbers[0]}")))
        elif numbers:
            run = len(numbers) > 2 and numbers == list(range(numbers[0], numbers[-1] + 1))
            text = _("{first} to {last}", first=numbers[0], last=numbers[-1]) if run else ", ".join(map(str, numbers))
            many = {"joint": _("joints {numbers}", numbers=text), "link": _("links {numbers}", numbers=text)}
            parts.append(many[kind])
    if len(parts) <= 6:
        return ", ".join(parts)
    return _("{names} and {count} more", names=", ".join(parts[:5]), count=len(parts) - 5)
