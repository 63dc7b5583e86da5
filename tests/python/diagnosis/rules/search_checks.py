# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Detection and identification: levels, the search over sets, what may replace a member."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np

from fastcal import load_robot
from fastcal.diagnosis import held_out_gains, rivals, rounds, rules
from fastcal.diagnosis.many_rows import searched_rows
from fastcal.diagnosis.search import RECENT, Family, Search, SearchNode
from fastcal.measurements.dataset import Dataset

from . import small_arm
from .linear_world import World, columns, name, predicting
from .mutants import falls_with


def state(p: list[float], names: int = 1, added: int = 0) -> SearchNode:
    """A set of `added` names that leaves these p values, of `names` names and blocks after them."""
    fit = SimpleNamespace(added=tuple(range(added)))
    found = SearchNode(fit, Family(1.0, 1.0))
    found.__dict__["p_values"] = np.array(p)
    RECENT.of(found, lambda: SimpleNamespace(count=names, label=str, bytes=0.0))
    found.__dict__["impossible"] = False
    return found


@falls_with(ALPHA_DETECT=1e-9)
@falls_with(ALPHA_DETECT=0.5)
def one_of_two_hundred_complete_models_shows_something() -> None:
    """Half of the level is spent on names, half on blocks without one."""
    assert state([0.003, 0.003]).suffices
    assert not state([0.002, 0.5]).suffices
    assert not state([0.5, 0.002]).suffices


@falls_with(ALPHA_FURTHER=1e-9)
@falls_with(ALPHA_FURTHER=0.5)
def two_of_a_thousand_true_sets_show_something_more() -> None:
    assert state([0.0015, 0.5], added=1).suffices
    assert not state([0.0005, 0.5], added=1).suffices


@falls_with(ALPHA_NAMED=1e-9)
@falls_with(ALPHA_GENERIC=1e-9)
@falls_with(ALPHA_NAMED=0.5)
@falls_with(ALPHA_GENERIC=0.5)
def three_names_and_one_block_of_a_hundred_refuse_a_true_name() -> None:
    clean = state([0.5, 0.5])
    assert state([0.04, 0.02]).is_compatible_with(clean)
    assert not state([0.02, 0.5]).is_compatible_with(clean)
    assert not state([0.5, 0.005]).is_compatible_with(clean)


def decoy_world() -> tuple[World, list]:
    """Two causes, and a decoy that comes first alone and leaves something that has no name."""
    C = columns(6)
    a, b, decoy, *others = (name(k + 1) for k in range(6))
    near = np.sqrt(0.985 / 2) * (C[:, 0] + C[:, 1]) + np.sqrt(0.015) * C[:, 2]
    named = dict(zip([a, b, decoy, *others], [C[:, 0], C[:, 1], near, *C[:, 3:].T], strict=True))
    return World(named, 60.0 * (C[:, 0] + C[:, 1]), {"joint9": C[:, 2]}), [a, b]


@falls_with(BEAM_WIDTH=1, CHILDREN_PER_NODE=1, MAX_EFFECTS=1)
def a_decoy_that_comes_first_does_not_hide_the_two_causes() -> None:
    world, truth = decoy_world()
    with world.search() as search:
        best = min((s for s in search.grow()[-1] if s.suffices), key=lambda s: s.bic, default=search.start)
    assert set(best.names) == set(truth)


@falls_with(EXCHANGES_PER_MEMBER=0)
def a_wrong_first_name_gives_way_once_the_others_are_in() -> None:
    C = columns(4)
    a, b, decoy, other = (name(k + 1) for k in range(4))
    near = C[:, :3] @ [0.8, 0.5, np.sqrt(1 - 0.8**2 - 0.5**2)]
    world = World({a: C[:, 0], b: C[:, 1], decoy: near, other: C[:, 3]}, 60.0 * (C[:, 0] + C[:, 1]))
    with world.search() as search:
        grown = search.grown_on(search.state([decoy], search.start))
    assert set(grown.names) == {a, b}


@falls_with(MAX_EFFECTS_GROWN=4)
def six_causes_are_found() -> None:
    C = columns(9)
    names = [name(k + 1) for k in range(9)]
    world = World(dict(zip(names, C.T, strict=True)), C[:, :6] @ np.linspace(40.0, 60.0, 6))
    with world.search() as search:
        best = min(search.grow()[-1], key=lambda s: s.bic)
    assert set(best.names) == set(names[:6])


@falls_with(MAX_WORK=0.0)
@falls_with(MAX_WORK=1e12)
def a_search_ends_where_its_work_is_done() -> None:
    C = columns(9)
    names = [name(k + 1) for k in range(9)]
    world = World(dict(zip(names, C.T, strict=True)), C[:, :6] @ np.linspace(40.0, 60.0, 6))
    plain, fitted = world.fit, []

    def dear(*arguments: Any) -> Any:
        fitted.append(arguments)
        return SimpleNamespace(**{**vars(plain(*arguments)), "work": 1e7})

    world.fit = dear  # type: ignore[method-assign]
    with world.search() as search:
        search.grow()
    assert search.is_cut_short
    assert 10 <= len(fitted) <= 10 + rules.CHILDREN_PER_NODE + 2


