# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the languages mean, held against pairs of pose and joints that controllers wrote; see maker_facts/README.md."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from itertools import combinations, permutations, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

import fastcal
from fastcal.compensation.configurations import Configurations
from fastcal.programs import Cell, Frames, read_program
from fastcal.robot.core_model import pose

FOLDER = Path(__file__).parent / "maker_facts"
TABLES = {path.stem: yaml.safe_load(path.read_text()) for path in sorted(FOLDER.glob("*.yaml"))}
TURNS = {
    f"by half a turn about {axis}": np.diag([*signs, 1.0])
    for axis, signs in (("x", (1, -1, -1)), ("y", (-1, 1, -1)), ("z", (-1, -1, 1)))
}
STILL = {"xyz_mm": [0.0] * 3, "rpy_deg": [0.0] * 3}


@dataclass(frozen=True, eq=False)
class Pair:
    """A row of a table: the program with its target, the arm, and the joints of the chain."""

    table: str
    row: int
    given: dict[str, Any]

    @property
    def robot(self) -> fastcal.Robot:
        return _robot(self.table, self.given["arm"])

    @property
    def program(self) -> Any:
        table = TABLES[self.table]
        text = table["program"].replace("TARGET", self.given["target"])
        return read_program({table["file"]: text.encode()})

    @property
    def id(self) -> str:
        return f"{self.table} {self.row}"

    @property
    def q(self) -> np.ndarray:
        return self.robot.pendant.chain(np.radians(self.given["joints_deg"]))

    @property
    def frames(self) -> Frames:
        """Of the program in the pair's tool, frame and base."""
        table, given = TABLES[self.table], self.given
        cell = Cell(
            T_controller_base=pose(given.get("base", STILL)),
            tools={table["tool_name"]: pose(given["tool"])} if "tool" in given else {},
            frames={table["frame_name"]: pose(given["frame"])} if "frame" in given else {},
        )
        return Frames(self.program, cell, np.eye(4))


@cache
def _robot(table: str, arm: str) -> fastcal.Robot:
    return fastcal.load_robot({"name": arm} | TABLES[table]["arms"][arm]["robot"])


@cache
def _configurations(table: str, arm: str) -> Configurations:
    return Configurations(_robot(table, arm), next(p for p in PAIRS if p.table == table).program.language)


PAIRS = [Pair(name, row, given) for name, table in TABLES.items() for row, given in enumerate(table["pairs"])]
POSES = [Pair(name, row, given) for name, table in TABLES.items() for row, given in enumerate(table.get("poses", []))]


def misses(pair: Pair, language: Any = None) -> list[str]:
    """In what the language, or a mutant of it, disagrees with a pair."""
    program, q, given = pair.program, pair.q, pair.given
    (target,) = program.targets
    arm = _configurations(pair.table, given["arm"]).arm
    spoken = language or program.language
    out = []
    if target.kind == "pose":
        T = pair.frames.to_base(0, spoken.pose(target.values))
        away = pair.robot.forward(q)[0]
        if np.linalg.norm((T - away)[:3, 3]) * 1e3 > given.get("within_mm", 0.05):
            out.append(f"position by {np.linalg.norm((T - away)[:3, 3]) * 1e3:.3f} mm")
        turned = Rotation.from_matrix(T[:3, :3].T @ away[:3, :3]).magnitude()
        if np.degrees(turned) > given.get("within_deg", 0.01):
            out.append(f"orientation by {np.degrees(turned):.3f} deg")
    asked, is_in = spoken.asked_branch(target), spoken.branch(q, arm)
    if any(None not in (a, b) and a != b for a, b in zip(asked, is_in, strict=False)):
        out.append(f"posture: asked {asked}, is {is_in}")
    shown = np.radians(given["joints_deg"])
    for joint, (low, high) in spoken.asked_turns(target).items():
        if not low - 1e-9 <= shown[joint] < high:
            out.append(f"turn of axis {joint + 1}")
    if not given.get("read_off") and (
        wrong := {k: v for k, v in spoken.words(target, q, arm).items() if v != target.words[k].text}
    ):
        out.append(f"words: {wrong}")
    return out


@cache
def ways(pose: Pair) -> list[np.ndarray]:
    """Joints of all the arm's solutions of a pose, each but for whole turns."""
    program = pose.program
    T = pose.frames.to_base(0, program.language.pose(program.targets[0].values))
    return _configurations(pose.table, pose.given["arm"])._ways(T, None)


def fitting(pose: Pair, language: Any = None) -> int:
    """How many of the arm's solutions have the words of a pose, as the language, or a mutant of it, reads them."""
    (target,) = pose.program.targets
    spoken = language or pose.program.language
    arm = _configurations(pose.table, pose.given["arm"]).arm
    asked, turns = spoken.asked_branch(target), spoken.asked_turns(target)
    count = 0
    for q in ways(pose):
        shown = pose.robot.pendant.shown(q)
        alike = all(None in (a, b) or a == b for a, b in zip(asked, spoken.branch(q, arm), strict=True))
        count += alike and all(_shows(pose.robot, joint, shown[joint], turn) for joint, turn in turns.items())
    return count


def _shows(robot: fastcal.Robot, joint: int, angle: float, turn: tuple[float, float]) -> bool:
    """Is an angle within a turn, and the joint within its limits, by some whole turns?"""
    angles = angle + 2 * np.pi * np.arange(-2, 3)
    low, high = robot.limits[joint]
    return bool(np.any((angles >= turn[0]) & (angles < turn[1]) & (angles >= low) & (angles <= high)))


