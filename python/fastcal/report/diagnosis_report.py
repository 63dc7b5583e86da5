# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The files of a diagnosis: model, patches, JSON and the page, whose parts are gathered here."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from fastcal.calibration.parallel import workers
from fastcal.diagnosis import partial_residuals
from fastcal.diagnosis.columns import columns_of
from fastcal.diagnosis.words import cause_in_words, finding_in_words, plan_text, reason_text
from fastcal.effects.rig_traits import RIG_TRAITS
from fastcal.io.design_out import write_poses
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.io.robot_file import write_spec
from fastcal.measurements.kinds import POINTS
from fastcal.report import (
    calibration_tables,
    charts,
    diagnosis_figures,
    diagnosis_tables,
    effect_figures,
    page,
    residual_figures,
    shop,
    workspace,
)
from fastcal.report.cell_scene import arm_and_rig, pictures_scene
from fastcal.report.diagnosis_steps import is_advice, next_steps
from fastcal.report.diagnosis_words import (
    GRADES,
    TOO_FEW,
    VERDICTS,
    drop_command,
    name_in_model,
    spoken,
    step_name,
    sureness,
    unexplained_sentence,
)
from fastcal.report.document import document_facts
from fastcal.report.figures import Figure
from fastcal.report.formatting import alike, percent
from fastcal.report.gap import waterfall
from fastcal.report.kind_words import kind_title, noise_text, noise_title
from fastcal.report.language import _, in_language, retold
from fastcal.report.sections import who_measured
from fastcal.report.tables import Table, capitalised, unit_text
from fastcal.report.view import Rows, rows_of
from fastcal.report.words import Verdict, listed
from fastcal.said import said

if TYPE_CHECKING:
    from fastcal.calibration.evaluation import Evaluation
    from fastcal.diagnosis.result import Diagnosis, Finding
    from fastcal.diagnosis.search import SearchNode

# The last are those of older versions: each took an effect out of the model that it was written for.
FILES = ("model.yaml", "diagnosis.json", "report.html", "next_poses.csv", "without_*.patch")


@dataclass(frozen=True)
class _Card:
    """A finding on the page."""

    title: str
    brief: str
    grade: str
    grade_text: str
    estimate: list[tuple[str, str]]
    sureness: list[str]
    reasons: list[str]
    equivalents: list[str]
    drop: str
    figures: list[Figure]
    note: str
    in_model: bool
    of_cell: bool  # a camera's or a board's

    @property
    def leading(self) -> tuple[str, str] | None:
        """The number that tells most of it: the first that has a deviation."""
        return next((line for line in self.estimate if "±" in line[1]), self.estimate[0] if self.estimate else None)


def write_diagnosis(
    found: Diagnosis,
    folder: str | os.PathLike[str],
    *,
    made_by: Mapping[str, Any] | None = None,
    also: Mapping[str, Any] | None = None,
    simulated: bool = False,
    language: str = "en",
) -> None:
    """Writes model.yaml, diagnosis.json, report.html and, where there is a plan, next_poses.csv, all or none.

    Args:
        found: What `diagnose` gave.
        folder: Made where it is not there; an older result in it is replaced.
        made_by: What the result comes from and who measured it; kept in all three files.
        also: Further keys of diagnosis.json.
        simulated: The measurements came from a simulator: the page says so.
        language: Of the page.
    """
    import fastcal

    origin = {} if made_by is None else {"made_by": dict(made_by)}
    with workers(found.search.problem.threads), atomic_folder(Path(folder), owned=FILES) as place:
        source = PurePath(found.train.data.source).name
        model = place / "model.yaml"
        write_spec(found.model.with_(**origin).spec, model, f"Diagnosed by fastcal {fastcal.__version__} from {source}")
        write_json(place / "diagnosis.json", found.to_json_dict() | origin | dict(also or {}))
        if found.plan is not None:
            write_poses(place / found.plan.file, found.plan.poses, found.model)
        text = diagnosis_page(found, simulated=simulated, made_by=made_by or {}, language=language)
        (place / "report.html").write_text(text, encoding="utf-8")


def diagnosis_page(
    found: Diagnosis, *, simulated: bool = False, made_by: Mapping[str, Any] | None = None, language: str = "en"
) -> str:
    """The HTML text of the page; with `made_by` it is a document that can be signed."""
    with in_language(language):
        return _page(found, simulated, made_by or {})


