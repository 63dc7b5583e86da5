# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""tools/lines: lines of the package by kind."""

import runpy
from pathlib import Path

TOOL = runpy.run_path(str(Path(__file__).parents[2] / "tools" / "lines"))

MODULE = '''"""What it is,
in two lines."""

# a comment
A = """text,
not a docstring"""  # with a comment behind it


def f():
    """Says nothing."""
    return A
'''


def test_each_line_is_counted_once() -> None:
    found = TOOL["counted"](MODULE)
    assert found == {"lines": 11, "code": 4, "docstrings": 3, "comments": 1, "blank": 3}
    assert found["lines"] == sum(found[kind] for kind in TOOL["KINDS"][1:])