@dataclass(frozen=True)
class Mutant:
    """A language with one of its facts turned: `change` is made to what `method` of it gives, or is given."""

    language: Any
    method: str
    change: Callable[[Any], Any]
    before: bool = False

    def words(self, *_: Any) -> dict[str, str]:
        return {}

    def __getattr__(self, name: str) -> Any:
        method = getattr(self.language, name)
        if name != self.method:
            return method
        return lambda given: method(self.change(given)) if self.before else self.change(method(given))


def mutants(table: str) -> Iterator[tuple[str, str, Callable[[Any], Any], bool]]:
    """Name, method, change and whether it is made before, of each."""
    program = next(p for p in PAIRS if p.table == table).program
    bits = range(len(program.language.asked_branch(program.targets[0])))
    turns = set(program.language.asked_turns(program.targets[0]))
    for i in bits:
        yield f"bit {i} turned", "asked_branch", partial(_turned_bit, i), False
    for i, j in combinations(bits, 2):
        yield f"bits {i} and {j} exchanged", "asked_branch", partial(_exchanged, i, j), False
    for joint, other in product(sorted(turns), sorted(set(range(6)) - turns)):
        yield f"turn of axis {joint + 1} as of axis {other + 1}", "asked_turns", partial(_renamed, joint, other), False
    for name, R in TURNS.items():
        yield f"the frame turned {name}", "pose", partial(np.matmul, R), False
        yield f"the tool turned {name}", "pose", partial(_times, R), False
    yield "the rotation the other way round", "pose", _inverted, False
    for order in sorted(set(permutations(range(3))) - {(0, 1, 2)}):
        yield f"angles in the order {order}", "pose", partial(_reordered, list(order)), True


def _turned_bit(i: int, bits: tuple[bool | None, ...]) -> tuple[bool | None, ...]:
    return tuple(None if bit is None else bit ^ (k == i) for k, bit in enumerate(bits))


def _exchanged(i: int, j: int, bits: tuple[bool | None, ...]) -> tuple[bool | None, ...]:
    return tuple(bits[{i: j, j: i}.get(k, k)] for k in range(len(bits)))


def _renamed(joint: int, other: int, turns: dict[int, Any]) -> dict[int, Any]:
    return {other if k == joint else k: turn for k, turn in turns.items()}


def _times(R: np.ndarray, T: np.ndarray) -> np.ndarray:
    return T @ R


def _inverted(T: np.ndarray) -> np.ndarray:
    return np.block([[T[:3, :3].T, T[:3, 3:]], [T[3:]]])


def _reordered(order: list[int], values: np.ndarray) -> np.ndarray:
    return np.concatenate([values[:-3], values[-3:][order]])


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair.id)
def test_a_published_pair_is_read_as_its_controller_meant_it(pair) -> None:
    assert misses(pair) == []


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair.id)
def test_the_joints_are_found_from_pose_and_words_alone(pair) -> None:
    program = pair.program
    if program.targets[0].kind == "joints":
        return
    T = pair.frames.to_base(0, program.language.pose(program.targets[0].values))
    near = None if program.language.names_postures else pair.q + 0.1
    q, why = _configurations(pair.table, pair.given["arm"]).solve(program.targets[0], T, near)
    assert why == ""
    # The numbers are rounded: where the wrist is nearly stretched, joints 4 and 6 follow a thousandth by a hundredth.
    shown = np.degrees(pair.robot.pendant.shown(q))
    within = pair.given.get("joints_within_deg", 10 * pair.given.get("within_deg", 0.01))
    np.testing.assert_allclose(shown, pair.given["joints_deg"], atol=within)


@pytest.mark.parametrize("pose", POSES, ids=lambda pose: pose.id)
def test_one_solution_of_an_arm_has_the_words_that_a_controller_wrote(pose) -> None:
    assert fitting(pose) == 1


@pytest.mark.parametrize("table", TABLES)
def test_every_mutant_of_a_fact_misses_a_pair_or_a_pose(table) -> None:
    mine = [pair for pair in PAIRS if pair.table == table]
    posed = [pose for pose in POSES if pose.table == table]

    def lives(method: str, *mutation: Any) -> bool:
        if any(misses(pair, Mutant(pair.program.language, method, *mutation)) for pair in mine):
            return False
        of_words = method in ("asked_branch", "asked_turns")
        return not any(of_words and not fitting(p, Mutant(p.program.language, method, *mutation)) for p in posed)

    assert {name for name, *mutation in mutants(table) if lives(*mutation)} == set(TABLES[table]["unbacked"])


@pytest.mark.parametrize(
    ("table", "name", "value"),
    [(t, name, value) for t in TABLES for name, values in TABLES[t]["constants"].items() for value in values],
    ids=str,
)
def test_every_other_constant_misses_a_pair(table, name, value, monkeypatch) -> None:
    module = sys.modules[type(next(p for p in PAIRS if p.table == table).program.language).__module__]
    monkeypatch.setattr(module, name, tuple(value))
    assert any(misses(pair) for pair in PAIRS if pair.table == table)


@pytest.mark.parametrize("table", TABLES)
def test_rows_come_from_several_sources(table) -> None:
    pairs, poses = TABLES[table]["pairs"], TABLES[table].get("poses", [])
    rows = [*(row for row in pairs if not row.get("read_off")), *poses]
    assert len(rows) >= 8
    assert len({row["source"] for row in rows}) >= 3
    assert {row["source"] for row in [*pairs, *poses]} == set(TABLES[table]["sources"])
