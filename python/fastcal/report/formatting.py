# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Numbers as a reader wants them: as many digits as their uncertainty carries.

Rule (GUM 7.2.6, JCGM 100:2008): a standard deviation is written with two significant digits, and a value with the same
number of decimals. Numbers are given in the unit they are to be printed in; nothing here converts.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fastcal.report.language import _, decimal_sign

if TYPE_CHECKING:
    from fastcal.measurements.kinds import Kind

MISSING = "\N{EN DASH}"
_MINUS = "\N{MINUS SIGN}"
_SUPERSCRIPT = str.maketrans("-0123456789", "\N{SUPERSCRIPT MINUS}⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN_DECIMALS = 5
_PLAIN_SIZE = 6
_TIMES_TEN = "\N{NARROW NO-BREAK SPACE}×\N{NARROW NO-BREAK SPACE}10"


def is_known(number: float | None) -> bool:
    """True for a finite number; None, NaN and infinities are not written."""
    return number is not None and math.isfinite(number)


def decimals_for(std: float) -> int:
    """Decimals that show `std` (> 0) with two significant digits: 0.0123 -> 3, 12.3 -> 0, 0.00998 -> 3 (0.010)."""
    exponent = math.floor(math.log10(float(f"{std:.1e}")))
    return max(0, 1 - exponent)


def with_uncertainty(std: float | None, *values: float | None) -> tuple[str, ...]:
    """The texts of `std` and of every value, all with the decimals that `std` asks for and one common power of ten.

    Without a usable std the values keep six significant digits. What is not known becomes an en dash.
    """
    known = [abs(value) for value in (std, *values) if value is not None and math.isfinite(value) and value != 0]
    if not known:
        return tuple(fixed(value, 0) if is_known(value) else MISSING for value in (std, *values))
    has_std = std is not None and is_known(std) and std > 0
    finest = std if has_std and std is not None else max(known)
    digits = decimals_for(finest) if has_std else max(0, 5 - math.floor(math.log10(finest)))
    largest = math.floor(math.log10(max(known)))
    if (has_std and digits > _PLAIN_DECIMALS and largest < 0) or largest >= _PLAIN_SIZE or largest < -3:
        shift, suffix = 10.0**largest, _TIMES_TEN + str(largest).translate(_SUPERSCRIPT)
        digits = decimals_for(finest / shift) if has_std else 5
    else:
        shift, suffix = 1.0, ""
    return tuple(
        MISSING if value is None or not is_known(value) else fixed(value / shift, digits) + (suffix if value else "")
        for value in (std, *values)
    )


def fixed(number: float | None, decimals: int) -> str:
    """`number` with fixed decimals, a true minus sign, and no negative zero."""
    if number is None or not math.isfinite(number):
        return MISSING
    text = f"{number:.{decimals}f}".replace(".", decimal_sign())
    return text.replace("-", _MINUS if number and any(digit in "123456789" for digit in text) else "")


def significant(number: float | None, digits: int = 3) -> str:
    """`number` with that many significant digits and never an exponent: 0.1013 -> 0.101, 1234.5 -> 1234."""
    if number is None or not math.isfinite(number):
        return MISSING
    if number == 0:
        return "0"
    rounded = float(f"{number:.{digits - 1}e}")
    return fixed(number, max(0, digits - 1 - math.floor(math.log10(abs(rounded)))))


def rough(number: float) -> str:
    """`number` with two significant digits, and with a power of ten from a million on: 3.6 × 10⁹ for 3616751466."""
    size = math.floor(math.log10(abs(float(f"{number:.1e}")))) if number and math.isfinite(number) else 0
    return significant(number, 2) if size < _PLAIN_SIZE else powered(number, 2)


def powered(number: float, digits: int = 3) -> str:
    """`number` (not zero) with that many significant digits and a power of ten: 1.14 × 10⁴ for 11426."""
    size = math.floor(math.log10(abs(float(f"{number:.{digits - 1}e}"))))
    return significant(number / 10.0**size, digits) + _TIMES_TEN + str(size).translate(_SUPERSCRIPT)


def alike(number: float | None, like: float) -> str:
    """`number` with the decimals that show `like` (2 to 3 significant digits), so that the two can be compared."""
    return fixed(number, decimals_for(like / 2.0) if is_known(like) and like > 0.0 else 3)


def sized(kind: Kind, error: float) -> str:
    """An error [SI] of a kind of reading with its unit: "0.0312 mm"."""
    return kind.text(error).replace(".", decimal_sign())


def count(number: int) -> str:
    """A count with thin spaces between thousands; only counts have them, since measures are copied into tables."""
    return f"{number:,d}".replace(",", "\N{NARROW NO-BREAK SPACE}")


def plural(number: int, noun: str, nouns: str | None = None) -> str:
    """'1 row', '12 rows', in the language of the page."""
    return f"{count(number)} {_(noun if number == 1 else nouns or noun + 's')}"


def percent(share: float, gap: str = "\N{NARROW NO-BREAK SPACE}") -> str:
    """A share of one in percent, whole above 10 %; `gap`: before the sign."""
    return f"{fixed(100 * share, 0 if share >= 0.0995 else 1)}{gap}%"
