# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects as written in a robot file or on the command line, and as the core builds them.

An entry of a robot file's `effects` is `{effect, owner, parameters, OPTION: VALUE ...}`. Options carry their unit at
the end of their name (`t0_c`, `at_s`, `low_rad`) and reach the core in SI without it; of lists of labels (`stations`,
`mounts`) it is given their number.
"""

from __future__ import annotations

import difflib
from collections.abc import Hashable, Iterable, Sequence, Set
from functools import cache
from typing import Any
from weakref import WeakKeyDictionary

from fastcal import _core
from fastcal.effects import registered
from fastcal.effects.rig_traits import RIG_TRAITS
from fastcal.effects.traits import Place, Traits
from fastcal.errors import InvalidInput
from fastcal.place import place_of
from fastcal.units import from_si, parse_name, to_si

Spec = dict[str, Any]

_GEOMETRY_UNITS = {"m": "mm", "rad": "deg"}  # what a table of a robot is written in
_EFFECT_UNITS = {"m": "mm", "m_s": "mm_s"}  # an effect's angles stay in radian, as its compliances are

LAGGED = "temperature behind a lag of "  # begins the column of a filtered temperature; its lag [s] follows
SINCE = "since row "  # begins the column of what there is from a row on; the row and the count of rows follow
MOVE = "last move of joint "  # begins the column of a joint's last moves; its number follows
_OF_CALIBRATION = ("curvature", "prior", "spread")  # options that the core does not read
_APART = (
    "order",
    "side",
    "sign",
    "column",
    "axis",
)  # options that make two entries of one effect and owner two different causes
_MOMENTS = ("at_s", "at_row")  # beside these, where what they are of stepped more than once
TOLD_APART_BY = (*_APART, *_MOMENTS)


def effect_names() -> list[str]:
    """All effects: the core's and those registered from Python."""
    return sorted([*_core.effect_names(), *registered.names()])


def traits_of(name: str) -> Traits:
    """What an effect states about itself; InvalidInput where the name is not known."""
    known = registered.find(name)
    if known is not None or name in RIG_TRAITS:
        return RIG_TRAITS[name] if known is None else known.traits
    return _core_traits(_known(name))


@cache
def _core_traits(name: str) -> Traits:
    return Traits(**_core.effect_traits(name))


@cache
def curve_of(place: Place) -> str:
    """The effect of the core that stands for a shape without a cause: of a "joint" or of any "frame"."""
    return next(
        name for name in _core.effect_names() if (_core_traits(name).role, _core_traits(name).place) == ("curve", place)
    )


NOTHING = "none"  # in place of a list of effects


def effect_owners(name: str, core: _core.RobotModel) -> list[str]:
    """All owners that a robot has for an effect, none where branches or loops rule it out; InvalidInput: not known."""
    known = registered.find(name)
    if known is not None:
        return known.owners_of(core)
    found = _OWNERS.setdefault(core, {})
    if name not in found:
        found[name] = tuple(_owners_in_core(_known(name), core))
    return list(found[name])


# A search asks for the same owners in every step, and those beside branches or loops are dear to find.
_OWNERS: WeakKeyDictionary[_core.RobotModel, dict[str, tuple[str, ...]]] = WeakKeyDictionary()


def _owners_in_core(name: str, core: _core.RobotModel) -> list[str]:
    owners = list(_core.effect_owners(name, core))
    if _is_of_drives(_core_traits(name)):
        passive = core.passive
        owners = [of for of in owners if not any(place_of(part).index in passive for part in of.split("<-"))]
    if len(core.branches) <= 1 and not len(core.home):
        return owners
    carries = _frames_below_tool(core)
    return [owner for owner in owners if _acts_beside_others(name, core, owner, carries)]


def _is_of_drives(traits: Traits) -> bool:
    """Is an effect that of motors, gears and encoders, which passive joints lack? They have bearings."""
    return traits.place == "joint" and traits.role == "cause" and traits.depends_on[:1] != ("load",)


