# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The diagnosis problem: a robot, its measurements and the hypotheses, as used by fits and score tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import measurements, noise_by_observation
from fastcal.calibration.columns import column_lengths
from fastcal.calibration.joint_noise import JointNoise
from fastcal.calibration.options_from_data import with_reference
from fastcal.calibration.parallel import each
from fastcal.calibration.postures import stays
from fastcal.calibration.problem import CalibrationProblem, prepare
from fastcal.calibration.tall import moved
from fastcal.calibration.touched_places import touched_places
from fastcal.calibration.unknowns import CORNERS
from fastcal.diagnosis.generic import Known
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import Exclusion, without_masses
from fastcal.diagnosis.postures import Postures, joint_repeatability, posture_rows
from fastcal.effects.entries import build_effects, effect_names, effect_owners, traits_of
from fastcal.measurements.conditions import build_samples, condition_columns
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kind_of
from fastcal.place import place_of
from fastcal.robot.robot import Robot, Spec

FloatArray = NDArray[np.float64]

ONE = " one"  # a column of ones: a regressor on it moves a frame, which gives the frame's own columns


@dataclass(frozen=True, eq=False)
class Noise:
    """Standard deviation of a measured number: root of its claim's square and common^2, times factor and scale.

    `memory` is the correlation of postures measured one after the other, `shared` that of neighbouring rows of one
    stay in a posture (`postures.stays`), beside it. `repeatability` is how well each joint repeats, over `factor`
    [rad; of slides m], anew in each row or, with `by_stay`, in each stay (`calibration/joint_noise`).
    """

    common: tuple[float, float, float]  # positions [m], all that is in rad, other lengths [m]
    factor: float = 1.0
    freedom: float = np.inf  # degrees of freedom that it was estimated with
    memory: float = 0.0
    shared: float = 0.0
    scale: Mapping[str, float] = field(default_factory=dict)  # by kind of observation; 1 where there is none
    repeatability: float = 0.0
    by_stay: bool = False

    @property
    def without_factor(self) -> tuple[object, ...]:
        """All that whitens rows but for `factor`."""
        joints = self.repeatability, self.by_stay
        return self.common, self.memory, self.shared, dict(self.scale), *joints

    @property
    def is_white(self) -> bool:
        """Does each number err by itself?"""
        return not self.follows and self.repeatability == 0

    @property
    def follows(self) -> bool:
        """Does a row err as those before it do?"""
        return self.memory > 0 or self.shared > 0

    @property
    def without_correlation(self) -> Noise:
        """As if each number erred by itself."""
        return replace(self, memory=0.0, shared=0.0, repeatability=0.0)


@dataclass(frozen=True, eq=False)
class Levers:
    """By what each joint moves the numbers of all rows: (N, numbers, n), NaN where nothing was measured."""

    data: Dataset
    measured: _core.Measurements
    moved: FloatArray


@dataclass(frozen=True, eq=False)
class Linearization:
    """A problem near a parameter vector; one row a measured number, whitened but for `Noise.factor`.

    Attributes:
        J: (m, P) derivatives by the parameters of the model and the observations' unknowns.
        r: (m,) predicted less measured.
        row: (m,) the fitted row that the number belongs to.
        number: (m,) which number of its row.
    """

    J: FloatArray
    r: FloatArray
    row: NDArray[np.intp]
    number: NDArray[np.intp]

    @cached_property
    def lengths(self) -> FloatArray:
        """(P,) of the columns of J."""
        return column_lengths(self.J)


