# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the model of a cell of several arms is missing: each way from what reads to a target is diagnosed as one arm.

A way's readings are its own: no joint of another arm moves its target. Joints that several ways have in common are told
as the cell's, once; what one of these ways names there and another does not is no cause of grade A. Nor is, of a way
that begins on an arm, what follows a joint slowly: there the weights of links bend and tilt what no fit of it tries.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from fastcal.cells.cell import Cell
from fastcal.cells.diagnosis import CellDiagnosis, CellFinding, Step, WayDiagnosis
from fastcal.cells.gap import gap_of
from fastcal.cells.moved_members import limits_of, moved_members, step_of, told_name, with_moved
from fastcal.cells.paths import Way
from fastcal.cells.readings import Readings
from fastcal.cells.sensor_ways import lengths_alone
from fastcal.cells.since_moved import as_since
from fastcal.cells.written import written_cell
from fastcal.diagnosis import diagnose
from fastcal.diagnosis.reasons import Reason
from fastcal.diagnosis.result import Finding
from fastcal.effects.entries import effect_names, label, options_of, traits_of
from fastcal.effects.rig_traits import PLACEMENT_STEP, RIG_TRAITS
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.place import Place, owner_of, place_of, places_of
from fastcal.robot.robot_spec import Entry
from fastcal.said import said

Progress = Callable[[str], None]

_FAST = 1.5  # cycles a turn of a joint, above which no weight that it carries goes round with it


def diagnose_cell(
    cell: Cell,
    readings: Readings,
    data: Sequence[tuple[Way, Dataset, Dataset | None]],
    *,
    test: Readings | None = None,
    exclude: Collection[str] = (),
    sigma: float | None = None,
    as_read: bool = False,
    mend: bool = False,
    threads: int = 1,
    progress: Progress | None = None,
) -> CellDiagnosis:
    """Finds what the arms of a cell are missing, way by way, names it with its arm, and calibrates the cell with it.

    Args:
        cell: As its file says.
        readings: All that was read.
        data: Each way with its rows, and with those that are only reported on.
        test: All that was read of the latter.
        exclude: Names that are not to be given, `EFFECT` or `EFFECT@ARM.jointN`.
        sigma: Standard deviation of a measured coordinate [m], where the readings have no column for it.
        as_read: Take the columns as they are.
        mend: Put pictures that are of other postures where they fit, as in `calibrate_cell`.
        threads: Cores.
        progress: Called with a sentence at each step.

    Raises:
        InvalidInput: As of `diagnose`, or a name to exclude is of no arm that was looked at.
    """
    notify = progress or (lambda text: None)
    readings = readings.in_order
    names = names_excluded([way for way, _, _ in data], exclude)
    ways, since = [], as_since(cell, readings)
    for (way, rows, held), own in zip(data, names, strict=True):
        if since is not readings:  # of what the file says was moved
            position, rotation = (since.tables.get(f"{field}@{way.name}") for field in ("position", "rotation"))
            rows = replace(rows, position=position, rotation=rotation)

        def tell(text: str, name: str = way.name) -> None:
            notify(f"{name}: {text}")

        options: dict[str, Any] = {"sigma": sigma, "as_read": as_read, "mend": mend, "threads": threads}
        found = diagnose(way.robot, rows, test=held, exclude=own, progress=tell, **options)
        if found.few:
            raise InvalidInput(found.few)
        ways.append(WayDiagnosis(way, found))
    effects = _merged(ways, moved_members(ways, readings), bool(exclude))
    notify("calibrating the cell with the effects found")
    with_effects, notes = with_causes(cell, readings, ways, effects)
    is_sure = all(of.finding.grade != "C" for of in effects)
    given: dict[str, Any] = {"exclude": exclude, "mend": mend, "threads": threads}
    written, instead = written_cell(cell, with_effects, readings, is_sure=is_sure, **given)
    notes += instead
    notes += [f"{each.way.name}: {note}" for each in ways for note in each.found.notes]
    if lengths := lengths_alone(readings):
        notes.append(said("no cause was looked for in the lengths of {views}", views=", ".join(lengths)))
    gap = gap_of(cell, written, readings, test, mend, threads)
    return CellDiagnosis(written, ways, effects, notes, gap, readings)


