# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Times of exports: dates and times of day, seconds since 1970, seconds since the instrument was switched on."""

from __future__ import annotations

import datetime
import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fastcal.arrays import FloatArray

Kind = Literal["date", "day", "counter"]

_CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}(?:[.,]\d+)?))?\s*([AaPp][Mm])?")
_DATE = re.compile(r"(\d{1,4})[./-](\d{1,2})[./-](\d{1,4})")
_ZONE = re.compile(r"(Z|UTC|GMT|[+-]\d{2}:?\d{2})\s*$", re.I)
_EPOCH = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3), (1e8, 1.0))  # from here on a number is ns, us, ms, s since 1970
DAY = 86400.0


@dataclass(frozen=True)
class Times:
    """When each row was taken.

    Attributes:
        seconds: (N,) since 1970, since midnight, or since whenever; NaN where a row has none.
        kind: date, day or counter, accordingly. Counters of two devices have nothing in common.
    """

    seconds: FloatArray
    kind: Kind


def read_times(texts: list[str], dates: list[str] | None, unit: tuple[str, float] | None) -> Times | None:
    """The times of a column, with a column of dates beside it or none; None where they can't be read."""
    numbers = [_number(text) for text in texts]
    if all(value is not None or not text for value, text in zip(numbers, texts, strict=True)) and any(texts):
        values = np.array([np.nan if value is None else value for value in numbers])
        size = float(np.nanmedian(np.abs(values)))
        scale = next((factor for limit, factor in _EPOCH if size >= limit), None)
        if scale is not None:
            return Times(values * scale, "date")
        return Times(values * (unit[1] if unit else 1.0), "counter")
    seconds, dated = [], []
    for text, date in zip(texts, dates or [""] * len(texts), strict=True):
        clock = _CLOCK.search(text)
        if clock is None:
            seconds.append(np.nan)
            dated.append(np.nan)
            continue
        hour = int(clock[1]) % 12 + 12 * (clock[4].lower() == "pm") if clock[4] else int(clock[1])
        seconds.append(hour * 3600.0 + int(clock[2]) * 60.0 + float((clock[3] or "0").replace(",", ".")))
        day = _day(text[: clock.start()] or date)
        dated.append(np.nan if day is None else day * DAY - _zone(text))
    of_day, since = np.array(seconds), np.array(dated)
    if np.isnan(of_day).mean() > 0.5:
        return None
    if np.isnan(since[~np.isnan(of_day)]).any():
        return Times(of_day, "day")
    return Times(of_day + since, "date")


def _number(text: str) -> float | None:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None


def _zone(text: str) -> float:
    """How far the clock of a text is ahead of UTC [s]; 0 where it names no zone."""
    match = _ZONE.search(text)
    if match is None or match[1][0] not in "+-":
        return 0.0
    sign = 1 if match[1][0] == "+" else -1
    return sign * (int(match[1][1:3]) * 3600.0 + int(match[1][-2:]) * 60.0)


def _day(text: str) -> int | None:
    """Days since 1970 of 2026-03-02, 02.03.2026; None where day and month are ambiguous, as in 3/2/2026."""
    match = _DATE.search(text)
    if match is None:
        return None
    first, second, third = (int(part) for part in match.groups())
    if first > 31:
        year, month, day = first, second, third
    elif "/" in match[0] and max(first, second) <= 12 and first != second:
        return None
    else:
        year, month, day = third, second, first
        if month > 12:
            month, day = day, month
    try:
        return (datetime.date(year + 2000 * (year < 100), month, day) - datetime.date(1970, 1, 1)).days
    except ValueError:
        return None
