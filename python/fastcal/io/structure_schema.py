# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The key `structure` of a robot file: the arm as a frame of beams, tied to the frames of its chain.

Checking a canonical structure gives the same structure, bit for bit.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fastcal.beams.element_stiffness import end_stiffness
from fastcal.errors import InvalidInput
from fastcal.io.fields import Fields
from fastcal.robot.structure import DIRECTIONS, frame_names

Spec = dict[str, Any]

DEFAULT_GROUP = "structure"
MAX_ENTRIES = 1000

_SECTION = (("young", "pa"), ("shear", "pa"), ("area", "m2"), ("inertia_y", "m4"), ("inertia_z", "m4"),
            ("torsion", "m4"))  # fmt: skip
_SHEAR_AREAS = (("shear_area_y", "m2"), ("shear_area_z", "m2"))  # 0: stiff in shear
_UPPER = np.triu_indices(6)
_SYMMETRY = 1e-6  # of the root of the two diagonal entries: what a finite-element program rounds off


def check_structure(value: Any, joint_types: list[str], path: Any) -> Spec:
    """The canonical form of a structure; an empty one stays empty.

    Raises:
        ParseError: A key is missing, unknown or invalid; the sentence names it.
    """
    top = Fields(value, "structure", path)
    if not value:
        return {}
    count = len(joint_types)
    spec: Spec = {"nodes": [_node(fields, count) for fields in top.entries("nodes", 2, MAX_ENTRIES)]}
    nodes = _names(top, "nodes", spec["nodes"])
    spec["sections"] = {name: _section(fields) for name, fields in _mappings(top, "sections")}
    spec["tables"] = {name: _table(fields, joint_types) for name, fields in _mappings(top, "tables")}
    spec["elements"] = [_element(fields, spec, nodes, count) for fields in top.entries("elements", 1, MAX_ENTRIES)]
    _names(top, "elements", spec["elements"])
    top.done()
    for kind in ("sections", "tables"):
        unused = set(spec[kind]) - {element.get(kind.removesuffix("s")) for element in spec["elements"]}
        if unused:
            top.refuse(f"{kind}.{min(unused)}", "no element has it")
        if not spec[kind]:
            del spec[kind]
    movers = [node for node in spec["nodes"] if node.get("moves")]
    if not movers:
        top.refuse("nodes", "no node moves a frame of the chain; give one of them moves: FRAME")
    if not any("payload" in node.get("carries", []) for node in spec["nodes"]):
        last = max(movers, key=lambda node: frame_names(count).index(node["moves"]))
        last["carries"] = [*last.get("carries", []), "payload"]
    return spec


def _mappings(top: Fields, key: str) -> list[tuple[str, Fields]]:
    value = top.take(key, {})
    if not isinstance(value, dict):
        top.fail(key, "a mapping of names to values", value)
    return [(str(name), Fields(entry, f"{top.where}.{key}.{name}", top.path)) for name, entry in value.items()]


def _names(top: Fields, key: str, entries: list[Spec]) -> list[str]:
    names = [entry["name"] for entry in entries]
    for i, name in enumerate(names):
        if name in names[:i]:
            top.refuse(f"{key}[{i}].name", f"the name '{name:.60}' is given twice")
    return names


def _node(fields: Fields, joint_count: int) -> Spec:
    """Where a node stands, what it moves, what hangs on it, how it is held."""
    frames = frame_names(joint_count)
    node: Spec = {"name": fields.text("name"), "frame": _frame(fields, "frame", frames)}
    node["xyz_mm"] = fields.quantities("xyz", "mm", 3, [0.0, 0.0, 0.0])
    node |= {key: _frame(fields, key, frames) for key in ("origin", "moves") if fields.has(key)}
    if (mass := fields.quantity("mass", "kg", 0.0)) != 0:
        node["mass_kg"] = _not_negative(fields, "mass_kg", mass)
    known = ["payload", *(f"link{i + 1}" for i in range(joint_count))]
    if carries := fields.take("carries", []):
        if not isinstance(carries, list) or any(name not in known for name in carries):
            fields.fail("carries", f"a list of payload and link1 to link{joint_count}", carries)
        node["carries"] = list(carries)
    if fields.has("held"):
        node["held"] = _held(fields)
    fields.done()
    return node


def _frame(fields: Fields, key: str, frames: list[str]) -> str:
    name = fields.text(key)
    if name not in frames:
        fields.fail(key, f"base, joint1 to {frames[-3]}, link1 to {frames[-2]} or tool", name)
    return name


def _held(fields: Fields) -> str:
    held = fields.text("held")
    if held != "all" and (not set(held.split()) <= set(DIRECTIONS)):
        fields.fail("held", f"all, or some of {' '.join(DIRECTIONS)}", held)
    return held


def _section(fields: Fields) -> Spec:
    """E, G, A, I_y, I_z, J and the shear areas."""
    section: Spec = {}
    for name, unit in _SECTION:
        key = f"{name}_{unit}"
        section[key] = fields.quantity(name, unit)
        if not section[key] > 0:
            fields.fail(key, "a number above 0", section[key])
    for name, unit in _SHEAR_AREAS:
        if (area := fields.quantity(name, unit, 0.0)) != 0:
            section[f"{name}_{unit}"] = _not_negative(fields, f"{name}_{unit}", area)
    fields.done()
    return section


