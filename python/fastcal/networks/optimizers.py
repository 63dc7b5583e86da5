# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""First-order steps on the rows of a matrix, each row with its own rule and rate: what one network would do alone.

sgd; momentum (Polyak 1964); nag (Nesterov 1983); adagrad (Duchi, Hazan, Singer 2011); rmsprop (Hinton 2012); adadelta
(Zeiler 2012); adam (Kingma, Ba 2015).
"""

from __future__ import annotations

from collections.abc import Sequence

import torch

from fastcal.errors import InvalidInput

RULES = ("sgd", "momentum", "nag", "adagrad", "rmsprop", "adadelta", "adam")
_MOMENTUM = 0.9
_SQUARES = 0.999
_RMS = 0.9
_SMALL = 1e-8


class Optimizer:
    """Steps of P rows.

    Args:
        rules: One of RULES a row.
        rates: (P,) learning rates.
        theta: (P, size), for its shape and device.
    """

    def __init__(self, rules: Sequence[str], rates: Sequence[float], theta: torch.Tensor) -> None:
        if unknown := set(rules) - set(RULES):
            raise InvalidInput(f"expected an optimizer of {', '.join(RULES)}, got {min(unknown)!r}")
        self._rates = torch.tensor(list(rates), dtype=theta.dtype, device=theta.device)[:, None]
        self._rows = {
            rule: torch.tensor([i for i, other in enumerate(rules) if other == rule], device=theta.device)
            for rule in dict.fromkeys(rules)
        }
        self._state = {rule: (torch.zeros_like(theta[rows]),) * 2 for rule, rows in self._rows.items()}
        self._steps = 0

    def step(self, theta: torch.Tensor, gradient: torch.Tensor, share: float = 1.0) -> None:
        """Moves theta in place; `share` scales the rates, for a schedule."""
        self._steps += 1
        with torch.no_grad():
            for rule, rows in self._rows.items():
                every = len(rows) == len(theta)
                g, rate = (gradient, self._rates) if every else (gradient[rows], self._rates[rows])
                first, second = self._state[rule]
                move, first, second = self._move(rule, g, rate * share, first, second)
                self._state[rule] = (first, second)
                if every:
                    theta -= move
                else:
                    theta[rows] -= move

    def _move(
        self, rule: str, g: torch.Tensor, rate: torch.Tensor, m: torch.Tensor, v: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """What is taken from theta, and the two states of the rule."""
        if rule == "sgd":
            return rate * g, m, v
        if rule in ("momentum", "nag"):
            m = _MOMENTUM * m + g
            return rate * (g + _MOMENTUM * m if rule == "nag" else m), m, v
        if rule == "adagrad":
            v = v + g * g
            return rate * g / (v.sqrt() + _SMALL), m, v
        if rule == "rmsprop":
            v = _RMS * v + (1 - _RMS) * g * g
            return rate * g / (v.sqrt() + _SMALL), m, v
        if rule == "adadelta":
            v = _RMS * v + (1 - _RMS) * g * g
            move = ((m + 1e-6) / (v + 1e-6)).sqrt() * g
            return rate * move, _RMS * m + (1 - _RMS) * move * move, v
        m = _MOMENTUM * m + (1 - _MOMENTUM) * g
        v = _SQUARES * v + (1 - _SQUARES) * g * g
        unbiased = (v / (1 - _SQUARES**self._steps)).sqrt() + _SMALL
        return rate / (1 - _MOMENTUM**self._steps) * m / unbiased, m, v
