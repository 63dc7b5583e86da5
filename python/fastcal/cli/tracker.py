# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""--sigma-range-mm, --sigma-angle-mrad and --instrument-at-mm: a tracker whose file gives no uncertainty."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fastcal.cli.options import three_numbers
from fastcal.cli.signatures import with_options

if TYPE_CHECKING:
    from fastcal.measurements.dataset import Dataset

OPTIONS: dict[str, tuple[Any, Any]] = {
    "sigma_range_mm": (
        Annotated[float | None, typer.Option(help="Standard deviation of a tracker's distances, along its beam.")],
        None,
    ),
    "sigma_angle_mrad": (
        Annotated[
            float | None,
            typer.Option(
                help="Standard deviation of a tracker's angles; across the beam this is multiplied by the distance."
            ),
        ],
        None,
    ),
    "instrument_at_mm": (
        Annotated[
            str | None,
            typer.Option(metavar="X,Y,Z", help="Position of the tracker in the measuring frame; default: the origin."),
        ],
        None,
    ),
}


@dataclass(frozen=True)
class Tracker:
    """What the options say; `seen` puts it into a data set."""

    sigma_range_mm: float
    sigma_angle_mrad: float
    at_mm: tuple[float, float, float]

    def seen(self, data: Dataset) -> Dataset:
        """The data as such a tracker measured them."""
        from fastcal.errors import InvalidInput
        from fastcal.units import to_si

        if data.sigma_position is not None:
            raise InvalidInput(f"{data.source} says how sure its points are: leave out --sigma-range-mm")
        place = [to_si(value, "mm") for value in self.at_mm]
        return data.with_tracker(to_si(self.sigma_range_mm, "mm"), to_si(self.sigma_angle_mrad, "mrad"), place)


def with_tracker(command: Callable[..., None]) -> Callable[..., None]:
    """The command with these options, where it has a parameter `tracker`, which then holds them: None, or a Tracker."""
    if "tracker" not in inspect.signature(command).parameters:
        return command

    def take(given: dict[str, Any], chosen: dict[str, Any]) -> None:
        given["tracker"] = _tracker(**chosen)

    return with_options(command, OPTIONS, take, ("tracker",))


def _tracker(
    sigma_range_mm: float | None, sigma_angle_mrad: float | None, instrument_at_mm: str | None
) -> Tracker | None:
    from fastcal.errors import InvalidInput

    if sigma_range_mm is None or sigma_angle_mrad is None:
        if sigma_range_mm is None and sigma_angle_mrad is None and instrument_at_mm is None:
            return None
        raise InvalidInput("--sigma-range-mm and --sigma-angle-mrad go together, --instrument-at-mm with them")
    place = (0.0, 0.0, 0.0) if instrument_at_mm is None else three_numbers("--instrument-at-mm", instrument_at_mm)
    return Tracker(sigma_range_mm, sigma_angle_mrad, place)


def seen_by(tracker: Tracker | None, data: Dataset) -> Dataset:
    """The data as the tracker of the options measured them, or as they are."""
    return data if tracker is None else tracker.seen(data)
