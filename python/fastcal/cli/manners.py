# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What all commands have in common: --quiet, --json, and examples in --help."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, cast

import typer

from fastcal.cli.console import Manner, manner
from fastcal.cli.signatures import with_options

EXAMPLES = {
    "calibrate": (
        "fastcal calibrate ur5 measurements.csv -o results --open",
        "fastcal calibrate robot.yaml fit.csv --test test.csv --effects geometry,joint_compliance@joint2 -o results",
    ),
    "diagnose": (
        "fastcal diagnose robot.yaml measurements.csv --test test.csv -o diagnosis",
        "fastcal diagnose robot.yaml measurements.csv --exclude gear_harmonic@joint1 -o diagnosis",
    ),
    "check": (
        "fastcal check results/model.yaml --plan 8 -o poses.csv",
        "fastcal check results/model.yaml november.csv --tolerance-mm 0.3 -o checks/2026-11.json",
        "fastcal check arms --date 2026-11-02 -o checks",
    ),
    "update": ("fastcal update results/model.yaml november.csv -o results_november",),
    "compare": ("fastcal compare results/model.yaml results_november/model.yaml -o comparison",),
    "history": ("fastcal history arm_7 -o arm_7_history", "fastcal history fleet --json"),
    "drop": (
        "fastcal drop diagnosis/model.yaml backlash@joint3 -o without_backlash.yaml",
        "fastcal drop diagnosis/model.yaml gear_harmonic@joint1:order=2 -o without_wave.yaml",
    ),
    "compliance": ("fastcal compliance robot.yaml payloads.csv --joints 2,3,5 -o compliance",),
    "zeros": ("fastcal zeros cell.yaml poses.csv --corners corners.csv -o zeros",),
    "train": ("fastcal train results/model.yaml measurements.csv --network mlp -o trained",),
    "predict": ("fastcal predict results/model.yaml poses.csv -o predicted.csv",),
    "compensate": (
        "fastcal compensate results/model.yaml targets.csv -o commands.csv",
        "fastcal compensate results/model.yaml weld.mod --payload-kg 12 -o weld_compensated.mod",
    ),
    "evaluate": ("fastcal evaluate results/model.yaml test.csv", "fastcal evaluate results/model.yaml test.csv --json"),
    "accept": (
        "fastcal accept results/model.yaml --plan --language rapid --compensated -o iso.mod",
        "fastcal accept results/model.yaml measured.csv --targets iso_plan.csv --tolerance-mm 0.3 -o acceptance",
    ),
    "design": (
        "fastcal design robot.yaml --count 40 -o poses.csv",
        "fastcal design robot.yaml --count 40 --separate backlash@joint3,gear_harmonic@joint3 -o poses.csv",
    ),
    "simulate": ("fastcal simulate robot.yaml poses.csv --noise-mm 0.05 --seed 1 -o simulated.csv",),
    "convert": ("fastcal convert ur5 --to urdf -o ur5.urdf",),
    "import": ("fastcal import tracker.csv --robot robot.yaml --joints joints.log -o measurements.csv",),
    "detect": ("fastcal detect pictures --cell cell.yaml --joints poses.csv -o corners.csv",),
    "place": (
        "fastcal place robot.yaml touches.csv --what tool -o with_tool.yaml",
        "fastcal place cell.yaml turns.csv --what axis --name table -o placed_cell.yaml",
    ),
    "template": ("fastcal template ur5 -o measurements.xlsx",),
    "robots": ("fastcal robots", "fastcal robots --json"),
    "effects": ("fastcal effects",),
    "fleet": ("fastcal fleet arms.csv -o fleet", "fastcal fleet arms.csv --cluster tcp://10.0.0.1:8786 -o fleet"),
    "studio": ("fastcal studio cell_7", "fastcal studio --demo"),
    "demo": ("fastcal demo -o demonstration",),
}

Quiet = Annotated[
    bool, typer.Option("-q", "--quiet", help="Print no summary and no progress, only warnings and errors.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]


def with_manners(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the options that all have; typer reads them from its signature."""
    common: dict[str, tuple[Any, Any]] = {"quiet": (Quiet, False), "json": (Json, False)}

    def take(_given: dict[str, Any], chosen: dict[str, Any]) -> None:
        for choice, wanted in chosen.items():
            if wanted:
                manner.set(cast("Manner", choice))

    return with_options(command, common, take)


def examples(name: str, command: Callable[..., None]) -> str | None:
    """The end of a command's help; one of another package has its lines as its attribute `examples`."""
    lines = EXAMPLES.get(name) or getattr(command, "examples", ())
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines) if lines else None
