# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What has happened to an arm that a check finds changed: the likeliest causes, their rivals and their sizes."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.monitoring.evidence import Evidence
from fastcal.monitoring.hypotheses import ODDS, Changing
from fastcal.monitoring.result import Cause, Change
from fastcal.monitoring.setting import Setting
from fastcal.units import factor

LEVEL = 0.003  # chance that an unchanged arm is called changed
MOST_CAUSES = 3
RIVAL = 0.02  # odds against the likeliest cause above which another may be it
ANOTHER = 0.02  # odds of a second event beside the first


def explained(setting: Setting) -> tuple[list[Cause], list[list[int]]]:
    """The likeliest causes, one after the other while something remains, and each one's rivals (itself first).

    Grown noise explains any misfit, so it is held against the whole set and not against its first member.
    """
    noise, evidence = len(setting.possible), setting.evidence
    chosen: list[int] = []
    rivals: list[list[int]] = []
    probability: list[float] = []
    while len(chosen) < MOST_CAUSES:
        shares = _shares(setting, evidence, chosen)
        best = int(np.argmax(shares))
        rivals.append([i for i in np.argsort(-shares, kind="stable").tolist() if shares[i] >= RIVAL * shares[best]])
        probability.append(float(shares[best]))
        chosen.append(best)
        evidence = setting.evidence.given(chosen)
        if evidence.degrees < 1 or min(evidence.p_value, evidence.smallest_p) * 2 >= LEVEL:
            break
    prior = sum(np.log(setting.possible[i].odds) for i in chosen) + (len(chosen) - 1) * np.log(ANOTHER)
    log_odds = setting.evidence.noise_odds[0] + np.log(ODDS["noise"]) - setting.evidence.odds_of(chosen) - prior
    if log_odds > 0:
        return [_cause(setting, [noise], 0, float(1 / (1 + np.exp(-log_odds))), [])], [[noise]]
    if log_odds > np.log(RIVAL):
        rivals[0].append(noise)
    causes = [
        _cause(setting, chosen, k, probability[k], [i for i in rivals[k] if i != each]) for k, each in enumerate(chosen)
    ]
    return causes, rivals


def _shares(setting: Setting, evidence: Evidence, chosen: list[int]) -> FloatArray:
    """(h,) probabilities of the hypotheses beside those that are chosen, given that one of them happened."""
    logs = np.array(
        [
            t.odds + np.log(h.odds) if t.rank > 0 and h.allows(t.value, t.std) else -np.inf
            for h, t in zip(setting.possible, evidence.tests, strict=True)
        ]
    )
    logs[chosen] = -np.inf
    return np.asarray(np.exp(logs - np.max(logs)) / np.sum(np.exp(logs - np.max(logs))))


def _cause(setting: Setting, chosen: list[int], k: int, probability: float, others: list[int]) -> Cause:
    """The k-th cause, its numbers estimated beside the other causes."""
    labels = tuple(_label(setting, i) for i in others)
    index = chosen[k]
    others_given = setting.evidence.given([i for i in chosen if i not in (index, len(setting.possible))])
    if index == len(setting.possible):
        kind = setting.rows.kinds[0]
        sigma = kind.shown(setting.rows.noise(kind))
        grown = others_given.noise_odds[1]
        std = grown * sigma / np.sqrt(2 * max(others_given.degrees, 1))
        change = Change(f"sigma_{kind.unit}", "instrument", grown * sigma, std, kind.unit, sigma, others_given.p_value)
        return Cause("noise", "noise", probability, labels, (change,))
    h, t = setting.possible[index], others_given.tests[index]
    p = setting.evidence.adjusted(t.p_value)
    changes = tuple(
        _change(number, value, std, p) for number, value, std in zip(h.numbers, t.value, t.std, strict=True)
    )
    return Cause(h.kind, h.label, probability, labels, changes)


def _change(number: Changing, value: float, std: float, p: float) -> Change:
    f = factor(number.unit)
    return Change(number.name, number.owner, number.was + value / f, std / f, number.unit, number.was, p)


def _label(setting: Setting, index: int) -> str:
    return "noise" if index == len(setting.possible) else setting.possible[index].label
