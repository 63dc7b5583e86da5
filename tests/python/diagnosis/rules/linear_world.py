# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A world in which a fit is linear least squares: the search, the grades and the waves without a robot.

Rows are whitened (noise 1). A world has some columns of geometry, names with a column each, blocks without a name, and
what was measured; `search` is the real one, its fits and score tests those of the world.
"""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np

from fastcal.diagnosis import blocks, rich_model
from fastcal.diagnosis import search as search_module
from fastcal.diagnosis.blocks import Columns
from fastcal.diagnosis.generic import Curves, Generic
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.problem import Noise
from fastcal.diagnosis.projection import basis
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.robot.robot_spec import Joint, Link

ROWS = 240
Array = np.ndarray[Any, Any]


def columns(count: int, seed: int = 0) -> Array:
    """(ROWS, count) orthonormal columns."""
    return np.linalg.qr(np.random.default_rng(seed).standard_normal((ROWS, count)))[0]


def name(joint: int, effect: str = "backlash", **options: Any) -> Hypothesis:
    """A cause; its column is what the world says."""
    variant = "".join(f"{key}={value:g}" for key, value in options.items())
    return Hypothesis({"effect": effect, "owner": f"joint{joint}", **options}, variant)


class World:
    """Names and blocks with a column (ROWS,) or columns (ROWS, k) each, and what was measured (ROWS,)."""

    def __init__(
        self,
        names: dict[Hypothesis, Array],
        measured: Array,
        generics: dict[str, Array] | None = None,
        seed: int = 99,
        q: Array | None = None,
    ) -> None:
        self.names = {n: column.reshape(ROWS, -1) for n, column in names.items()}
        self.generics = {owner: column.reshape(ROWS, -1) for owner, column in (generics or {}).items()}
        noise = np.random.default_rng(seed).standard_normal(ROWS)
        self.geometry = columns(3, seed=1234)
        self.r = measured + noise
        data = SimpleNamespace(time=None, q=q, payload=np.arange(ROWS))
        robot = SimpleNamespace(joints=[Joint("revolute", link=Link(1.0))], passive=())
        start = SimpleNamespace(robot=robot)
        self.problem = SimpleNamespace(
            threads=1,
            names=list(self.names),
            noise=Noise((1.0, 1.0, 1.0)),
            kept=data,
            start=start,
            data=data,
            measured=SimpleNamespace(shows_scale=True),
        )

    def fit(self, problem: Any, added: Sequence[Hypothesis], start: Any = None) -> Any:
        """Least squares by the geometry and the added names."""
        X = np.hstack([self.geometry, *(self.names[n] for n in added)])
        first = 3 + np.cumsum([0, *(self.names[n].shape[1] for n in added)])
        places = {id(n): slice(first[k], first[k + 1]) for k, n in enumerate(added)}
        theta = np.linalg.lstsq(X, self.r, rcond=None)[0]
        left = self.r - X @ theta
        parameters = [SimpleNamespace(name="size", sigma=1.0, lower=-np.inf, upper=np.inf) for _ in range(X.shape[1])]
        return SimpleNamespace(
            problem=problem,
            added=tuple(added),
            theta=theta,
            free=list(range(X.shape[1])),
            remaining=float(left @ left),
            freedom=float(ROWS - X.shape[1]),
            near=SimpleNamespace(r=left, row=np.arange(ROWS)),
            whitened=(X, left, np.arange(ROWS)),
            basis=basis(X),
            normal=X.T @ X,
            place=lambda n: places[id(n)],
            columns=lambda n: list(range(places[id(n)].start, places[id(n)].stop)),
            value=lambda n: theta[places[id(n)]],
            covariance=np.linalg.inv(X.T @ X),
            model=SimpleNamespace(parameters=parameters),
            work=X.size,
        )

    def columns_at(self, fit: Any, alone: list[Hypothesis] | None = None) -> Columns:
        """Of everything that is not in the fit, or of some names alone."""
        if alone is not None:
            return Columns(alone, [], np.hstack([self.names[n] for n in alone]), [], [], {})
        names = [n for n in self.names if n not in fit.added]
        generics = [
            Generic(owner, Curves((f"q{owner.removeprefix('joint')}",), c)) for owner, c in self.generics.items()
        ]
        parts = [*(self.names[n] for n in names), *self.generics.values()]
        sizes = [part.shape[1] for part in parts]
        ways = [np.ones((ROWS, 1))] * len(generics)
        return Columns(names, generics, np.hstack(parts), sizes, ways, {"joint1": np.ones((ROWS, 1))})

    @contextmanager
    def looked_at(self) -> Iterator[None]:
        """What could be added to fits is what this world has."""
        with (
            mock.patch.object(blocks, "columns_at", self.columns_at),
            mock.patch.object(rich_model, "columns_at", self.columns_at),
        ):
            yield

    @contextmanager
    def search(self) -> Iterator[Search]:
        """The real search in this world."""
        with mock.patch.object(search_module, "fit", self.fit), self.looked_at():
            yield Search(self.problem)  # type: ignore[arg-type]


def predicting(helps: float) -> AbstractContextManager[object]:
    """Sets of names predict held-out rows better than none by so much, with a standard error of 0.05."""
    square = np.random.default_rng(1).chisquare(3, 400)
    jitter = np.random.default_rng(2).standard_normal(400)
    better = square - helps + jitter - jitter.mean()
    return mock.patch.object(SearchNode, "predicted", property(lambda self: better if self.names else square))
