# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures as a page shows them, with marks drawn over them."""

from __future__ import annotations

import base64
from dataclasses import dataclass


@dataclass(frozen=True)
class Card:
    """A picture on a page.

    Attributes:
        title, text: Above and below it.
        picture: A data URL; empty: none.
        width, height: Of the picture [px].
        corners: Marks: u, v, colour.
        is_caution: Something is wrong with it.
        row: The set and the row in it that it belongs to, as the page's drawings name them; empty: none.
    """

    title: str
    text: str
    picture: str
    width: int
    height: int
    corners: tuple[tuple[float, float, str], ...] = ()
    is_caution: bool = False
    row: str = ""

    @property
    def radius(self) -> float:
        """Of a mark [px of the picture]."""
        return max(self.width, self.height) / 110


def data_url(jpeg: bytes) -> str:
    """A JPEG as a page carries it; empty where there is none."""
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode('ascii')}" if jpeg else ""
