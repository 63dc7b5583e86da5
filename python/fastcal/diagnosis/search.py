# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The search: sets of effects with which nothing significant remains.

Detection, identification, adaptation (Teunissen 2018): a set of effects suffices if, with it in the model, no other
effect and no generic block is significant (encompassing). Sets grow from the best few of each size, each refitted with
all its nonlinearity; in those that suffice, every member is then exchanged for every other effect that could replace
it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.repeatability import posture_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.blocks import Blocks, blocks
from fastcal.diagnosis.doubts import is_impossible, step_around_few_rows
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.held_out import STRETCHES, HeldOut, gain, last_stretch, lead, positions
from fastcal.diagnosis.hypothesis import Hypothesis, Key
from fastcal.diagnosis.library import without_masses
from fastcal.diagnosis.periodic import forward, is_periodic, many_waves
from fastcal.diagnosis.problem import Problem
from fastcal.diagnosis.recent import Recent
from fastcal.diagnosis.scans import at_best_moment
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.effects.entries import traits_of
from fastcal.said import said

FloatArray = NDArray[np.float64]

# Sets of one size that are kept.
BEAM_WIDTH = 3
# Names that are tried in place of each member of a set that grows on.
EXCHANGES_PER_MEMBER = 2
# Names that are tried in place of each member of the set that is given.
REPLACEMENTS_PER_MEMBER = 8
# Share of a member's chi square that a replacement must explain by its score test to be tried.
REPLACEMENT_SHARE = 0.5

# Numbers of Jacobians (measured numbers times parameters) that the fits of one search may evaluate before it tries no
# larger sets and no further exchanges: 1,500 linearizations of 300 points with 75 parameters. A limit of effort:
# simulated sets of 300 rows took 0.3 to 25 % of it.
MAX_WORK = 1e8
_LOADS = frozenset(["torque", "load"])


RECENT: Recent[Blocks] = Recent(lambda found: found.bytes)


@dataclass(frozen=True)
class Family:
    """How many independent tests the named and the generic blocks are worth."""

    named: float
    generic: float


