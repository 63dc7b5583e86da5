# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What many tests need."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The measurement sets beside the repository; without them a test is skipped, or fails where they are due."""
    folder = Path(__file__).resolve().parents[3] / "shared" / "data"
    if not folder.is_dir():
        missing = f"the measurement sets are not at {folder}"
        if os.environ.get("FASTCAL_DATA_REQUIRED") == "1":
            pytest.fail(missing)
        pytest.skip(missing)
    return folder


@pytest.fixture(scope="session")
def programs() -> dict[str, dict[str, bytes]]:
    """The files of a robot program in each language, by the language's name."""
    folder = Path(__file__).parent / "data" / "programs"
    names = {
        "RAPID": ["glue.mod"],
        "KRL": ["weld.src", "weld.dat"],
        "FANUC LS": ["PICK.LS"],
        "URScript": ["palletize.script"],
    }
    return {language: {name: (folder / name).read_bytes() for name in files} for language, files in names.items()}
