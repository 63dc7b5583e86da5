# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The sentences that fastcal's code says to a person: all that it raises, and what else reads as a sentence in it."""

from __future__ import annotations

import ast
import functools
import re
import string
from collections.abc import Iterator
from pathlib import Path

import fastcal

SOURCE = Path(fastcal.__file__).parent
ERRORS = re.compile(r"^(InvalidInput|Undetermined|ParseError|TooLarge|AlreadyCompensated|NotExpandedError)$")
# Rooms for programs in Python: their errors are about arrays and options that no command passes on.
OF_PYTHON = {"beams", "surrogate", "report"}
# Besides what they raise, these hold texts that are written into files, tables of words, names of reasons, CSS.
ONLY_RAISED = re.compile(
    r"importers/(words|templates)|measurements/labels|io/(hand_eye_\w+|urdf_file)|cli/(manners|who)|"
    r"diagnosis/(reasons|rig_library|sensitivity|generic)|calibration/bootstrap|effects/entries|"
    r"programs/(driving|measuring|fanuc/instructions|visiting|\w+/statements)|units|studio/"
)
# About an argument in Python that a command cannot get wrong.
ABOUT_ARRAYS = re.compile(r"(have|got|of) shape|shape \(|must hold real numbers|has no attribute|^J and r|^J must")
# No sentences: patterns, reprs, remarks in files that are written, forms of names.
NO_SENTENCE = re.compile(
    r"^<[A-Z]|^#|[\\\n]|\(\?|\[A-Z|^(Trained|Identified|Written|Without|ISO 9283 \w+) |^(corners|targets) are |"
    r"^KUKA: R|^- found|^import sys|^R = Rz|\{\}_\w+$|by fastcal$"
)
# What typer says of a command line.
OF_TYPER = {
    *("Missing argument '{}'.", "Missing option '{}'.", "No such option: {}", "No such option: {} Did you mean {}?"),
    *("No such option: {} (Possible options: {})", "No such command '{}'.", "No such command '{}'. Did you mean {}?"),
    *("Invalid value for '{}': {}", "Invalid value: {}", "File '{}' does not exist.", "Path '{}' does not exist."),
    *("Directory '{}' does not exist.", "File '{}' is a directory.", "'{}' is not a valid integer."),
    *("'{}' is not a valid float.", "'{}' is not one of {}.", "{} is not in the range {}."),
    *("Got unexpected extra argument ({})", "Got unexpected extra arguments ({})", "Option '{}' requires an argument."),
    "interrupted",
}
SMALL = re.compile(
    r"\b(the|of|and|with|from|that|are|is|were|not|this|which|has|have|by|on|its|for|be|no|an?|in|to|or|expected|must|it|"
    r"where|as|but|than|them|they|what|if|one|each|all|more|only|at|left|out|found|between|beyond)\b",
    re.IGNORECASE,
)


@functools.cache
def syntax(path: Path) -> list[ast.AST]:
    """Of a module's syntax the literal texts, and what says what they are for."""
    kinds = (ast.Call, ast.Constant, ast.Expr, ast.JoinedStr, ast.keyword)
    return [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, kinds)]


@functools.cache
def texts(path: Path) -> list[tuple[int, str]]:
    """A module's literal texts that have letters, as messages, with the identity of each."""
    found = ((id(node), message_of(node)) for node in syntax(path) if isinstance(node, ast.Constant | ast.JoinedStr))
    return [(name, message) for name, message in found if " " in message or message.isalpha()]


def shape(message: str) -> str:
    """A message without the names of its placeholders, which in code are expressions; {} is for str.format."""
    parts = string.Formatter().parse(message)
    return "".join(literal + ("{}" if name is not None else "") for literal, name, *_spec in parts)


def message_of(node: ast.AST) -> str:
    """Of a literal text: the message with placeholders; "" of what is none."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):  # for str.format or said(): {} or {name}
        doubled = node.value.replace("{", "{{").replace("}", "}}")
        return re.sub(r"\{\{(\w*(?::[^{}\s][^{}]*)?)\}\}", r"{\1}", doubled)
    parts = node.values if isinstance(node, ast.JoinedStr) else []
    return "".join(
        str(part.value).replace("{", "{{").replace("}", "}}") if isinstance(part, ast.Constant) else "{}"
        for part in parts
    )


def raised(path: Path) -> Iterator[str]:
    """What errors are made of: the texts in their first argument."""
    for node in syntax(path):
        if isinstance(node, ast.Call) and node.args and ERRORS.match(getattr(node.func, "id", "")):
            first = node.args[0]
            yield from map(message_of, [first.body, first.orelse] if isinstance(first, ast.IfExp) else [first])


def in_words(message: str) -> list[str]:
    """The fixed words of a message."""
    return re.findall(r"(?<![\w-])[^\W\d_][\w'-]*", re.sub(r"\{[^{}]*\}", " ", message))


def spoken(path: Path) -> Iterator[str]:
    """The texts of three words and more, one of them small, that are no docstring, help or message of said()."""
    silent: set[int] = set()
    for node in syntax(path):
        if isinstance(node, ast.Expr):  # a docstring
            silent.add(id(node.value))
        elif isinstance(node, ast.keyword) and node.arg in ("help", "epilog", "metavar"):
            silent |= {id(part) for part in ast.walk(node.value)}
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "compile":
            silent |= {id(part) for part in ast.walk(node)}
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("_", "said", "translated", "chained"):
            silent.add(id(node.args[0]))
        elif isinstance(node, ast.JoinedStr):
            silent |= {id(part) for part in node.values}
    for name, message in texts(path):
        words = in_words(message) if name not in silent and message.count(" ") > 1 else []
        if len(words) >= 3 and SMALL.search(" ".join(words)) and not NO_SENTENCE.search(message):
            yield message


def all_sentences() -> set[str]:
    """The shapes of what a command can print: all that rooms raise, and what else reads as a sentence in them."""
    found: list[str] = []
    for path in sorted(SOURCE.rglob("*.py")):
        place = path.relative_to(SOURCE)
        if place.parts[0] not in OF_PYTHON:
            found += raised(path)
            found += [] if ONLY_RAISED.match(place.as_posix()) else spoken(path)
    return OF_TYPER | {shape(text) for text in found if in_words(text) and not ABOUT_ARRAYS.search(shape(text))}


def all_texts() -> set[str]:
    """The shapes of all literal texts of the package, and of what typer says: parts of sentences are among them."""
    return OF_TYPER | {shape(message) for path in SOURCE.rglob("*.py") for _name, message in texts(path)}


def said_in_cpp(message: str) -> bool:
    """Whether all fixed words of a message stand in texts of the compiled part."""
    return all(literal in _of_cpp() for literal, *_more in string.Formatter().parse(message) if len(literal) > 3)


@functools.cache
def _of_cpp() -> str:
    core = Path(__file__).parents[3] / "cpp" / "fastcal"  # the package may be installed elsewhere
    files = [path for kind in ("*.cpp", "*.hpp") for path in core.rglob(kind)]
    texts = re.findall(r'"(?:[^"\\\n]|\\.)*"(?:\s*"(?:[^"\\\n]|\\.)*")*', "".join(map(Path.read_text, files)))
    return re.sub(r'"\s*"', "", "\n".join(texts))
