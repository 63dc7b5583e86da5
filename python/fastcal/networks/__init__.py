# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Networks on what identification leaves: trained with torch, judged against rivals on held-out regions, kept guarded.

Needs `pip install 'fastcal[networks]'`. What is trained here is used by numpy alone (`fastcal.correction`).
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from fastcal.errors import InvalidInput

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from fastcal.networks.training import TrainingResult, train

NETWORKS = ("mlp", "gp")
ENTRY_POINTS = "fastcal.networks"  # a network's name = a function as `training.Fit` describes
_HOMES = {"TrainingResult": "training", "train": "training"}
_NEEDED = {"torch": "torch", "sklearn": "scikit-learn"}

__all__ = ["NETWORKS", "TrainingResult", "train"]


def installed() -> dict[str, EntryPoint]:
    """The networks of installed packages by their names; none replaces one of fastcal's own."""
    from importlib.metadata import entry_points  # takes as long as a short command

    return {point.name: point for point in entry_points(group=ENTRY_POINTS) if point.name not in NETWORKS}


def require() -> None:
    """Raises InvalidInput, with what to install, where a library that training needs is missing."""
    missing = []
    for module, package in _NEEDED.items():
        try:
            importlib.import_module(module)
        except ImportError:
            missing.append(package)
    if missing:
        raise InvalidInput(
            f"training needs {', '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed; "
            "pip install 'fastcal[networks]' brings it (a trained model needs none of this to be used)"
        )


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'fastcal.networks' has no attribute '{name}'")
    require()
    return getattr(importlib.import_module(f"fastcal.networks.{_HOMES[name]}"), name)
