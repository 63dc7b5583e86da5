# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal paper`: a paper's whole study on simulated arms."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fastcal.cli.console import emit, progress, say
from fastcal.cli.options import OutFolder

FILES = ("paper.json", "report.html")
REAL = "real"


def paper(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Which: see docs/papers.md; 'real' for real arms.")],
    output: OutFolder,
    data: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Of 'real': the public rows, as in docs/public-data.md.")
    ] = None,
    splits: Annotated[int, typer.Option(min=1, help="Of 'real': random splits of each campaign.")] = 10,
    arms: Annotated[int, typer.Option(min=1, help="Simulated arms, each with its own errors and noise.")] = 3,
    full: Annotated[bool, typer.Option("--full", help="The paper's whole search budgets.")] = False,
    diagnose: Annotated[
        bool, typer.Option("--diagnose", help="Diagnose the arms on the study's own rows as well.")
    ] = False,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Arms at a time, by default one a core; the numbers do not depend on it.")
    ] = None,
    cluster: Annotated[str | None, typer.Option(metavar="ADDRESS", help="Run the arms on this Dask scheduler.")] = None,
) -> None:
    """Run a paper's study on simulated arms, or on real ones.

    A page shows the paper's figures, its method's and fastcal's best.
    """
    import joblib

    from fastcal.errors import InvalidInput
    from fastcal.io.atomic import write_text
    from fastcal.io.folder import atomic_folder, check_folder
    from fastcal.io.results import write_json
    from fastcal.report.language import language, messages_of
    from fastcal_studies import run_study
    from fastcal_studies.page import paper_page

    if (name == REAL) != (data is not None):
        raise InvalidInput(f"--data FOLDER belongs to '{REAL}', and '{REAL}' needs it: got '{name}'")
    check_folder(output, FILES)
    cores = threads or joblib.cpu_count()
    with progress() as show, messages_of("fastcal_studies"):
        if data is not None:
            from fastcal_studies.real import run_real

            content = run_real(data, splits=splits, full=full, threads=cores, cluster=cluster, progress=show)
        else:
            show("simulating and calibrating")
            content = run_study(
                name, arms=arms, full=full, threads=cores, cluster=cluster, diagnose=diagnose, progress=show
            )
    with atomic_folder(output, owned=FILES) as folder:
        write_json(folder / "paper.json", content)
        write_text(folder / "report.html", paper_page(content, language.get()))
    with messages_of("fastcal_studies"):
        if "sentence" in content:
            say(content["sentence"])
        for entry in content["headlines"]:
            method, best = entry["method"]["median"], entry["best"]["median"]
            say(f"{entry['measure']}: paper {entry['paper']:.4g}, its method here {method:.4g}, fastcal {best:.4g}")
        for run in content.get("diagnoses", []):
            names = ", ".join(f"{one['name']} {one['told']}" for one in run["names"]) or "no name"
            say(f"arm {run['seed']}: {run['verdict']}, {names}; {_mm(run['after_mm'])}, plain {_mm(run['plain_mm'])}")
    say(str(output / "report.html"))
    emit({key: content[key] for key in ("paper", "arms", "full", "headlines")})


def _mm(value: float | None) -> str:
    return "no answer" if value is None else f"{value:.4g} mm"


paper.examples = (  # type: ignore[attr-defined]  # what `fastcal paper --help` ends with
    "fastcal paper kuka_kr500 -o kr500",
    "fastcal paper siasun_sr210d --arms 10 --threads 2 -o sr210d",
    "fastcal paper real --data public -o real",
)