@falls_with(SEARCHED_NUMBERS=1500)
@falls_with(SEARCHED_NUMBERS=10**9)
def names_are_searched_for_in_eighteen_thousand_numbers() -> None:
    """Of 20,000 rows that is 6,000 of positions and 3,000 of poses."""
    q = np.random.default_rng(0).uniform(-1, 1, (20_000, 6))
    positions = Dataset(q=q, payload=np.zeros(len(q)), position=q[:, :3])
    poses = replace(positions, rotation=np.tile([1.0, 0.0, 0.0, 0.0], (len(q), 1)))
    for data, most in ((positions, 6000), (poses, 3000)):
        assert searched_rows(data.select(slice(0, most)), load_robot("ur5")) is None
        chosen = searched_rows(data, load_robot("ur5"))
        assert chosen is not None
        assert most <= len(chosen) <= most + 30


@falls_with(MIN_SNR_BESIDE_REST=0.0)
@falls_with(MIN_SNR_BESIDE_REST=1e3)
def beside_something_without_a_name_only_loud_names_stay() -> None:
    C = columns(4)
    loud, weak = name(1), name(2)
    world = World({loud: C[:, 0], weak: C[:, 1]}, C[:, :3] @ [60.0, 7.0, 80.0], {"joint3": C[:, 2]})
    with world.search() as search:
        found = search.pruned(search.state([loud, weak], search.start))
    assert found.names == (loud,)


@falls_with(MIN_SNR_BESIDE_REST=0.0)
@falls_with(MIN_SNR_BESIDE_REST=1e3)
def so_do_those_of_a_longer_list() -> None:
    C = columns(7)
    names = [name(k + 1) for k in range(6)]
    sizes = np.array([60.0, 7.0, 5.0, 30.0, 6.0, 3.0])
    world = World(dict(zip(names, C.T, strict=False)), C @ [*sizes, 80.0], {"joint9": C[:, 6]})
    with world.search() as search:
        assert search.pruned(search.state(names, search.start)).names == (names[0], names[3])


@falls_with(MIN_GAIN=-1e9)
@falls_with(MIN_GAIN=1e9)
def of_ten_names_those_that_help_held_out_rows_stay() -> None:
    C = columns(10)
    names = [name(k + 1, "gear_harmonic", order=2.0) for k in range(10)]
    world = World(dict(zip(names, C.T, strict=True)), 20.0 * C.sum(axis=1))
    helps = {repr(member): 3.0 if k < 6 else 1.0 for k, member in enumerate(names)}
    with (
        world.search() as search,
        predicting(0.5),
        mock.patch.object(
            SearchNode, "gains", property(lambda self: [(0.1 * helps[repr(n)], 0.1) for n in self.names])
        ),
    ):
        assert set(held_out_gains.borne_out(search, search.state(names, search.start)).names) == set(names[:6])


@falls_with(MAX_PLAUSIBLE_SIZE=np.inf)
def beside_something_without_a_name_no_wave_is_larger_than_gears_have() -> None:
    wave = name(1, "gear_harmonic", order=2.0)
    parameters = [SimpleNamespace(name=n, sigma=3e-4) for n in ("sine_2x", "cosine_2x")]

    def is_oversized(amplitude: float, suffices: bool) -> bool:
        fit = SimpleNamespace(
            place=lambda n: slice(0, 2), theta=np.array([amplitude, 0.0]), model=SimpleNamespace(parameters=parameters)
        )
        return held_out_gains._is_oversized_wave(SimpleNamespace(fit=fit, suffices=suffices), wave)

    assert is_oversized(0.3, suffices=False)
    assert not is_oversized(3e-3, suffices=False)
    assert not is_oversized(0.3, suffices=True)


def likeness_world(alike: float) -> tuple[World, list]:
    """A cause of 25 times the noise, another that looks alike, and one that does not."""
    C = columns(3)
    names = [name(k + 1) for k in range(3)]
    other = alike * C[:, 0] + np.sqrt(1 - alike**2) * C[:, 1]
    return World(dict(zip(names, [C[:, 0], other, C[:, 2]], strict=True)), 25.0 * C[:, 0]), names


@falls_with(REPLACEMENTS_PER_MEMBER=0, REPLACEMENT_SHARE=1.1)
def a_name_that_looks_alike_is_an_equivalent() -> None:
    world, names = likeness_world(0.999)
    with world.search() as search:
        found = search.alternatives(search.state([names[0]], search.start))
    assert [[other.names for other in others] for others in found] == [[(names[1],)]]


