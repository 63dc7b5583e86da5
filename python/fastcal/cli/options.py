# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer


def _arms(incomplete: str) -> list[str]:
    """Names of shipped arms, for the shell to complete."""
    from fastcal.robots import available

    return [name for name in available() if name.startswith(incomplete.lower())]


RobotFile = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="A robot file (.yaml, .urdf, .xacro) or the name of a shipped arm (see fastcal robots).",
        autocompletion=_arms,
    ),
]
ModelFile = Annotated[str, typer.Argument(metavar="MODEL", help="A calibrated robot: model.yaml.")]
OfCell = Annotated[
    str,
    typer.Option("--name", metavar="TARGET", help="In a cell: the target whose arm is meant; it is the tool."),
]
AsRead = Annotated[
    bool, typer.Option("--as-read", help="Accept the columns as they are, even if another reading fits far better.")
]
DataFiles = Annotated[
    list[Path],
    typer.Argument(
        metavar="DATA...",
        help=(
            "Measured poses, or exports with joint positions and points. With several files, each has its own "
            "station and mount."
        ),
    ),
]
OutFile = Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The file to write.")]
Corners = Annotated[
    Path | None,
    typer.Option("--corners", metavar="FILE", help="Board corners detected by cameras in these poses."),
]
TestCorners = Annotated[
    Path | None,
    typer.Option("--test-corners", metavar="FILE", help="Board corners detected in the poses of --test."),
]
Mend = Annotated[
    bool,
    typer.Option(
        "--mend",
        help=(
            "Move pictures in wrong rows to the rows where they fit, otherwise they are left out; `calibrate` also "
            "identifies a lens that the pictures contradict."
        ),
    ),
]
HandEyes = Annotated[
    list[Path] | None,
    typer.Option(
        "--hand-eye",
        metavar="FILE",
        help=(
            "Write the hand-eye transform for other programs: .calib (easy_handeye2), .launch.py (MoveIt), .urdf, "
            "camera_info.yaml, .yaml (OpenCV); repeatable."
        ),
    ),
]
OutFolder = Annotated[Path, typer.Option("-o", "--output", metavar="OUT", help="The folder to write into.")]
Threads = Annotated[int, typer.Option(min=1, help="Number of threads; the result does not depend on it.")]
Views = Annotated[
    str, typer.Option(metavar="LIST", help="In a cell of several arms: the reading, TARGET or TARGET:SENSOR.")
]
Seed = Annotated[int, typer.Option(min=0, help="The same seed gives the same numbers.")]
BesideLanguage = Annotated[
    Literal["rapid", "krl", "fanuc", "urscript", "none"] | None,
    typer.Option(help="Language of the motion program written next to the table; default: that of the arm's maker."),
]
DwellS = Annotated[float, typer.Option(min=0, help="Waiting time of the program at each measured pose.")]
SpeedPercent = Annotated[
    float, typer.Option(min=1, max=100, help="Speed of the program, as a percentage of the arm's maximum.")
]


def language_named(text: str) -> str:
    """En or de, of what may be a locale's name: de_DE.UTF-8."""
    name = text.lower().replace("-", "_").partition(".")[0].partition("_")[0]
    if name not in LANGUAGES:
        raise typer.BadParameter(f"expected {' or '.join(LANGUAGES)}, got '{text}'")
    return name


LANGUAGES = ("en", "de")  # as fastcal.report has them
PageLanguage = Annotated[
    str,
    typer.Option(
        envvar="FASTCAL_LANGUAGE",
        metavar="en|de",
        parser=language_named,
        help="Language of the report and the terminal output.",
    ),
]

# As fastcal.calibration and fastcal.selection have them; written out here so that `fastcal --help` need not load it.
Method = Literal["nls", "bfgs", "bfgs_mean_distance"]
Solver = Literal["newton", "ceres"]
Loss = Literal["tukey", "huber", "cauchy", "none"]
Rule = Literal["least", "one_standard_error"]


def left_out_geometry(effects: str) -> list[str]:
    """A note where a list of effects leaves the geometry as it is, which few mean; no note where it is asked for."""
    from fastcal.effects.entries import NOTHING

    asked = [name.strip() for name in effects.split(",") if name.strip()]
    if not asked or "geometry" in asked or asked == [NOTHING]:
        return []
    return [
        f"--effects {effects} leaves the geometry as ROBOT has it: base, tool and these effects alone are identified; "
        f"write --effects geometry,{effects} to identify it too"
    ]


def no_views(views: str) -> None:
    """InvalidInput where --views was given for one arm."""
    from fastcal.errors import InvalidInput

    if views:
        raise InvalidInput("--views is for a cell of several arms; an arm alone has one tool to read")


def file_names(files: list[Path]) -> str:
    """The names of some files without their folders."""
    return ", ".join(file.name for file in files)


def three_numbers(option: str, text: str) -> tuple[float, float, float]:
    """X,Y,Z as numbers."""
    from fastcal.errors import InvalidInput

    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InvalidInput(f"{option} takes three numbers such as 900,0,700, got '{text}'") from None
    return x, y, z


def words_of(robot: str) -> list[str]:
    """The words of a command line that name a robot, with the links of its arm where they were given or chosen."""
    words: list[str] = robot.words() if hasattr(robot, "words") else [robot]
    return words
