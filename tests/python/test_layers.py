# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The fences between the rooms of the house, read from the `#include` and `import` lines themselves."""

import ast
import re
from collections.abc import Iterator
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CPP = ROOT / "cpp" / "fastcal"
PYTHON = ROOT / "python" / "fastcal"

# Folder of cpp/fastcal: the other folders that it may include.
MODEL = {"math", "robot", "structure", "effects", "kernels"}
MAY_INCLUDE: dict[str, set[str]] = {
    "math": set(),
    "kernels": set(),
    "robot": {"math"},
    "structure": {"math", "robot", "kernels"},
    "effects": {"math", "robot"},
    "measurement": {"math", "robot"},
    "model": MODEL,
    "identification": MODEL | {"model", "measurement"},
    "design": MODEL | {"model"},
    "ik": MODEL | {"model"},
    "diagnosis": {"math"},
}

# A library by how its headers begin: the only files of cpp/ that may include it.
FOREIGN_HEADERS = {
    r"(urdf_|console_bridge/)": ["fastcal/robot/urdf.cpp"],
    r"kdl/": [],
    r"ceres/": ["fastcal/identification/*.cpp"],
    r"glog/": ["fastcal/identification/*.cpp", "bindings/module.cpp"],
    r"pybind11/": ["bindings/*"],
}

# Room of the package: the other rooms whose modules it may import. Every module but those of LOOSE lies in a room.
EDGE = {"arrays", "display", "errors", "place", "said", "units"}
ARM = {*EDGE, "effects", "measurements", "correction", "robot"}
MAY_IMPORT: dict[str, set[str]] = {
    "arrays": set(),
    "errors": set(),
    "display": set(),
    "place": set(),
    "said": set(),
    "units": {"arrays", "errors"},
    "robots": set(),
    "beams": {"_core", "arrays", "errors"},
    "correction": {"arrays", "errors"},
    "effects": {"_core", *EDGE},
    "measurements": {"_core", "effects", *EDGE},
    "robot": {"_core", *ARM},
    "conversion": {*EDGE, "effects", "robot"},
    "calibration": {"_core", *ARM},
    "cells": {"_core", *ARM, "calibration", "conversion", "design", "diagnosis", "monitoring"},
    "surrogate": {"_core", *ARM, "calibration"},
    "selection": {"_core", *ARM, "calibration"},
    "ik": {"_core", *ARM},
    "programs": {"_core", *EDGE, "measurements", "robot", "ik", "calibration"},
    "compensation": {"_core", *ARM, "calibration", "ik", "programs"},
    "budget": {"arrays", "errors", "robot"},
    "acceptance": {"_core", *ARM, "calibration", "ik", "programs", "compensation", "budget"},
    "design": {"_core", *ARM, "calibration", "ik"},
    "networks": {*ARM, "calibration"},
    "monitoring": {"_core", *ARM, "calibration", "design"},
    "diagnosis": {"_core", *ARM, "calibration", "selection", "design", "surrogate"},
    "io": {"_core", *ARM, "robots", "beams", "calibration", "cells", "design", "programs", "budget", "acceptance"},
    "importers": {"_core", *ARM, "calibration", "cells", "io", "programs"},
    "camera": {"_core", *ARM, "calibration", "io"},
    "report": {
        *ARM,
        *(
            "calibration",
            "cells",
            "selection",
            "ik",
            "compensation",
            "design",
            "diagnosis",
            "monitoring",
            "budget",
            "acceptance",
            "io",
            "camera",
        ),
    },
    "fleet": {*ARM, "calibration", "diagnosis", "io", "report", "robots"},
    "live": {*ARM, "calibration", "design", "io"},
    "studio": {
        *ARM,
        *("calibration", "compensation", "design", "fleet", "importers", "io", "live", "programs", "report", "robots"),
    },
}
# The package of studies, which users of fastcal need not have: the rooms that its modules may import.
STUDIES_MAY_IMPORT = {
    *(
        *ARM,
        "calibration",
        "selection",
        "conversion",
        "ik",
        "compensation",
        "design",
        "diagnosis",
        "networks",
        "io",
        "report",
        "cli",
    ),
}
# What binds the rooms together may import any of them, and is imported by none.
DOORS = {"__init__", "__main__", "cli"}
LOOSE = {"__init__", "__main__", "arrays", "errors", "place", "said", "units"}


