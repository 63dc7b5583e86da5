# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""--base-link, --tip-link and --xacro: which arm of a URDF is meant, for every command that takes a robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, get_args, get_type_hints

import typer

from fastcal.cli.console import say
from fastcal.cli.signatures import with_options

OPTIONS: dict[str, tuple[Any, Any]] = {  # with their defaults
    "base_link": (
        Annotated[str, typer.Option(metavar="LINK", help="First link of the arm in a URDF; default: the root.")],
        "",
    ),
    "tip_link": (
        Annotated[
            str,
            typer.Option(metavar="LINK", help="Last link of the arm in a URDF; needed only if the URDF branches."),
        ],
        "",
    ),
    "xacro": (
        Annotated[
            list[str] | None,
            typer.Option(
                metavar="NAME:=VALUE",
                help="An argument of a xacro file (repeatable); `yes` allows a robot file to refer to one.",
            ),
        ],
        None,
    ),
}
_NAMES_OF_ROBOTS = ("ROBOT", "MODEL")  # how the metavars of such arguments and options begin


def with_links(command: Callable[..., None]) -> Callable[..., None]:
    """The command with these options, where one of its parameters names a robot."""
    hints = get_type_hints(command, include_extras=True)
    robots = [name for name, hint in hints.items() if _names_a_robot(hint)]
    if not robots:
        return command

    def take(given: dict[str, Any], links: dict[str, Any]) -> None:
        for name in robots:
            if given.get(name) is not None:
                given[name] = _source(given[name], **links)

    return with_options(command, OPTIONS, take)


def _names_a_robot(hint: Any) -> bool:
    metavars = [getattr(extra, "metavar", None) or "" for extra in getattr(hint, "__metadata__", ())]
    is_text = get_args(hint)[:1] in ((str,), (str | None,))
    return is_text and any(metavar.startswith(_NAMES_OF_ROBOTS) for metavar in metavars)


def _source(robot: str, base_link: str, tip_link: str, xacro: list[str] | None) -> str:
    """What a parameter names, with what the options say; prints which links were chosen in a bare URDF."""
    is_bare = robot.lower().endswith((".urdf", ".xacro"))
    if not (is_bare or base_link or tip_link or xacro):
        return robot
    from fastcal.io.robot_file import chosen_arm
    from fastcal.io.robot_source import RobotSource

    source = RobotSource(robot, base_link, tip_link, tuple(xacro or ()))
    if not is_bare:
        return source
    source, notes = chosen_arm(source)
    for note in notes:
        say(note)
    return source
