# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of the diagnosis' performance is what its committed record says."""

import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[3]
RECORD = TOP / "bench" / "python" / "bench_diagnosis.json"


def test_the_page_is_rendered_from_the_record() -> None:
    command = [sys.executable, str(TOP / "bench" / "python" / "bench_diagnosis.py"), "--render", str(RECORD)]
    page = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert page == (TOP / "docs" / "diagnosis-performance.md").read_text(encoding="utf-8")
