# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How a robot, a data set or a result shows itself in a shell and in a notebook; `report` has the words and charts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastcal.display import late

if TYPE_CHECKING:
    import pandas as pd
    from plotly.graph_objects import Figure


class Shown:
    """A one-line `repr`, a table in notebooks, `summary()` and `to_frame()`."""

    def summary(self) -> str:
        """The content in a few lines, as the command of the same name prints them."""
        return "\n".join(late.call("summary", self))

    def to_frame(self) -> pd.DataFrame:
        """The numbers as a pandas table; units stand at the end of the columns' names, as in files."""
        frame: pd.DataFrame = late.call("frame", self)
        return frame

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {late.call('headline', self)}>"

    def _repr_html_(self) -> str:
        return str(late.call("notebook_html", self))


class PlottedArm:
    """The report's arm of what was found of it, as a Plotly figure."""

    def plot_arm(self) -> Figure:
        """The arm where the error or difference is largest, its joints coloured by their part in it, and arrows."""
        return late.call("chart", self, "arm")


class PlottedCell:
    """The report's charts of what was found of a cell, as Plotly figures."""

    def plot_arm(self) -> Figure:
        """The cell where the error is largest: arms, cameras, boards, targets, and the errors as arrows."""
        return late.call("chart", self, "arm")

    def plot_gap(self) -> Figure:
        """Of each kind of reading the error with places alone, what is taken of it, what remains, and the noise."""
        return late.call("chart", self, "gap")


class Plotted(PlottedArm, Shown):
    """`Shown`, and the report's charts of the residuals as Plotly figures."""

    def plot_errors(self) -> Figure:
        """Share of poses within an error, before and after."""
        return late.call("chart", self, "errors")

    def plot_histogram(self) -> Figure:
        """Histogram of the error after calibration."""
        return late.call("chart", self, "histogram")

    def plot_residuals(self, over: str | None = None) -> Figure:
        """Residuals of the training poses against a variable, with medians of bins and their 95 % band.

        Args:
            over: `q1` ... `qn`, `order`, `time`, `temperature` or `payload`. None: the one with the strongest trend.

        Raises:
            InvalidInput: The data have no such variable, or it is the same in all rows.
        """
        return late.call("chart", self, "residuals", over)

    def plot_workspace(self) -> Figure:
        """The errors as arrows in the workspace, before and after."""
        return late.call("chart", self, "workspace")

    def plot_noise(self) -> Figure:
        """Normal plot of the residuals, with the line of the estimated noise."""
        return late.call("chart", self, "noise")
