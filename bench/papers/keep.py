# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Keeps a study's paper.json here, without its runs, with six digits and the commit whose code made it.

    python bench/papers/keep.py OUT [COMMIT]

COMMIT is that of the working tree, unless it is told.
"""

import json
import subprocess
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


def head() -> str:
    """The commit of the working tree."""
    command = ["git", "rev-parse", "--short=8", "HEAD"]
    return subprocess.run(command, cwd=Path(__file__).parent, check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    folder, *told = sys.argv[1:]
    content = read_json(Path(folder) / "paper.json")
    content.pop("runs")
    content = {"paper": content.pop("paper"), "commit": told[0] if told else head()} | content
    text = json.dumps(rounded(content), ensure_ascii=False, separators=(",", ":")).replace('{"number"', '\n{"number"')
    (Path(__file__).parent / f"{content['paper']['name']}.json").write_text(text + "\n", encoding="utf-8")
