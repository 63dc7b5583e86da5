# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The key `structure`: what is refused and in which words, and its canonical form."""

import copy
from typing import Any

import numpy as np
import pytest

from fastcal.errors import ParseError
from fastcal.io.robot_schema import check_spec
from fastcal.robot.robot import Robot

Spec = dict[str, Any]

TUBE = {"young_pa": 7e10, "shear_pa": 2.6e10, "area_m2": 3e-3, "inertia_y_m4": 8e-6, "inertia_z_m4": 8e-6,
        "torsion_m4": 1.6e-5}  # fmt: skip
STIFF = np.diag([1e8, 2e6, 2e6, 1e5, 3e5, 3e5])
BENT = STIFF + 2e5 * (np.eye(6)[[1]].T @ np.eye(6)[[5]] + np.eye(6)[[5]].T @ np.eye(6)[[1]])


def bending() -> Spec:
    """An arm of two joints, the second one a slider, with two beams."""
    turn = {"type": "revolute", "min_deg": -90, "max_deg": 90, "theta_deg": 0, "d_mm": 1, "a_mm": 2, "alpha_deg": 3}
    slider = {"type": "prismatic", "min_mm": 0, "max_mm": 500, "theta_deg": 0, "d_mm": 0, "a_mm": 0, "alpha_deg": 0}
    spec: Spec = {"name": "arm", "kinematics": "dh", "joints": [turn, slider]}
    spec["structure"] = {
        "nodes": [
            {"name": "foot", "frame": "base", "held": "all"},
            {"name": "knee", "frame": "joint1", "xyz_mm": [100, 0, 0]},
            {"name": "tip", "frame": "link2", "xyz_mm": [300, 0, 0], "moves": "link2"},
        ],
        "sections": {"tube": dict(TUBE)},
        "tables": {"slide": {"extension_joint": 2, "extension_mm": [0, 500], "extension_degree": 1,
                             "matrices_si": [BENT.ravel().tolist(), STIFF.ravel().tolist()]}},
        "elements": [
            {"name": "thigh", "start": "foot", "end": "knee", "section": "tube", "mass_kg": 5},
            {"name": "shin", "start": "knee", "end": "tip", "table": "slide", "mass_kg": 3, "group": "shins"},
        ],
    }  # fmt: skip
    return spec


def changed(spec: Spec, place: str, value: Any) -> Spec:
    """A copy with the value at a place such as `nodes.0.frame` of its structure set, or deleted where it is `...`."""
    spec = copy.deepcopy(spec)
    target: Any = spec["structure"]
    *path, last = place.split(".")
    for key in path:
        target = target[int(key)] if isinstance(target, list) else target[key]
    if value is ...:
        del target[last]
    else:
        target[int(last) if isinstance(target, list) else last] = value
    return spec


