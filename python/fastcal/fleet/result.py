# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What became of the arms of a fleet."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd

NOT_CALIBRATED = "refused"  # bad input, beside the statuses of a calibration


@dataclass(frozen=True)
class ArmResult:
    """One row of the table; errors are distances over all rows, RMS.

    Attributes:
        name: Of the arm.
        status: converged, not_converged, too_few_equations, or refused: its files are invalid.
        rows: Measured poses.
        kind, unit: Which readings the next four are of, positions where points were measured, and in which unit.
        before, after, test: Of the nominal arm, of the model, and of the model on other poses.
        noise: Of one number.
        before_mm, after_mm, test_mm, sigma_mm: The same of points; None where none were measured.
        outliers: How many rows the noise does not explain.
        unidentifiable: How many directions the data can't determine.
        checks: "all": columns and residuals were looked at, as `calibrate` does; "fit": the fit alone, since it is
            like the fleet's.
        message: Why it was refused or did not converge; else notes, or the sentence of a diagnosis.
        verdict: Of a diagnosis.
        causes: Grades and names that it gave, "A backlash@joint4".
        model: The identified robot; None where there is none. It is in no table.
    """

    name: str
    status: str
    rows: int = 0
    kind: str = ""
    unit: str = ""
    before: float | None = None
    after: float | None = None
    test: float | None = None
    noise: float | None = None
    before_mm: float | None = None
    after_mm: float | None = None
    test_mm: float | None = None
    sigma_mm: float | None = None
    outliers: int = 0
    unidentifiable: int = 0
    checks: str = "fit"
    message: str = ""
    verdict: str = ""
    causes: str = ""
    model: Robot | None = field(default=None, repr=False, compare=False)

    def to_row(self) -> dict[str, Any]:
        """The columns of fleet.csv."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "model"}


@dataclass(frozen=True)
class Fleet:
    """The arms in the order of the list."""

    arms: list[ArmResult]

    def __len__(self) -> int:
        return len(self.arms)

    def __iter__(self) -> Iterator[ArmResult]:
        return iter(self.arms)

    def __getitem__(self, name: str) -> ArmResult:
        for arm in self.arms:
            if arm.name == name:
                return arm
        raise InvalidInput(f"there is no arm '{name}' in the fleet")

    @property
    def failed(self) -> list[ArmResult]:
        """Arms without a model."""
        return [arm for arm in self.arms if arm.status != "converged"]

    @property
    def is_diagnosed(self) -> bool:
        """Were its arms diagnosed, not calibrated?"""
        return any(arm.verdict for arm in self.arms)

    def columns(self) -> dict[str, list[Any]]:
        """The table, by column."""
        rows = [arm.to_row() for arm in self.arms]
        return {name: [row[name] for row in rows] for name in rows[0]}

    def to_frame(self) -> pd.DataFrame:
        """The table for pandas."""
        import pandas as pd

        return pd.DataFrame(self.columns())
