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
_DELTA = 1e-6


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
        self._state = {
            rule: (torch.zeros_like(theta[rows]), torch.zeros_like(theta[rows])) for rule, rows in self._rows.items()
        }
        self._steps = 0

    def step(self, theta: torch.Tensor, gradient: torch.Tensor, share: float = 1.0) -> None:
        """Moves theta in place; `share` scales the rates, for a schedule."""
        self._steps += 1
        with torch.no_grad():
            for rule, rows in self._rows.items():
                every = len(rows) == len(theta)
                g, rate = (gradient, self._rates) if every else (gradient[rows], self._rates[rows])
                move = self._move(rule, g, rate * share, *self._state[rule])
                if every:
                    theta -= move
                else:
                    theta.index_add_(0, rows, move, alpha=-1)

    def _move(self, rule: str, g: torch.Tensor, rate: torch.Tensor, m: torch.Tensor, v: torch.Tensor) -> torch.Tensor:
        """What is taken from theta; the two states of the rule, m and v, are changed in place."""
        if rule == "sgd":
            return rate * g
        if rule in ("momentum", "nag"):
            m.mul_(_MOMENTUM).add_(g)
            return rate * (torch.add(g, m, alpha=_MOMENTUM) if rule == "nag" else m)
        if rule == "adagrad":
            v.addcmul_(g, g)
            return rate * g / v.sqrt().add_(_SMALL)
        if rule == "rmsprop":
            v.mul_(_RMS).addcmul_(g, g, value=1 - _RMS)
            return rate * g / v.sqrt().add_(_SMALL)
        if rule == "adadelta":
            v.mul_(_RMS).addcmul_(g, g, value=1 - _RMS)
            move = ((m + _DELTA) / (v + _DELTA)).sqrt_().mul_(g)
            m.mul_(_RMS).addcmul_(move, move, value=1 - _RMS)
            return rate * move
        m.mul_(_MOMENTUM).add_(g, alpha=1 - _MOMENTUM)
        v.mul_(_SQUARES).addcmul_(g, g, value=1 - _SQUARES)
        unbiased = (v / (1 - _SQUARES**self._steps)).sqrt_().add_(_SMALL)
        return (m / unbiased).mul_(rate / (1 - _MOMENTUM**self._steps))