def _acts_beside_others(name: str, core: _core.RobotModel, owner: str, carries: Set[str]) -> bool:
    """The core refuses effects of chains alone; what else it lacks, as an option, is not asked here.

    Of a joint or link that does not carry the tool only the weight counts.
    """
    if _core_traits(name).without_masses:
        return False  # what hangs beyond a joint is told from a chain alone
    shows_by_weight = len(core.home) or _core_traits(name).role == "nuisance"
    if not shows_by_weight and not all(_moves_tool(carries, part) for part in owner.split("<-")):
        return False
    try:
        _core.make_effect(name, core, owner, {})
    except InvalidInput as refused:
        return "closed loops" not in str(refused)
    return True


def _moves_tool(carries: Set[str], owner: str) -> bool:
    """True of all that is no joint or link beside the tool's branch, whose frames are given."""
    place = place_of(owner)
    return place.kind not in ("joint", "link") or not place.number or owner in carries


def _frames_below_tool(core: _core.RobotModel) -> Set[str]:
    """Names of the tool's frame and of all that carry it."""
    names, parents, frame = set(), core.parents, core.frame_count - 1
    while frame >= 0:
        names.add(core.frame_name(frame))
        frame = parents[frame]
    return names


@cache
def _core_names() -> frozenset[str]:
    return frozenset(_core.effect_names())


def _known(name: str) -> str:
    """The name of an effect of the core; InvalidInput where it is none."""
    if name not in _core_names():
        there = ["geometry", *effect_names()]
        near = difflib.get_close_matches(name, there, n=1, cutoff=0.6)
        meant = f"did you mean '{near[0]}'? There" if near else "there"
        raise InvalidInput(
            f"no effect is called '{name}'; {meant} are {', '.join(there)} (those written in Python once registered)"
        )
    return name


def edge_unit(parameter: _core.Parameter, *, geometry: bool) -> str:
    """The unit in which a parameter is written for people."""
    unit = parameter.unit
    return (_GEOMETRY_UNITS if geometry else _EFFECT_UNITS).get(unit, unit)


def edge_name(parameter: _core.Parameter, *, geometry: bool) -> str:
    """The name with its unit at the end, such as theta_deg, compliance_rad_nm, rad_nm or error."""
    name, unit = parameter.name, edge_unit(parameter, geometry=geometry)
    return name if unit == "1" else f"{name}_{unit}" if name else unit


def value_at_edge(parameter: _core.Parameter, value: float, *, geometry: bool) -> float:
    """An SI value in the unit of `edge_unit`."""
    return from_si(value, edge_unit(parameter, geometry=geometry))


def full_name(parameter: _core.Parameter) -> str:
    """Owner and name; "joint1 rad_k" where the unit says it all."""
    return f"{parameter.owner} {parameter.name or parameter.unit}"


def label(entry: Spec) -> str:
    """The entry as it is written on a command line."""
    return f"{entry['effect']}@{entry['owner']}"


def identity(entry: Spec) -> tuple[Any, ...]:
    """Equal for two entries of the same cause."""
    options = options_of(entry)
    return (*identity_at_any_moment(entry), *(options.get(key) for key in _MOMENTS))


def identity_at_any_moment(entry: Spec) -> tuple[Any, ...]:
    """Equal for two steps of one thing, too."""
    options = options_of(entry)
    return (entry["effect"], entry["owner"], *(options.get(key) for key in _APART))


def identity_options(entry: Spec) -> Spec:
    """The options of an entry that tell it from another cause of the same effect and owner."""
    options = options_of(entry)
    return {key: options[key] for key in TOLD_APART_BY if options.get(key) is not None}


def same_parameters(entry: Spec) -> Hashable:
    """Equal for two entries whose parameters mean the same: those of one effect, owner and options.

    How a calibration holds the parameters (`prior`, `curvature`) is no part of what they mean.
    """
    options = {key: value for key, value in options_of(entry).items() if key not in _OF_CALIBRATION}
    return entry["effect"], entry["owner"], frozenset((key, _hashable(value)) for key, value in options.items())


