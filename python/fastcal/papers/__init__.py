# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The papers whose methods fastcal implements, each as a whole study on simulated arms."""

from fastcal.papers.study import NAMES as NAMES
from fastcal.papers.study import load_study as load_study
from fastcal.papers.study import run_study as run_study
