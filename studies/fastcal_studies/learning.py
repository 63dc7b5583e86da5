# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Whether networks can be trained here, and what a page says where they can't."""

from __future__ import annotations

from importlib.util import find_spec

HAS_TORCH = find_spec("torch") is not None
WITHOUT_TORCH = "it needs a network, and torch is not installed here: pip install 'fastcal-studies[networks]'."