@dataclass(frozen=True, eq=False)
class SearchNode:
    """A set of names, its fit, and what is significant beyond it."""

    fit: Fit
    family: Family

    @property
    def names(self) -> tuple[Hypothesis, ...]:
        """The added names."""
        return self.fit.added

    @property
    def blocks(self) -> Blocks:
        """Score tests of everything else; those of sets that were asked about long ago are made anew."""
        return RECENT.of(self, lambda: blocks(self.fit))

    @property
    def is_tested(self) -> bool:
        """Was anything asked about what is beyond it? Many sets of a search are fitted and left at that."""
        return RECENT.was_asked(self)

    @cached_property
    def p_values(self) -> FloatArray:
        """Of all blocks, without correction for their number."""
        scores = self.blocks.tests.scores
        return p_values(np.asarray(scores.statistic), np.asarray(scores.rank), self.fit.problem.noise.freedom)

    @cached_property
    def predicted(self) -> FloatArray:
        """(N,) squares of held-out rows: `HeldOut.squares`."""
        return HeldOut(self.fit).squares()

    @cached_property
    def gains(self) -> list[tuple[float, float]]:
        """By how much each name helps to predict held-out rows, and its standard error (`held_out.gain`).

        Of what errs by its joint's own position, rows at positions that were held out. Rows of one posture may err
        alike, whatever they carry.
        """
        owners = [name.owner if is_periodic(name) else None for name in self.names]
        held = {owner: HeldOut(self.fit, owner=owner) for owner in dict.fromkeys(owners)}
        whole = {owner: part.squares() for owner, part in held.items()}
        data = self.fit.problem.data
        group = {owner: posture_groups(data) if owner is None else positions(data, owner) for owner in held}
        return [
            gain(whole[owner], held[owner].squares(self.fit.columns(name)), group[owner])
            for name, owner in zip(self.names, owners, strict=True)
        ]

    def gain_by_stretches(self, name: Hypothesis) -> tuple[float, float]:
        """By how much a name helps to predict stretches of the order of measuring, and its standard error."""
        held = HeldOut(self.fit, owner=STRETCHES)
        return gain(held.squares(), held.squares(self.fit.columns(name)))

    def lead_at_the_end(self, name: Hypothesis) -> float:
        """Standard errors by which a name helps to predict the last of these stretches."""
        held = HeldOut(self.fit, owner=STRETCHES)
        return lead(held.squares(), held.squares(self.fit.columns(name)), last_stretch(self.fit.problem.data))

    def wald(self, name: Hypothesis) -> float:
        """Wald's chi square of one name: b^T S^-1 b, S the covariance of its parameters b."""
        at = self.fit.columns(name)
        value = self.fit.value(name)
        return float(value @ np.linalg.lstsq(self.fit.covariance[np.ix_(at, at)], value)[0])

    @property
    def bic(self) -> float:
        """Of the set: what remains and log m for each parameter that it adds."""
        m = len(self.fit.near.r)
        return float(self.fit.remaining + np.log(m) * self.size)

    @property
    def size(self) -> int:
        """Parameters that the names add, those that were searched for among them."""
        return sum(self.fit.place(n).stop - self.fit.place(n).start + n.searched for n in self.names)

    def significant(self, named: float | None = None, generic: float | None = None) -> list[int]:
        """Blocks that are, at family-wise levels (ALPHA_NAMED, ALPHA_GENERIC), the strongest first."""
        named = rules.ALPHA_NAMED if named is None else named
        generic = rules.ALPHA_GENERIC if generic is None else generic
        p = self.p_values
        limit = np.where(
            np.arange(len(p)) < self.blocks.count, named / self.family.named, generic / self.family.generic
        )
        found = np.flatnonzero(p < limit)
        return [int(i) for i in found[np.argsort(p[found], kind="stable")]]

    @cached_property
    def suffices(self) -> bool:
        """Nothing more is detected, and the names have possible signs."""
        level = rules.ALPHA_FURTHER if self.names else rules.ALPHA_DETECT
        return not self.impossible and not self.significant(level / 2, level / 2)

    def is_compatible_with(self, best: SearchNode) -> bool:
        """No block is significant at the levels of a confidence set but those that the best set leaves too."""
        left = {best.blocks.label(i) for i in best.significant()}
        return not self.impossible and all(self.blocks.label(i) in left for i in self.significant())

    @cached_property
    def impossible(self) -> bool:
        """A parameter is beyond its bounds, a law bends where no rows are or has no load: another cause's symptoms.

        Or steps go there and back around a few rows.
        """
        return any(is_impossible(self.fit, name) for name in self.names) or step_around_few_rows(self.fit)

    @property
    def key(self) -> tuple[str, ...]:
        """Equal for the same set."""
        return tuple(sorted(map(repr, self.names)))


