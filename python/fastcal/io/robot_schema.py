# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a robot file may hold, and its canonical form: every key in its place, defaults filled in, mm and degrees.

Checking a canonical spec gives the same spec, bit for bit.
"""

from __future__ import annotations

import math
import os
from typing import Any

from fastcal.correction import Correction
from fastcal.io.calibration_schema import check_calibration
from fastcal.io.fields import REQUIRED, Fields
from fastcal.io.known_distances import check_known_distance
from fastcal.io.loop_schema import check_branch, check_loops, check_order
from fastcal.io.pendant_schema import check_pendant
from fastcal.io.rig_schema import ARM, check_arm_rig, check_cell_names, on_links
from fastcal.io.structure_schema import check_structure
from fastcal.io.urdf_links import links_of

Spec = dict[str, Any]
KINDS = ("dh", "mdh", "poe", "urdf")
MAX_JOINTS = 100

_ZERO = [0.0, 0.0, 0.0]
_STANDARD_GRAVITY = [0.0, 0.0, -9.80665]
_UNIT_TOLERANCE = 1e-6  # a direction typed with seven digits
_ROUNDED_KG_M2 = 1e-12  # moments of a link without mass, as iCub's URDF has them: -5e-20
_EXACT = 1e-12  # what is this near is left as it is, so that a file loads back bit for bit


def check_spec(value: Any, path: str | os.PathLike[str] = "robot") -> Spec:
    """The canonical form of a robot given as plain data.

    Args:
        value: What the file holds; for `kinematics: urdf` with its joints already read.
        path: Named in messages.

    Raises:
        ParseError: Something is missing, unknown or invalid; the sentence names the key.
    """
    top = Fields(value, "", path)
    spec: Spec = {"name": top.text("name"), "kinematics": top.choice("kinematics", KINDS)}
    kind = spec["kinematics"]
    joints = top.entries("joints", 1, MAX_JOINTS)
    spec["joints"] = [_joint(fields, kind, len(joints)) for fields in joints]
    _check_mimics(spec["joints"], joints)
    check_order(spec["joints"], joints, kind)
    spec |= _end_of_chain(top, kind)
    if kind == "urdf":
        _check_joint_names(spec["joints"], joints)
    spec["coupling"] = _coupling(top, len(joints))
    if top.has("pendant"):
        spec["pendant"] = check_pendant(top.entries("pendant", 0, len(joints)), spec["joints"])
    spec["base"] = _frame(top, "base")
    spec["tool"] = _frame(top, "tool")
    if loops := check_loops(top.entries("loops", 0, 1000), spec["joints"], spec["tool"]):
        spec["loops"] = loops
    payload = top.inner("payload", {})
    spec["payload"] = {"com_mm": payload.quantities("com", "mm", 3, _ZERO)}
    payload.done()
    spec["gravity_m_s2"] = top.quantities("gravity", "m_s2", 3, _STANDARD_GRAVITY)
    spec["gravity_frame"] = top.choice("gravity_frame", ("base", "measuring"), "base")
    spec["wrench_frame"] = top.choice("wrench_frame", ("base", "flange", "tool"), "base")
    if (compensator := top.optional("compensator")) is not None:
        spec["compensator"] = _compensator(Fields(compensator, "compensator", path), len(joints))
    if (equilibrium := top.optional("equilibrium")) is not None:
        if not isinstance(equilibrium, bool):
            top.fail("equilibrium", "true or false", equilibrium)
        spec["equilibrium"] = equilibrium
    spec["effects"] = [_effect(fields) for fields in top.entries("effects", 0, 1000)]
    spec["structure"] = check_structure(top.take("structure", {}), [joint["type"] for joint in spec["joints"]], path)
    if top.has("known_distances"):
        spec["known_distances"] = [check_known_distance(fields) for fields in top.entries("known_distances", 0, 1000)]
    spec |= check_arm_rig(top, len(joints)) | check_cell_names(top)
    if (of_poses := top.optional("of_poses")) is not None:
        if of_poses is not True:
            top.fail("of_poses", "true, or no such key", of_poses)
        spec["of_poses"] = True
    spec |= _additions(top, kind, spec["joints"])
    top.done()
    return on_links(spec, links_of(ARM, spec), top)


def _additions(top: Fields, kind: str, joints: list[Spec]) -> Spec:
    """What fastcal adds: uncertainties, the correction, what it was made by, notes, and the URDF that it came from."""
    path = top.path
    spec: Spec = {}
    if top.has("calibration"):
        spec["calibration"] = check_calibration(top.inner("calibration"), joints)
    if (correction := top.optional("correction")) is not None:
        spec["correction"] = _correction(correction, path)
    if made_by := top.plain("made_by", {}):
        if not isinstance(made_by, dict):
            top.fail("made_by", "a mapping", made_by)
        spec["made_by"] = dict(made_by)
    if notes := top.plain("notes", []):
        if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
            top.fail("notes", "a list of texts", notes)
        spec["notes"] = notes
    if (source := top.optional("source")) is not None:
        if kind != "urdf":
            top.refuse("source", "the URDF of a robot goes with kinematics: urdf")
        spec["source"] = _source(Fields(source, "source", path))
    return spec


def _end_of_chain(top: Fields, kind: str) -> Spec:
    """The flange where the rows do not reach it: at q = 0 in the base (poe), else in the frame of the last joint."""
    if kind == "poe":
        if top.has("flange"):
            top.refuse("flange", "goes with kinematics dh, mdh and urdf; home is the flange of a robot of kind poe")
        return {"home": _frame(top, "home", required=True)}
    return {"flange": _frame(top, "flange")} if kind == "urdf" or top.has("flange") else {}


def _source(fields: Fields) -> Spec:
    """The URDF that the joints were read from, so that they can be written back into it; or a UR file's hash."""
    if fields.has("ur_hash"):
        source: Spec = {"ur_hash": fields.text("ur_hash")}
        fields.done()
        return source
    source = {"base_link": fields.text("base_link"), "tip_link": fields.text("tip_link")}
    xml = fields.take("xml")
    if not isinstance(xml, str) or "<" not in xml:
        fields.fail("xml", "the text of a URDF", xml)
    fields.done()
    return source | {"xml": xml}


