# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robot files in and out: YAML of any kind, a bare URDF, or the name of an arm that comes with fastcal."""

from __future__ import annotations

import copy
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fastcal import robots
from fastcal.correction.correction import Correction
from fastcal.errors import InvalidInput, ParseError
from fastcal.io.atomic import write_bytes, write_text
from fastcal.io.correction_file import read_correction, write_correction
from fastcal.io.fields import Fields, without_traces
from fastcal.io.loop_lists import closing_frame, is_loop_list
from fastcal.io.mechanism_file import ENDINGS as MECHANISMS
from fastcal.io.mechanism_file import read_mechanism, with_lists, with_loops
from fastcal.io.regular_file import is_folder, is_there
from fastcal.io.rig_file import OF_CELLS, TAKE_CELLS, cell_spec, is_cell
from fastcal.io.robot_schema import Spec, check_spec
from fastcal.io.robot_source import RobotSource
from fastcal.io.ur_files import is_ur_kinematics, ur_spec
from fastcal.io.urdf_file import ENDINGS, read_urdf, urdf_text, what_moves_the_tool, what_urdf_loses
from fastcal.io.urdf_in_place import in_place, is_from_urdf
from fastcal.io.xml_text import read_xml, xml_bytes
from fastcal.io.yaml_file import read_text, read_yaml
from fastcal.io.yaml_text import yaml_text
from fastcal.robot.loops import has_branches
from fastcal.robot.robot import Robot

_OF_MEASUREMENTS = (".csv", ".tsv", ".txt", ".xlsx", ".xls", ".parquet", ".html", ".mat", ".npy", ".npz")


def load_robot(
    source: str | os.PathLike[str] | Mapping[str, Any],
    *,
    base_link: str = "",
    tip_link: str = "",
    xacro: Mapping[str, str] | None = None,
) -> Robot:
    """A robot from a YAML or URDF file, a shipped arm by its name, or the content of a robot file as a mapping.

    The name of a shipped arm (`fastcal.robots.available()`) may be written `UR5` or `ur-5`; a file or folder of that
    name is given as `./ur5`.

    Args:
        source: The file, name or mapping.
        base_link: Where the arm in a URDF begins; empty: its root.
        tip_link: Where it ends; empty: where it can end in one way only.
        xacro: Values of the arguments of a xacro file, by name.

    Raises:
        ParseError: The file is not there or holds an invalid value.
    """
    return Robot(read_spec(source, base_link=base_link, tip_link=tip_link, xacro=xacro))


def read_spec(
    source: str | os.PathLike[str] | Mapping[str, Any],
    *,
    base_link: str = "",
    tip_link: str = "",
    xacro: Mapping[str, str] | None = None,
    loops: Sequence[Any] = (),
) -> Spec:
    """The canonical spec of a robot file or a shipped arm: every key in its place, defaults filled in, mm and degrees.

    Args:
        source: The file, name or mapping.
        base_link: Where the arm in a URDF begins; empty: its root.
        tip_link: Where it ends; empty: where it can end in one way only.
        xacro: Values of the arguments of a xacro file, by name; given, if only as {}, a robot file may name a xacro.
        loops: Closed loops beside those of a robot file, as its key `loops` has them.

    Raises:
        ParseError: One sentence that names the file, the key, what was expected and what came.
    """
    if isinstance(source, RobotSource):
        base_link, tip_link = base_link or source.base_link, tip_link or source.tip_link
        xacro = xacro or (_arguments(source) if source.xacro else None)
    links = {key: name for key, name in (("base_link", base_link), ("tip_link", tip_link)) if name}
    if isinstance(source, Mapping):
        value: Any = copy.deepcopy(dict(source))
        path = Path(str(value.get("name", "robot")))
    else:
        path = _found(source)
        if path.suffix.lower() in _OF_MEASUREMENTS:
            raise ParseError(
                "is no robot file (.yaml, .urdf, .xacro) and no name of a shipped arm; the robot comes before the data",
                path,
            )
        if path.suffix.lower() in (*ENDINGS, *MECHANISMS):
            if loops:
                raise ParseError("its loops go into a robot file (kinematics: urdf, urdf: FILE) with its motors", path)
            return check_spec(_described(path, base_link, tip_link, xacro), path)
        value = read_yaml(path)
    if is_cell(value) and not links:
        value = cell_spec(value, path, read_spec)
    elif isinstance(value, dict) and (own := [key for key in OF_CELLS if key in value]):
        raise ParseError(f"{own[0]}: makes the file a cell, which {TAKE_CELLS} take", path)
    if loops and isinstance(value, dict):
        value["loops"] = [*(value.get("loops") or []), *loops]
    return _of_content(value, path, links, xacro)


