# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every message of a translated page has its German, and its placeholders are the English ones."""

import ast
import re
import string
from collections.abc import Iterator
from pathlib import Path

import jinja2
import pytest
import yaml
from jinja2 import nodes
from jinja2.ext import extract_from_ast

from fastcal.calibration.camera_places import ONE_AXIS, TWO_AXES
from fastcal.diagnosis import words
from fastcal.diagnosis.words import effect_in_words
from fastcal.effects.entries import effect_names
from fastcal.effects.rig_traits import ALIKE, RIG_TRAITS
from fastcal.monitoring.words import phrase
from fastcal.report import diagnosis_words, language, page, shop
from fastcal.report.diagnosis_tables import needs_of
from fastcal.report.formatting import fixed, plural
from fastcal.report.language import _, catalogue, in_language

from .sentences import all_sentences, all_texts, said_in_cpp, shape, syntax

TRANSLATED = re.compile(r"^ *from fastcal\.report\.language import .*\b_\b", re.MULTILINE)
REPORT = Path(language.__file__).parent
# Sentences of lower rooms that pages translate where they show them.
FROM_BELOW = {
    "positions",
    "orientations",
    "lengths",
    "corners",
    "corner",
    "length",
    "inclinations",
    "touches of a plane",
    "touches of a socket",
    "touches of a ball",
    "touches of a cube",
    "readings of a dial gauge",
    "estimated from the residuals; no sigma column",
    ONE_AXIS,
    TWO_AXES,
}


def texts_of(node: ast.expr) -> Iterator[str]:
    """The strings that an argument may be."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from texts_of(node.body)
        yield from texts_of(node.orelse)


def of_python(path: Path) -> Iterator[str]:
    for node in syntax(path):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id in ("_", "translated", "said", "chained"):
                yield from texts_of(node.args[0])
            elif node.func.id == "plural" and len(node.args) == 2:
                for noun in texts_of(node.args[1]):
                    yield from (noun, f"{noun}s")


def of_template(path: Path) -> Iterator[str]:
    environment: jinja2.Environment = page._environment()
    tree = environment.parse(path.read_text(encoding="utf-8"))
    for _line, _function, message in extract_from_ast(tree, ("_",)):
        first = message[0] if isinstance(message, tuple) else message
        if first is not None:
            yield str(first)
    for found in tree.find_all(nodes.Filter):
        if found.name == "plural" and found.args and isinstance(found.args[0], nodes.Const):
            yield from (found.args[0].value, f"{found.args[0].value}s")


def messages() -> set[str]:
    """Of the pages that speak more than one language: modules that import `_`, templates that call it."""
    out = set(FROM_BELOW) | {phrase(effect) for effect in effect_names()}
    out |= {effect_in_words(effect).message for effect in [*effect_names(), *RIG_TRAITS]} | set(ALIKE.values())
    out |= {need for effect in effect_names() for need in needs_of(effect)}
    out |= {*words._REASONS.values(), *words._OF_A_JOINT.values(), *diagnosis_words._VARIANTS.values()}
    out |= {message for both in shop._MOVED.values() for message in both}
    modules = [
        path
        for room in ("report", "fleet", "studio", "cli")
        for path in (REPORT.parent / room).rglob("*.py")
        if TRANSLATED.search(path.read_text(encoding="utf-8"))
    ]
    saying = [path for path in REPORT.parent.rglob("*.py") if "said(" in path.read_text(encoding="utf-8")]
    for path in [*modules, *saying, REPORT.parent / "monitoring" / "words.py"]:
        out |= set(of_python(path))
    for path in (REPORT / "templates").glob("*.html"):
        if '_("' in path.read_text(encoding="utf-8"):
            out |= set(of_template(path))
    return out


def placeholders(text: str) -> set[str]:
    return {name for _literal, name, _spec, _conversion in string.Formatter().parse(text) if name is not None}


def test_every_message_has_its_german_and_no_german_is_left_over() -> None:
    german = catalogue("de")
    asked, told = messages(), all_sentences()
    assert len(asked) > 200
    assert len(told) > 1000
    assert sorted(asked - german.keys()) == []
    assert sorted(told - {shape(message) for message in german}) == []
    texts = all_texts()
    assert [m for m in sorted(german.keys() - asked) if shape(m) not in texts and not said_in_cpp(m)] == []


@pytest.mark.parametrize("name", [name for name in language.LANGUAGES if name != "en"])
def test_placeholders_and_hover_templates_agree(name: str) -> None:
    sentences = yaml.safe_load((REPORT / "messages" / f"{name}_sentences.yaml").read_text(encoding="utf-8"))
    for message, other in catalogue(name).items():
        may_lack = placeholders(message) if message in sentences else set()  # "is" or "are" of English grammar alone
        assert placeholders(message) - may_lack <= placeholders(other) <= placeholders(message), message
        assert message.count("%{{") == other.count("%{{"), message
        assert other.strip() == other or message.strip() != message, message


def test_a_language_is_that_of_the_block_alone() -> None:
    assert (_("Method"), fixed(-1.25, 2), plural(2, "pose")) == ("Method", "\N{MINUS SIGN}1.25", "2 poses")
    with in_language("de"):
        assert (_("Method"), fixed(-1.25, 2), plural(2, "pose")) == ("Verfahren", "\N{MINUS SIGN}1,25", "2 Posen")
        assert plural(1, "pose") == "1 Pose"
    assert fixed(1.25, 2) == "1.25"