def _correction(value: Any, path: str | os.PathLike[str]) -> Correction | Spec:
    """Where a file's correction lies, beside it; the correction itself where the spec is of a robot."""
    if isinstance(value, Correction):
        return value
    fields = Fields(value, "correction", path)
    found = {"file": fields.text("file"), "sha256": fields.text("sha256")}
    if found["file"] in (".", "..") or set(found["file"]) & set("/\\:"):
        fields.fail("file", "the name of a file in the same folder", found["file"])
    fields.done()
    return found


def _frame(top: Fields, key: str, required: bool = False) -> Spec:
    fields = top.inner(key) if required else top.inner(key, {})
    frame = fields.frame()
    fields.done()
    return frame


def _joint(fields: Fields, kind: str, joint_count: int) -> Spec:
    """One joint: its type, the geometry of its kind, limits, gear, what drives it, link."""
    joint: Spec = {"name": fields.text("name")} if kind == "urdf" else {}
    joint["type"] = fields.choice("type", ("revolute", "prismatic"))
    revolute = joint["type"] == "revolute"
    if kind == "poe":
        joint |= _screw(fields, revolute)
    elif kind == "urdf":
        joint["origin"] = _frame(fields, "origin")
        joint["axis"] = _direction(fields, "axis")
    else:
        for name, unit in (("theta", "deg"), ("d", "mm"), ("a", "mm"), ("alpha", "deg")):
            joint[f"{name}_{unit}"] = fields.quantity(name, unit)
        joint["beta_deg"] = fields.quantity("beta", "deg", 0.0)
    unit, low, high = ("deg", -360.0, 360.0) if revolute else ("mm", REQUIRED, REQUIRED)
    joint[f"min_{unit}"] = fields.quantity("min", unit, low)
    joint[f"max_{unit}"] = fields.quantity("max", unit, high)
    if not joint[f"min_{unit}"] < joint[f"max_{unit}"]:
        got = f"{joint[f'min_{unit}']!r} and {joint[f'max_{unit}']!r}"
        fields.refuse("", f"min_{unit} must be below max_{unit}, got {got}")
    joint |= check_branch(fields, unit)
    if (ratio := fields.optional("motor_ratio")) is not None:
        joint["motor_ratio"] = fields.checked_number("motor_ratio", ratio)
        if ratio == 0:
            fields.fail("motor_ratio", "a number other than 0", ratio)
    if (mimic := fields.optional("mimic")) is not None:
        driven = Fields(mimic, f"{fields.where}.mimic", fields.path)
        joint["mimic"] = {
            "joint": driven.count("joint", 1, joint_count),
            "multiplier": driven.number("multiplier", 1.0),
        }
        joint["mimic"][f"offset_{unit}"] = driven.quantity("offset", unit, 0.0)
        driven.done()
    if (link := fields.optional("link")) is not None:
        joint["link"] = _link(Fields(link, f"{fields.where}.link", fields.path))
    fields.done()
    return joint


def _screw(fields: Fields, revolute: bool) -> Spec:
    """A POE joint: omega and point_mm or v_mm = -omega x point; prismatic: omega 0 and the unit direction v."""
    if not revolute:
        omega = fields.vector("omega", 3, _ZERO)
        if any(omega):
            fields.fail("omega", "[0, 0, 0] for a prismatic joint", str(omega))
        return {"omega": omega, "v": _direction(fields, "v"), "d_mm": fields.quantity("d", "mm", 0.0)}
    omega = _direction(fields, "omega")
    screw: Spec = {"omega": omega}
    if fields.has_quantity("v", "mm"):
        if fields.has_quantity("point", "mm"):
            fields.refuse("", "expected point_mm or v_mm, got both")
        screw["v_mm"] = _moment(fields, omega)
    else:
        screw["point_mm"] = fields.quantities("point", "mm", 3)
    return screw | {"theta_deg": fields.quantity("theta", "deg", 0.0)}


