# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal train`: a calibrated model and measurements in; the model with a network on what it leaves out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from fastcal.cli.console import emit, progress, say, warn
from fastcal.cli.options import DataFiles, ModelFile, OutFolder, Seed, Threads, file_names

if TYPE_CHECKING:
    from fastcal.networks import TrainingResult

FILES = ("model.yaml", "model.safetensors", f"model-{'[0-9a-f]' * 16}.safetensors", "training.json")


def train(
    model: ModelFile,
    data: DataFiles,
    output: OutFolder,
    network: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="Kind of network: mlp, gp, or one provided by fastcal-studies or another package."
        ),
    ] = "mlp",
    rivals: Annotated[
        str,
        typer.Option(metavar="LIST", help="Baselines that it must beat: gp, knn, boosting, joint-profiles; or none."),
    ] = "gp,knn,boosting,joint-profiles",
    folds: Annotated[int, typer.Option(min=2, help="Number of cross-validation folds.")] = 5,
    seed: Seed = 0,
    device: Annotated[Literal["auto", "cpu", "cuda"], typer.Option(help="Device to compute on.")] = "auto",
    trials: Annotated[
        int | None, typer.Option(min=0, help="Trials per axis for somm and ca-somm; 0: the sizes of the paper.")
    ] = None,
    storage: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="File in which the trials of a search are stored, and from which it resumes."
        ),
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="ga-dnn: use the full budget of the paper.")] = False,
    minutes: Annotated[
        float | None,
        typer.Option(
            help=(
                "Time limit after which a search ends with the best result so far; --storage allows it to be resumed."
            )
        ),
    ] = None,
    any_load: Annotated[
        bool, typer.Option("--any-load", help="Leave load effects to the model's compliances: global compensation.")
    ] = False,
    prior: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="MODEL", help="A trained model of another arm of this kind; then a few rows suffice."
        ),
    ] = None,
    threads: Threads = 1,
) -> None:
    """Train a network on a model's residuals.

    It is kept only if it beats its baselines on held-out regions. With --from, training starts from the network of
    another arm of the same kind and needs only 20 to 100 rows; it too is used only if it improves held-out rows.
    """
    from fastcal.importers import load_measurements
    from fastcal.io.folder import atomic_folder, check_folder
    from fastcal.io.results import write_json
    from fastcal.io.robot_file import load_robot, write_spec
    from fastcal.networks import train as trained

    check_folder(output, FILES)
    robot = load_robot(model)
    measured = load_measurements(data, robot)
    wanted = [] if rivals == "none" else [name.strip() for name in rivals.split(",")]
    with progress() as show:
        found = trained(
            robot,
            measured,
            network=network,
            rivals=wanted,
            folds=folds,
            seed=seed,
            device=device,
            trials=trials,
            storage=storage,
            full=full,
            minutes=minutes,
            any_load=any_load,
            prior=None if prior is None else load_robot(prior),
            threads=threads,
            progress=show,
        )
    with atomic_folder(output, owned=FILES) as folder:
        write_spec(found.model.spec, folder / "model.yaml", f"Trained by fastcal from {file_names(data)}: {found.used}")
        write_json(folder / "training.json", found.to_json_dict())
    warn([*measured.notes, *found.notes])
    _say(found, output)


def _say(found: TrainingResult, output: Path) -> None:
    say(f"{found.model.name}: {found.rows} rows, {found.regions['count']} regions of joint space, each held out once")
    for name, score in sorted(found.scores.items(), key=lambda item: item[1]["mean"]):
        kinds = [(score, "mm"), *([(found.turn_scores[name], "deg")] if found.turn_scores else [])]
        sizes = (f"mean {of['mean']:.4f} {u}, rms {of['rms']:.4f} {u}, max {of['max']:.4f} {u}" for of, u in kinds)
        say(f"  {name}: {'; '.join(sizes)}")
    say(found.verdict)
    if found.coverage is not None:
        say(f"90 % intervals hold {found.coverage:.0%} of the held-out coordinates")
    say(str(output / "model.yaml"))
    emit(found.to_json_dict())
