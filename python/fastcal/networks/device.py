# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where torch computes, and that its result does not depend on how many cores it finds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from threadpoolctl import threadpool_limits

from fastcal.errors import InvalidInput


def device_of(name: str) -> torch.device:
    """The device: auto (a GPU where there is one, else the CPU), cpu or cuda.

    Raises:
        InvalidInput: Another name, or cuda where there is none.
    """
    if name not in ("auto", "cpu", "cuda"):
        raise InvalidInput(f"expected the device auto, cpu or cuda, got {name!r}")
    if name == "cuda" and not torch.cuda.is_available():
        raise InvalidInput("the device cuda was requested, and torch finds no GPU here")
    return torch.device("cuda" if name != "cpu" and torch.cuda.is_available() else "cpu")


@contextmanager
def one_thread() -> Iterator[None]:
    """Lets torch, BLAS and OpenMP use one core: sums split over cores round differently, and small ones lose."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        torch.set_num_threads(before)
