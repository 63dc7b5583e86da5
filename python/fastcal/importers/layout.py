# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Finds the table in a grid: title rows above it, the header, a row of units, rows of numbers, and remarks below."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from fastcal.importers.export import Export, is_value, number, with_units
from fastcal.importers.footers import footer_start
from fastcal.importers.grid import Grid, Row
from fastcal.importers.words import ANGLES, LENGTHS, POLAR, UNIT_WORDS, Title, meaning, plain_words, unit_of
from fastcal.said import said

_SEARCHED = 200  # rows in which the header is looked for
_FEWEST_TITLES = 3
_MOST_TURNED = 200_000  # cells of a table that stands on its side
_UNITS = re.compile(
    r"\b(length |angle |angular )?(units?|unite|unites|unité|unités|einheit|einheiten|unita|unità|unidades)\b", re.I
)


def read_table(grid: Grid, dialect: str = "a table") -> Export:
    """The table of a grid; without a header its columns are known by their number alone.

    Raises:
        ParseError: There are no rows of numbers, or they are wider than the header.
    """
    header = find_header(grid)
    if header is None:
        turned = _turned(grid)
        is_turned = turned is not None and find_header(turned) is not None
        return read_table(turned, dialect) if turned is not None and is_turned else _without_header(grid, dialect)
    titles = _titles(grid, header)
    after, remarks = _below(grid, header)
    units = [""] * len(titles)
    if after and _is_units(after[0].cells):
        units = _padded(after[0].cells, len(titles))
        after = after[1:]
    elif header > 0 and _is_units(grid.rows[header - 1].cells):
        units = _padded(grid.rows[header - 1].cells, len(titles))
    meanings = with_units(titles, units)
    rows, lines, notes = _body(grid, titles, after)
    notes += remarks
    if not rows:
        raise grid.error("holds no rows of numbers below its header")
    return Export(grid, dialect, titles, meanings, rows, lines, stated_units(grid, header), notes=tuple(notes))


def _below(grid: Grid, header: int) -> tuple[list[Row], list[str]]:
    """The rows below the header but for remarks, and a sentence on those of numbers that somebody put a mark before."""
    below = [row for row in grid.rows[header + 1 :] if not row.blank]
    after = [row for row in below if not row.comment]
    numbers = [row for row in below if row.comment and sum(map(is_value, row.cells)) >= _FEWEST_TITLES]
    if numbers and not any(sum(map(is_value, row.cells)) >= _FEWEST_TITLES for row in after):
        return below, []  # the mark begins the names of all rows
    if not numbers:
        return after, []
    lines = ", ".join(str(row.line) for row in numbers[:6]) + (", ..." if len(numbers) > 6 else "")
    return after, [f"{len(numbers)} rows behind the mark of a remark are left out (lines {lines})"]


def find_header(grid: Grid) -> int | None:
    """The place of the row with the most titles that are known, of at least three; None where there is none."""
    best, place = (False, _FEWEST_TITLES - 1), None
    for k, row in enumerate(grid.rows[:_SEARCHED]):
        filled = [cell for cell in row.cells if cell]
        numbers = sum(map(is_value, filled))
        if numbers * 3 > len(filled):
            continue
        known = sum(meaning(cell) is not None for cell in filled)
        # A comment is the header only where nothing else is.
        if known >= _FEWEST_TITLES and (not row.comment, known) > best:
            best, place = (not row.comment, known), k
    return place


def _turned(grid: Grid) -> Grid | None:
    """The grid with its columns as rows, where the first cells of its rows title them; None where they do not.

    Its lines are the columns of the file. Rows that title nothing known, such as those above the table, stay titles.
    """
    rows = [row for row in grid.rows if not row.blank]
    width = max((len(row.cells) for row in rows), default=0)
    if not _FEWEST_TITLES <= len(rows) <= _SEARCHED or width <= 2 or width * len(rows) > _MOST_TURNED:
        return None
    titled = [row for row in rows if meaning(row.cells[0]) is not None and any(map(is_value, row.cells))]
    if not _are_titles([row.cells[0] for row in titled], width - 1):
        return None
    first, last = rows.index(titled[0]), rows.index(titled[-1])
    above = rows[first - 1 : first]
    if above and above[0].cells[0] and len(above[0].cells) == len(titled[0].cells):
        first -= 1  # the names of the poses
    columns = zip(*(_padded(row.cells, width) for row in rows[first : last + 1]), strict=True)
    body = (Row(column, cells) for column, cells in enumerate(columns, start=1))
    said = "the table stands on its side, a column a pose: its columns are read as rows, and counted so in messages"
    before = (row for row in rows[:first] if len(list(filter(None, row.cells))) == 1)
    return replace(grid, rows=(*before, *body), text="", notes=(*grid.notes, said))