def spec_of(content: Mapping[str, Any], path: str | os.PathLike[str]) -> Spec:
    """`read_spec` of the content of a robot file, or of a part of the one at `path`: what it names lies beside that."""
    return _of_content(copy.deepcopy(dict(content)), Path(path), {}, None)


def _of_content(value: Any, path: Path, links: dict[str, str], xacro: Mapping[str, str] | None) -> Spec:
    value = _with_parts(value, path, links, xacro)
    if isinstance(value, dict):
        value.setdefault("name", path.stem)
    return _with_correction(check_spec(value, path), path)


def _with_parts(value: Any, path: Path, links: dict[str, str], xacro: Mapping[str, str] | None) -> Any:
    """The content of a YAML file with what it names: a UR's calibration, a URDF beside it, a list of its loops."""
    if is_ur_kinematics(value) and not links:
        return ur_spec(value, path)
    if isinstance(value, dict) and value.get("kinematics") == "urdf" and "urdf" in value:
        return _with_urdf(value | links, path, xacro)
    if is_loop_list(value):
        return with_lists(value, path, **links)
    if links:
        raise ParseError(f"{' and '.join(links)} choose an arm in a URDF, and this robot is not one", path)
    return value


def _described(path: Path, base_link: str, tip_link: str, xacro: Mapping[str, str] | None) -> Spec:
    """What a URDF, a xacro, an SDF or an MJCF file holds."""
    if path.suffix.lower() in MECHANISMS or (
        path.suffix.lower() == ".urdf" and (path.parent / "config.json").is_file() and closing_frame(read_xml(path))
    ):
        return read_mechanism(path, base_link, tip_link)
    return read_urdf(path, base_link, tip_link, xacro)


def chosen_arm(source: RobotSource) -> tuple[RobotSource, list[str]]:
    """A bare URDF or xacro with the links between which its arm lies, and the sentences that say what was chosen."""
    spec = read_spec(source)
    chosen = RobotSource(source, spec["source"]["base_link"], spec["source"]["tip_link"], source.xacro)
    return chosen, [note for note in spec.get("notes", []) if " was chosen" in note or " without limits " in note]


def _arguments(source: RobotSource) -> dict[str, str]:
    """The arguments of a xacro file by name."""
    found = {}
    for given in source.xacro:
        name, assigned, value = given.partition(":=")
        if given == "yes":
            continue
        if not name or not assigned:
            raise ParseError(f"expected a xacro argument as NAME:=VALUE, got '{given:.60}'", str(source))
        found[name] = value
    return found


def _found(source: str | os.PathLike[str]) -> Path:
    """The file that is meant: a shipped arm by its exact name, else a file, else a shipped arm by a likely spelling."""
    if not isinstance(source, str | os.PathLike):
        raise ParseError(f"expected a robot file, the name of a shipped arm or a mapping, got {type(source).__name__}")
    path = Path(source)
    name = source if isinstance(source, str) else ""
    if (shipped := robots.path_of(name)) is not None:
        return shipped
    if is_folder(path):
        hint = f"; did you mean {path / 'model.yaml'}?" if (path / "model.yaml").is_file() else ""
        raise ParseError(f"is a folder; expected a robot file or the name of a shipped arm{hint}", path)
    if is_there(path) or not name:
        return path
    meant = robots.likely(name)
    if len(meant) == 1:
        return robots.FOLDER / f"{meant[0]}.yaml"
    if "/" in name or path.suffix.lower() in (".yaml", ".yml", *ENDINGS):
        raise ParseError("there is no such file", source)
    near = [] if meant else robots.similar(name)
    if near:
        raise ParseError(
            f"there is no such file, and no shipped arm has that name; did you mean {' or '.join(near)}? "
            "(fastcal robots lists them)",
            source,
        )
    listed = ", ".join(meant or robots.available())
    raise ParseError(
        f"there is no such file, and {'several shipped arms have' if meant else 'no shipped arm has'} that name; "
        f"{'they' if meant else 'shipped'} are {listed}",
        source,
    )


