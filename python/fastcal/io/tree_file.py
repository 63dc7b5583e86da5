# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cell files in and out: YAML of arms, targets, sensors, cameras and boards, each with what it stands on.

A robot file with targets or sensors of its own is a cell of that one arm.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fastcal.cells.branches import possible_ways
from fastcal.cells.cell import Arm, Cell, Distance, Known, Point
from fastcal.cells.paths import Way, serial_ways
from fastcal.cells.pose_arm import POSE, pose_arm
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.atomic import write_text
from fastcal.io.calibration_schema import check_calibration
from fastcal.io.fields import Fields, without_traces
from fastcal.io.known_distances import check_known_distance
from fastcal.io.regular_file import is_file
from fastcal.io.rig_file import OF_CELLS
from fastcal.io.rig_schema import ARM, check_knocked, check_rig
from fastcal.io.robot_file import read_spec, spec_of
from fastcal.io.robot_schema import Spec, check_spec
from fastcal.io.urdf_file import read_urdf_tree
from fastcal.io.urdf_links import UrdfLinks, links_of
from fastcal.io.xml_text import read_xml
from fastcal.io.yaml_file import read_text, read_yaml
from fastcal.io.yaml_text import yaml_text
from fastcal.robot.robot import Robot

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,59}")
_MAY_BE_A_CELL = re.compile(rf"^['\"]?(arms|{'|'.join(OF_CELLS)})['\"]?:", re.MULTILINE)


def is_cell(source: str | os.PathLike[str]) -> bool:
    """Is it a YAML file of arms, or of one arm and what is read of it or reads?

    One arm with cameras or loops and nothing else is read as a robot that has them.
    """
    path = Path(source)
    if path.suffix.lower() not in (".yaml", ".yml") or not is_file(path):
        return False
    if not _MAY_BE_A_CELL.search(read_text(path)):
        return False
    content = read_yaml(path)
    if not isinstance(content, dict) or "arms" not in content:
        return isinstance(content, dict) and not content.keys().isdisjoint(OF_CELLS)
    arms = content["arms"]
    several = isinstance(arms, dict) and len(arms) > 1
    is_carried = not content.keys().isdisjoint(("cameras", "loops"))
    return several or not is_carried or not content.keys().isdisjoint((*OF_CELLS, "known_distances"))


def _content(path: str | os.PathLike[str]) -> Any:
    """What a cell file holds; of a robot file, the cell of the arm ARM, which keeps all that is its own."""
    content = read_yaml(path)
    if not isinstance(content, dict) or "arms" in content:
        return content
    there = {key: content[key] for key in (*OF_CELLS, "known_distances", "cameras", "boards") if key in content}
    targets, tool = there.get("targets") or {}, content.get("tool") or {}
    if isinstance(targets, dict) and isinstance(tool, dict) and tool:
        there["targets"] = {"tool": {"on": ARM, **tool}, **targets}  # of columns without a name
    own = {key: value for key, value in content.items() if key not in (*there, "base", "tool")}
    base = content.get("base") or {}
    place = base if isinstance(base, dict) else {"base": base}  # refused by its key
    name = str(content.get("name", Path(path).stem))
    return {"cell": name, "arms": {ARM: {"robot": own, **place}}, **there}


@dataclass
class _Entry:
    """One arm as its file has it."""

    name: str
    robot: Any
    links: tuple[str, str]
    on: str
    place: Spec
    known: Known
    key: str


@dataclass
class _Chain:
    """An arm as one chain; the names of arms that end in it; the links of its URDF, if it is of one."""

    arm: Arm
    ends: list[str] = field(default_factory=list)
    links: UrdfLinks | None = None


