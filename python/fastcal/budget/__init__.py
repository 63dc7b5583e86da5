# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Uncertainty budgets by the GUM: what is known of the instrument and the conditions, and what that does to points."""

from fastcal.budget.components import Component, Scene, components_of
from fastcal.budget.evaluation import Uncertainty, combined
from fastcal.budget.inputs import KINDS, Budget, Input, drawn

__all__ = ["KINDS", "Budget", "Component", "Input", "Scene", "Uncertainty", "combined", "components_of", "drawn"]
