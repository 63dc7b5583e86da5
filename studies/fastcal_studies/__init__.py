# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The papers whose methods fastcal implements, each as a whole study on simulated arms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fastcal_studies.study import NAMES, load_study, run_study

__all__ = ["NAMES", "load_study", "run_study"]


def __getattr__(name: str) -> Any:
    """Loaded when asked for: `fastcal --help` reads this package's command and needs none of it."""
    if name not in __all__:
        raise AttributeError(f"module 'fastcal_studies' has no attribute '{name}'")
    from fastcal_studies import study

    return getattr(study, name)
