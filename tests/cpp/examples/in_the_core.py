# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Runs the tests of an own effect or observation on the package with another core, which has the one file of it.

usage: in_the_core.py MODULE TEST
"""

import os
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[3]
TESTS = ROOT / "tests" / "python"


def main(module: Path, test: str) -> int:
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder) / "fastcal"
        package.mkdir()
        for path in (ROOT / "python" / "fastcal").iterdir():
            if path.suffix != ".so" and path.name != "__pycache__":
                (package / path.name).symlink_to(path)
        (package / f"_core{sysconfig.get_config_var('EXT_SUFFIX')}").symlink_to(module)
        paths = {"PYTHONPATH": folder, "FASTCAL_OWN": "core"}
        run = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", TESTS / test]
        return subprocess.run(run, cwd=ROOT, env=os.environ | paths, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), sys.argv[2]))
