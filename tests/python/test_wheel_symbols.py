# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""tools/wheel_symbols: a wheel needs no newer C library than its name promises."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from fastcal import _core

TOOL = Path(__file__).parents[2] / "tools" / "wheel_symbols"


def checked(folder: Path, tag: str, content: bytes) -> subprocess.CompletedProcess[str]:
    """What the tool says of a wheel with one library."""
    wheel = folder / f"fastcal-0.2.0-cp311-cp311-{tag}.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("fastcal/_core.cpython-311-x86_64-linux-gnu.so", content)
        archive.writestr("fastcal/words.py", b"\0GLIBC_2.99\0")  # no library
    return subprocess.run([sys.executable, TOOL, wheel], capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("tag", "needs", "newest"),
    [
        ("manylinux_2_28_x86_64", b"\0GLIBC_2.14\0GLIBC_2.28\0GLIBC_2.9\0", "2.28"),
        ("manylinux_2_27_x86_64.manylinux_2_28_x86_64", b"\0GLIBC_2.2.5\0", "2.2.5"),
    ],
)
def test_a_promise_that_is_kept(tmp_path: Path, tag: str, needs: bytes, newest: str) -> None:
    ended = checked(tmp_path, tag, b"\x7fELF" + needs)
    assert (ended.returncode, ended.stdout) == (0, f"wheel_symbols: glibc {newest} and newer\n")


@pytest.mark.parametrize(
    ("tag", "needs", "said"),
    [
        ("manylinux_2_28_x86_64", b"\0GLIBC_2.28\0GLIBC_2.29\0", "needs glibc 2.29"),
        ("manylinux_2_27_x86_64.manylinux_2_28_x86_64", b"\0GLIBC_2.28\0", "promises 2.27"),
        ("linux_x86_64", b"\0GLIBC_2.17\0", "promises no version"),
        ("manylinux_2_28_x86_64", b"no symbols", "no library that uses glibc"),
    ],
)
def test_a_promise_that_is_not(tmp_path: Path, tag: str, needs: bytes, said: str) -> None:
    ended = checked(tmp_path, tag, b"\x7fELF" + needs)
    assert ended.returncode == 1
    assert said in ended.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="ELF files are Linux's")
def test_the_module_of_this_system_names_its_symbols(tmp_path: Path) -> None:
    ended = checked(tmp_path, "manylinux_2_4_x86_64", Path(_core.__file__).read_bytes())
    assert "needs glibc 2." in ended.stderr
