# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The documentation builds as a site without a warning, a dead link being one, and lists every public name."""

import re
import subprocess
from pathlib import Path

import fastcal

ROOT = Path(__file__).parents[2]


def test_the_site_builds_without_a_warning() -> None:
    built = subprocess.run([ROOT / "tools" / "site"], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    assert "WARNING" not in built.stderr
    home = Path(built.stdout.strip().splitlines()[-1])
    assert "fastcal" in home.read_text(encoding="utf-8")


def test_the_reference_lists_every_public_name() -> None:
    listed = set(
        re.findall(r"^::: fastcal\.(\w+)$", (ROOT / "docs" / "reference.md").read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert listed == {name for name in fastcal.__all__ if not name.startswith("_")}