@dataclass(frozen=True, eq=False)
class Problem:
    """A robot, its measurements, what may be missing, and how noise and rows are taken.

    Attributes:
        start: The robot with base and tool fitted; its own effects are identified again.
        data: All rows; `used` (N,) marks those that are fitted.
        names: What may be added.
        noise: Of a measured number.
        known: Curves by the rows that they are over; problems with other noise or names share them.
        excluded: Names that the user left out; a search may come upon further ones.
        weight: (N,) of the rows' squares, where some count for less (`heavy_tails`).
        built: Effects of the core, by their entries: each is made once.
        arm_size: Standard deviation by which the geometry is held near nominal, in plausible sizes; 0: base and tool
            alone are fitted. None: it is held as `priors.widest` has it.
        is_plain: Are names fitted by themselves, as `calibrate` does, without what comes with them (`with_nuisances`)?
        repeatability: Of the joints over the noise of a corner [rad / px], where cameras see boards (`postures`).
        joints_repeat: No noise of the joints is looked for (`joint_repeats`).
        levers: By what the joints move the numbers of data, known once for all problems of these (`decorrelation`).
    """

    start: CalibrationProblem
    data: Dataset
    used: NDArray[np.bool_]
    names: list[Hypothesis]
    noise: Noise
    threads: int = 1
    known: dict[bytes, Known] = field(default_factory=dict)
    excluded: frozenset[Exclusion] = frozenset()
    weight: FloatArray | None = None
    built: dict[str, _core.Effect] = field(default_factory=dict)
    arm_size: float | None = None
    is_plain: bool = False
    repeatability: float | None = None
    joints_repeat: bool = False
    levers: dict[int, Levers] = field(default_factory=dict)

    @property
    def curves(self) -> Known:
        """Curves over the fitted rows, kept for later searches: each is computed once."""
        return self.known.setdefault(self.used.tobytes(), {})

    @cached_property
    def kept(self) -> Dataset:
        """The rows that are fitted, with the column of ones."""
        kept = self.data.select(self.used)
        return replace(kept, extra={**kept.extra, ONE: np.ones(len(kept))})

    @cached_property
    def measured(self) -> _core.Measurements:
        """What was measured in them."""
        return measurements(self.kept, self.start.robot)

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Indices of the fitted rows in `data`."""
        return np.flatnonzero(self.used)

    @cached_property
    def own(self) -> int:
        """Parameters of the robot itself."""
        return len(self.start.model.robot.parameters)

    @cached_property
    def touched(self) -> NDArray[np.intp] | None:
        """(N,) place that each row of `data` touches; None where no places are held out (`touched_places`)."""
        return touched_places(self.data, measurements(self.data, self.start.robot))

    @property
    def has_nominal_arm(self) -> bool:
        """Are base and tool all of the arm that is fitted?"""
        return self.arm_size == 0

    @cached_property
    def geometry(self) -> list[int]:
        """Those of the robot's own parameters that are identified."""
        asked = [i for i in self.start.asked if i < self.own]
        if not self.has_nominal_arm:
            return asked
        return [i for i in asked if self.start.parameters[i].owner in ("base", "tool")]

    @cached_property
    def stays(self) -> NDArray[np.intp]:
        """(N,) of all rows, the stay in a posture that each belongs to."""
        return stays(self.data)

    @cached_property
    def successions(self) -> dict[bytes, tuple[NDArray[np.intp], FloatArray]]:
        """What `memory` finds of rows, by the rows of their numbers."""
        return {}

    @cached_property
    def joint_noises(self) -> dict[bytes, JointNoise]:
        """What `decorrelation` finds of rows, by the rows of their numbers."""
        return {}

    @cached_property
    def unknowns(self) -> FloatArray:
        """(U,) unknowns of the observations, to begin with: places of anchors, planes ..."""
        return np.asarray(self.start.alignment.unknowns, dtype=np.float64)

    def linearized(
        self,
        model: _core.ErrorModel,
        samples: _core.Samples,
        theta: FloatArray,
        memory: _core.TwistMemory | None = None,
        *,
        columns: bool = True,
    ) -> Linearization:
        """What was measured in the fitted rows, near parameters of a model; `memory` and `columns` as of the core."""
        common = noise_by_observation(self.measured, self.noise.common)
        near = _core.linearize(model, samples, self.measured, theta, common, self.threads, memory, columns)
        row, number = (np.asarray(index, dtype=np.intp) for index in (near.row, near.number))
        all_J, r = near.J, near.r
        if self.pictures is not None:
            row, number = self.pictures.row, self.pictures.number
            all_J, r = self.pictures.of(np.asarray(near.J)), self.pictures.of(np.asarray(near.r))
        if not self.noise.scale and self.weight is None:
            return Linearization(all_J, r, row, number)
        size = 1 / np.array([self.noise.scale.get(kind, 1.0) for kind in self.kinds])[number]
        if self.weight is not None:
            size *= np.sqrt(self.weight[self.rows[row]])
        J = np.empty(all_J.shape)
        each(lambda rows: np.multiply(all_J[rows], size[rows, np.newaxis], out=J[rows]), moved(len(J), len(J.T)))
        return Linearization(J, r * size, row, number)

    @cached_property
    def pictures(self) -> Postures | None:
        """How the corners of pictures are taken together; None where there are none."""
        if self.repeatability is None:
            return None
        model, samples = self.model(self.given, self.kept)
        common = [1.0] * len(self.measured.observations)
        theta = np.concatenate([model.start, self.unknowns])
        near = _core.linearize(model, samples, self.measured, theta, common, self.threads)
        rows = posture_rows(self.start.robot, self.kept, self.measured, near, self.unknowns)
        return Postures(rows, self.repeatability)

    @cached_property
    def kinds(self) -> list[str]:
        """Kind of observation of each number of a row: position three times, orientation three times."""
        return [kind_of(of) for of in self.measured.observations for _ in of.components]

    @cached_property
    def misfit(self) -> float:
        """Length of the residual that the robot leaves as it came, base and tool fitted, whitened but for `factor`.

        At least that of the noise.
        """
        model, samples = self.model(self.given, self.kept)
        theta = np.concatenate([model.start, self.unknowns])
        near = self.linearized(model, samples, theta)
        return max(float(np.linalg.norm(near.r)), self.noise.factor * float(np.sqrt(len(near.r))))

    @property
    def given(self) -> list[Spec]:
        """Effects that the robot file has."""
        return list(self.start.robot.entries)

    def complete(self, entries: Sequence[Spec]) -> list[Spec]:
        """Effects of the robot file and these, with what comes with them."""
        every = [*self.given, *entries]
        return every if self.is_plain else with_nuisances(every, self.start.robot)

    def effects(self, entries: Sequence[Spec]) -> list[_core.Effect]:
        """The entries as the core has them."""
        return build_effects([core_entry(entry) for entry in entries], self.start.model.robot, self.built)

    def model(
        self, entries: Sequence[Spec], data: Dataset, effects: Sequence[_core.Effect] | None = None
    ) -> tuple[_core.ErrorModel, _core.Samples]:
        """The robot with these effects at 0, and the conditions of the rows of `data`; `effects` where known."""
        core = self.start.model.robot
        effects = self.effects(entries) if effects is None else list(effects)
        model = _core.ErrorModel(core, effects).with_equilibrium(self.start.model.at_equilibrium)
        return model, build_samples([core_entry(e) for e in entries], effects, core, data.q, condition_columns(data))

    def with_rows(self, used: NDArray[np.bool_]) -> Problem:
        """The same with other rows fitted."""
        return replace(self, used=used)

    def with_noise(self, noise: Noise) -> Problem:
        """The same with other noise."""
        return replace(self, noise=noise)


