# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checked reading of the mappings of a file: every refusal names the file, the key, what was expected and what came.

A quantity's key ends in its unit; any unit of its kind is read and brought to the one of the canonical form.
"""

from __future__ import annotations

import difflib
import math
import os
from typing import Any, NoReturn

from fastcal import units
from fastcal.errors import ParseError

SMALLEST, LARGEST = 1e-100, 1e100
REQUIRED: Any = object()  # the default of a key that must be given
_FRAME = (("xyz", "mm"), ("rpy", "deg"))


def without_traces(value: Any) -> Any:
    """The same with 0 for numbers below the least that a file holds: what rounding leaves of nothing."""
    if isinstance(value, dict):
        return {key: without_traces(each) for key, each in value.items()}
    if isinstance(value, list):
        return [without_traces(each) for each in value]
    return 0.0 if isinstance(value, float) and 0 < abs(value) < SMALLEST else value


class Fields:
    """One mapping of a file whose keys are taken one by one; `done` refuses what was not taken.

    Args:
        value: The value in the file.
        where: Its key path there, such as `joints[2].link`; empty at the top.
        path: The file, for messages.
    """

    def __init__(self, value: Any, where: str, path: str | os.PathLike[str]) -> None:
        self.where = where
        self.path = path
        if not isinstance(value, dict):
            self.fail("", "a mapping of names to values", value)
        self._left: dict[str, Any] = dict(value)
        self._known: list[str] = []

    def fail(self, key: str, expected: str, got: Any) -> NoReturn:
        """Refuses the value of a key."""
        raise ParseError(f"{self._place(key)}expected {expected}, got {_shown(got)}", self.path)

    def refuse(self, key: str, sentence: str) -> NoReturn:
        """Refuses a key with a sentence of its own."""
        raise ParseError(f"{self._place(key)}{sentence}", self.path)

    def has(self, key: str) -> bool:
        """Whether the key was given and is not yet taken."""
        self._known.append(key)
        return key in self._left

    def take(self, key: str, default: Any = REQUIRED) -> Any:
        """The value of a key as it is."""
        self._known.append(key)
        if key not in self._left:
            if default is REQUIRED:
                near = difflib.get_close_matches(key, self._left, n=1, cutoff=0.8)
                self.refuse("", f"{key} is missing" + (f"; did you mean '{near[0]:.60}'?" if near else ""))
            return default
        return self._left.pop(key)

    def optional(self, key: str) -> Any:
        """The value of a key as it is, None where it is not given."""
        return self.take(key, None)

    def text(self, key: str, default: str = REQUIRED) -> str:
        """One line of text that is not empty."""
        value = self.take(key, default)
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            self.fail(key, "a line of text", value)
        return value

    def choice(self, key: str, choices: tuple[str, ...], default: str = REQUIRED) -> str:
        """One of a few words."""
        value = self.take(key, default)
        if value not in choices:
            self.fail(key, f"{', '.join(choices[:-1])} or {choices[-1]}", value)
        return str(value)

    def truth(self, key: str, default: bool = REQUIRED) -> bool:
        """True or false."""
        value = self.take(key, default)
        if not isinstance(value, bool):
            self.fail(key, "true or false", value)
        return value

    def names(self, key: str, default: list[str] = REQUIRED, *, expected: str = "a list of names") -> list[str]:
        """A list of texts."""
        value = self.take(key, default)
        if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
            self.fail(key, expected, value)
        return list(value)

    def frame(self, end: str = "") -> dict[str, list[float]]:
        """xyz_mm and rpy_deg, 0 where they are not given; from keys that begin with `end`, such as from_xyz_mm."""
        zero = [0.0] * 3
        return {f"{name}_{unit}": self.quantities(f"{end}{name}", unit, 3, zero) for name, unit in _FRAME}

    def number(self, key: str, default: float = REQUIRED) -> float:
        """A finite number without a unit."""
        return self.checked_number(key, self.take(key, default))

    def count(self, key: str, low: int, high: int) -> int:
        """A whole number from `low` to `high`."""
        value = self.take(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or value not in range(low, high + 1):
            self.fail(key, f"a whole number from {low} to {high}", value)
        return int(value)

    def inner(self, key: str, default: Any = REQUIRED) -> Fields:
        """The mapping that a key holds."""
        return Fields(self.take(key, default), f"{self.where}.{key}".lstrip("."), self.path)

    def entries(self, key: str, low: int, high: int) -> list[Fields]:
        """The mappings of a list of `low` to `high` of them; none where 0 do and the key is not given."""
        value = self.take(key, []) if low == 0 else self.take(key)
        if value is None and low == 0:
            value = []  # a key whose last entry was taken out, as YAML reads it
        if not isinstance(value, list) or not low <= len(value) <= high:
            entries = f"{low} to {high}" if low < high else f"{low}"
            self.fail(key, f"a list of {entries} entries", value)
        return [Fields(entry, f"{self.where}.{key}[{i}]".lstrip("."), self.path) for i, entry in enumerate(value)]

    def vector(self, key: str, size: int, default: list[float] = REQUIRED) -> list[float]:
        """A list of `size` finite numbers without a unit."""
        return self.checked_vector(key, self.take(key, default), size)

    def quantity(self, name: str, unit: str, default: float = REQUIRED) -> float:
        """The number under `name`_UNIT, in `unit`."""
        key, given = self._find(name, unit)
        if key is None:
            return float(self.take(f"{name}_{unit}", default))
        return _converted(self.checked_number(key, self._left.pop(key)), given, unit)

    def quantities(self, name: str, unit: str, size: int, default: list[float] = REQUIRED) -> list[float]:
        """The list of `size` numbers under `name`_UNIT, in `unit`."""
        key, given = self._find(name, unit)
        if key is None:
            return list(self.take(f"{name}_{unit}", default))
        return [_converted(x, given, unit) for x in self.checked_vector(key, self._left.pop(key), size)]

    def positive(self, name: str, unit: str) -> float | None:
        """The number above 0 under `name`_UNIT (UNIT alone where the name is empty), in `unit`; None: not given.

        A key of this name in a unit of another kind is another quantity: sigma_deg beside sigma_mm.
        """
        keys = {f"{name}_{u}".lstrip("_"): u for u in units.unit_names(units.UNITS[unit].kind)}
        self._known.append(f"{name}_{unit}".lstrip("_"))
        given = [key for key in keys if key in self._left]
        if len(given) > 1:
            self.refuse("", f"{' and '.join(given)} give the same value twice")
        if not given:
            return None
        value = self.number(given[0])
        if not value > 0:
            self.fail(given[0], f"a {'standard deviation' if name == 'sigma' else 'number'} above 0", value)
        return _converted(value, keys[given[0]], unit)

    def sigmas(self) -> dict[str, float]:
        """sigma_mm and sigma_deg, the standard deviations of a placement: those of them that are given."""
        found = {f"sigma_{unit}": self.positive("sigma", unit) for unit in ("mm", "deg")}
        return {key: value for key, value in found.items() if value is not None}

    def has_quantity(self, name: str, unit: str) -> bool:
        """Whether `name` was given in whatever unit; a wrong or missing unit is refused here."""
        return self._find(name, unit)[0] is not None

    def rest(self) -> dict[str, Any]:
        """All keys that are left, as plain data."""
        rest = {key: self._plain(key, value) for key, value in self._left.items()}
        self._left.clear()
        return rest

    def plain(self, key: str, default: Any) -> Any:
        """Data of any shape, its numbers finite."""
        return self._plain(key, self.take(key, default))

    def done(self) -> None:
        """Refuses the first key that was not taken, with the nearest one that is known."""
        for key in self._left:
            near = difflib.get_close_matches(key, self._known, n=1, cutoff=0.6)
            hint = f"did you mean '{near[0]}'?" if near else f"known here are {', '.join(dict.fromkeys(self._known))}"
            self.refuse("", f"the key '{key:.60}' is not known; {hint}")

    def _find(self, name: str, unit: str) -> tuple[str | None, str]:
        """The key that gives `name`, and its unit; refuses units that won't do and two keys for one thing."""
        self._known.append(f"{name}_{unit}")
        kind = units.UNITS[unit].kind
        fitting = [f"{name}_{u}" for u in units.unit_names(kind)]
        given = [key for key in self._left if units.parse_name(key)[0] == name or _is_suffixed(key, name)]
        if not given:
            return None, unit
        if len(given) > 1:
            self.refuse("", f"{' and '.join(given)} give the same value twice")
        key = given[0]
        suffix = units.parse_name(key)[1]
        if key not in fitting or suffix is None:
            would_do = fitting[0] if len(fitting) == 1 else f"{', '.join(fitting[:-1])} or {fitting[-1]}"
            wrong = "needs its unit at the end of its name" if key == name else f"does not end in a unit of {kind}"
            self.refuse(key, f"{wrong}; {would_do} would do")
        return key, suffix

    def checked_number(self, key: str, value: Any) -> float:
        """The value of a key, refused unless it is a finite number."""
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            self.fail(key, "a finite number", value)
        return self._of_a_size(key, value)

    def checked_vector(self, key: str, value: Any, size: int) -> list[float]:
        """The value of a key, refused unless it is a list of `size` finite numbers."""
        if not isinstance(value, list) or len(value) != size:
            self.fail(key, f"a list of {size} numbers", value)
        return [self.checked_number(f"{key}[{i}]", x) for i, x in enumerate(value)]

    def _plain(self, key: str, value: Any) -> Any:
        if isinstance(value, dict):
            return {k: self._plain(f"{key}.{k}", v) for k, v in value.items()}
        if isinstance(value, list):
            return [self._plain(f"{key}[{i}]", v) for i, v in enumerate(value)]
        if isinstance(value, float) and not math.isfinite(value):
            self.fail(key, "a finite number", value)
        if isinstance(value, float):
            self._of_a_size(key, value)
        if not isinstance(value, (str, int, float, type(None))):
            self.fail(key, "text, numbers, lists and mappings", value)
        return value

    def _of_a_size(self, key: str, value: float) -> float:
        """The value, refused where its unit's conversion or its square would leave what a double holds."""
        if value != 0 and not SMALLEST <= abs(value) <= LARGEST:
            self.fail(key, f"0, or a number of {SMALLEST:g} to {LARGEST:g} in size", value)
        return float(value)

    def _place(self, key: str) -> str:
        place = ".".join(part for part in (self.where, key) if part)
        return f"{place}: " if place else ""


def _is_suffixed(key: str, name: str) -> bool:
    """Whether `key` looks like `name` with an unknown unit, such as d_cm: an underscore and up to four letters more."""
    return key.startswith(f"{name}_") and units.parse_name(key)[1] is None and len(key) - len(name) <= 5


def _converted(value: float, given: str, unit: str) -> float:
    return value if given == unit else units.from_si(units.to_si(value, given), unit)


def _shown(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, dict):
        return f"a mapping of {len(value)} keys"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