WRONG = [
    ("nodes.0.frame", "joint3", "[0].frame: expected base, joint1 to joint2, link1 to link2 or tool, got 'joint3'"),
    ("nodes.0.held", "ux up", "nodes[0].held: expected all, or some of ux uy uz rx ry rz, got 'ux up'"),
    ("nodes.1.name", "foot", "structure.nodes[1].name: the name 'foot' is given twice"),
    ("nodes.1.mass_kg", -1, "nodes[1].mass_kg: expected a number that is not negative, got -1.0"),
    ("nodes.1.carries", ["link3"], "nodes[1].carries: expected a list of payload and link1 to link2, got a list of 1"),
    ("nodes.2.moves", ..., "structure.nodes: no node moves a frame of the chain; give one of them moves: FRAME"),
    ("nodes.2.xyz", [0, 0, 1], "nodes[2]: xyz_mm and xyz give the same value twice"),
    ("elements.0.end", "toe", "elements[0].end: expected one of the nodes foot, knee, tip, got 'toe'"),
    ("elements.0.end", "foot", "elements[0].end: expected another node than its start, got 'foot'"),
    ("elements.0.section", "pipe", "elements[0].section: expected one of tube, got 'pipe'"),
    ("elements.0.section", ..., "elements[0]: expected one of section, table and matrix_si, got none"),
    ("elements.0.table", "slide", "elements[0]: expected one of section, table and matrix_si, got section and table"),
    ("elements.0.group", "a b", "elements[0].group: expected a word of letters, digits and _, got 'a b'"),
    ("elements.0.up", [0, 0, 0], "elements[0].up: expected a direction, got '[0.0, 0.0, 0.0]'"),
    ("elements.0.end_hinge", "zz", "elements[0].end_hinge: expected the local axes it turns about, some of x, y, z"),
    ("elements.0.mass_t", 3, "elements[0]: mass_kg and mass_t give the same value twice"),
    ("sections.tube.area_m2", 0, "sections.tube.area_m2: expected a number above 0, got 0.0"),
    ("sections.pipe", TUBE, "structure.sections.pipe: no element has it"),
    ("sections.tube.youngs_pa", 7e10, "sections.tube: the key 'youngs_pa' is not known; did you mean 'young_pa'?"),
    ("tables.slide.extension_joint", 1, "tables.slide.extension_joint: expected a prismatic joint, got 1"),
    ("tables.slide.extension_joint", ..., "tables.slide: angle_joint or extension_joint is missing"),
    ("tables.slide.extension_degree", 2, "extension_degree: expected a whole number from 0 to 1, got 2"),
    ("tables.slide.matrices_si", [[1]], "matrices_si: expected a list of 2 matrices, one for each place of the grid"),
    ("tables.slide.matrices_si.1", [1] * 20, "matrices_si[1]: expected 21 numbers (the upper triangle), 36 (6 x 6)"),
    ("tables.slide.matrices_si.1", [1] * 21, "matrices_si[1]: the stiffness of the end with the start clamped must be"),
    ("tables.slide.matrices_si.1", (np.eye(6) + 0.1 * np.tri(6)).ravel().tolist(), "stiffness must be symmetric"),
    ("tables.slide.matrices_si.1", np.eye(12).ravel().tolist(), "is not the matrix of a free element"),
    ("springs", [], "structure: the key 'springs' is not known"),
]  # fmt: skip


@pytest.mark.parametrize(("place", "value", "sentence"), WRONG)
def test_invalid_input_is_refused_in_one_sentence(place: str, value: Any, sentence: str) -> None:
    with pytest.raises(ParseError) as caught:
        check_spec(changed(bending(), place, value), "arm.yaml")
    assert str(caught.value).startswith("arm.yaml: structure")
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_canonical_form_is_its_own() -> None:
    spec = check_spec(bending())
    structure = spec["structure"]
    assert structure["nodes"][2]["carries"] == ["payload"]
    assert (
        structure["elements"][0] | {"group": "structure", "up": [0.0, 0.0, 1.0], "up_frame": "base"}
        == structure["elements"][0]
    )
    assert [len(matrix) for matrix in structure["tables"]["slide"]["matrices_si"]] == [21, 21]
    assert repr(check_spec(copy.deepcopy(spec))) == repr(spec)
    assert check_spec(bending() | {"structure": {}})["structure"] == {}


def test_matrices_in_three_forms_are_the_same() -> None:
    lever = np.eye(6)
    lever[3:, :3] = [[0, 0, 0], [0, 0, -0.3], [0, 0.3, 0]]  # what a force at the end is at the start, 0.3 m along x
    whole = np.block([[lever @ BENT @ lever.T, -lever @ BENT], [-BENT @ lever.T, BENT]])
    forms = [BENT[np.triu_indices(6)].tolist(), BENT.ravel().tolist(), whole.ravel().tolist()]
    specs = [check_spec(changed(bending(), "tables.slide.matrices_si.0", form)) for form in forms]
    assert repr(specs[0]) == repr(specs[1]) == repr(specs[2])


def test_an_unknown_frame_is_refused_when_the_robot_is_made() -> None:
    with pytest.raises(ValueError, match="node knee is free: no element ends there"):
        Robot(check_spec(changed(changed(bending(), "elements.0.end", "tip"), "elements.1.start", "foot")))