@falls_with(DECISIVE_BIC=0.0)
def of_many_names_what_was_fitted_on_the_way_is_an_equivalent() -> None:
    for alike, expected in ((0.9999, 1), (0.5, 0)):
        world, names = likeness_world(alike)
        with world.search() as search:
            best, other = (search.state([n, names[2]], search.start) for n in names[:2])
            best, other = sorted((best, other), key=lambda state: state.bic)
            (others, none) = search.known_alternatives(best)
        assert others == [other][:expected]
        assert none == []


@falls_with(REPLACEMENT_SHARE=0.0)
def a_name_that_explains_too_little_is_not_even_fitted() -> None:
    world, names = likeness_world(0.5)
    with world.search() as search:
        assert search.alternatives(search.state([names[0]], search.start)) == [[]]
        assert (repr(names[1]),) not in search.seen
        assert (repr(names[2]),) not in search.seen


@falls_with(DECISIVE_BIC=0.0)
@falls_with(DECISIVE_BIC=1e6)
def a_set_that_leaves_something_is_given_where_it_is_likelier_by_150_to_1() -> None:
    enough = SimpleNamespace(bic=100.0, suffices=True, impossible=False)
    hardly = SimpleNamespace(bic=91.0, suffices=False, impossible=False)
    clearly = SimpleNamespace(bic=89.0, suffices=False, impossible=False)
    assert rounds._best([[enough, hardly]]) is enough
    assert rounds._best([[clearly], [enough]]) is clearly


@falls_with(MIN_EXPLAINED_SHARE=0.0)
@falls_with(MIN_EXPLAINED_SHARE=1.0)
def names_that_explain_less_than_half_of_the_misfit_are_not_given() -> None:
    start = SimpleNamespace(fit=SimpleNamespace(remaining=1000.0))
    search = SimpleNamespace(start=start)
    assert Search.explains_little(search, SimpleNamespace(fit=SimpleNamespace(remaining=600.0)))
    assert not Search.explains_little(search, SimpleNamespace(fit=SimpleNamespace(remaining=400.0)))


@falls_with(MAX_SEARCHES=1)
def waves_of_other_orders_begin_the_search_again() -> None:
    first, second = (
        SimpleNamespace(bic=9.0, suffices=True, impossible=False, names=[]),
        SimpleNamespace(bic=1.0, impossible=False, names=[]),
    )
    second.suffices = True
    found = {"first": first, "second": second}
    problems = {key: SimpleNamespace(key=key, noise=None) for key in found}
    again = {id(first): (problems["second"], "level 1"), id(second): (None, "level 2")}

    def search_of(problem: SimpleNamespace, notify: object = None) -> SimpleNamespace:
        return SimpleNamespace(grow=lambda: [[found[problem.key]]], is_cut_short=False)

    def rivals_of(search: SimpleNamespace) -> SimpleNamespace:
        more = lambda problem: rivals_of(search_of(problem))  # noqa: E731
        return SimpleNamespace(search=search, names_are_hopeless=False, again=more)

    with (
        mock.patch.object(rounds, "Search", search_of),
        mock.patch.object(rivals, "Rivals", rivals_of),
        mock.patch.object(rounds, "_again", lambda problem, best, sigma, steps_in_noise: again[id(best)]),
    ):
        _, best, level = rounds.searched(problems["first"], "level 0", None, print)
    assert best is second
    assert level == "level 2"


def a_search_that_was_cut_short_begins_again_once_with_what_a_scan_names() -> None:
    for scanned, last in ((["jump"], 1), ([], 0)):
        begun: list[int] = []
        problems = [SimpleNamespace(names=scanned * k, noise=None) for k in range(3)]

        def rivals_of(problem: SimpleNamespace, begun: list[int] = begun) -> SimpleNamespace:
            best = SimpleNamespace(bic=0.0, suffices=True, impossible=False)
            search = SimpleNamespace(grow=lambda: begun.append(0) or [[best]], is_cut_short=True, problem=problem)
            return SimpleNamespace(search=search, names_are_hopeless=False, again=rivals_of)

        def next_of(
            search: SimpleNamespace, best: object, sigma: object, problems: list[SimpleNamespace] = problems
        ) -> tuple[SimpleNamespace, str]:
            return problems[problems.index(search.problem) + 1], "level"

        with (
            mock.patch.object(rounds, "Search", lambda problem, notify: problem),
            mock.patch.object(rivals, "Rivals", rivals_of),
            mock.patch.object(rounds, "_again", next_of),
        ):
            plain, _, _ = rounds.searched(problems[0], "level 0", None, print)
        assert plain.search.problem is problems[last]
        assert len(begun) == last + 1


@falls_with(RESTART_BELOW=0.0)
@falls_with(RESTART_BELOW=1.0)
def markedly_less_noise_begins_the_search_again() -> None:
    before = small_arm.problem(small_arm.measured([]))
    assert rounds._is_calmer(before.with_noise(replace(before.noise, factor=0.8)), before)
    assert not rounds._is_calmer(before.with_noise(replace(before.noise, factor=0.97)), before)
