# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The commands, and the one place where an error becomes a line and an exit code."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer
from typer.core import TyperGroup

from fastcal.cli.arm_links import with_links
from fastcal.cli.console import NOT_CONVERGED, fail, manner, spoken
from fastcal.cli.languages import asked_for, with_language
from fastcal.cli.manners import examples, with_manners
from fastcal.cli.own_inputs import keeps_its_inputs
from fastcal.cli.pages import with_page
from fastcal.cli.tracker import with_tracker
from fastcal.cli.who import with_who
from fastcal.errors import FastcalError, InvalidInput, Undetermined, unloaded
from fastcal.said import sentence_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

OK, INTERNAL, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

_COMPLETION = "_FASTCAL_COMPLETE"  # the variable by which the shell asks typer for completions

# The base of what typer raises over usage, for which it has no name of its own in every version.
_UsageError = cast("type[Exception]", typer.BadParameter.__mro__[2])

# The commands as `fastcal --help` lists them, and the module and function of each.
GROUPS = {
    "Calibrate": {
        "calibrate": "calibrate:calibrate",
        "diagnose": "diagnose:diagnose",
        "evaluate": "models:evaluate",
        "train": "train:train",
        "drop": "drop:drop",
        "compliance": "compliance:compliance",
        "zeros": "zeros:zeros",
    },
    "Plan": {
        "design": "design:design",
        "template": "imports:template",
        "import": "imports:import_",
        "detect": "detect:detect",
        "place": "place:place",
    },
    "Use": {
        "compensate": "compensate:compensate",
        "predict": "models:predict",
        "convert": "convert:convert",
    },
    "Watch": {
        "check": "check:check",
        "update": "update:update",
        "compare": "update:compare",
        "history": "history:history",
        "accept": "accept:accept",
        "fleet": "fleet:fleet",
    },
    "More": {
        "studio": "studio:studio",
        "demo": "demo:demo",
        "simulate": "simulate:simulate",
        "robots": "lists:robots",
        "effects": "lists:effects",
    },
}
COMMANDS = {name: home for group in GROUPS.values() for name, home in group.items()}
ENTRY_POINTS = "fastcal.commands"  # the group of an installed package's commands
IN_EXTRAS = {"paper": "papers"}  # commands of fastcal's other packages, and the extra that brings each


class _Grouped(TyperGroup):
    """The list of commands under the headings of `GROUPS`."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Writes each group's commands with the first sentence of their help; those of other packages come last."""
        width = max(map(len, self.commands))
        limit = formatter.width - 6 - width
        other = [name for name in self.commands if name not in COMMANDS]
        for title, group in {**GROUPS, "Installed": other}.items():
            rows = [
                (name.ljust(width), command.get_short_help_str(limit))
                for name in group
                if (command := self.get_command(ctx, name)) is not None
            ]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def application(names: Iterable[str] = COMMANDS, *, listed: bool = False) -> typer.Typer:
    """`fastcal` with these of its commands; only their modules are imported.

    Args:
        names: Of the commands.
        listed: They are only to be listed: reading the options of all takes longer than everything else.
    """
    app = typer.Typer(
        cls=_Grouped,
        add_completion=True,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback(
        epilog="Exit code 0: done. 2: bad input or usage. 3: not converged, too few equations, undecided. "
        "4: limit exceeded, or changed. 5: with --strict, parts were not understood."
    )(_fastcal)
    for name in names:
        command = _command(name)
        if listed:
            app.command(name, help=command.__doc__)(_listed)
            continue
        whole = with_page(name, with_who(with_tracker(with_links(keeps_its_inputs(with_language(command))))))
        app.command(name, epilog=examples(name, command))(with_manners(whole))
    return app


def _command(name: str) -> Callable[..., None]:
    """The function of a command, of fastcal or of an installed package."""
    if name in COMMANDS:
        module, _, function = COMMANDS[name].partition(":")
        found: Callable[..., None] = getattr(importlib.import_module(f"fastcal.cli.{module}"), function)
        return found
    point = installed()[name]
    try:
        return cast("Callable[..., None]", point.load())
    except Exception as error:
        raise InvalidInput(f"the installed command '{name}' ({point.value}) cannot be loaded: {error}") from error


def installed() -> dict[str, EntryPoint]:
    """The commands of installed packages by their names; none replaces one of fastcal's own."""
    from importlib.metadata import entry_points  # takes as long as a short command

    return {point.name: point for point in entry_points(group=ENTRY_POINTS) if point.name not in COMMANDS}


def _listed() -> None:
    """Instead of a command that is only listed."""


def _show_version(wanted: bool) -> None:
    if wanted:
        from fastcal import __version__

        typer.echo(f"fastcal {__version__}")
        raise typer.Exit


def _fastcal(
    version: Annotated[
        bool, typer.Option("-V", "--version", help="Show the version.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Kinematic calibration of robot arms.

    Files carry the unit of every quantity at the end of its name: x_mm, q1_deg, payload_kg.
    """


def _needed(arguments: Sequence[str]) -> typer.Typer:
    """What the arguments ask for: a command, or the list of all; all where one comes later, and where a shell asks."""
    if arguments and arguments[0] in COMMANDS:
        return application(arguments[:1])
    others = installed()
    if arguments and arguments[0] in others:
        return application(arguments[:1])
    if arguments and (extra := IN_EXTRAS.get(arguments[0])) is not None:
        raise InvalidInput(
            f"the command '{arguments[0]}' is not installed: pip install 'fastcal[{extra}]' brings it "
            "(in a checkout: pip install ./studies)"
        )
    names = [*COMMANDS, *others]
    return application(names, listed=set(names).isdisjoint(arguments) and _COMPLETION not in os.environ)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs `fastcal` with the given arguments, or with those of the process; returns the exit code."""
    given = sys.argv[1:] if arguments is None else arguments
    manner.set("text")
    spoken.set(asked_for(given))
    try:
        code = typer.main.get_command(_needed(given)).main(arguments, prog_name="fastcal", standalone_mode=False)
        sys.stdout.flush()
    except Undetermined as error:
        return _failed(sentence_of(error), NOT_CONVERGED)
    except FastcalError as error:
        return _failed(sentence_of(error), BAD_INPUT)
    except _UsageError as error:
        said = " ".join(str(error.format_message()).replace("Value error, ", "").split())  # type: ignore[attr-defined]
        command = getattr(getattr(error, "ctx", None), "command_path", "fastcal")
        return _failed(said, BAD_INPUT, command)
    except (KeyboardInterrupt, typer.Abort):
        return _failed("interrupted", INTERRUPTED)
    except BrokenPipeError:
        # The reader has gone: nothing can be said, and the interpreter must not try again when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return INTERNAL
    except OSError as error:
        return _failed(str(error), BAD_INPUT)
    except Exception as error:
        if (missing := unloaded(error)) is not None:
            return _failed(str(missing), BAD_INPUT)
        # A fault of fastcal itself is one line too.
        if os.environ.get("FASTCAL_TRACEBACK"):
            raise
        said = f"internal error, {type(error).__name__}: {error} (FASTCAL_TRACEBACK=1 shows where; please report it)"
        return _failed(said, INTERNAL)
    return int(code or OK)


def _failed(message: str, code: int, command: str = "") -> int:
    fail(message, command)
    return code
