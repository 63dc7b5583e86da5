# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The beams of an arm: from the key `structure` of a canonical robot spec to the core, edge units to SI.

The effect `beam_gravity` turns them into twists on the chain; `fastcal.io.structure_schema` says what the keys mean.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.place import place_of
from fastcal.units import to_si

Spec = dict[str, Any]

_SECTION = (
    "young_pa", "area_m2", "inertia_z_m4", "inertia_y_m4", "torsion_m4", "shear_pa", "shear_area_y_m2",
    "shear_area_z_m2",
)  # fmt: skip
DIRECTIONS = ("ux", "uy", "uz", "rx", "ry", "rz")


def frame_names(joint_count: int) -> list[str]:
    """The frames of a chain in its order: base, joint1, link1, ..., tool."""
    return ["base", *(f"{kind}{i}" for i in range(1, joint_count + 1) for kind in ("joint", "link")), "tool"]


def build_structure(spec: Spec, frames: list[str]) -> _core.ArmStructure | None:
    """The core's structure; None where the robot file has none.

    Args:
        spec: The canonical `structure`.
        frames: Names of the chain's frames in its order, "base" to "tool".

    Raises:
        InvalidInput: The nodes and elements are no frame.
    """
    if not spec:
        return None
    tables = list(spec.get("tables", {}))
    nodes = [node["name"] for node in spec["nodes"]]
    groups = list(dict.fromkeys(element["group"] for element in spec["elements"]))
    elements = []
    for element in spec["elements"]:
        section = spec.get("sections", {}).get(element.get("section", ""))
        elements.append(
            _core.StructureElement(
                name=element["name"],
                start=nodes.index(element["start"]),
                end=nodes.index(element["end"]),
                section=None if section is None else [float(section.get(key, 0.0)) for key in _SECTION],
                mass=element["mass_kg"],
                hinges=[_axes(element.get(key, "")) for key in ("start_hinge", "end_hinge")],
                group=groups.index(element["group"]),
                up_frame=frames.index(element["up_frame"]),
                up=np.asarray(element["up"], dtype=float),
                stiffness=full_matrix(element["matrix_si"]) if "matrix_si" in element else None,
                table=tables.index(element["table"]) if "table" in element else -1,
            )
        )
    return _core.ArmStructure(
        [_node(node, frames) for node in spec["nodes"]],
        elements,
        [_table(spec["tables"][name]) for name in tables],
        groups,
    )


def full_matrix(upper: list[float]) -> FloatArray:
    """(6, 6) of the upper triangle row by row."""
    K = np.zeros((6, 6))
    K[np.triu_indices(6)] = upper
    return K + np.triu(K, 1).T


def _node(node: Spec, frames: list[str]) -> _core.StructureNode:
    carries = node.get("carries", [])
    held = DIRECTIONS if node.get("held") == "all" else node.get("held", "").split()
    return _core.StructureNode(
        name=node["name"],
        origin=frames.index(node["origin"] if "origin" in node else node["frame"]),
        frame=frames.index(node["frame"]),
        position=to_si(np.asarray(node["xyz_mm"], dtype=float), "mm"),
        moves=frames.index(node["moves"]) if "moves" in node else -1,
        mass=node.get("mass_kg", 0.0),
        links=[place_of(name).index for name in carries if name != "payload"],
        carries_payload="payload" in carries,
        held=sum(1 << DIRECTIONS.index(name) for name in set(held)),
    )


def _axes(hinge: str) -> int:
    return sum(1 << "xyz".index(axis) for axis in hinge)


def _table(table: Spec) -> tuple[_core.StiffnessTable, int, int]:
    """The fitted table over its grid, and the joints (from 0, -1: none) that it depends on."""
    angle = to_si(np.asarray(table.get("angle_deg", [0.0]), dtype=float), "deg")
    extension = to_si(np.asarray(table.get("extension_mm", [0.0]), dtype=float), "mm")
    angles, extensions = np.meshgrid(angle, extension, indexing="ij")
    matrices = np.array([full_matrix(upper).ravel() for upper in table["matrices_si"]])
    fitted = _core.StiffnessTable(
        angles.ravel(), extensions.ravel(), matrices, table.get("angle_degree", 0), table.get("extension_degree", 0)
    )
    return fitted, table.get("angle_joint", 0) - 1, table.get("extension_joint", 0) - 1
