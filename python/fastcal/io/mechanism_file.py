# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots with closed loops from the files of other programs: MJCF, SDF, and URDF with loops beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from fastcal.errors import ParseError
from fastcal.io.fields import Fields
from fastcal.io.loop_lists import add_closing_frames, add_lists, closing_frame, onshape_motors, urdf_of
from fastcal.io.mechanism import EVERY, Mechanism, Pins, Ratio
from fastcal.io.mechanism_closing import close
from fastcal.io.mechanism_spec import mechanism_spec
from fastcal.io.mjcf_file import read_mjcf
from fastcal.io.sdf_file import read_sdf
from fastcal.io.urdf_mechanism import LOOP_ELEMENTS, read_urdf_mechanism
from fastcal.io.xml_text import read_xml
from fastcal.robot.core_model import pose
from fastcal.units import to_si

Spec = dict[str, Any]
ENDINGS = (".sdf", ".mjcf", ".xml")


def read_mechanism(path: Path, base_link: str = "", tip_link: str = "") -> Spec:
    """The content of a robot file of what an MJCF or SDF file holds; not yet checked.

    Raises:
        ParseError: What closes its loops, its motors or its ends are not understood; one sentence.
    """
    of, motors = _mechanism(path)
    driven = _motors(of, motors)
    if path.suffix.lower() == ".urdf":
        close(of, driven)
    return mechanism_spec(of, driven, base_link, tip_link)


def with_lists(value: Spec, path: Path, base_link: str = "", tip_link: str = "") -> Spec:
    """The same of a list of frames that coincide (`loop_lists`) and the URDF beside it.

    Raises:
        ParseError: A frame, joint or type is not known, or the ends are not; one sentence.
    """
    of, _ = _mechanism(urdf_of(path))
    of.path = str(path)
    return mechanism_spec(of, add_lists(of, value, path), base_link, tip_link)


def with_loops(value: Spec, path: Path) -> Spec:
    """A robot file that names a URDF, SDF or MJCF and gives its `motors` and, by the names of links, `loops`.

    Raises:
        ParseError: Something is missing, unknown or invalid; the sentence names the key.
    """
    top = Fields(value, "", path)
    ends = {key: top.text(key) if top.has(key) else "" for key in ("base_link", "tip_link")}
    file = path.parent / top.text("urdf")
    of, motors = _mechanism(file)
    if (given := top.optional("motors")) is not None:
        if not isinstance(given, list) or not all(isinstance(name, str) for name in given):
            top.fail("motors", "a list of names of joints", given)
        motors = given
    loops = top.take("loops", [])
    if not isinstance(loops, list):
        top.fail("loops", "a list", loops)
    ends_given = {str(entry.get("from")) for entry in loops if isinstance(entry, dict)}
    of.pins = [pins for pins in of.pins if not ends_given & set(pins.links)]  # the file's own word on closing frames
    closes_itself = bool(of.pins) and not loops and file.suffix.lower() == ".urdf"
    for k, entry in enumerate(loops):
        _add_loop(of, Fields(entry, f"loops[{k + 1}]", path), f"loop{k + 1}")
    _start(of, top)
    driven = _motors(of, motors)
    if closes_itself:
        close(of, driven)
    known = ("urdf", "base_link", "tip_link", "motors", "loops", "start_deg", "start_mm")
    return mechanism_spec(of, driven, **ends) | {k: v for k, v in value.items() if k not in known}


def closed_by_itself(xml: str, path: Path) -> None:
    """Refuses a URDF that holds a loop, which the reader of serial arms would open without a word."""
    if "<!ENTITY" in xml:
        return
    try:
        root = _parsed(xml)
    except (ET.ParseError, LookupError, ValueError):
        return  # for the reader to say
    by_child: dict[str, str] = {}
    for joint in root.findall("joint"):
        child = joint.find("child")
        link, name = "" if child is None else child.get("link", ""), joint.get("name", "")
        if link and link in by_child:
            raise ParseError(
                f"joints '{by_child[link]}' and '{name}' both carry link '{link}', a closed loop; name the URDF "
                "in a robot file (kinematics: urdf, urdf: FILE) with its motors: [...] and tip_link",
                path,
            )
        by_child[link] = name
    closing = [f"<{tag}> '{each.get('name', '')}' closes" for tag in LOOP_ELEMENTS for each in root.findall(tag)]
    closing += [f"frames '{name}_1' and '{name}_2' close" for name in [closing_frame(xml)] if name]
    if closing:
        raise ParseError(
            f"{closing[0]} a loop, and nothing says which joints have motors; name the URDF in a robot file "
            "(kinematics: urdf, urdf: FILE) with its motors: [...] and tip_link",
            path,
        )