def _page(found: Diagnosis, simulated: bool, made_by: Mapping[str, Any]) -> str:
    train, geometry = compared_rows(found, _("Training"), "train")
    test, _geometry = compared_rows(found, _("Test"), "test")
    sets = [rows for rows in (train, test) if rows is not None]
    arrows = residual_figures.arrows(sets)
    base = np.asarray(found.model.description.base.xyz_mm, float)
    arm = arm_and_rig(found.model, found.steps[0].model, [(train, found.train), (test, found.test)])
    verdict, tone = TOO_FEW if found.few else VERDICTS[found.verdict]
    word = _(verdict)
    if found.misfits:
        kinds = listed([_(misfit.kind.plural) for misfit in found.misfits])
        word = _("{verdict}; {kinds} do not fit", verdict=word, kinds=kinds)
        tone = "caution" if tone == "good" else tone
    if tone == "good" and any(f.grade != "A" for f in found.effects):
        tone = "caution"
    state = found.final
    smallest = diagnosis_tables.smallest_by_kind(found)
    cards = [_card(found, finding) for finding in found.effects]
    return page.render(
        "diagnosis.html",
        title=_("Diagnosis of {robot}", robot=found.model.name),
        robot_name=found.model.name,
        simulated=simulated,
        sources=[
            (name, PurePath(part.data.source).name, len(part.data))
            for name, part in ((_("Training"), found.train), (_("Test"), found.test))
            if part is not None
        ],
        who=who_measured(made_by),
        verdict=Verdict(tone, word, _(found.sentence)),
        steps=next_steps(found),
        sections=_sections(found),
        tiles=_tiles(found),
        misfits=[(kind_title(misfit.kind), capitalised(_(misfit.text))) for misfit in found.misfits],
        cards=cards,
        chips=[(card.grade, card.brief, f"cause-{k}") for k, card in enumerate(cards[:6], start=1)],
        grades={grade: _(text) for grade, text in GRADES.items()}
        if found.effects
        else {},  # the glossary explains those that the page gives
        effect_key=effect_figures.effect_key(),
        plan=found.plan if is_advice(found.plan) else None,
        plan_sentence="" if found.plan is None else _(plan_text(found.plan, spoken)),
        unexplained=None if found.unexplained is None else unexplained_sentence(found.unexplained, _tried(found)),
        unexplained_figures=_unexplained_figures(found, state),
        gap=gap_figure(found),
        nothing_missing=found.verdict == "none" and not found.few,
        alternatives=diagnosis_figures.alternatives(found),
        ranking=diagnosis_tables.ranking_table(found),
        confusion=confusion_figure(found),
        columns=columns_of(found.train.data),
        untestable=diagnosis_tables.untestable_table(found),
        smallest=diagnosis_tables.smallest_table(smallest),
        limits=diagnosis_figures.limits(smallest),
        pairs=_pairs(train, geometry, changed=len(found.steps) > 1),
        components=charts.component_key(train.components) if train else [],
        trend_note=residual_figures.drawn_note(train.row_count) if train else "",
        scene=pictures_scene(found.model, found.steps[0].model, found.train)
        if arrows is None
        else workspace.scene(
            *arrows, base, _("the measuring frame"), arm, residual_figures.places_of_arrows(train, found.outliers)
        ),
        flat_views=[] if arrows is None else workspace.flat_views(*arrows),
        noise=[(noise_title(of.kind), noise_text(of)) for of in found.noise.values()],
        sigma_note=_(found.sigma_note),
        normal_plot=residual_figures.normal_plot(train, found.main_noise, found.outliers) if train else None,
        outlier_table=_outlier_table(found, train),
        outlier_count=len(found.outliers),
        notes=[*map(retold, found.notes)],
        document=document_facts(made_by),
    )


def _sections(found: Diagnosis) -> list[tuple[str, str]]:
    """What the contents list: id and short title of the sections that the page has."""
    return [
        *([("misfits", _("Do not fit"))] if found.misfits else []),
        *([("plan", _("Next measurement"))] if is_advice(found.plan) else []),
        *([("found", _("What is missing"))] if found.effects else []),
        *([("unexplained", _("Unexplained"))] if found.unexplained is not None else []),
        ("workspace", _("Workspace")),
        *([("ranking", _("Other causes"))] if found.ranking else []),
        ("unseen", _("Not testable")),
        ("remaining", _("Before and after")),
        ("noise", _("Noise and outliers")),
        ("words", _("Glossary and notes")),
    ]


def compared_rows(found: Diagnosis, name: str, part: str) -> tuple[Rows | None, Rows | None]:
    """The rows of a set with everything that was found, "before" being the geometry alone; and those of the latter."""
    first: Evaluation | None = getattr(found.steps[0], part)
    last: Evaluation | None = getattr(found.steps[-1], part)
    if first is None or last is None:
        return None, None
    was = {name: of.numbers for name, of in first.kinds.items()}
    told = {name: replace(of, numbers_before=was.get(name)) for name, of in last.kinds.items()}
    compared = replace(last, before=first.after, error_before=first.error_after, kinds=told)
    kinds = found.model.joint_types
    return rows_of(name, compared, kinds), rows_of(name, first, kinds)


