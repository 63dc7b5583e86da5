# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A robot as a command line names it: a file, and for a URDF the links between which its arm lies."""

from __future__ import annotations

from collections.abc import Sequence


class RobotSource(str):
    """The name of a robot file, with the options given with it.

    Attributes:
        base_link: Where the arm in a URDF begins; empty: not given.
        tip_link: Where it ends; empty: not given.
        xacro: The arguments of a xacro file, `name:=value` each.
    """

    base_link: str
    tip_link: str
    xacro: Sequence[str]

    def __new__(cls, name: str, base_link: str = "", tip_link: str = "", xacro: Sequence[str] = ()) -> RobotSource:
        """A name, with what else is known."""
        source = super().__new__(cls, name)
        source.base_link, source.tip_link, source.xacro = base_link, tip_link, xacro
        return source

    def words(self) -> list[str]:
        """The same as words of a command line."""
        links = (("--base-link", self.base_link), ("--tip-link", self.tip_link))
        given = [(option, link) for option, link in links if link] + [("--xacro", argument) for argument in self.xacro]
        return [str(self), *(word for pair in given for word in pair)]