def _are_titles(cells: Sequence[str], poses: int) -> bool:
    """Whether cells title a point's coordinates, or all joints of an arm, and are no names of points such as A1."""
    roles = [title.role for cell in cells if (title := meaning(cell)) is not None]
    joints = sorted(int(role[1:]) for role in roles if re.fullmatch(r"q\d{1,2}", role))
    numbered = joints == list(range(1, len(joints) + 1)) and _FEWEST_TITLES <= len(joints) <= poses
    return {"x", "y", "z"} <= {*roles} or numbered


def stated_units(grid: Grid, header: int) -> dict[str, tuple[str, float]]:
    """Units that the lines above the header state, such as Units: MM / DEG."""
    found: dict[str, tuple[str, float]] = {}
    for row in grid.rows[: header + 1]:
        text = " ".join(row.cells)
        if match := _UNITS.search(text):
            for word in re.findall(r"[^\s,;:/=()\[\]]+", text[match.end() :]):
                if (unit := UNIT_WORDS.get(word.lower())) and unit[0] in (*LENGTHS, *ANGLES):
                    found.setdefault("length" if unit[0] in LENGTHS else "angle", unit)
    return found


def _titles(grid: Grid, header: int) -> list[str]:
    """The header's titles; where some come twice, with the words of the row above that hold for several columns."""
    titles = [" ".join(cell.split()) for cell in grid.rows[header].cells]
    filled = [title.lower() for title in titles if title]
    above = next((row for row in reversed(grid.rows[:header]) if not row.blank), None)
    if len(set(filled)) == len(filled) or above is None:
        return titles
    groups, group = [], ""
    for cell in _padded(above.cells, len(titles)):
        group = cell or group
        groups.append(group)
    return [f"{group} {title}".strip() if title else "" for group, title in zip(groups, titles, strict=True)]


def _is_units(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    known = sum(unit_of(cell) is not None for cell in filled)
    return known >= 2 and known >= len(filled) - 1 and any(number(cell) is None for cell in filled)


def _padded(cells: Sequence[str], width: int) -> list[str]:
    return [*cells[:width], *[""] * (width - len(cells))]


def _body(grid: Grid, titles: Sequence[str], after: Sequence[Row]) -> tuple[list[list[str]], list[int], list[str]]:
    """Rows of numbers, their lines, and what was left out behind them."""
    width = len(titles)
    rows: list[list[str]] = []
    lines: list[int] = []
    pages = 1
    for row in after:
        cells = row.cells
        if any(cells[width:]):
            if sum(map(is_value, cells)) < width / 2:
                continue  # a sentence
            hint = "; decimal commas need ; or tab between the cells" if len(cells) >= 2 * width - 2 else ""
            raise grid.error(f"expected {width} cells as in the header, got {len(cells)}{hint}", row.line)
        if [" ".join(cell.split()) for cell in cells[:width]] == list(titles):
            pages += 1  # the header again, on the next page
            continue
        rows.append(_padded(cells, width))
        lines.append(row.line)
    notes = []
    if pages > 1:
        notes.append(f"the header comes {pages} times, and the rows below each are taken")
    kept = footer_start(rows, lines)
    if kept < len(rows):
        named = ", ".join(next((cell for cell in row if cell), "") for row in rows[kept:][:8])
        notes.append(f"left out below the table: {named}")
    return rows[:kept], lines[:kept], notes


def _without_header(grid: Grid, dialect: str) -> Export:
    body = [row for row in grid.rows if not row.blank and not row.comment]
    body = [row for row in body if sum(number(cell) is not None for cell in row.cells) >= _FEWEST_TITLES]
    if not body:
        raise grid.error(said("holds no table: no row names columns that are known, and no row holds three numbers"))
    _refuse_polar(grid, body[0])
    width = max(len(row.cells) for row in body)
    none: list[Title | None] = [None] * width
    rows = [_padded(row.cells, width) for row in body]
    units = stated_units(grid, len(grid.rows) - 1)
    titles = _unknown_titles(grid, body[0], width)
    return Export(grid, dialect, titles, none, rows, [row.line for row in body], units, headed=False)


def _unknown_titles(grid: Grid, first: Row, width: int) -> list[str]:
    """The words right above a table that title its columns, though none of them is known; empty: there are none."""
    above = [row for row in grid.rows[: grid.rows.index(first)] if not row.blank]
    cells = [" ".join(cell.split()) for cell in above[-1].cells] if above else []
    are_titles = len(cells) == width == len(set(cells)) and all(cells) and not any(map(is_value, cells))
    return cells if are_titles else [""] * width


def _refuse_polar(grid: Grid, first: Row) -> None:
    """Refuses the angles of an instrument, which by their order alone would pass for coordinates.

    Raises:
        ParseError: A row above the first of the numbers titles two or more of its columns so.
    """
    for row in grid.rows[: grid.rows.index(first)]:
        titles = [cell for cell in row.cells if POLAR & set(plain_words(cell))]
        if len(titles) > 1 and len(row.cells) == len(first.cells):
            named = ", ".join(f"'{title}'" for title in titles)
            raise grid.error(f"{named} are angles of the instrument: export Cartesian coordinates, X, Y and Z")