def _parsed(text: str) -> ET.Element:
    return ET.fromstring(text.encode() if text.startswith("<?xml") else text)  # noqa: S314 - entities are refused


def _root(path: Path) -> ET.Element:
    text = read_xml(path)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ParseError("declares entities, which are not read", path)
    try:
        return _parsed(text)
    except (ET.ParseError, LookupError, ValueError) as error:
        raise ParseError(f"is no XML: {error}", path) from None


def _include(element: ET.Element, path: Path, seen: set[Path]) -> None:
    """Puts what files hold in the place of MJCF's <include>; they are named from the folder of the first file."""
    children = list(element)
    element[:] = []
    for child in children:
        if child.tag != "include":
            _include(child, path, seen)
            element.append(child)
            continue
        other = path.parent / child.get("file", "")
        if other.resolve() in seen:
            raise ParseError(f"includes '{child.get('file', '')}' twice", path)
        seen.add(other.resolve())
        included = _root(other)
        _include(included, path, seen)
        element.extend(included)


def _mechanism(path: Path) -> tuple[Mechanism, list[str] | None]:
    root = _root(path)
    try:
        if root.tag == "mujoco":
            _include(root, path, {path.resolve()})
            return read_mjcf(str(path), root)
        if root.tag == "sdf":
            return read_sdf(str(path), root), None
        if root.tag == "robot":
            of = read_urdf_mechanism(str(path), root)
            add_closing_frames(of)
            return of, onshape_motors(path, of) if of.pins else None
    except KeyError as error:
        raise ParseError(f"an element lacks {error}", path) from None
    except ValueError as error:
        raise error if isinstance(error, ParseError) else ParseError(f"a number is not one: {error}", path) from None
    raise ParseError(f"expected MJCF (mujoco), SDF (sdf) or URDF (robot), got <{root.tag:.40}>", path)


def _motors(of: Mechanism, given: list[str] | None) -> list[str]:
    if given:
        return given
    moving = [joint.name for joint in of.joints if joint.kind != "fixed"]
    if given is None and not of.pins and len({joint.child for joint in of.joints}) == len(of.joints):
        return [name for name in moving if name not in {ratio.driven for ratio in of.ratios}]  # a tree without loops
    return of.fail(
        "nothing says which joints have motors; name the file in a robot file (kinematics: urdf, urdf: FILE, "
        f"tip_link: ...) with motors: [...] of {', '.join(moving[:20])}"
    )


def _start(of: Mechanism, top: Fields) -> None:
    """`start_deg` and `start_mm`: positions by joint in which the loops nearly close."""
    joints = {joint.name: joint for joint in of.joints}
    for unit in ("deg", "mm"):
        given = top.take(f"start_{unit}", {})
        if not isinstance(given, dict) or not given.keys() <= joints.keys():
            top.fail(f"start_{unit}", "a position by the name of each joint", given)
        for name, value in given.items():
            joints[name].start = to_si(top.checked_number(f"start_{unit}.{name}", value), unit)


def _add_loop(of: Mechanism, fields: Fields, usual: str) -> None:
    name = fields.text("name", usual)
    if fields.has("ratios"):
        driven = fields.text("joint")
        kinds = {joint.name: joint.kind for joint in of.joints}
        ratios = fields.take("ratios")
        if driven not in kinds or not isinstance(ratios, dict) or not set(ratios) <= set(kinds):
            fields.fail("ratios", "a ratio by the name of each joint that turns another", ratios)
        unit = "mm" if kinds[driven] == "prismatic" else "deg"
        offset = to_si(fields.quantity("offset", unit, 0.0), unit)
        checked = {key: fields.checked_number(f"ratios.{key}", ratio) for key, ratio in ratios.items()}
        of.ratios.append(Ratio(name, driven, checked, offset))
        fields.done()
        return
    ends = [of.frame(fields.text(key)) for key in ("from", "to")]
    places = [T @ pose(fields.frame(f"{end}_")) for end, (_, T) in zip(("from", "to"), ends, strict=True)]
    links = (ends[0][0], ends[1][0])
    if fields.has_quantity("length", "mm"):
        of.pins.append(Pins(name, links, (places[0], places[1]), length_mm=fields.quantity("length", "mm")))
    else:
        fixed = fields.take("fixed")
        if not isinstance(fixed, list) or not fixed or any(each not in EVERY for each in fixed):
            fields.fail("fixed", f"a list of {', '.join(EVERY)}", fixed)
        of.pins.append(Pins(name, links, (places[0], places[1]), tuple(fixed)))
    fields.done()