def _hashable(value: Any) -> Hashable:
    return tuple(map(_hashable, value)) if isinstance(value, (list, tuple)) else value


def without_repeats(entries: Sequence[Spec]) -> list[Spec]:
    """The entries in order, of those of one cause the first; a step without its moment is any that is there."""
    seen: dict[tuple[Any, ...], Spec] = {}
    for entry in entries:
        has_moment = any(options_of(entry).get(key) is not None for key in _MOMENTS)
        if has_moment or identity_at_any_moment(entry) not in map(identity_at_any_moment, seen.values()):
            seen.setdefault(identity(entry), entry)
    return list(seen.values())


def options_of(entry: Spec) -> Spec:
    """The options of an entry as they are written, those that are listed among the parameters too."""
    options = {key: value for key, value in entry.items() if key not in ("effect", "owner", "parameters")}
    given = entry.get("parameters") or {}
    for key in traits_of(entry["effect"]).among_parameters:
        if key in given:
            options[key] = given[key]["value"] if isinstance(given[key], dict) else given[key]
    return options


def core_options(entry: Spec) -> Spec:
    """The options as the core takes them: SI, units dropped, labels counted."""
    out: Spec = {}
    labels = traits_of(entry["effect"]).labels
    for key, value in options_of(entry).items():
        if key in _OF_CALIBRATION:
            continue
        if key == labels:
            out["count"] = float(len(value))
            continue
        name, unit = parse_name(key)
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number and not _is_option(value):
            raise InvalidInput(f"{label(entry)}: expected a number, a word or a list of numbers for its option '{key}'")
        many = unit is not None and isinstance(value, (list, tuple))
        si = [to_si(float(x), unit or "1") for x in value] if many else value
        out[name if unit else key] = to_si(float(value), unit or "1") if number else si
    return out


def written_list(name: str, option: tuple[str, Sequence[float]]) -> tuple[str, list[float]]:
    """A list of the core's, (unit, SI values), as an option of a file: its name with the unit behind, and numbers."""
    unit, values = option
    written = _EFFECT_UNITS.get(unit, unit)
    return (name if unit == "1" else f"{name}_{written}"), [from_si(float(value), written) for value in values]


def _is_option(value: object) -> bool:
    """A word, a truth, or a list of numbers: what an option may hold beside a number."""
    if isinstance(value, (list, tuple)):
        return all(isinstance(x, (int, float)) for x in value)
    return isinstance(value, (str, bool))


def build_effects(
    entries: Sequence[Spec], core: _core.RobotModel, built: dict[str, _core.Effect] | None = None
) -> list[_core.Effect]:
    """The effects in order; they share the columns of `extra_columns` and the table of registered effects.

    `built` keeps those of this core that the other entries have no part in, and they are taken from there again.
    """
    columns = extra_columns(entries)
    effects, table = [], 0
    for entry in entries:
        known = registered.find(entry["effect"])
        if known is not None:
            effects.append(known.build(entry["owner"], core, table))
            table += known.width(entry["owner"])
            continue
        own = own_columns(entry)
        key = None if built is None or own or "inputs" in entry else repr(entry)
        if key is not None and built is not None and key in built:
            effects.append(built[key])
            continue
        options = core_options(entry)
        if "inputs" in options:
            options["inputs"] = _by_index(str(options["inputs"]), columns)
        elif own:
            options["index"] = float(columns.index(own[0]))
        effects.append(_core.make_effect(_known(entry["effect"]), core, entry["owner"], options))
        if key is not None and built is not None:
            built[key] = effects[-1]
    return effects


def extra_columns(entries: Sequence[Spec]) -> list[str]:
    """Columns beyond the core's own that the entries look at, each once."""
    return list(dict.fromkeys(column for entry in entries for column in own_columns(entry)))


def table_width(entries: Sequence[Spec]) -> int:
    """Columns of the table of registered effects that the entries have."""
    known = [(registered.find(entry["effect"]), entry["owner"]) for entry in entries]
    return sum(of.width(owner) for of, owner in known if of is not None)


