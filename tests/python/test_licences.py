# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""docs/licences.md names every library that the extension loads and every package that fastcal or an extra installs."""

import re
import shutil
import subprocess
import tomllib
from importlib.metadata import distributions
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet

from fastcal import _core

ROOT = Path(__file__).parents[2]
DEBIAN_12 = "3.11.2"  # its Python, the oldest that ./test runs on
PAGE = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")


def name(requirement: str) -> str:
    return re.split(r"[<>=\[ ]", requirement)[0]


def test_every_library_that_the_extension_loads_is_named() -> None:
    if shutil.which("ldd") is None:
        pytest.skip("there is no ldd")
    listed = subprocess.run(["ldd", _core.__file__], capture_output=True, text=True, check=True).stdout
    libraries = {Path(line.split()[0]).name.split(".so")[0] for line in listed.splitlines()} - {"linux-vdso"}
    assert "libcholmod" in libraries
    assert {library for library in libraries if f"`{library}`" not in PAGE} == set()


def test_every_package_that_pip_installs_is_named() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wanted = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    for packages in project["project"]["optional-dependencies"].values():
        wanted += packages
    names = {name(each) for each in wanted} - {"fastcal", "fastcal-studies"}
    rows = re.findall(r"^\| ([^|]*) \| [^|]* \| [^|]* \|$", PAGE, re.MULTILINE)
    listed = {package.strip() for row in rows for package in row.split(",")}
    assert names - listed == set()


def test_all_holds_nothing_that_is_not_free() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    free = [each for extra, packages in extras.items() if extra != "opensees" for each in packages]
    assert not any("opensees" in each for each in free)


def test_the_lock_file_holds_every_package_of_the_development_environment() -> None:
    lock = (ROOT / "dev.lock").read_text(encoding="utf-8").lower().replace("_", "-")
    locked = {line.split("==")[0] for line in lock.splitlines() if "==" in line}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    assert {name(each).lower().replace("_", "-") for each in wanted} - {"fastcal"} - locked == set()


def test_the_locked_versions_can_be_installed_in_the_python_of_debian_12() -> None:
    locked = (ROOT / "dev.lock").read_text(encoding="utf-8").lower().splitlines()
    installed = {f"{each.name}=={each.version.split('+')[0]}".lower(): each.metadata for each in distributions()}
    known = {line: installed[line].get("Requires-Python") or "" for line in locked if line in installed}
    assert len(known) > 100
    assert {line: asked for line, asked in known.items() if DEBIAN_12 not in SpecifierSet(asked)} == {}