def load_cell(path: str | os.PathLike[str]) -> Cell:
    """The cell of a file.

    Arms that name the same URDF and base_link share its joints: what several of them have in common is an arm of its
    own, named by the link where their ways part.

    Raises:
        ParseError: One sentence that names the file, the key, what was expected and what came.
    """
    top = Fields(_content(path), "", path)
    name = top.text("cell", Path(path).stem)
    entries = [_entry(key, fields) for key, fields in _members(top, "arms")]
    if not entries:
        top.refuse("arms", "expected at least one arm, got none")
    points = [_point(key, role, fields) for role in ("target", "sensor") for key, fields in _members(top, f"{role}s")]
    distances = _distances(top)
    rig = _rig(top)
    records = top.inner("calibrations", {}).rest()
    record = check_calibration(top.inner("calibration"), []) if top.has("calibration") else None
    if top.has("loops"):
        top.refuse("loops", "only the arm of a cell of one arm, without targets and sensors, may have closed loops")
    top.done()
    names = [*(entry.name for entry in entries), *(point.name for point in points), *rig["cameras"], *rig["boards"]]
    for twice in sorted({each for each in names if names.count(each) > 1}):
        top.refuse("", f"two members of the cell are named '{twice}'; expected a name for each")
    chains = _chains(entries, Path(path))
    flanges = {end: chain.arm.flange for chain in chains for end in chain.ends} | {
        chain.arm.name: chain.arm.flange for chain in chains
    }

    links = {end: chain.links for chain in chains for end in chain.ends if chain.links is not None}

    def stands_on(on: str, place: Spec) -> tuple[str, Spec]:
        arm, _, link = on.partition("/")
        if not link or arm not in links:
            return flanges.get(on, on), place
        try:
            return links[arm].placed(link, place)
        except InvalidInput as error:
            raise ParseError(f"'{on:.60}': {error}", path) from None

    def point_there(of: Point) -> Point:
        on, place = stands_on(of.on, of.place)
        return replace(of, on=on, place=place)

    def moved(arm: Arm) -> Arm:
        on, base = stands_on(arm.on, arm.robot.spec["base"])
        return replace(arm, on=on) if base is arm.robot.spec["base"] else replace(arm, on=on, robot=_based(arm, base))

    arms = tuple(moved(chain.arm) for chain in chains)
    placed = tuple(map(point_there, points))
    for entry in (*rig["cameras"].values(), *rig["boards"].values()):
        entry["on"], place = stands_on(entry["on"], {"xyz_mm": entry["xyz_mm"], "rpy_deg": entry["rpy_deg"]})
        entry |= place
    touched = tuple(of for of in distances if " " in of.start and " " in of.end)  # of frames no name has a blank
    distances = tuple(of for of in distances if of not in touched)
    cell = Cell(name, arms, placed, distances, **rig, record=record, touched=touched)
    _check(cell, top)
    return replace(cell, records=_records(cell, records, top)) if records else cell


def _records(cell: Cell, given: Spec, top: Fields) -> Spec:
    """`calibrations`: of each way to a target how surely its numbers are known, as a robot file has it."""
    ways = {way.name: way for way in possible_ways(cell, list(given))}
    alone = {way.name: way for way in serial_ways(cell, list(given))}
    out = {}
    for name, record in given.items():
        if name not in ways:
            top.refuse(f"calibrations.{name!s:.60}", "expected the name of a target on an arm's flange")
        try:
            check_spec({**ways[name].robot.spec, "calibration": record}, top.path)
            out[name] = record
        except ParseError as error:
            if not _is_of(alone[name], record, top):  # files of before ways had the weight of other arms
                top.refuse(f"calibrations.{name}", error.message)
    return out


def _is_of(way: Way, record: Spec, top: Fields) -> bool:
    """Is a record one of a way as its arms alone?"""
    try:
        check_spec({**way.robot.spec, "calibration": record}, top.path)
    except ParseError:
        return False
    return True


def _check(cell: Cell, top: Fields) -> None:
    """Stands everything on something that there is?"""
    for arm in cell.arms:
        if arm.robot.description.cameras or arm.robot.description.boards:
            top.refuse(f"arms.{arm.name}", "its robot file has cameras or boards; expected them in the cell's own file")
    try:
        core = cell.core
    except InvalidInput as error:
        lost = str(error).endswith("no such frame")
        raise ParseError(f"{error}; expected {_frames(cell)}" if lost else str(error), top.path) from None
    for k, known in enumerate(cell.distances):
        for key, end in (("from", known.start), ("to", known.end)):
            try:
                core.frame(end)
            except InvalidInput:
                names = ", ".join(of.name for of in cell.points) or "none"
                top.refuse(
                    f"known_distances[{k}].{key}",
                    f"there is no '{end:.60}'; expected a target or sensor, which are {names}, {_frames(cell)}",
                )
    for key, own in (("cameras", cell.cameras), ("boards", cell.boards)):
        for name, entry in own.items():
            try:
                core.frame(entry["on"])
            except InvalidInput as error:
                top.refuse(f"{key}.{name}", f"stands on '{entry['on']:.60}': {error}")


