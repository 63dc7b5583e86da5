# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The commands, and the one place where an error becomes a line and an exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated, cast

import typer

from fastcal.cli import (
    accept,
    calibrate,
    check,
    compensate,
    convert,
    demo,
    design,
    diagnose,
    fleet,
    history,
    imports,
    lists,
    models,
    paper,
    simulate,
    train,
    update,
)
from fastcal.cli.arm_links import with_links
from fastcal.cli.console import fail, manner
from fastcal.cli.manners import examples, with_manners
from fastcal.cli.own_inputs import keeps_its_inputs
from fastcal.cli.tracker import with_tracker
from fastcal.cli.who import with_who
from fastcal.errors import FastcalError, Undetermined, unloaded

OK, INTERNAL, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

# The base of what typer raises over usage, for which it has no name of its own in every version.
_UsageError = cast("type[Exception]", typer.BadParameter.__mro__[2])

COMMANDS = (
    calibrate.calibrate,
    diagnose.diagnose,
    check.check,
    update.update,
    update.compare,
    history.history,
    train.train,
    models.predict,
    compensate.compensate,
    models.evaluate,
    accept.accept,
    design.design,
    simulate.simulate,
    convert.convert,
    imports.import_,
    imports.template,
    lists.robots,
    lists.effects,
    fleet.fleet,
    paper.paper,
    demo.demo,
)

app = typer.Typer(
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in COMMANDS:
    name = command.__name__.rstrip("_")
    whole = with_who(with_tracker(with_links(keeps_its_inputs(command))))
    app.command(name, epilog=examples(name))(with_manners(name, whole))


def _show_version(wanted: bool) -> None:
    if wanted:
        from fastcal import __version__

        typer.echo(f"fastcal {__version__}")
        raise typer.Exit


@app.callback(
    epilog="Exit code 0: done. 2: bad input or usage. 3: not converged, too few equations, undecided. 4: over, changed."
)
def _fastcal(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Kinematic calibration of robot arms.

    Files carry the unit of every quantity at the end of its name: x_mm, q1_deg, payload_kg.
    """


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs `fastcal` with the given arguments, or with those of the process; returns the exit code."""
    manner.set("text")
    try:
        code = typer.main.get_command(app).main(arguments, prog_name="fastcal", standalone_mode=False)
        sys.stdout.flush()
    except Undetermined as error:
        return _failed(str(error), calibrate.NOT_CONVERGED)
    except FastcalError as error:
        return _failed(str(error), BAD_INPUT)
    except _UsageError as error:
        said = str(error.format_message()).replace("Value error, ", "")  # type: ignore[attr-defined]
        command = getattr(getattr(error, "ctx", None), "command_path", "fastcal")
        return _failed(f"{said} (see {command} --help)", BAD_INPUT)
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


def _failed(message: str, code: int) -> int:
    fail(message)
    return code