def conditions_read(entry: Spec, effect: _core.Effect) -> list[str]:
    """Conditions that an entry's effect looks at, as the core names them: "temperature", "approach4" ..."""
    own = registered.find(entry["effect"])
    return list(own.columns if own else effect.data_columns)


def own_columns(entry: Spec) -> list[str]:
    """The user's own column that an entry names, or what follows from several rows: a filtered temperature, moves."""
    if "column" in entry:
        return [str(entry["column"])]
    if "move{n}" in traits_of(entry["effect"]).depends_on:
        return [f"{MOVE}{place_of(entry['owner']).number}"]
    if "inputs" in entry:
        words = str(entry["inputs"]).split()
        return [f"{MOVE}{word.removeprefix('move')}" for word in words if word.startswith("move")]
    options = options_of(entry)
    if "at_row" in options:
        return [f"{SINCE}{options['at_row']:g} of {options.get('rows', 0):g}"]
    lag = lag_of(entry)
    return [f"{LAGGED}{lag!r}"] if lag > 0 else []


def _by_index(inputs: str, columns: Sequence[str]) -> str:
    """The inputs of a surrogate with moves as the core knows them: by their place among the columns."""
    words = inputs.split()
    moves = {word: f"{MOVE}{word.removeprefix('move')}" for word in words if word.startswith("move")}
    return " ".join(f"extra:{columns.index(moves[word])}" if word in moves else word for word in words)


def position_option(joint_type: str) -> tuple[str, str]:
    """What the position of a joint is called as an option of an effect, and its unit: ("at_deg", "deg")."""
    unit = "deg" if joint_type == "revolute" else "mm"
    return f"at_{unit}", unit


def lag_of(entry: Spec) -> float:
    """[s] The lag of a thermal effect; 0 where it has none."""
    return float(options_of(entry).get("lag_s", 0.0)) if "lag_s" in traits_of(entry["effect"]).among_parameters else 0.0


def parse_effects(
    text: str | Sequence[str], core: _core.RobotModel, there: Sequence[Spec] = ()
) -> tuple[bool, list[Spec]]:
    """Reads `geometry,joint_compliance@joint2,gear_harmonic@joint1:order=2` into (is geometry asked for, entries).

    All owners of a name unless one is given. A name behind a colon is an option; numbers are read as numbers. NOTHING
    alone asks for no more than base and tool.

    Args:
        text: What is asked for.
        core: The robot.
        there: Entries that it has. Their owners may be asked for as they are, even where the identified geometry would
            not make them owners: a link that came out too short to bend.

    Raises:
        InvalidInput: A name, owner or option is unknown.
    """
    items: Iterable[str] = text.split(",") if isinstance(text, str) else text
    if text in (NOTHING, [NOTHING]):
        return False, []
    geometry = False
    entries: list[Spec] = []
    for item in items:
        head, *options = str(item).strip().split(":")
        name, _, owner = head.partition("@")
        if not name:
            raise InvalidInput(f"an effect list holds an empty name: '{text}'")
        if name == "geometry":
            geometry = True
            continue
        owners = effect_owners(name, core)
        own = [entry for entry in there if (entry["effect"], entry["owner"]) == (name, owner)]
        if own and owner not in owners and not options:
            entries += own
            continue
        if owner and owner not in owners:
            raise InvalidInput(f"{name} has no owner '{owner}' on this robot; there are {', '.join(owners) or 'none'}")
        for chosen in [owner] if owner else owners:
            entry: Spec = {"effect": name, "owner": chosen}
            for option in options:
                key, equals, value = option.partition("=")
                if not equals:
                    raise InvalidInput(f"an option is written name=value, got '{option}' in '{item}'")
                entry[key] = _number_or_text(value)
            build_effects([entry], core)
            entries.append(entry)
    return geometry, entries


def _number_or_text(value: str) -> float | str:
    try:
        return float(value)
    except ValueError:
        return value