def _frames(cell: Cell) -> str:
    """What a member may stand on, in words."""
    several = {arm.name: f"{arm.name}.link1 to " if arm.robot.joint_count > 1 else "" for arm in cell.arms}
    arms = [f"{arm.name}, {arm.name}.base or {several[arm.name]}{arm.flange}" for arm in cell.arms]
    return ", ".join(["world", *arms])


def _distances(top: Fields) -> tuple[Distance, ...]:
    """`known_distances`, between targets, sensors or frames of arms."""
    given = top.take("known_distances", [])
    if not isinstance(given, list):
        top.fail("known_distances", "a list of {from, to, mm, sigma_mm}", given)
    out = []
    for i, entry in enumerate(given):
        found = check_known_distance(fields := Fields(entry, f"known_distances[{i}]", top.path))
        if found["from"] == found["to"]:
            fields.refuse("to", f"expected another frame than '{found['from']:.60}'")
        out.append(Distance(found["from"], found["to"], found["mm"], found["sigma_mm"]))
    return tuple(out)


def _rig(top: Fields) -> Spec:
    """`cameras` and `boards`."""
    return {"cameras": {}, "boards": {}} | check_rig(top, lambda fields, on: on)


def cell_text(cell: Cell, comment: str = "") -> str:
    """The file of a cell, which holds its arms itself; it loads back bit for bit."""
    content: dict[str, Any] = {"cell": cell.name, "arms": {}}
    for arm in cell.arms:
        spec = {key: value for key, value in arm.robot.spec.items() if key not in ("base", "source")}
        robot = POSE if arm.of_poses else spec
        content["arms"][arm.name] = {"robot": robot, **_where(arm.on, arm.robot.spec["base"], arm.known)}
    for role in ("target", "sensor"):
        if members := {of.name: _where_now(of) for of in cell.points if of.role == role}:
            content[f"{role}s"] = members
    for key, own in (("cameras", cell.cameras), ("boards", cell.boards)):
        if own:
            content[key] = {name: dict(entry) for name, entry in own.items()}
    if known := [*cell.distances, *cell.touched]:
        content["known_distances"] = [of.entry for of in known]
    if cell.record is not None:
        content["calibration"] = dict(cell.record)
    if cell.records:
        content["calibrations"] = {name: dict(record) for name, record in cell.records.items()}
    return "".join(f"# {line}\n" for line in comment.splitlines()) + yaml_text(without_traces(content))


def write_cell(cell: Cell, path: str | os.PathLike[str], comment: str = "") -> None:
    """Writes the file of a cell, whole or not at all."""
    write_text(path, cell_text(cell, comment))


def _where(on: str, place: Spec, known: Known) -> dict[str, Any]:
    out: dict[str, Any] = {"on": on, "xyz_mm": place["xyz_mm"], "rpy_deg": place["rpy_deg"]}
    if known.fixed:
        out["fixed"] = True
    return out | {key: value for key, value in vars(known).items() if key != "fixed" and value is not None}


def _where_now(of: Point) -> dict[str, Any]:
    out = _where(of.on, of.place, of.known)
    return out if of.knocked is None else {**out, "knocked": dict(of.knocked)}


def _members(top: Fields, key: str) -> list[tuple[str, Fields]]:
    """The mappings of `arms`, `targets` or `sensors`, by their names."""
    value = top.take(key, {})
    if not isinstance(value, dict):
        top.fail(key, "a mapping of names to members", value)
    out = []
    for name, entry in value.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name) or name == "world":
            top.refuse(key, f"expected names of letters, digits, _ and - that begin with a letter, got '{name!s:.60}'")
        out.append((name, Fields(entry, f"{key}.{name}", top.path)))
    return out


