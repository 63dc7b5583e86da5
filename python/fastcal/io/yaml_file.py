# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""YAML in: mappings, lists, text, numbers, true, false and null, and nothing that could surprise.

Built from the parser's events, so that no tag makes an object, no nesting reaches the stack, and an alias costs what it
stands for. Numbers are those of YAML 1.2: 1e-7 is a number, 1:30, 0x10, 010 (ten) and `no` have no second meaning.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import yaml

from fastcal.errors import ParseError
from fastcal.io.regular_file import read_bytes
from fastcal.io.text_encoding import marked_encoding

MAX_BYTES = 64_000_000  # the root of a covariance of 3,400 parameters
MAX_VALUES = 500_000  # a covariance of 950 parameters, listed as older versions did, is 450,000
MAX_DEPTH = 32

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml where it is built in; only its events are used
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_NOT_FINITE = re.compile(r"([-+]?)\.(inf|nan)\Z", re.IGNORECASE)
_WORDS: dict[str, bool | None] = {"": None, "~": None, "null": None, "true": True, "false": False}


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a file of reasonable size: UTF-8, or UTF-16 with its mark, as PowerShell writes what is printed.

    Raises:
        ParseError: There is no such file, it is none, too large, or no text.
    """
    content = read_bytes(path, MAX_BYTES)
    encoding = marked_encoding(content) or "utf-8"
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        name = encoding.removesuffix("-sig").upper()
        raise ParseError(f"expected {name} text, got the byte 0x{content[error.start]:02x}", path) from None


def read_yaml(path: str | os.PathLike[str]) -> Any:
    """The one document of a YAML file as plain Python data; integers stay integers.

    Raises:
        ParseError: Names the file, the line, what was expected and what came.
    """
    return parsed_yaml(read_text(path), path)


def parsed_yaml(text: str, path: str | os.PathLike[str]) -> Any:
    """`read_yaml` of a text that was read from `path`.

    Raises:
        ParseError: Names the file, the line, what was expected and what came.
    """
    try:
        return _Builder(path).build(yaml.parse(text, Loader=_LOADER))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else None
        raise ParseError(f"is not valid YAML: {error.problem or error.context}", path, line) from None
    except yaml.YAMLError as error:
        raise ParseError(f"is not valid YAML: {str(error).splitlines()[0]}", path) from None


class _Built(NamedTuple):
    """A finished value: how many values it holds and how deep, which an alias to it costs again."""

    value: Any
    size: int
    depth: int


class _Open:
    """A mapping or list that is being filled; `key` waits for its value."""

    def __init__(self, event: Any) -> None:
        self.is_mapping = isinstance(event, yaml.MappingStartEvent)
        self.value: Any = {} if self.is_mapping else []
        self.anchor: str | None = event.anchor
        self.key: str | None = None
        self.count = 1
        self.depth = 1


class _Builder:
    """A stack of open containers over the stream of events."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._path = path
        self._anchors: dict[str, _Built] = {}
        self._stack: list[_Open] = []
        self._root: _Built | None = None

    def build(self, events: Iterator[Any]) -> Any:
        """Takes the events of one document."""
        documents = 0
        for event in events:
            documents += isinstance(event, yaml.DocumentStartEvent)
            if documents > 1:
                self._fail("expected one document, got a second one", event)
            self._take(event)
        if self._root is None:
            raise ParseError("is empty", self._path)
        return self._root.value

    def _take(self, event: Any) -> None:
        match event:
            case yaml.MappingStartEvent() | yaml.SequenceStartEvent():
                self._check_tag(event)
                self._stack.append(_Open(event))
                if len(self._stack) > MAX_DEPTH:
                    self._fail(f"is nested more than {MAX_DEPTH} deep", event)
            case yaml.MappingEndEvent() | yaml.SequenceEndEvent():
                done = self._stack.pop()
                self._add(_Built(done.value, done.count, done.depth), event, done.anchor)
            case yaml.ScalarEvent():
                self._check_tag(event)
                self._add(_Built(_scalar(event), 1, 0), event, event.anchor)
            case yaml.AliasEvent():
                name = str(event.anchor)
                if name not in self._anchors:
                    self._fail(f"the alias *{name} refers to nothing that is complete before it", event)
                self._add(self._anchors[name], event, None)

    def _add(self, built: _Built, event: Any, anchor: str | None) -> None:
        if anchor is not None:
            self._anchors[anchor] = built
        if not self._stack:
            self._root = built
            return
        top = self._stack[-1]
        top.count += built.size
        top.depth = max(top.depth, built.depth + 1)
        if top.count > MAX_VALUES or len(self._stack) + built.depth > MAX_DEPTH:
            self._fail(f"holds more than {MAX_VALUES} values or is nested more than {MAX_DEPTH} deep", event)
        if not top.is_mapping:
            top.value.append(built.value)
        elif top.key is not None:
            top.value[top.key], top.key = built.value, None
        elif not isinstance(built.value, str):
            self._fail(f"expected a name as key, got {built.value!r:.40}", event)
        elif built.value in top.value:
            self._fail(f"the key '{built.value}' is given twice in one mapping", event)
        else:
            top.key = built.value

    def _check_tag(self, event: Any) -> None:
        if event.tag is not None and event.tag != "!":
            self._fail(f"the tag {event.tag!r:.60} is not read: robot files hold plain data only", event)

    def _fail(self, message: str, event: Any) -> None:
        raise ParseError(message, self._path, event.start_mark.line + 1)


def _scalar(event: Any) -> str | int | float | bool | None:
    text: str = event.value
    if event.style is not None and event.style != "":  # quoted or a block: text, whatever it looks like
        return text
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    if _INTEGER.match(text):
        return int(text)
    if _FLOAT.match(text):
        return float(text)
    if found := _NOT_FINITE.match(text):
        return float(found.group(1) + found.group(2))
    return text
