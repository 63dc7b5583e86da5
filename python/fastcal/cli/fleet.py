# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal fleet`: a list of arms in; a folder an arm, one table and one page out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fastcal.cli.console import NOT_CONVERGED, emit, progress, say
from fastcal.cli.options import Loss, OutFolder, PageLanguage
from fastcal.cli.own_inputs import refuse

if TYPE_CHECKING:
    from fastcal.fleet import Fleet


def fleet(
    arms: Annotated[
        Path,
        typer.Argument(metavar="LIST", help="A CSV file with the columns robot and data, optionally test and name."),
    ],
    output: OutFolder,
    jobs: Annotated[int, typer.Option(min=1, help="Number of processes; the results do not depend on it.")] = 1,
    cluster: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Address of a Dask scheduler whose workers see the same files."),
    ] = None,
    effects: Annotated[
        str, typer.Option(metavar="LIST", help="Effects to identify; base and tool are always identified.")
    ] = "geometry",
    loss: Annotated[Loss, typer.Option(help="Robust loss on the whitened error of a row.")] = "tukey",
    check_all: Annotated[
        bool,
        typer.Option("--check-all", help="Check columns and residuals of every arm, not only of conspicuous ones."),
    ] = False,
    reports: Annotated[bool, typer.Option("--reports", help="Write a page for every arm.")] = False,
    diagnose: Annotated[
        bool, typer.Option("--diagnose", help="Also diagnose each arm, as `fastcal diagnose` does.")
    ] = False,
    page_language: PageLanguage = "en",
) -> None:
    """Calibrate or diagnose many arms.

    Results of an earlier run in the same folder are reused for arms whose files have not changed.
    """
    from fastcal.errors import InvalidInput
    from fastcal.fleet import calibrate_many, diagnose_many, read_list
    from fastcal.fleet.page import write_fleet

    if diagnose and (effects != "geometry" or loss != "tukey" or check_all or reports):
        raise InvalidInput("--diagnose goes without --effects, --loss, --check-all and --reports: it finds the effects")
    listed = read_list(arms)
    named = [Path(part) for arm in listed for part in (arm.robot, arm.data, arm.test) if isinstance(part, str)]
    refuse([arms, *named], [output, *(output / arm.name for arm in listed)])
    with progress() as show:
        if diagnose:
            found = diagnose_many(listed, out=output, jobs=jobs, cluster=cluster, language=page_language, progress=show)
        else:
            found = calibrate_many(
                listed,
                out=output,
                jobs=jobs,
                cluster=cluster,
                check_all=check_all,
                reports=reports,
                language=page_language,
                progress=show,
                effects=effects,
                loss=loss,
            )
        show("writing the page")
        write_fleet(found, output, language=page_language)
    _say(found, output)
    if found.failed:
        raise typer.Exit(NOT_CONVERGED)


def _say(found: Fleet, output: Path) -> None:
    from fastcal.fleet.page import STATUSES
    from fastcal.report.diagnosis_words import VERDICTS
    from fastcal.report.language import _, language

    numbers = {"some": len(found) - len(found.failed), "all": len(found)}
    if found.is_diagnosed:
        say(_("{some} of {all} arms diagnosed", **numbers))
    else:
        say(_("{some} of {all} arms calibrated", **numbers))
    for arm in found:
        if arm.verdict:
            word = arm.verdict if language.get() == "en" else _(VERDICTS[arm.verdict][0])
            say(f"  {arm.name}: {word}{': ' if arm.causes else ''}{arm.causes}")
    for arm in found.failed:
        say(f"  {arm.name}: {_(STATUSES[arm.status])}: {arm.message}")
    say(str(output / "report.html"))
    emit({"arms": [arm.to_row() for arm in found]})
