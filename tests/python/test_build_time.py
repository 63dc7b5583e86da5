# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""bench/build_time, what is compiled once, and that a build folder keeps its commands when ccache comes later."""

import json
import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BENCH = runpy.run_path(str(ROOT / "bench" / "build_time"))


def test_outputs_are_counted_by_room() -> None:
    core, bindings = "cpp/CMakeFiles/fastcal_core.dir", "cpp/CMakeFiles/_core.dir"
    made = {
        f"{core}/fastcal/ik/pose_search.cpp.o": 3.0,
        f"{core}/fastcal/ik/pose_solver.cpp.o": 1.0,
        f"{core}/Unity/unity_effects_2_cxx.cxx.o": 5.0,
        f"{core}/cmake_pch.hxx.gch": 7.0,
        f"{bindings}/Unity/unity_bindings_0_cxx.cxx.o": 20.0,
        "tests/cpp/CMakeFiles/ik_test.dir/ik/pose_test.cpp.o": 2.0,
        "bench/cpp/CMakeFiles/bench_rows.dir/rows.cpp.o": 6.0,
        "cpp/_core.so": 16.0,
    }
    assert BENCH["table"](made, verbose=False) == [
        "| | outputs | CPU time | the longest |",
        "|---|---|---|---|",
        "| bindings | 1 | 20.0 s | 20.0 s |",
        "| linking | 1 | 16.0 s | 16.0 s |",
        "| precompiled headers | 1 | 7.0 s | 7.0 s |",
        "| benchmarks | 1 | 6.0 s | 6.0 s |",
        "| core, effects | 1 | 5.0 s | 5.0 s |",
        "| core, ik | 2 | 4.0 s | 3.0 s |",
        "| tests, ik | 1 | 2.0 s | 2.0 s |",
        "| all | 8 | **1.0 min** | |",
    ]


def test_the_clock_notes_output_and_cpu_time_and_passes_the_status_on(tmp_path: Path) -> None:
    log = tmp_path / "clock"
    busy = "import sys, time\nwhile time.process_time() < 0.2: pass\nsys.exit(3)"
    command = [sys.executable, ROOT / "bench" / "build_time", "--clock", log, sys.executable, "-c", busy, "-o", "a.o"]
    assert subprocess.run(command, check=False).returncode == 3
    made, seconds = json.loads(log.read_text(encoding="utf-8"))
    assert made == "a.o"
    assert 0.2 <= seconds < 2


def test_a_run_that_was_stopped_goes_on_in_its_folder(tmp_path: Path) -> None:
    (tmp_path / "asan").mkdir()
    (tmp_path / "asan" / "build.ninja").write_text("", encoding="utf-8")
    assert BENCH["configured"]("tests", tmp_path, tmp_path / "clock", sys.executable) == tmp_path / "asan"
    assert [path.name for path in (tmp_path / "asan").iterdir()] == ["build.ninja"], "not configured again"


DECOMPOSITION = re.compile(r"(\w*(?:QR|SVD|LU|LLT|LDLT|EigenSolver))<(?:Eigen::)?MatrixXd")


def test_decompositions_of_any_size_are_compiled_once() -> None:
    """Where the header that says so is missing, a file compiles them anew: 5 to 10 s of it."""
    seen = set()
    for path in sorted((ROOT / "cpp" / "fastcal").rglob("*.cpp")):
        text = path.read_text(encoding="utf-8")
        for name in DECOMPOSITION.findall(text):
            header = "pivoted_lu.hpp" if name == "FullPivLU" else "decompositions.hpp"
            assert path.stem == header[:-4] or f'#include "fastcal/math/{header}"' in text, f"{path}: {name}"
            seen.add(name)
        assert "fullPivLu()" not in text, f"{path}: FullPivLU and solve() of pivoted_lu.hpp"
    assert {"FullPivLU", "LLT", "JacobiSVD"} <= seen


@pytest.mark.skipif(shutil.which("cmake") is None or shutil.which("ninja") is None, reason="needs cmake and ninja")
def test_a_ccache_that_comes_later_changes_no_command(tmp_path: Path) -> None:
    tools = tmp_path / "tools"
    tools.mkdir()
    build = tmp_path / "build"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("CMAKE")}
    environment["PATH"] = f"{tools}:{environment['PATH']}"
    command = ["cmake", "-S", str(ROOT), "-B", str(build), "-G", "Ninja", "-DFASTCAL_BUILD_TESTS=OFF"]

    def configured(*more: str) -> bool:
        """Configures; is ccache in the commands?"""
        subprocess.run([*command, *more], check=True, capture_output=True, env=environment)
        return f"{tools}/ccache" in (build / "CMakeFiles" / "rules.ninja").read_text(encoding="utf-8")

    assert not configured("-DFASTCAL_CCACHE=FASTCAL_CCACHE-NOTFOUND")
    (tools / "ccache").write_text('#!/bin/sh\nexec "$@"\n', encoding="utf-8")
    (tools / "ccache").chmod(0o755)
    assert not configured()
    shutil.rmtree(build)
    assert configured()  # a new folder takes it
