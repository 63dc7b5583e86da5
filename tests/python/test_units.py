# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Units: exact factors, names split by the longest unit, and no factor anywhere else in the package."""

import io
import math
import tokenize
from pathlib import Path

import numpy as np
import pytest

from fastcal import units
from fastcal.errors import InvalidInput


@pytest.mark.parametrize(
    ("value", "unit", "si"),
    [
        (9.0, "mm", 0.009),
        (1.0, "in", 0.0254),
        (1000.0, "um", 0.001),
        (180.0, "deg", math.pi),
        (5.0, "mrad", 0.005),
        (250.0, "g", 0.25),
        (20.0, "c", 293.15),
        (20.0, "k", 20.0),
        (3.0, "mm_s", 0.003),
        (90.0, "deg_s", math.pi / 2),
        (2.5e-7, "rad_nm", 2.5e-7),
        (0.25, "1", 0.25),
    ],
)
def test_known_values(value: float, unit: str, si: float) -> None:
    assert units.to_si(value, unit) == si
    assert units.from_si(si, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("unit", units.UNITS)
def test_arrays_come_back_from_every_unit(unit: str) -> None:
    values = np.random.default_rng(0).normal(size=(50, 3))
    back = units.from_si(units.to_si(values, unit), unit)
    np.testing.assert_allclose(back, values, rtol=1e-15, atol=4e-16 * abs(units.UNITS[unit].offset))
    one_more = units.to_si(values + 1.0, unit) - units.to_si(values, unit)
    np.testing.assert_allclose(one_more, units.factor(unit), rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("x_mm", ("x", "mm")),
        ("rate_x_mm_s", ("rate_x", "mm_s")),
        ("rate_rx_rad_s", ("rate_rx", "rad_s")),
        ("compliance_rad_nm", ("compliance", "rad_nm")),
        ("inverse_ei_1_nm2", ("inverse_ei", "1_nm2")),
        ("coefficient_1_k", ("coefficient", "1_k")),
        ("stiffness_n_m", ("stiffness", "n_m")),
        ("gravity_m_s2", ("gravity", "m_s2")),
        ("inertia_kg_m2", ("inertia", "kg_m2")),
        ("mx_nm", ("mx", "nm")),
        ("at_s", ("at", "s")),
        ("FX_N", ("FX", "n")),
        ("qw", ("qw", None)),
        ("mm", ("mm", None)),
        ("_mm", ("_mm", None)),
        ("station_1", ("station_1", None)),
        ("", ("", None)),
    ],
)
def test_names_are_split_by_their_longest_unit(name: str, parts: tuple[str, str | None]) -> None:
    assert units.parse_name(name) == parts


def test_an_unknown_unit_is_refused_with_those_that_are_known() -> None:
    with pytest.raises(InvalidInput, match=r"^unit 'furlong' is not known; known are 1, m, mm"):
        units.to_si(1.0, "furlong")


def test_kinds_list_their_units() -> None:
    assert units.unit_names("length") == ["m", "mm", "um", "in"]
    assert units.unit_names("torque") == ["nm"]


NAMES = {"deg2rad", "rad2deg", "radians"}
ANYWHERE = {"180", "180.0", "273.15", "25.4"}
AS_FACTOR = {"1e3", "1000", "1000.0", "1e-3", "0.001"}  # harmless as a limit


def factors(source: str) -> list[str]:
    """The conversions between units in a Python text, as line: token."""
    tokens = list(tokenize.generate_tokens(io.StringIO(source).readline))
    return [
        f"{token.start[0]}: {token.string}"
        for before, token, after in zip(tokens, tokens[1:], tokens[2:], strict=False)
        if token.string in NAMES | ANYWHERE
        or (token.string == "degrees" and before.string == "." and after.string == "(")
        or (token.string in AS_FACTOR and {before.string, after.string} & {"*", "/", "*=", "/="})
    ]


def test_factors_are_found() -> None:
    assert factors("x = 3\ny = x * 1e3\nz = np.deg2rad(x) + 1e-3\nw = math.degrees(x) / 1000\n") == [
        "2: 1e3",
        "3: deg2rad",
        "4: degrees",
        "4: 1000",
    ]


def test_no_other_file_holds_a_factor() -> None:
    table = Path(units.__file__)
    files = [path for path in sorted(table.parent.rglob("*.py")) if path != table]
    assert table.with_name("errors.py") in files
    found = {str(path): factors(path.read_text(encoding="utf-8")) for path in files}
    assert {path: lines for path, lines in found.items() if lines} == {}
