# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Keeps a study's paper.json here, without its runs and with six digits: python bench/papers/keep.py OUT"""

import json
import sys
from pathlib import Path
from typing import Any

from fastcal.io.results import read_json


def rounded(value: Any) -> Any:
    """The same with floats of six significant digits."""
    if isinstance(value, dict):
        return {key: rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [rounded(entry) for entry in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


if __name__ == "__main__":
    content = read_json(Path(sys.argv[1]) / "paper.json")
    content.pop("runs")
    text = json.dumps(rounded(content), ensure_ascii=False, separators=(",", ":")).replace('{"number"', '\n{"number"')
    (Path(__file__).parent / f"{content['paper']['name']}.json").write_text(text + "\n", encoding="utf-8")
