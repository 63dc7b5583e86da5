# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of the diagnosis: every rule with its number and reason, every reason of a grade, and few words."""

import re
from pathlib import Path

import pytest

from fastcal.diagnosis import rules
from fastcal.diagnosis.reasons import Reason

DOCS = Path(__file__).parents[4] / "docs"
PAGE = DOCS / "diagnosis-rules.md"
MOST_WORDS = 1500  # of a page that is read to its end


# Words of the page that answer each reason.
ANSWERED = {
    Reason.EQUIVALENTS: "other causes fit equally well",
    Reason.WEAK_SIGNAL: "its signal is below what grade A needs",
    Reason.LOOKS_LIKE_OTHERS: "its signal is weak beside what else is missing",
    Reason.UNNAMED_RIVALS: "an unnamed cause does as well",
    Reason.CURVE_WITHOUT_NAME: "position error has a shape that no single cause explains",
    Reason.SIMPLER_DOES: "what sets it apart from a simpler one",
    Reason.ORDERS_ALIKE: "waves of other orders fit as well",
    Reason.ZERO_JUMPED: "a moved zero of a joint does the same",
    Reason.ZERO_CREEPS: "a moved zero of a joint does the same",
    Reason.NOT_HELD_OUT: "held-out poses are not predicted better",
    Reason.UNSTABLE: "in cross-validation another cause ranked first",
    Reason.OWN_MODEL: "an unexplained error, is in the way",
    Reason.NOISE_OVER_CLAIM: "the noise exceeds its claim",
    Reason.NAMES_EXCLUDED: "names were excluded",
    Reason.UNSURE_COMPANION: "another effect of the set",
    Reason.SOMETHING_REMAINS: "an unexplained error",
    Reason.SHADOW: "an unexplained error",
    Reason.LOAD_MODIFIER: "look-alikes",
    Reason.OTHER_FORM: "look-alikes",
    Reason.NO_MASSES: "the robot file has no masses",
    Reason.IMPLAUSIBLE: "its size is implausible",
    Reason.TURNED_DIRECTION: "its lost motion negative",
    Reason.MAY_BE_CHANCE: "may be chance",
    Reason.NOT_OF_OTHER_POSTURES: "postures held out with all their payloads",
    Reason.CHANGES_OTHERWISE: "may be chance",
    Reason.PLAIN_MODEL_PREDICTS: "a plain model makes unnecessary",
    Reason.PART_OF_A_PLAIN_MODEL: "a plain model",
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


@pytest.mark.parametrize("page", ["diagnosis.md", "diagnosis-method.md"])
def test_a_page_can_be_read_to_its_end(page: str) -> None:
    words = [word for word in (DOCS / page).read_text(encoding="utf-8").split() if re.search(r"[^\W\d_]", word)]
    assert len(words) < MOST_WORDS, f"{page} has {len(words)} words: say it shorter, or on a page of its own"


def test_every_reason_against_a_better_grade_is_explained() -> None:
    """Each clause that a card may show is answered by the page's section on grade B, or said with its effect there."""
    section = (DOCS / "diagnosis.md").read_text(encoding="utf-8").partition("## Why is the grade B?")[2]
    section = section.partition("\n## ")[0]
    missing = [reason for reason, words in ANSWERED.items() if words not in section]
    assert missing == []
    assert set(ANSWERED) == set(Reason) - NOT_ON_CARDS