def _of_a_size(problem: CalibrationProblem) -> CalibrationProblem:
    """Where nothing measured shows how long links are, lengths that `calibrate` holds stay at nominal.

    All that touches of unknown points leave falls with the size of the arm: free of it, a fit ends in an arm of none.
    """
    if problem.measured.shows_scale:
        return problem
    every, own = problem.parameters, len(problem.model.robot.parameters)
    held = {i for i in problem.identify().held if i < own and every[i].unit == "m" and every[i].owner != "base"}
    return replace(problem, asked=[i for i in problem.asked if i not in held])


def prepared_problem(
    robot: Robot,
    data: Dataset,
    names: list[Hypothesis],
    noise: Noise,
    threads: int,
    excluded: frozenset[Exclusion] = frozenset(),
) -> Problem:
    """All measured rows, base and tool fitted."""
    start = _of_a_size(prepare(robot, data, effects="geometry", threads=threads))
    repeatability = joint_repeatability(start) if CORNERS in data.kinds else None
    return Problem(start, data, data.measured, names, noise, threads, excluded=excluded, repeatability=repeatability)


def core_entry(entry: Spec) -> Spec:
    """An entry without what only the diagnosis knows."""
    return {key: value for key, value in entry.items() if key != "corner"}


def with_nuisances(entries: Sequence[Spec], robot: Robot) -> list[Spec]:
    """The entries, and what comes with those that follow loads, held by priors: the errors of masses and centres.

    Where the robot has no masses, a joint that yields under a payload yields under the arm's unknown weight as well.
    """
    effects = build_effects([core_entry(entry) for entry in entries], robot.core)
    there = {(entry["effect"], entry["owner"]) for entry in entries}
    out = list(entries)
    if not any(effect.follows_loads for effect in effects):
        return out
    traits = {name: traits_of(name) for name in effect_names()}
    nuisances = [
        (effect, owner)
        for effect in traits
        if traits[effect].role == "nuisance"
        for owner in effect_owners(effect, robot.core)
        if _has_mass(robot, owner)
    ]
    if without_masses(robot):
        yielding = dict.fromkeys(e["owner"] for e in entries if traits[e["effect"]].depends_on == ("torque",))
        nuisances += [
            (effect, owner)
            for effect in traits
            if traits[effect].without_masses
            for owner in yielding
            if owner in effect_owners(effect, robot.core)
        ]
    held = [{"effect": e, "owner": o, "prior": "yes"} for e, o in nuisances if (e, o) not in there]
    return out + [with_reference(entry, robot) for entry in held]


def _has_mass(robot: Robot, owner: str) -> bool:
    """Is the mass of a link known? True for what is not a link."""
    if not owner.startswith("link"):
        return True
    return robot.joints[place_of(owner).index].mass_kg > 0
