# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What every file of the tree owes: a licence header, a version told once, a changelog that keeps its form."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

import fastcal

ROOT = Path(__file__).parents[2]
HEADER = ["SPDX-FileCopyrightText: 2026 The fastcal authors", "SPDX-License-Identifier: MIT"]
SOURCES = {".cpp", ".hpp", ".py", ".pyi", ".sh", ".supp", ".toml", ".yaml"}
SCRIPTS = {"CMakeLists.txt", "run", "setup", "test", "stubs"}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def tracked_files() -> list[Path]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True)
    return [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def test_every_source_file_opens_with_its_licence() -> None:
    sources = [path for path in tracked_files() if path.suffix in SOURCES or path.name in SCRIPTS]
    assert ROOT / "cpp" / "CMakeLists.txt" in sources
    bare = []
    for path in sources:
        lines = path.read_text(encoding="utf-8").splitlines()
        start = 1 if lines and lines[0].startswith("#!") else 0
        if [line.lstrip("#/ ") for line in lines[start : start + 2]] != HEADER:
            bare.append(str(path.relative_to(ROOT)))
    assert bare == []


def test_the_version_is_written_once() -> None:
    version = PROJECT["version"]
    assert fastcal.__version__ == version
    elsewhere = [
        str(path.relative_to(ROOT))
        for path in tracked_files()
        if path.name not in {"CHANGELOG.md", "pyproject.toml"}
        and path.suffix in {".cpp", ".hpp", ".py", ".txt"}
        and re.search(rf"(?i)version\W+{re.escape(version)}\b", path.read_text(encoding="utf-8"))
    ]
    assert elsewhere == []


def test_the_studies_go_with_this_version() -> None:
    studies = tomllib.loads((ROOT / "studies" / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert studies["version"] == PROJECT["version"]
    assert studies["dependencies"] == [f"fastcal=={PROJECT['version']}"]
    assert PROJECT["optional-dependencies"]["papers"] == [studies["name"]]


def changelog_sections() -> list[str]:
    """The titles of the changelog's versions, newest first."""
    return re.findall(r"^## (.+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)


def test_the_changelog_keeps_its_form() -> None:
    titles = changelog_sections()
    assert titles[0] == "[Unreleased]"
    released = [re.fullmatch(r"\[(\d+)\.(\d+)\.(\d+)\] - \d{4}-\d\d-\d\d", title) for title in titles[1:]]
    assert None not in released
    versions = [tuple(map(int, match.groups())) for match in released if match]
    assert versions == sorted(set(versions), reverse=True)

    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    kinds = re.findall(r"^### (.+)$", text, re.MULTILINE)
    assert set(kinds) <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def test_the_changelog_can_be_read() -> None:
    """At most forty lines a release, and no timings: those are in docs/benchmarks.md."""
    for release in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split("\n## ")[1:]:
        lines = [line for line in release.splitlines()[1:] if line.strip()]
        assert len(lines) <= 40, f"{release.splitlines()[0]} has {len(lines)} lines"
        timings = re.findall(r"[\d.]+ (?:ms|us|µs|s|seconds?|minutes?|MB|GB)\b|\bCPU\b|% (?:less|faster)", release)
        assert timings == []


def test_a_change_of_the_code_is_in_the_changelog() -> None:
    """Either the coming version has entries, or the newest one listed is the version of the package."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    coming = text.split("## [Unreleased]", 1)[1].split("\n## ", 1)[0]
    if not re.search(r"^- \S", coming, re.MULTILINE):
        assert changelog_sections()[1].startswith(f"[{PROJECT['version']}]")


def test_the_workflows_run_what_is_there() -> None:
    workflows = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
    assert [path.name for path in workflows] == ["ci.yml", "wheels.yml"]
    for path in workflows:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        steps = [step for job in content["jobs"].values() for step in job["steps"]]
        words = [word for step in steps for word in step.get("run", "").split()]
        scripts = {word for word in words if re.fullmatch(r"(?:\./|\.ci/|tools/)\w+", word)}
        assert {name for name in scripts if not (ROOT / name).is_file()} == set()
        assert (".ci/run" in scripts) == (path.name == "ci.yml"), "public CI runs what is run here"


def test_the_conda_recipe_asks_for_what_pip_installs() -> None:
    recipe = yaml.safe_load((ROOT / "tools" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
    run = [requirement.replace(" ", "") for requirement in recipe["requirements"]["run"]]
    assert sorted(run) == sorted([f"python{PROJECT['requires-python']}", *PROJECT["dependencies"]])


def test_wheels_are_made_for_every_python_that_is_supported() -> None:
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["cibuildwheel"]
    pythons = re.findall(r"cp3(\d+)-\*", tool["build"])
    assert f">=3.{pythons[0]}" == PROJECT["requires-python"]
    assert list(map(int, pythons)) == list(range(int(pythons[0]), int(pythons[-1]) + 1))
    assert tool["manylinux-x86_64-image"] == tool["manylinux-aarch64-image"] == "manylinux_2_28"
    for system in ("linux", "macos", "windows"):
        assert "tools/wheel_libraries" in tool[system]["before-all"]


@pytest.mark.parametrize("name", ["run", "test", "setup", ".ci/run", "tools/stubs", "tools/wheel_libraries"])
def test_a_script_can_be_run(name: str) -> None:
    mode = subprocess.run(["git", "ls-files", "--stage", name], cwd=ROOT, check=True, capture_output=True, text=True)
    assert mode.stdout.startswith("100755")
