# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal design` of a cell with cameras: the poses for pictures, and how surely the cameras are known then."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastcal.cli.console import emit, progress, say, warn

if TYPE_CHECKING:
    from fastcal.io.design_out import ProgramPlace
    from fastcal.robot.robot import Robot


def design_of_pictures(
    arm: Robot,
    count: int,
    output: Path,
    place: ProgramPlace,
    measured: Path | None,
    corners: Path | None,
    focus_mm: str | None,
    of_points: Mapping[str, tuple[Any, Any]],
    options: dict[str, Any],
    driving: dict[str, Any],
) -> None:
    """Chooses the poses, writes table and program, and says what is known before and after.

    `of_points`: options that pictures do not take, and what they are where they were not given.
    """
    from fastcal.design.pictures import design_pictures
    from fastcal.errors import InvalidInput
    from fastcal.importers.corners import load_seen
    from fastcal.io.design_out import write_poses_and_program
    from fastcal.report.language import _

    for option, (value, default) in of_points.items():
        if value != default:
            raise InvalidInput(f"{option} is for measured points; pictures are planned without it")
    if (measured is None) != (corners is None):
        raise InvalidInput("--measured and --corners go together: the poses of pictures, and what was seen in them")
    focus = None if focus_mm is None else focus_range(focus_mm)
    taken = None if measured is None else load_seen([measured], arm, corners)
    with progress() as show:
        found = design_pictures(
            arm, count, measured=taken, surroundings=driving["surroundings"], focus=focus, progress=show, **options
        )
    files, notes = write_poses_and_program(output, found.poses, arm, place, **driving)
    chosen = {"file": output, "count": count, "all": found.candidate_count}
    say(_("{file}: {count} pictures of {all} that show a board and are clear", **chosen))
    for camera, share in found.coverage.items():
        part = 100.0 * float(share)
        say(_("camera {camera}: corners in {share:.0f} % of the parts of its picture", camera=camera, share=part))
    for title, places in ((_("before"), found.before), (_("after"), found.after)):
        for of in places:
            say(f"{title}: {of.sentence}")
    for line in [*(_("program: {file}", file=file) for file in files[1:]), *notes]:
        say(line)
    warn(found.notes)
    emit(
        {
            "poses": len(found),
            "candidates": found.candidate_count,
            "rejected": found.rejected,
            "coverage": found.coverage,
            "before": [of.to_json_dict() for of in found.before],
            "after": [of.to_json_dict() for of in found.after],
            "files": list(map(str, files)),
        }
    )


def focus_range(text: str) -> tuple[float, float]:
    """NEAR,FAR of --focus-mm [m]. InvalidInput where it is no range."""
    from fastcal.errors import InvalidInput
    from fastcal.units import to_si

    try:
        near, far = (float(part) for part in text.split(","))
    except ValueError:
        near, far = 0.0, 0.0
    if not 0 < near < far:
        raise InvalidInput(f"--focus-mm takes two distances, such as 300,700, the nearer one first; got '{text:.60}'")
    return float(to_si(near, "mm")), float(to_si(far, "mm"))
