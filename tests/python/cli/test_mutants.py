# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Damaged measurement and robot files: a result or one line, never a crash and never a hang."""

import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fastcal.cli import main

ROWS = 25
PIECES = [
    *(b",", b";", b"\n", b"\t", b'"', b".", b"-", b"e", b" ", b"nan", b"inf", b"1e999", b"1e300", b"-1", b"0"),
    *(b"\xff", b"\0", b"_cm", b"deg", b"x_mm", b"{", b"}", b"[", b"]", b":", b"&a", b"*a", b"null", b"true", b"!!"),
]
MANY = settings(
    max_examples=100, deadline=20_000, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@st.composite
def damage(draw: st.DrawFn) -> list[tuple[float, int, bytes]]:
    """Up to six places (as shares of the file's length), how much goes there, and what comes in its place."""
    cut = st.sampled_from([0, 1, 4, 40])
    piece = st.one_of(st.sampled_from(PIECES), st.binary(max_size=3))
    return draw(st.lists(st.tuples(st.floats(0, 1), cut, piece), min_size=1, max_size=6))


def damaged(content: bytes, changes: list[tuple[float, int, bytes]]) -> bytes:
    for share, cut, piece in changes:
        start = int(share * len(content))
        content = content[:start] + piece + content[start + cut :]
    return content


def check(robot: Path, data: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> int:
    """Runs a calibration; what it leaves must fit its exit code."""
    capsys.readouterr()
    code = main(["calibrate", str(robot), str(data), "-o", str(out)])
    said = capsys.readouterr()
    assert code in (0, 2, 3), said.err
    assert "internal error" not in said.err
    if code == 2:
        assert len(said.err.splitlines()) == 1
        assert not out.exists()
        return code
    json.loads((out / "result.json").read_text(), parse_constant=pytest.fail)
    assert (out / "model.yaml").exists() == (code == 0)
    for path in out.iterdir():
        path.unlink()
    out.rmdir()
    return code


@pytest.fixture
def sound(demo: Path, tmp_path: Path) -> Path:
    """robot.yaml and some rows of measurements.csv."""
    (tmp_path / "robot.yaml").write_bytes((demo / "robot.yaml").read_bytes())
    lines = (demo / "measurements.csv").read_text().splitlines(keepends=True)
    (tmp_path / "measurements.csv").write_text("".join(lines[: ROWS + 1]))
    return tmp_path


@MANY
@given(changes=damage())
def test_damaged_measurements_are_calibrated_or_refused(sound, capsys, changes) -> None:
    bad = sound / "bad.csv"
    bad.write_bytes(damaged((sound / "measurements.csv").read_bytes(), changes))
    check(sound / "robot.yaml", bad, sound / "out", capsys)


@MANY
@given(changes=damage())
def test_damaged_robot_files_are_used_or_refused(sound, capsys, changes) -> None:
    bad = sound / "bad.yaml"
    bad.write_bytes(damaged((sound / "robot.yaml").read_bytes(), changes))
    check(bad, sound / "measurements.csv", sound / "out", capsys)


def test_what_the_mutants_start_from_is_calibrated(sound, capsys) -> None:
    assert check(sound / "robot.yaml", sound / "measurements.csv", sound / "out", capsys) == 0
