# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The values of a name are those of a model that has it."""

from types import SimpleNamespace
from typing import Any

import pytest

from fastcal.diagnosis import adaptation
from fastcal.diagnosis.found import Found


@pytest.mark.parametrize(
    ("name", "unsure", "model"),
    [("wave 3", {}, "written"), ("wave 5", {}, "of all names"), ("wave 3", {"'wave 3'": "doubt"}, "of all names")],
)
def test_a_name_that_curves_of_the_written_model_stand_for_has_its_values_from_the_fit_of_all_names(
    monkeypatch: pytest.MonkeyPatch, name: Any, unsure: dict[str, str], model: str
) -> None:
    monkeypatch.setattr(adaptation, "robot_of", lambda fit, sigma: fit)
    found: Any = SimpleNamespace(
        told=SimpleNamespace(unsure=unsure),
        model=SimpleNamespace(state=SimpleNamespace(names=("wave 3",))),
        told_fit="of all names",
        level=SimpleNamespace(sigma=1e-4),
    )
    assert Found._having(found, name, "written") == model  # type: ignore[arg-type]