def names_excluded(ways: Sequence[Way], exclude: Collection[str]) -> list[list[str]]:
    """Of each way the names that it is not to give, as its own arm calls them."""
    out = [list(way.not_tried) for way in ways]
    for name in exclude:
        effect, at, owner = name.partition("@")
        hit = False
        for way, own in zip(ways, out, strict=True):
            local = {way.owner(str(of)): str(of) for of in _places(way)}
            local |= {way.owner(of): of for of in ("base", "tool", "payload", "robot", "structure")}
            local |= {str(Place(way.root, "base", 0)): "base"} if way.root else {}
            if effect == PLACEMENT_STEP and not way.seeing:
                steps = [(step, of) for step in effect_names() if (of := step_of(step)) in ("base", "tool")]
                ends = {"base": way.instrument, "tool": way.target.name}
                own += [f"{step}@{of}" for step, of in steps if not at or ends[of] == owner]
                hit = hit or owner in ends.values()
            if effect in RIG_TRAITS:
                local = {of: of for of in way.seeing}
            if not at:
                own.append(way.tried_as(name))
            elif owner in local:
                own.append(f"{way.tried_as(effect)}@{local[owner]}")
            hit = hit or not at or owner in local
        if not hit:
            joints = ", ".join(
                f"{Place(arm.name, 'joint', 1)} ..." for arm in dict.fromkeys(a for way in ways for a in way.arms)
            )
            raise InvalidInput(f"--exclude {name:.60}: expected an owner such as {joints}")
    return out


def _places(way: Way) -> list[Place]:
    """Joints and links that are on a way, and not beside it, as its own arm calls them."""
    own = [k for k, (arm, _) in enumerate(way.joints, start=1) if arm in way.arms]
    return [Place("", kind, k) for kind in ("joint", "link") for k in own]


def _merged(ways: Sequence[WayDiagnosis], moved: Mapping[int, Step], excluded: bool) -> list[CellFinding]:
    """The findings of all ways, those of one name as one; `excluded`: were names not to be given?"""
    named: dict[tuple[str, str, float | None], list[tuple[WayDiagnosis, Finding]]] = {}
    for each in ways:
        for finding in each.found.effects:
            order, step = finding.parameters.get("order"), moved.get(id(finding))
            apart = step.first if step is not None else None if order is None else round(order.value, 1)
            effect, owner = step.name if step is not None else told_name(each.way, finding.effect, finding.owner)
            key = (effect, owner, apart)
            named.setdefault(key, []).append((each, finding))
    out = []
    for (effect, owner, _), found in named.items():
        clearest, finding = max(found, key=lambda of: of[1].snr)
        steps = tuple(moved[id(of)] for _, of in found if id(of) in moved)
        seen = [each.way.name for each, _ in found]
        others = [
            e.way.name
            for e in ways
            if _moves(e.way, owner) and e.way.name not in seen and not _likens(e, effect, owner)
        ]
        alike = [_alike(each.way, of, moved) for each, of in found]
        equivalents = [of for of in _alike(clearest.way, finding, moved) if all(of in own for own in alike)]
        weighs = all(_is_like_weights(each.way, of) for each, of in found)
        limits = limits_of(finding, moved)
        if clearest.way.not_tried and not excluded:  # which `weighs` judges
            limits = tuple(of for of in limits if of.reason != Reason.NAMES_EXCLUDED)
        is_sure = finding.grade == "A" or (finding.grade == "B" and not limits)
        grade = ("B" if others or weighs or limits else "A") if is_sure else finding.grade
        parameters = {clearest.way.told(name): value for name, value in finding.parameters.items()}
        told = replace(
            finding,
            effect=effect,
            owner=owner,
            equivalents=tuple(equivalents),
            grade=grade,
            parameters=parameters,
            limits=limits,
        )
        entry = next((of for of in clearest.found.model.entries if finding.is_of(of)), None)
        entry = None if entry is None or not finding.in_model else clearest.way.told_entry(entry)
        out.append(CellFinding(told, entry, tuple(seen), tuple(others), weighs, steps))
    return sorted(out, key=lambda of: -of.finding.snr)


