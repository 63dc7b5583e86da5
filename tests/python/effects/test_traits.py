# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What effects tell about themselves, asked of every one: nothing else in Python knows an effect by its name."""

import copy
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import _core
from fastcal.calibration.options_from_data import with_origins
from fastcal.compensation.programs import robot_without_measurement
from fastcal.conversion import convert
from fastcal.diagnosis.library import build_library, needs
from fastcal.diagnosis.plan import approached_joints
from fastcal.diagnosis.problem import with_nuisances
from fastcal.diagnosis.variants import other_forms
from fastcal.diagnosis.words import cause_in_words
from fastcal.effects import registered
from fastcal.effects.entries import build_effects, curve_of, effect_owners, traits_of
from fastcal.effects.registered import States, register_effect
from fastcal.effects.traits import Traits, filled
from fastcal.errors import InvalidInput
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.report.shop import kind_in_words
from fastcal.robot.robot import Robot

NAMES = _core.effect_names()


@pytest.fixture
def registry(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(registered, "_effects", {})
    return


def least_options(name: str) -> dict[str, Any]:
    steps = {step: {"at_s": 7000.0} for step in ("base_step", "tool_step", "zero_step", "range_step")}
    others = {"range_wave": {"period_mm": 400.0}, "base_settling": {"tau_s": 900.0}, "regressor": {"column": "tilt"}}
    return {**steps, **others, "gear_harmonic": {"order": 3.0}}.get(name, {})


@pytest.mark.parametrize("name", NAMES)
def test_every_trait_is_one_that_its_readers_know(name: str, arm: Robot, poses: Dataset) -> None:
    traits = traits_of(name)
    owners = effect_owners(name, arm.core)
    assert traits.phrase == traits.phrase.strip()
    for owner in owners:
        entry = {"effect": name, "owner": owner, **least_options(name)}
        assert cause_in_words(name, owner).endswith(f": {traits.phrase}")
        for columns in (True, False):
            text = needs(name, owner, columns=columns)
            assert text
            assert "{" not in text
        for variable in (*traits.depends_on, traits.plotted_over):
            assert re.fullmatch(r"\w+", filled(variable, owner)), variable
        given = with_origins(entry, arm, poses)
        (effect,) = build_effects([given], arm.core)
        decided = (set(traits.options_from_data) - {"reference"}) | set(effect.reference)
        assert (given != entry) == bool(decided - set(entry))
        assert effect.follows_loads == bool({"torque", "load"} & set(traits.depends_on))
        carried = {e["effect"] for e in with_nuisances([given], arm)} - {name}
        assert carried == ({"link_com", "link_mass"} if effect.follows_loads else set())
        for parameter in effect.parameters:
            assert kind_in_words(name, parameter.name) != "size"


@pytest.mark.parametrize("name", NAMES)
def test_a_library_names_causes_alone_and_says_what_data_lack(name: str, arm: Robot, poses: Dataset) -> None:
    traits, owners = traits_of(name), effect_owners(name, arm.core)
    bare = Dataset.from_arrays(poses.q)
    named = {n.owner for n in build_library(arm, poses).names if n.effect == name}
    lacking = build_library(arm, bare)
    if traits.role in ("nuisance", "curve", "scanned", "on request"):
        assert named == set()
        assert name not in {n.effect for n in lacking.names} | {u.effect for u in lacking.untestable}
        return
    assert named == (set() if traits.without_masses else set(owners))
    untestable = {u.owner: u.needs for u in lacking.untestable if u.effect == name}
    (effect, *_) = build_effects([{"effect": name, "owner": o} for o in owners], arm.core) or (None,)
    if (effect is not None and effect.data_columns) or traits.without_masses:
        assert untestable == {owner: filled(traits.needs_data, owner) for owner in owners}
    else:
        assert untestable == {}


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_is_converted_or_refused_and_compensated_or_left_out(
    name: str, arm: Robot, poses: Dataset, with_effects: Any
) -> None:
    # The frames of a URDF leave base and flange, of which the rows of a DH table move one.
    rows = convert(arm, "dh").spec
    stay = {
        "axes": True,
        "rows": False,
        "base": rows["base"] == arm.spec["base"],
        "flange": rows["tool"] == arm.spec["tool"],
    }
    assert stay["base"] != stay["flange"]
    refers_to = traits_of(name).refers_to
    for owner in effect_owners(name, arm.core)[:1]:
        model = with_effects(arm, with_origins({"effect": name, "owner": owner, **least_options(name)}, arm, poses))
        for kind, kept in (("urdf", refers_to != "rows"), ("dh", stay[refers_to])):
            moved = convert(model, kind, drop_effects=True)
            assert moved.dropped == (() if kept else (f"{name}@{owner}",))
            assert [e["effect"] for e in moved.spec["effects"]] == [name] * kept
            if not kept:
                with pytest.raises(InvalidInput, match=f"{name}@{owner}.* can't be carried"):
                    convert(model, kind)
        left = [e["effect"] for e in robot_without_measurement(model).spec["effects"]]
        assert left == ([] if traits_of(name).of_the_measurement else [name])


def test_sag_is_tried_by_its_evenly_spread_mass_where_no_masses_are_known(arm: Robot, poses: Dataset) -> None:
    bare = copy.deepcopy(arm.spec)
    for joint in bare["joints"]:
        joint.pop("link", None)
    one_load = replace(poses, payload=np.full(len(poses), 5.0))
    entries = [n.entry for n in build_library(Robot(bare), one_load).names if n.effect == "gravity_sag"]
    assert {e["owner"] for e in entries} == set(effect_owners("gravity_sag", arm.core))
    assert {e["moments"] for e in entries} == {"even"}


def test_the_curves_that_stand_for_no_cause_are_found_by_their_place() -> None:
    assert (curve_of("joint"), curve_of("frame")) == ("joint_profile", "regressor")


def test_directions_of_approach_are_planned_for_what_depends_on_them(
    arm: Robot, poses: Dataset, registry: None
) -> None:
    register_effect(
        "play",
        owners=["joint2"],
        parameters=[("size", "rad", 1e-4, "half the play")],
        basis=lambda states: np.zeros((len(states.q), 6, 1)),
        columns=["approach"],
        depends_on=["approach{n}"],
    )
    names = [n for n in build_library(arm, poses).names if n.key in {("play", "joint2"), ("backlash", "joint5")}]
    assert sorted(approached_joints(names)) == [1, 4]


def test_default_traits_of_an_effect_written_in_python(registry: None) -> None:
    def basis(states: States) -> Any:
        return np.zeros((len(states.q), 6, 1))

    given: dict[str, Any] = {"parameters": [("", "rad", 1e-4, "turn per level")], "basis": basis}
    register_effect("floor_heat", owners=["base"], columns=["temperature"], extra=["level"], **given)
    assert traits_of("floor_heat") == Traits(
        "floor heat",
        place="base",
        needs_data="temperature and level",
        shown_by="poses in which {owner} moves further",
        number="turn per level",
    )
    register_effect("floor_heat", owners=["joint1", "joint2"], follows_loads=True, **given)
    assert traits_of("floor_heat").place == "joint"
    assert traits_of("floor_heat").shown_by.startswith("a load about it")
    for owners in (["joint1", "tool"], ["robot"], lambda core: ["base"]):
        register_effect("floor_heat", owners=owners, **given)
        assert traits_of("floor_heat").place == "frame"


def test_an_invalid_trait_is_refused() -> None:
    for wrong, sentence in (
        (
            {"role": "villain"},
            "role of an effect must be one of cause, nuisance, load modifier, curve, scanned, .*, got 'villain'",
        ),
        ({"place": "moon"}, "place of an effect must be one of joint, .*, got 'moon'"),
        ({"refers_to": "luck"}, "refers_to of an effect must be one of axes, base, flange, rows, got 'luck'"),
    ):
        with pytest.raises(InvalidInput, match=sentence):
            Traits("a thing", **wrong)
    with pytest.raises(InvalidInput, match="no effect is called 'rust'"):
        traits_of("rust")


def test_texts_are_filled_for_an_owner() -> None:
    assert filled("q{n} by q{m} of {owner}", "joint6<-joint15") == "q6 by q15 of joint6<-joint15"
    assert filled("approach{n}", "joint12") == "approach12"


def test_loads_are_given_to_an_effect_that_follows_them_and_to_no_other(
    arm: Robot, poses: Dataset, with_effects: Any, registry: None
) -> None:
    """The force on the base's frame is the weight of the arm and its payload, whatever the posture."""
    seen: list[States] = []

    def basis(states: States) -> Any:
        seen.append(states)
        return np.zeros((len(states.q), 6, 1))

    given: dict[str, Any] = {"owners": ["base"], "parameters": [("tilt", "rad_nm", 1e-8, "")], "basis": basis}
    register_effect("pedestal", follows_loads=True, **given)
    with_effects(arm, {"effect": "pedestal", "owner": "base"}).forward(poses.q[:5], payload=poses.payload[:5])
    force = np.linalg.norm(seen[-1].load_on("base")[:, :3], axis=1)
    mass = sum(joint["link"]["mass_kg"] for joint in arm.spec["joints"])
    np.testing.assert_allclose(force, 9.81 * (mass + poses.payload[:5]), rtol=1e-3)
    with pytest.raises(InvalidInput, match="no frame is called 'floor'; there are base, joint1"):
        seen[-1].load_on("floor")
    register_effect("pedestal", **given)
    with_effects(arm, {"effect": "pedestal", "owner": "base"}).forward(poses.q[:5])
    with pytest.raises(InvalidInput, match="not registered with follows_loads=True"):
        seen[-1].load_on("base")


@pytest.mark.parametrize("name", NAMES)
def test_every_documented_form_is_tried(name: str) -> None:
    """`option=word` of an effect's page is a form, what a diagnosis tries it with, or the law that it has anyway."""
    traits = traits_of(name)
    page = (Path(__file__).parents[3] / "docs" / "effects" / f"{name}.md").read_text(encoding="utf-8")
    stated = {form.partition(":")[0] for form in traits.forms} | {traits.diagnosed_with}
    anyway = {"form=piecewise", "by=group", "side=motor"}  # groups are the plain law's parts, a motor's turns an order
    found = set(re.findall(r"\b([a-z]+=[a-z]+)\b", page)) - {"prior=yes"}  # how calibration holds it
    assert found <= stated | anyway
    assert {form.partition(":")[0] for form in traits.forms} <= found


@pytest.mark.parametrize("name", [name for name in NAMES if traits_of(name).forms])
def test_every_form_is_another_law_of_the_same_place(name: str, arm: Robot, poses: Dataset) -> None:
    owner = effect_owners(name, arm.core)[1]
    plain = {"effect": name, "owner": owner}
    forms = other_forms(plain, arm, poses)
    assert {form.variant.partition(":")[0] for form in forms} == {f.partition(":")[0] for f in traits_of(name).forms}
    (own,) = build_effects([plain], arm.core)
    for form in forms:
        assert form.key == (name, owner)
        (effect,) = build_effects([form.entry], arm.core)
        is_other = [p.name for p in effect.parameters] != [p.name for p in own.parameters]
        assert is_other or form.entry.get("torque") == "payload"


DRIVES = ("backlash", "coupling_ratio", "current_compliance", "gear_harmonic", "joint_compliance", "reduction_ratio")


@pytest.mark.parametrize("name", ["palletizer", "delta", "five_bar"])
def test_passive_joints_have_bearings_and_neither_gears_nor_encoders(name: str) -> None:
    """A coupling from a palletizer's passive joint, which turns as joint 3 does, hid a wrong reduction ratio."""
    core = load_robot(name).core
    passive = {f"joint{k + 1}" for k in core.passive}
    of = {effect: {part for owner in effect_owners(effect, core) for part in owner.split("<-")} for effect in DRIVES}
    assert passive
    assert all(not owners & passive for owners in of.values())
    assert of["reduction_ratio"] == {f"joint{k + 1}" for k in range(core.joint_count)} - passive
    assert passive <= set(effect_owners("bearing_tilt", core)) | set(effect_owners("pin_slack", core))