def includes(path: Path) -> list[str]:
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', path.read_text(encoding="utf-8"), re.MULTILINE)


def cpp_files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix in {".cpp", ".hpp"})


def imports(path: Path) -> Iterator[str]:
    """Full names of what a Python file imports, anywhere in it; `from a import b` gives a.b."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.relative_to(ROOT)} imports by a relative name"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def package_imports() -> Iterator[tuple[str, str, str]]:
    """(module, imported module, line to show) for each import of fastcal's own modules; `io` stands for all of io/."""
    for path in sorted(PYTHON.rglob("*.py")):
        place = path.relative_to(PYTHON)
        module = place.parts[0].removesuffix(".py")
        for name in imports(path):
            parts = name.split(".")
            if parts[0] == "fastcal" and len(parts) > 1 and parts[1] != module:
                yield module, parts[1], f"{place} imports {name}"


@pytest.mark.parametrize("folder", sorted(path.name for path in CPP.iterdir() if cpp_files(path)))
def test_a_cpp_folder_includes_only_what_lies_beneath_it(folder: str) -> None:
    allowed = MAY_INCLUDE[folder] | {folder}
    found = [
        f"{path.relative_to(ROOT)} includes {name}"
        for path in cpp_files(CPP / folder)
        for name in includes(path)
        if name.startswith("fastcal/") and name.split("/")[1] not in allowed
    ]
    assert found == []


def test_own_headers_are_included_by_their_full_name() -> None:
    found = [
        f"{path.relative_to(ROOT)} includes {name}"
        for path in cpp_files(CPP)
        for name in includes(path)
        if name.endswith(".hpp") and "/" not in name
    ]
    assert found == []


def test_an_effect_knows_no_other_effect() -> None:
    files = cpp_files(CPP / "effects")
    effects = {path.stem for path in files if "\nFASTCAL_REGISTER_EFFECT(" in path.read_text(encoding="utf-8")}
    assert "joint_compliance" in effects
    found = [
        f"{path.relative_to(ROOT)} includes {name}"
        for path in files
        for name in includes(path)
        if name.startswith("fastcal/effects/") and Path(name).stem in effects - {path.stem}
    ]
    assert found == []


@pytest.mark.parametrize("library", FOREIGN_HEADERS)
def test_a_library_is_included_in_its_one_place(library: str) -> None:
    users = {
        str(path.relative_to(ROOT / "cpp"))
        for path in cpp_files(ROOT / "cpp")
        for name in includes(path)
        if re.match(library, name)
    }
    assert {user for user in users if not any(fnmatch(user, home) for home in FOREIGN_HEADERS[library])} == set()


def test_kernels_hold_no_templates_of_others() -> None:
    """Code of Eigen or the standard library compiled for an instruction set could be linked in for every other file."""
    plain = {"cmath", "cstddef", "cstdint", "cstdlib", "cstring"}
    plain |= {"immintrin.h"}  # always inlined, and refused where a function's own instruction set lacks one
    plain |= {"cpuid.h"}  # macros of one instruction
    found = [
        f"{path.relative_to(ROOT)} includes {name}"
        for path in cpp_files(CPP / "kernels")
        for name in includes(path)
        if name not in plain and not name.startswith("fastcal/kernels/")
    ]
    assert found == []


def rooms() -> set[str]:
    return {path.name for path in PYTHON.iterdir() if path.is_dir() and any(path.glob("*.py"))}


def test_every_module_lies_in_a_room() -> None:
    assert {path.stem for path in PYTHON.glob("*.py")} == LOOSE
    assert rooms() | LOOSE == {*MAY_IMPORT, *DOORS}