def write_spec(
    spec: Spec, path: str | os.PathLike[str], comment: str = "", drop_effects: bool = False
) -> tuple[str, ...]:
    """Writes a canonical spec, whole or not at all: XML where the path ends in .urdf, else YAML.

    A spec that was read from a URDF becomes that URDF with other origins of its joints and nothing else changed.

    The YAML loads back bit for bit; a trained correction goes into a .safetensors file beside it,
    named by its content; that of the model which was there before goes where no other model names it.
    A URDF of fastcal's own holds the joints, the links' masses, base and tool (as fixed joints).

    Args:
        spec: A canonical spec; of kind `urdf` for a .urdf file.
        path: The file.
        comment: Lines to put at the top of a YAML file.
        drop_effects: Write a .urdf though it can't hold the effects of the spec.

    Returns:
        The keys of the spec, and the names of its effects, for which the file has no place (.urdf only).

    Raises:
        InvalidInput: The file cannot be written, or it can't hold what moves the tool.
    """
    if Path(path).suffix.lower() != ".urdf":
        if (correction := spec.get("correction")) is not None:
            return _write_with_correction(without_traces(spec), Path(path).resolve(), correction, comment)
        write_text(path, _commented(comment) + yaml_text(without_traces(spec)))
        return ()
    if has_branches(spec):
        raise InvalidInput(f"{path}: a URDF has no place for branches and closed loops; write a .yaml file")
    lost = what_urdf_loses(spec)
    if (moving := what_moves_the_tool(spec)) and not drop_effects:
        raise InvalidInput(
            f"{path}: a URDF has no place for {', '.join(moving)}; write a .yaml file, or allow them to be dropped "
            "(--drop-effects)"
        )
    write_bytes(path, xml_bytes(in_place(spec) if is_from_urdf(spec) else urdf_text(spec)))
    return lost


def _write_with_correction(spec: Spec, path: Path, correction: Correction, comment: str) -> tuple[str, ...]:
    """The network first, under a name of its own, then in one step the model that refers to it."""
    before = set(path.parent.glob("*.safetensors"))
    old = _named_correction(path)
    network, sha256 = write_correction(correction, path)
    try:
        write_text(
            path, _commented(comment) + yaml_text(spec | {"correction": {"file": network.name, "sha256": sha256}})
        )
    except BaseException:
        if network not in before:
            network.unlink(missing_ok=True)
        raise
    others = [other for other in path.parent.glob("*.yaml") if other != path]
    if old is not None and old != network.name and not any(_named_correction(other) == old for other in others):
        (path.parent / old).unlink(missing_ok=True)
    return ()


def _named_correction(model: Path) -> str | None:
    """The name of the network file that a model file of fastcal's refers to; None where it names none."""
    try:
        found = re.search(r'^correction:\s*\{?\s*file: "?([^/",\n]+\.safetensors)"?', read_text(model), re.MULTILINE)
    except ParseError:
        return None
    return found.group(1) if found else None


def _commented(comment: str) -> str:
    return "".join(f"# {line}\n" for line in comment.splitlines())


def _with_correction(spec: Spec, path: Path) -> Spec:
    """A spec whose correction, if it refers to one, is read from the file beside it."""
    entry = spec.get("correction")
    if entry is not None:
        spec["correction"] = read_correction(path.parent / entry["file"], entry["sha256"])
    return spec


def _with_urdf(value: dict[str, Any], path: Path, xacro: Mapping[str, str] | None) -> dict[str, Any]:
    """A file of kind urdf with the joints of the URDF that it names, which lies beside it."""
    top = Fields(value, "", path)
    if top.has("joints"):
        top.refuse("", "expected urdf: FILE or joints, got both")
    base_link, tip_link = (top.text(key) if top.has(key) else "" for key in ("base_link", "tip_link"))
    file = top.text("urdf")
    if "loops" in value or "motors" in value or Path(file).suffix.lower() in MECHANISMS:
        return with_loops(value, path)
    if xacro is None and file.lower().endswith(".xacro"):
        how = "if you trust it, add --xacro yes (xacro={})"
        top.refuse("urdf", f"expected a URDF, got a xacro, which is a program: {how}")
    spec = read_urdf(path.parent / file, base_link, tip_link, xacro)
    return spec | {key: entry for key, entry in value.items() if key not in ("urdf", "base_link", "tip_link")}