def _alike(way: Way, finding: Finding, moved: Mapping[int, Step]) -> list[tuple[str, str]]:
    """What does as well as a finding of a way."""
    step = moved.get(id(finding))
    return [*(told_name(way, *of) for of in finding.equivalents), *(() if step is None else step.alike)]


def _is_like_weights(way: Way, finding: Finding) -> bool:
    """Is a cause, found from a sensor that moves, of a kind for which the weights of links may pass?

    The torque of a weight about a joint goes once round with it: faster waves, and what no posture sets, are not.
    """
    order = finding.parameters.get("order")
    is_fast = order is not None and order.value >= _FAST
    follows = traits_of(finding.effect).depends_on[:1]
    of_posture = bool(follows) and follows[0].startswith(("q", "current", "x"))
    return bool(way.not_tried) and of_posture and not is_fast


def _moves(way: Way, owner: str) -> bool:
    """Is an owner of the cell on a way, or at an end of it?"""
    if not way.seeing and owner in (way.instrument, way.target.name):
        return True
    return {place.arm for place in places_of(owner)} <= {arm.name for arm in way.arms}


def _likens(each: WayDiagnosis, effect: str, owner: str) -> bool:
    """Would a name do as well as one that a way gives?"""
    return any((effect, owner) == told_name(each.way, *of) for f in each.found.effects for of in f.equivalents)


def with_causes(
    cell: Cell, readings: Readings, ways: Sequence[WayDiagnosis], effects: Sequence[CellFinding]
) -> tuple[Cell, list[str]]:
    """The cell whose arms have the causes that are sure; notes on those that its postures cannot tell."""
    notes = []
    for of in effects:
        seeing = next(each for each in ways if each.way.name == of.seen_by[0])
        way = seeing.way
        places = places_of(of.finding.owner)
        arm = next((arm for arm in way.arms if arm.name == places[0].arm), way.arms[-1])
        if of.entry is None:
            if of.finding.effect in RIG_TRAITS:
                cell = seeing.mended(cell, of.finding.owner)
            continue
        if of.steps:
            cell, note = with_moved(cell, of, readings)
            notes += [note] if note else []
            continue
        of_one = len({place.arm for place in places}) == 1
        if len(way.arms) > 1 and not (of_one and _can_be_of_an_arm(of.entry)):
            notes.append(
                f"{of.finding.label} is not in model.yaml: it refers to the rows of the whole way to {way.name}"
            )
            continue
        own: Entry = {**of.entry, "owner": owner_of(replace(place, arm="") for place in places)}
        try:
            there = arm.robot.with_(effects=[*cell.arm(arm.name).robot.entries, own])
            arms = tuple(replace(each, robot=there) if each.name == arm.name else each for each in cell.arms)
            tried = replace(cell, arms=arms)
            tried.model  # noqa: B018  which says whether it can be in a cell
            readings.samples(tried)  # and this whether these postures have what it needs
        except InvalidInput as error:
            notes.append(f"{label(of.entry)} of {arm.name} is not in model.yaml: {error}")
            continue
        cell = tried
    return cell, notes


def _can_be_of_an_arm(entry: Entry) -> bool:
    """Can an effect of a way be one of the arm that has its owner?

    What follows axes alone is the same there. What refers to the rows of the way finds other numbers in the arm's own,
    where it has nothing but numbers, and is of a joint or link.
    """
    place, refers_to = place_of(entry["owner"]), traits_of(entry["effect"]).refers_to
    return refers_to == "axes" or (refers_to == "rows" and place.number > 0 and not options_of(entry))