def _table(fields: Fields, joint_types: list[str]) -> Spec:
    """Stiffness sampled on a grid over a joint that turns the element and one that extends it, angle by angle."""
    table: Spec = {}
    count = 1
    for kind, joint_type, unit in (("angle", "revolute", "deg"), ("extension", "prismatic", "mm")):
        if not fields.has(f"{kind}_joint"):
            continue
        joint = table[f"{kind}_joint"] = fields.count(f"{kind}_joint", 1, len(joint_types))
        if joint_types[joint - 1] != joint_type:
            fields.fail(f"{kind}_joint", f"a {joint_type} joint", joint)
        key = f"{kind}_{unit}"
        values = fields.take(key)
        if not isinstance(values, list) or len(values) < 2:
            fields.fail(key, "a list of at least 2 numbers", values)
        table[key] = fields.checked_vector(key, values, len(values))
        table[f"{kind}_degree"] = fields.count(f"{kind}_degree", 0, len(values) - 1)
        count *= len(values)
    if not table:
        fields.refuse("", "angle_joint or extension_joint is missing; a stiffness that depends on none is a matrix_si")
    matrices = fields.take("matrices_si")
    if not isinstance(matrices, list) or len(matrices) != count:
        fields.fail("matrices_si", f"a list of {count} matrices, one for each place of the grid", matrices)
    table["matrices_si"] = [_matrix(fields, f"matrices_si[{i}]", matrix) for i, matrix in enumerate(matrices)]
    fields.done()
    return table


def _matrix(fields: Fields, key: str, value: Any) -> list[float]:
    """The upper triangle, 21 numbers row by row, of K (6 x 6): stiffness of the end, start clamped; N, m, rad."""
    sizes = {21: 0, 36: 6, 144: 12}
    if not isinstance(value, list) or len(value) not in sizes:
        fields.fail(key, "21 numbers (the upper triangle), 36 (6 x 6) or 144 (12 x 12)", value)
    numbers = fields.checked_vector(key, value, len(value))
    K = np.zeros((6, 6))
    if len(numbers) == 21:
        K[_UPPER] = numbers
        K = K + np.triu(K, 1).T
    else:
        size = sizes[len(numbers)]
        try:
            K = end_stiffness("it", np.reshape(numbers, (size, size)), 6)
        except InvalidInput as error:
            fields.refuse(key, str(error))
    diagonal = np.diag(K)
    if not (diagonal > 0).all() or np.linalg.eigvalsh(K / np.sqrt(np.outer(diagonal, diagonal)))[0] <= 0:
        fields.refuse(key, "the stiffness of the end with the start clamped must be positive definite")
    if (np.abs(K - K.T) > _SYMMETRY * np.sqrt(np.outer(diagonal, diagonal))).any():
        fields.refuse(key, "a stiffness must be symmetric")
    return [float(x) for x in ((K + K.T) / 2)[_UPPER]]


def _element(fields: Fields, spec: Spec, nodes: list[str], joint_count: int) -> Spec:
    """From node to node: what it is made of, what it weighs, where it is hinged, and the side of its local z."""
    element: Spec = {"name": fields.text("name")}
    for end in ("start", "end"):
        element[end] = fields.text(end)
        if element[end] not in nodes:
            fields.fail(end, f"one of the nodes {', '.join(nodes)}", element[end])
    if element["start"] == element["end"]:
        fields.fail("end", "another node than its start", element["end"])
    element |= _stiffness(fields, spec)
    element["mass_kg"] = _not_negative(fields, "mass_kg", fields.quantity("mass", "kg", 0.0))
    element["group"] = fields.text("group", DEFAULT_GROUP)
    if not element["group"].isidentifier():
        fields.fail("group", "a word of letters, digits and _", element["group"])
    element["up"] = fields.vector("up", 3, [0.0, 0.0, 1.0])
    if not math.hypot(*element["up"]) > 0:
        fields.fail("up", "a direction", str(element["up"]))
    start = next(node for node in spec["nodes"] if node["name"] == element["start"])
    element["up_frame"] = (
        _frame(fields, "up_frame", frame_names(joint_count)) if fields.has("up_frame") else start["frame"]
    )
    for key in ("start_hinge", "end_hinge"):
        if fields.has(key):
            element[key] = fields.text(key)
            if not set(element[key]) <= set("xyz") or len(set(element[key])) != len(element[key]):
                fields.fail(key, "the local axes it turns about, some of x, y, z", element[key])
    fields.done()
    return element


def _stiffness(fields: Fields, spec: Spec) -> Spec:
    """What an element is made of: the name of a section or table, or its own matrix."""
    given = [key for key in ("section", "table", "matrix_si") if fields.has(key)]
    if len(given) != 1:
        fields.refuse("", f"expected one of section, table and matrix_si, got {' and '.join(given) or 'none'}")
    (key,) = given
    if key == "matrix_si":
        return {key: _matrix(fields, key, fields.take(key))}
    name, known = fields.text(key), spec[key + "s"]
    if name not in known:
        fields.fail(key, f"one of {', '.join(known)}" if known else f"a {key} that is given", name)
    return {key: name}


def _not_negative(fields: Fields, key: str, value: float) -> float:
    if value < 0:
        fields.fail(key, "a number that is not negative", value)
    return value