_JUDGED = {
    "test": (said("test poses"), said("test poses, which no fit has seen")),
    "held out": (said("held-out poses"), said("held-out poses, each part predicted by a fit to the others")),
    "fitted": (said("poses of the fit"), said("poses of the fit")),
}


def _tried(found: Diagnosis) -> int:
    """Causes that were tried: effects and owners."""
    return len({name.key for name in found.search.problem.names})


def _tiles(found: Diagnosis) -> list[tuple[str, str, str]]:
    gap = found.judged_gap
    sizes, floor, unit = gap.sizes, gap.floor, unit_text(gap.unit)
    before, after = sizes[0], sizes[-1]
    where = _(_JUDGED[gap.on][0])
    size = noise_text(found.main_noise)
    of_one = (
        _("{size} per coordinate", size=size)
        if found.main_noise.kind.name == POINTS
        else _("{size} per number", size=size)
    )
    noise = (_("Noise alone would give"), f"{alike(floor, floor)} {unit}", of_one)
    dead = len({(u.effect, u.owner) for u in found.untestable})
    tried = (_("Causes tried"), str(_tried(found)), _("{count} more cannot be detected in these data", count=dead))
    error = _("RMS error, {poses}", poses=where)
    if len(sizes) == 1:
        unexplained = np.sqrt(max(after**2 - floor**2, 0.0))
        above = (_("Beyond the noise"), f"{alike(unexplained, floor)} {unit}", _("root of the difference of squares"))
        return [(error, f"{alike(after, floor)} {unit}", _("calibrated geometry")), noise, above, tried]
    return [
        (
            error,
            f"{alike(after, floor)} {unit}",
            _("was {size} with geometry alone", size=f"{alike(before, floor)} {unit}"),
        ),
        noise,
        (_("Gap closed"), percent(gap.closed), _("of the mean square beyond the noise")),
        tried,
    ]


def _card(found: Diagnosis, finding: Finding) -> _Card:
    is_of_rig = finding.effect in RIG_TRAITS  # no effect of the fit: it is in the cell's own numbers
    seen = None if is_of_rig else partial_residuals.of_finding(found.fitted_with(finding), finding)
    cause = capitalised(_(finding_in_words(finding)))
    drawn = [] if seen is None else effect_figures.effect_figures(seen, finding.owner, f"effect-{_slug(finding)}")
    return _Card(
        cause,
        cause.partition(" (")[0],
        finding.grade,
        _(GRADES[finding.grade]),
        shop.estimate_lines(finding.effect, finding.parameters),
        sureness(finding),
        list(dict.fromkeys(_(reason_text(because, spoken)) for because in finding.limits)),
        [capitalised(_(cause_in_words(*other))) for other in finding.equivalents],
        drop_command(finding) if finding.in_model and not is_of_rig else "",
        drawn,
        "" if seen is None else effect_figures.left_out_note(seen),
        finding.in_model,
        is_of_rig,
    )


def _slug(finding: Finding) -> str:
    """The name of a finding where `<-`, `:` and `=` may not stand."""
    return name_in_model(finding).replace("<-", "_from_").replace(":", "_").replace("=", "_")


def _unexplained_figures(found: Diagnosis, state: SearchNode) -> list[Figure]:
    if found.unexplained is None:
        return []
    seen = partial_residuals.of_unexplained(state, found.unexplained.owner, found.unexplained.depends_on)
    return [] if seen is None else effect_figures.effect_figures(seen, found.unexplained.owner, "unexplained")


def gap_figure(found: Diagnosis) -> Figure:
    """The error of the geometry alone, what each effect takes of it, what remains, and the noise."""
    gap = found.judged_gap
    steps = list(zip([step_name(step.added) for step in found.gap], gap.sizes, strict=True))
    return waterfall(steps, gap.floor, _(_JUDGED[gap.on][1]), gap.unit)


def confusion_figure(found: Diagnosis) -> Figure | None:
    """How alike the signatures of the leading causes are; None where there are fewer than two."""
    names, correlation = found.confusion
    if len(names) < 2:
        return None
    given = {f.label for f in found.effects}
    boxed = [k for k, name in enumerate(names) if f"{name.effect}@{name.owner}" in given]
    return diagnosis_figures.confusion_map([spoken(name) for name in names], correlation, boxed)


def _pairs(train: Rows | None, geometry: Rows | None, *, changed: bool) -> list[list[Figure]]:
    if train is None or geometry is None:
        return []
    named = (
        {_("geometry alone"): geometry, _("with the effects found"): train}
        if changed
        else {_("calibrated geometry"): train}
    )
    states = {name: (rows, rows.trends) for name, rows in named.items()}
    return residual_figures.trend_pairs(states)


def _outlier_table(found: Diagnosis, train: Rows | None) -> Table | None:
    if train is None:
        return None
    weights = np.ones(train.row_count)
    weights[found.outliers] = 0.0
    return calibration_tables.outlier_table(train, found.outliers, weights)