@dataclass(eq=False)
class Search:
    """Remembers every set that was fitted; `earlier` are those of a search with other noise: where fits begin.

    `work` counts the numbers of Jacobians that its fits took; beyond MAX_WORK no larger sets and no exchanges are
    tried, and `is_cut_short` says that some were left untried.
    """

    problem: Problem
    notify: Callable[[str], None] = lambda text: None
    most: int = field(default_factory=lambda: rules.MAX_EFFECTS)
    seen: dict[tuple[str, ...], SearchNode] = field(default_factory=dict)
    earlier: dict[tuple[str, ...], SearchNode] = field(default_factory=dict)
    work: int = 0
    is_cut_short: bool = False

    def may_go_on(self) -> bool:
        """Is there work left for what a search would try next? Where not, it was cut short."""
        self.is_cut_short |= self.work > MAX_WORK
        return not self.is_cut_short

    def again(self, problem: Problem) -> Search:
        """A search of the same robot and data with more names or other noise."""
        return Search(problem, self.notify, self.most, earlier=self.earlier | self.seen)

    @cached_property
    def start(self) -> SearchNode:
        """Nothing added."""
        first = SearchNode(fit(self.problem, []), Family(1.0, 1.0))
        count, rank = first.blocks.count, np.asarray(first.blocks.tests.scores.rank)
        # Far in the tail, tests that look alike rarely pass together: each counts.
        causes = {n.cause for n, r in zip(first.blocks.names, rank, strict=False) if r > 0}
        state = SearchNode(first.fit, Family(max(len(causes), 1.0), max(float(np.sum(rank[count:] > 0)), 1.0)))
        RECENT.of(state, lambda: first.blocks)
        return state

    @cached_property
    def many_waves(self) -> list[int]:
        """Names of the start that are all significant waves, where the errors are those of many waves; else none."""
        return many_waves(self.start, self.most)

    def grow(self) -> list[list[SearchNode]]:
        """Sets of 0, 1, ... names, the best of each size first, until one suffices or `most` are in; or many waves."""
        levels = [[self.start]]
        if not self.start.suffices and self.many_waves:
            waves = [self.start.blocks.names[i] for i in self.many_waves]
            return [*levels, [self.state(waves, self.start)]]
        while not any(state.suffices for state in levels[-1]) and len(levels) <= self.most and self.may_go_on():
            children: dict[tuple[str, ...], SearchNode] = {}
            for state in levels[-1][:BEAM_WIDTH]:
                if children and not self.may_go_on():
                    break
                for names in self.next_sets(state, rules.CHILDREN_PER_NODE):
                    child = self.state(names, state)
                    if self._is_earned(child, state):
                        children[child.key] = child
            if not children:
                break
            ranked = sorted((c for c in children.values() if not c.impossible), key=lambda s: s.bic)
            if not ranked:
                break
            # Further down none can be chosen: less likely than the best by more than the odds ask for.
            levels.append(
                [c for k, c in enumerate(ranked) if k < BEAM_WIDTH or c.bic < ranked[0].bic + rules.DECISIVE_BIC]
            )
            self.notify(said("{count} effects: {effects}", count=len(levels) - 1, effects=", ".join(ranked[0].key)))
        return self._with_last_sets(levels)

    def _with_last_sets(self, levels: list[list[SearchNode]]) -> list[list[SearchNode]]:
        """Larger sets where none suffices, and all joints that yield where several names do.

        Of joints that all yield the first to be found is often a link that bends, and what comes next makes up for it.
        """
        likeliest = min(levels[-1], key=lambda s: s.bic)
        if len(levels) > self.most and not any(state.suffices for state in levels[-1]):
            return [*levels, [self.grown_on(seed) for seed in (likeliest, *self.yielding_joints())]]
        if sum(map(_yields, likeliest.names)) > 1:
            return [*levels[:-1], [*levels[-1], *self.yielding_joints()]]
        return levels

    def explains_little(self, state: SearchNode) -> bool:
        """Do the names of a set explain too small a share of the misfit?"""
        return state.fit.remaining > (1 - rules.MIN_EXPLAINED_SHARE) * self.start.fit.remaining

    def yielding_joints(self) -> list[SearchNode]:
        """The set of all joints that give under load, each of which explains more beyond the others; at most one."""
        found = self.start.blocks
        among = [
            i
            for i, name in enumerate(found.names)
            if traits_of(name.effect).depends_on == ("torque",) and found.sizes[i] == 1
        ]
        chosen = forward(self.start, among, len(among)) if among else []
        return [self.state([found.names[i] for i in chosen], self.start)] if len(chosen) > 1 else []

    def grown_on(self, state: SearchNode) -> SearchNode:
        """A set with more names, one at a time, its members exchanged after each, while BIC falls by DECISIVE_BIC.

        A wrong first name, such as a link that bends where two joints yield, gives way once the others are in.
        """
        while not state.suffices and len(state.names) < rules.MAX_EFFECTS_GROWN and self.may_go_on():
            children = [self.state(names, state) for names in self.next_sets(state, rules.CHILDREN_PER_NODE)]
            earned = [c for c in children if not c.impossible and self._is_earned(c, state)]
            if not earned:
                break
            more = self._exchanged(min(earned, key=lambda s: s.bic))
            if more.bic > state.bic - rules.DECISIVE_BIC:
                break
            state = more
        return state

    def _exchanged(self, state: SearchNode) -> SearchNode:
        """The set with members exchanged for likelier names, one at a time, until none is better by DECISIVE_BIC."""
        for _ in range(rules.MAX_EFFECTS_GROWN):
            others = [
                self.state(names, state)
                for member in state.names
                if self.may_go_on()
                for names in self.next_sets(self.without(state, member), EXCHANGES_PER_MEMBER)
            ]
            best = min((s for s in others if not s.impossible), key=lambda s: s.bic, default=state)
            if best.bic > state.bic - rules.DECISIVE_BIC:
                return state
            state = best
        return state

    def _is_earned(self, child: SearchNode, parent: SearchNode) -> bool:
        """Is what a set explains beyond another still significant when it is fitted? A score may promise too much."""
        drop = np.array([parent.fit.remaining - child.fit.remaining])
        more = np.array([child.size - parent.size], dtype=np.int32)
        return bool(p_values(drop, more, self.problem.noise.freedom)[0] < rules.ALPHA_NAMED / self.start.family.named)

    def next_sets(self, state: SearchNode, count: int) -> list[tuple[Hypothesis, ...]]:
        """Sets with one name more, or a richer name in place of one, the most promising names first."""
        tests = state.blocks.tests
        gain = np.asarray(tests.scores.statistic)[: state.blocks.count]
        rank = np.asarray(tests.scores.rank)[: state.blocks.count]
        p = state.p_values[: state.blocks.count]
        worth = state.blocks.worth(gain, rank, np.arange(len(gain)))
        order = np.argsort(-worth, kind="stable")
        out: list[tuple[Hypothesis, ...]] = []
        causes: set[tuple[Any, ...]] = set()
        best_of: dict[Key, float] = {}
        for name, value in zip(state.blocks.names, worth, strict=True):
            best_of[name.key] = max(best_of.get(name.key, -np.inf), float(value))
        for i in order:
            name = state.blocks.names[i]
            if any(
                worth[i] < best_of.get((simple, name.owner), -np.inf) + rules.DECISIVE_BIC
                for simple in name.traits.generalizes
            ):
                continue  # the simpler name does as well
            if len(out) >= count:
                break
            if p[i] > rules.ALPHA_NAMED / state.family.named:
                break
            richer = [n for n in state.names if n.owner == name.owner and name.effect in n.traits.generalizes]
            if name.cause in causes or richer:
                continue
            causes.add(name.cause)
            simpler = name.traits.generalizes
            kept = tuple(n for n in state.names if not (n.owner == name.owner and n.effect in simpler))
            out.append((*kept, at_best_moment(name, state)))
            if without_masses(self.problem.start.robot):
                # The score of a compliance lacks the sag that comes with it, which a richer one can feign.
                simple = [n for n in state.blocks.names if n.owner == name.owner and n.effect in simpler]
                out += [(*kept, n) for n in simple if n.cause not in causes]
                causes.update(n.cause for n in simple)
        return out

    def state(self, names: Sequence[Hypothesis], near: SearchNode) -> SearchNode:
        """The fit of a set, from a fit of nearly the same."""
        key = tuple(sorted(map(repr, names)))
        if key not in self.seen:
            begun = self.earlier.get(key, near)
            self.seen[key] = SearchNode(fit(self.problem, names, begun.fit), self.start.family)
            self.work += self.seen[key].fit.work
        return self.seen[key]

    def pruned(self, state: SearchNode) -> SearchNode:
        """A set without the names that it can do without.

        Where it suffices, those without which it does too; where something remains, those below
        MIN_SNR_BESIDE_REST: they may be shadows of what has no name. Of many, the weaker half of these at once.
        """
        while len(state.names) > self.most and not state.suffices:
            worth = [state.wald(name) for name in state.names]
            weak = [i for i in np.argsort(worth, kind="stable") if worth[i] <= rules.MIN_SNR_BESIDE_REST**2]
            if not weak:
                return state
            gone = weak[: (len(weak) + 1) // 2]
            rest = [name for i, name in enumerate(state.names) if i not in gone]
            state = self.state(rest, state) if rest else self.start
        while state.names and len(state.names) <= self.most:
            fewer = min((self.without(state, name) for name in state.names), key=lambda s: s.fit.remaining)
            if state.suffices and not (fewer.suffices and fewer.bic < state.bic):
                break
            if not state.suffices and fewer.fit.remaining - state.fit.remaining > rules.MIN_SNR_BESIDE_REST**2:
                break
            state = fewer
        return state

    def without(self, state: SearchNode, name: Hypothesis) -> SearchNode:
        """A set without one of its names."""
        rest = [n for n in state.names if n is not name]
        return self.state(rest, state) if rest else self.start

    def alternatives(self, best: SearchNode) -> list[list[SearchNode]]:
        """For each member of a set that stands, the sets that stand as well with another name in its place."""
        return [self._replacements(best, self.without(best, member), member) for member in best.names]

    def known_alternatives(self, best: SearchNode) -> list[list[SearchNode]]:
        """As `alternatives`, of the sets that the search has fitted: of many names, to try each takes long."""
        likely = [s for s in self.seen.values() if not s.impossible and s.bic < best.bic + rules.DECISIVE_BIC]
        return [[s for s in likely if _exchanges(s, best, n) and s.is_compatible_with(best)] for n in best.names]

    def _replacements(self, best: SearchNode, base: SearchNode, member: Hypothesis) -> list[SearchNode]:
        worth = base.fit.remaining - best.fit.remaining
        scores = base.blocks.tests.scores
        statistic, rank = np.asarray(scores.statistic), np.asarray(scores.rank)
        enough = REPLACEMENT_SHARE * max(worth, 0.0)
        found: list[tuple[Hypothesis, SearchNode]] = []
        keys: set[Key] = {member.key}
        order = np.argsort(-statistic[: base.blocks.count], kind="stable")
        tried = 0
        for i in order:
            name = base.blocks.names[i]
            if statistic[i] < enough or rank[i] == 0 or tried >= REPLACEMENTS_PER_MEMBER:
                break
            if name.key in keys or (member.effect in name.traits.generalizes and name.owner == member.owner):
                continue
            keys.add(name.key)
            tried += 1
            state = self.state((*base.names, at_best_moment(name, base)), best)
            # One of more parameters that fits no worse is refused by its parameters alone: too little to call it wrong.
            is_let = state.is_compatible_with(best) or (self._loads_are_guessed(member, name) and not state.impossible)
            if is_let and (state.bic < best.bic + rules.DECISIVE_BIC or state.fit.remaining <= best.fit.remaining):
                found.append((name, state))
        simple = {name.key for name, _ in found} | {member.key}
        return [
            state
            for name, state in found
            if not any((simpler, name.owner) in simple for simpler in name.traits.generalizes)
        ]

    def _loads_are_guessed(self, *names: Hypothesis) -> bool:
        """Do names yield to loads in data of one payload? If it did vary, what it did stays significant beside any."""
        return not np.ptp(self.problem.data.payload) and all(map(_yields, names))


def _yields(name: Hypothesis) -> bool:
    """Does a name yield to loads?"""
    return not _LOADS.isdisjoint(name.traits.depends_on)


def _exchanges(state: SearchNode, best: SearchNode, member: Hypothesis) -> bool:
    """Does a set hold another effect or owner in place of one member of the best, and else the same?"""
    keys, rest = {name.key for name in state.names}, {name.key for name in best.names if name is not member}
    return len(state.names) == len(best.names) and rest <= keys and member.key not in keys