def _place(fields: Fields) -> tuple[str, Spec, Known]:
    """What a member stands on, where, and how surely that is known."""
    on = fields.text("on", "world")
    place = fields.frame()
    fixed = fields.truth("fixed", False)
    return on, place, Known(fixed, **fields.sigmas())


def _entry(name: str, fields: Fields) -> _Entry:
    robot = fields.take("robot")
    if not isinstance(robot, str | Mapping):
        fields.fail("robot", "a robot file, the name of a shipped arm or a mapping", robot)
    base_link, tip_link = (fields.text(key) if fields.has(key) else "" for key in ("base_link", "tip_link"))
    on, place, known = _place(fields)
    fields.done()
    return _Entry(name, robot, (base_link, tip_link), on, place, known, fields.where)


def _point(name: str, role: str, fields: Fields) -> Point:
    on, place, known = _place(fields)
    knocked = check_knocked(fields.inner("knocked")) if fields.has("knocked") else None
    fields.done()
    return Point(name, role, on, place, known, knocked)


def _chains(entries: list[_Entry], path: Path) -> list[_Chain]:
    """The arms as chains that share no joint."""
    out: list[_Chain] = []
    done: set[str] = set()
    for entry in entries:
        if entry.name in done:
            continue
        together = [other for other in entries if _shares(entry, other)]
        done |= {other.name for other in together}
        out += _forked(together, path) if len(together) > 1 else [_alone(entry, path)]
    return out


def _shares(a: _Entry, b: _Entry) -> bool:
    """Do two arms name the same URDF and the same base_link?"""
    if a is b:
        return True
    return (
        isinstance(a.robot, str)
        and a.robot == b.robot
        and a.robot.lower().endswith(".urdf")
        and (a.links[0] == b.links[0])
    )


def _alone(entry: _Entry, path: Path) -> _Chain:
    if entry.robot == POSE:
        spec = check_spec(pose_arm(entry.name), path)
    elif isinstance(entry.robot, Mapping):
        spec = spec_of(entry.robot, path)
    else:
        file = path.parent / entry.robot
        source = file if file.suffix else entry.robot
        spec = read_spec(source, base_link=entry.links[0], tip_link=entry.links[1])
    spec["base"] = entry.place
    arm = Arm(entry.name, Robot(spec), entry.on, entry.known, entry.robot == POSE)
    return _Chain(arm, [entry.name], links_of(entry.name, spec))


def _forked(entries: list[_Entry], path: Path) -> list[_Chain]:
    """Arms of one URDF, their shared joints first."""
    first = entries[0]
    for other in entries[1:]:
        if (other.on, other.place) != (first.on, first.place):
            raise ParseError(
                f"{other.key}: shares the joints of arm '{first.name}', and so stands where that stands; expected the "
                "same on, xyz_mm and rpy_deg",
                path,
            )
    tips = {entry.links[1]: entry.name for entry in entries}
    if len(tips) < len(entries):
        raise ParseError(f"{first.key}: arms of one URDF end at different links; expected a tip_link for each", path)
    out: list[_Chain] = []
    for parent, tip, found in read_urdf_tree(path.parent / first.robot, first.links[0], list(tips)):
        spec = check_spec(found, path)
        spec["gravity_frame"] = "measuring"
        name = tips.get(tip, tip)
        on = first.on if parent < 0 else out[parent].arm.flange
        if parent < 0:
            spec["base"] = first.place
        # Behind a fork the first joint's own origin says where it is.
        known = first.known if parent < 0 else Known(fixed=True)
        out.append(_Chain(Arm(name, Robot(spec), on, known), [name] if tip in tips else []))
    shared = [(chain.arm.name, chain.arm.robot.spec) for chain in out]
    links = UrdfLinks(read_xml(path.parent / first.robot), first.links[0], shared)
    return [replace(chain, links=links) for chain in out]


def _based(arm: Arm, base: Spec) -> Robot:
    """The arm's robot with its base there."""
    return Robot({**arm.robot.spec, "base": base})
