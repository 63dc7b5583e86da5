# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of the diagnosis: every rule with its number and reason, every reason of a grade, and few words."""

import re
from pathlib import Path

import pytest

from fastcal.diagnosis import rules, words
from fastcal.diagnosis.reasons import Reason

DOCS = Path(__file__).parents[4] / "docs"
PAGE = DOCS / "diagnosis-rules.md"
MOST_WORDS = 1500  # of a page that is read to its end


# Words that a card and the page's answer to it share: who reads the one finds the other.
SHARED = {
    Reason.EQUIVALENTS: "other causes explain the data equally well",
    Reason.WEAK_SIGNAL: "times the noise; grade A needs",
    Reason.LOOKS_LIKE_OTHERS: "a cause that looks alike would be recognized",
    Reason.UNNAMED_RIVALS: "an unidentified cause would fit equally well",
    Reason.CURVE_WITHOUT_NAME: "the joint's position error has a shape that no single cause explains",
    Reason.SIMPLER_DOES: "the data do not distinguish it from",
    Reason.OTHER_FORM: "another law would fit equally well",
    Reason.LOAD_MODIFIER: "it may reflect the form of a large load effect",
    Reason.ORDERS_ALIKE: "look the same at these positions of the joint",
    Reason.SLOW_WAVE_ALIKE: "looks the same",
    Reason.OWN_JUMP: "would fit as well",
    Reason.ZERO_JUMPED: "looks the same: check its mastering",
    Reason.ZERO_CREEPS: "looks the same: check its mastering",
    Reason.NOT_HELD_OUT: "held-out poses are not predicted clearly better with it",
    Reason.WORSE_ON_TEST_POSES: "the test poses are predicted worse",
    Reason.UNSTABLE: "in cross-validation it ranked first in only",
    Reason.NOISE_OVER_CLAIM: "times the stated noise",
    Reason.NAMES_EXCLUDED: "causes were excluded from the search",
    Reason.UNSURE_COMPANION: "another effect in the set is uncertain",
    Reason.SOMETHING_REMAINS: "something else remains unexplained",
    Reason.SHADOW: "most of the misfit has another cause",
    Reason.OWN_MODEL: "the model that was written",
    Reason.PART_OF_A_PLAIN_MODEL: "the data do not show whether this joint has it",
    Reason.NO_MASSES: "the robot file has no masses",
    Reason.IMPLAUSIBLE: "it would have to be implausibly large",
    Reason.TURNED_DIRECTION: "its size is negative",
    Reason.AGAINST_LOAD: "nothing deflects against its load",
}
# Those of what is given and not written, which the page answers in one paragraph.
NOT_WRITTEN = {
    Reason.MAY_BE_CHANCE,
    Reason.NOT_OF_OTHER_POSTURES,
    Reason.CHANGES_OTHERWISE,
    Reason.PLAIN_MODEL_PREDICTS,
}
# Of hypotheses that are not given at all.
NOT_ON_CARDS = {
    Reason.GIVEN,
    Reason.IMPOSSIBLE,
    Reason.NOT_SIGNIFICANT,
    Reason.NOT_NEEDED,
    Reason.LEAVES_MORE,
}


def number(value: float | tuple[float, ...]) -> str:
    """As the page writes it."""
    return ", ".join(map(number, value)) if isinstance(value, tuple) else f"{value:g}"


def test_the_page_has_every_rule_with_its_number_and_reason() -> None:
    rows = re.findall(r"^\| `([A-Z_]+)` \| (.+?) \| (.+?) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert [(name, value) for name, value, _ in sorted(rows)] == [
        (name, number(value)) for name, value in sorted(vars(rules).items()) if name.isupper()
    ]
    assert all(len(reason) > 10 and len(reason.split()) < 30 for _, _, reason in rows)


@pytest.mark.parametrize("page", ["diagnosis.md", "diagnosis-method.md", "diagnosis-rules.md"])
def test_a_page_can_be_read_to_its_end(page: str) -> None:
    read = [word for word in (DOCS / page).read_text(encoding="utf-8").split() if re.search(r"[^\W\d_]", word)]
    assert len(read) < MOST_WORDS, f"{page} has {len(read)} words: say it shorter, or on a page of its own"


def test_every_reason_against_a_better_grade_is_explained() -> None:
    """Each clause that a card may show is answered, in its own words, by the page's section on grade B."""
    section = (DOCS / "diagnosis.md").read_text(encoding="utf-8").partition("## Why is the grade B?")[2]
    section = section.partition("\n## ")[0].lower()
    said = {reason: words._REASONS[reason] for reason in Reason}
    assert [reason for reason, shared in SHARED.items() if shared.lower() not in section] == []
    assert [reason for reason, shared in SHARED.items() if shared not in said[reason]] == []
    assert "it is not in the model" in section
    assert {reason for reason in Reason if said[reason].startswith("it is not in the model")} == NOT_WRITTEN
    assert set(SHARED) | NOT_WRITTEN == set(Reason) - NOT_ON_CARDS