def test_a_room_imports_only_what_lies_beneath_it() -> None:
    found = [
        line
        for module, imported, line in package_imports()
        if module not in DOORS and imported not in MAY_IMPORT[module]
    ]
    assert found == []


def test_studies_import_rooms_and_no_room_imports_studies() -> None:
    found = {
        parts[1]
        for path in sorted((ROOT / "studies").rglob("*.py"))
        for name in imports(path)
        if (parts := name.split("."))[0] == "fastcal"
    }
    assert found <= STUDIES_MAY_IMPORT
    assert {"calibration", "networks"} <= found
    back = [path.name for path in PYTHON.rglob("*.py") if any("fastcal_studies" in name for name in imports(path))]
    assert back == []


def test_the_rooms_have_an_order() -> None:
    beneath = {room: set(MAY_IMPORT[room]) for room in MAY_IMPORT}
    order: list[str] = []
    while beneath:
        free = sorted(room for room, others in beneath.items() if not others & (set(beneath) - {room}))
        assert free, f"a circle among {sorted(beneath)}"
        order += free
        for room in free:
            del beneath[room]
    assert order[:3] == ["arrays", "display", "errors"]


def test_torch_is_imported_by_the_networks_alone() -> None:
    found = [
        str(path.relative_to(PYTHON))
        for path in PYTHON.rglob("*.py")
        if any(name.split(".")[0] == "torch" for name in imports(path)) and "networks" not in path.parts
    ]
    assert found == []


# Files of the package that name an effect: an example for a reader, a default that a caller may change, its own code,
# or the thing in nature (what rubs in a gear, in a motor's current).
MAY_NAME = {
    "calibration/compliance.py": {"joint_compliance", "joint_compliance_nonlinear"},
    "calibration/motor_currents.py": {"friction"},
    "calibration/payload_pairs.py": {"joint_compliance"},
    "calibration/setups.py": {"station_offset", "tool_shift"},
    "cells/place.py": {"reduction_ratio"},
    "cells/sensor_ways.py": {"current_compliance", "joint_compliance"},
    "cli/demo.py": {"joint_compliance"},
    "cli/design.py": {"joint_compliance"},
    "cli/manners.py": {"backlash", "gear_harmonic", "joint_compliance"},
    "cli/simulate.py": {"friction"},
    "design/rivals.py": {"joint_compliance"},
    "importers/templates.py": {"backlash"},
    "studio/demo.py": {"joint_compliance"},
    "surrogate/adding.py": {"surrogate"},
    "surrogate/entries.py": {"surrogate"},
    "surrogate/problem.py": {"surrogate"},
}


@cache
def effect_names() -> str:
    """All effects of the core, as an alternative of a pattern."""
    files = cpp_files(CPP / "effects")
    return "|".join(file.stem for file in files if 'FASTCAL_REGISTER_EFFECT("' in file.read_text("utf-8"))


def named_effects(path: Path) -> set[str]:
    """Effects whose names stand in the strings of a Python file, its docstrings left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    texts = [
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs
    ]
    return {name for text in texts for name in re.findall(rf"(?<![\w.])({effect_names()})(?![\w.])", text)}


def test_python_knows_effects_by_their_traits_alone() -> None:
    found = {str(path.relative_to(PYTHON)): named_effects(path) for path in PYTHON.rglob("*.py")}
    assert {file: names for file, names in found.items() if not names <= MAY_NAME.get(file, set())} == {}
    assert found["cli/demo.py"]


def test_the_fences_see_what_they_guard() -> None:
    """Each reader finds an import that is known to be there, so an empty list above means something."""
    assert "urdf_parser/urdf_parser.h" in includes(CPP / "robot" / "urdf.cpp")
    for folder, header in ((CPP / ".." / "bindings", "pybind11/pybind11.h"), (CPP / "identification", "ceres/ceres.h")):
        assert any(header in includes(path) for path in cpp_files(folder))
    assert ("units", "errors", "units.py imports fastcal.errors.InvalidInput") in list(package_imports())
