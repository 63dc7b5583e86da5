# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Deflections against their loads, `sign=against`: looked for where a set leaves something that nothing else explains.

No joint or link deflects against its load. A controller that compensates for deflection already leaves it where it
takes the arm for softer, or its load for heavier, than they are. It is never more than grade C: the law is sure, what
makes it is not.
"""

from __future__ import annotations

from dataclasses import replace

from fastcal.diagnosis import rules
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import Library
from fastcal.diagnosis.problem import Problem
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.variants import other_forms

_FORM = "sign=against"


def is_against_load(name: Hypothesis) -> bool:
    """Is it such a deflection?"""
    return name.variant == _FORM


def with_deflections_against_load(library: Library, search: Search, best: SearchNode) -> Library | None:
    """The library and those deflections against their loads that by themselves are likelier than the best set.

    None where there is none, where the library has such already, or where the search was cut short.
    """
    if search.is_cut_short or any(map(is_against_load, library.names)):
        return None
    alone = [search.state([form], search.start) for form in _forms(search.problem)]
    likelier = [state for state in alone if not state.impossible and state.bic < best.bic - rules.DECISIVE_BIC]
    against = [name for state in likelier if state.fit.converged for name in state.names]
    return replace(library, names=[*library.names, *against]) if against else None


def _forms(problem: Problem) -> list[Hypothesis]:
    """The deflections of a library, as if they were against their loads."""
    plain = [name for name in problem.names if _FORM in name.traits.forms and not name.variant]
    forms = [form for name in plain for form in other_forms(name.entry, problem.start.robot, problem.kept)]
    return [form for form in forms if is_against_load(form)]