def _direction(fields: Fields, key: str) -> list[float]:
    """A unit vector; one typed with few digits is brought to length 1."""
    vector = fields.vector(key, 3)
    length = math.hypot(*vector)
    if abs(length - 1) > _UNIT_TOLERANCE:
        fields.refuse(key, f"expected a vector of length 1, got one of length {length:.9g}")
    return vector if abs(length - 1) <= _EXACT else [x / length for x in vector]


def _moment(fields: Fields, omega: list[float]) -> list[float]:
    """The moment v = -omega x point, perpendicular to omega; what rounding left along it is taken out."""
    v = fields.quantities("v", "mm", 3)
    along = sum(a * b for a, b in zip(omega, v, strict=True))
    scale = 1 + math.hypot(*v)
    if abs(along) > _UNIT_TOLERANCE * scale:
        fields.refuse("v_mm", f"must be perpendicular to omega (a hinge has no pitch), got {along:.9g} mm along it")
    return v if abs(along) <= _EXACT * scale else [x - along * w for x, w in zip(v, omega, strict=True)]


def _link(fields: Fields) -> Spec:
    link: Spec = {"mass_kg": fields.quantity("mass", "kg"), "com_mm": fields.quantities("com", "mm", 3, _ZERO)}
    if link["mass_kg"] < 0:
        fields.fail("mass_kg", "a mass that is not negative", link["mass_kg"])
    if fields.has_quantity("inertia", "kg_m2"):
        link["inertia_kg_m2"] = fields.quantities("inertia", "kg_m2", 6)  # xx, yy, zz, xy, xz, yz
        moments = link["inertia_kg_m2"][:3]
        if min(moments) < -_ROUNDED_KG_M2:
            fields.fail("inertia_kg_m2", "moments xx, yy, zz that are not negative", str(moments))
        link["inertia_kg_m2"][:3] = [max(moment, 0.0) for moment in moments]
    fields.done()
    return link


def _check_joint_names(joints: list[Spec], fields: list[Fields]) -> None:
    for i, joint in enumerate(joints):
        if any(joint["name"] == other["name"] for other in joints[:i]):
            fields[i].refuse("name", f"the name '{joint['name']:.60}' is given to two joints")


def _check_mimics(joints: list[Spec], fields: list[Fields]) -> None:
    """A joint follows one that moves by itself."""
    for i, joint in enumerate(joints):
        if "mimic" in joint and "mimic" in joints[joint["mimic"]["joint"] - 1]:
            own = joint["mimic"]["joint"] == i + 1
            fields[i].refuse(
                "mimic", f"joint {joint['mimic']['joint']} {'is the joint itself' if own else 'is driven too'}"
            )


def _coupling(top: Fields, joint_count: int) -> list[Spec]:
    """q_joint turns by ratio when q_source turns: nominal gear coupling c_ij."""
    coupling: list[Spec] = []
    for fields in top.entries("coupling", 0, joint_count * joint_count):
        entry: Spec = {key: fields.count(key, 1, joint_count) for key in ("joint", "source")}
        entry["ratio"] = fields.number("ratio")
        fields.done()
        if entry["joint"] == entry["source"]:
            fields.fail("source", f"another joint than joint {entry['joint']} itself", entry["source"])
        if any((e["joint"], e["source"]) == (entry["joint"], entry["source"]) for e in coupling):
            fields.refuse("", f"the coupling of joint {entry['joint']} to joint {entry['source']} is given twice")
        coupling.append(entry)
    return coupling


def _compensator(fields: Fields, joint_count: int) -> Spec:
    """A spring between an anchor and an arm that joint `joint` turns."""
    compensator: Spec = {
        "joint": fields.count("joint", 1, joint_count),
        "anchor_mm": fields.quantities("anchor", "mm", 3),
        "arm_mm": fields.quantities("arm", "mm", 3),
        "stiffness_n_m": fields.quantity("stiffness", "n_m"),
        "free_length_mm": fields.quantity("free_length", "mm"),
    }
    if compensator["stiffness_n_m"] <= 0:
        fields.fail("stiffness_n_m", "a stiffness above 0", compensator["stiffness_n_m"])
    fields.done()
    return compensator


def _effect(fields: Fields) -> Spec:
    """An effect of an identified model; its options belong to the effect itself."""
    effect: Spec = {"effect": fields.text("effect"), "owner": fields.text("owner")}
    parameters = fields.plain("parameters", {})
    if not isinstance(parameters, dict):
        fields.fail("parameters", "a mapping of names to values", parameters)
    checked: Spec = {}
    for name, given in parameters.items():
        where = f"{fields.where}.parameters.{name}"
        entry = Fields(given if isinstance(given, dict) else {"value": given}, where, fields.path)
        checked[name] = {"value": entry.number("value")}
        if (std := entry.optional("std")) is not None:
            checked[name]["std"] = entry.checked_number("std", std)
        checked[name] |= entry.rest()
    return effect | {"parameters": checked} | fields.rest()
