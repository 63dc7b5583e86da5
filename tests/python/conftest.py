# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What many tests need."""

import html
import importlib.util
import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import simulate
from fastcal.calibration.simulation import random_poses
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--enable-logging=stderr",
    "--v=0",
    "--window-size=1280,2400",
    # Timers of a page pass in no time while a busy machine still paints a frame that they wait for: ample.
    "--virtual-time-budget=1000000",
]
SOFTWARE_GL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NO_GL = ["--disable-gpu", "--disable-3d-apis"]
# A hint about speed, which the software renderer draws from the browser itself.
HARMLESS = "Canvas2D: Multiple readback operations"
PROBE = """
<script>
addEventListener("securitypolicyviolation", (event) => { window.blocked = event.effectiveDirective; });
const wait = setInterval(async () => {
  if (document.body.dataset.state !== "ready") return;
  clearInterval(wait);
  const seen = await (async () => { %s })();
  const box = document.createElement("pre");
  box.id = "probe";
  box.textContent = JSON.stringify(seen);
  document.body.append(box);
}, 20);
</script>
</body>"""

# Headless Chromium makes no window narrower than 500 pixels: the phone is a frame in one.
PHONE = """<!DOCTYPE html><html><head><title>phone</title></head><body style="margin:0">
<iframe srcdoc="%s" style="border:0;width:400px;height:9000px"></iframe><script>
addEventListener("message", (event) => { document.body.dataset.state = "ready"; window.seen = event.data; });
</script></body></html>"""
ON_PHONE = """<script>
  const wait = setInterval(() => {
    if (document.body.dataset.state !== "ready") return;
    clearInterval(wait);
    parent.postMessage((() => { %s })(), "*");
  }, 20);</script></body>"""


class Browser:
    """Runs a page in headless Chromium in a fresh profile."""

    no_gl = NO_GL

    def __init__(self, command: str, folder: Path) -> None:
        self.command, self.folder = command, folder

    def run(self, page: str, *flags: str) -> tuple[str, list[str]]:
        """The document after its scripts ran, and the lines of the console."""
        path = self.folder / "page.html"
        path.write_text(page, encoding="utf-8")
        return self.visit(path.as_uri(), *flags)

    def visit(self, address: str, *flags: str) -> tuple[str, list[str]]:
        """The same of a page that has an address."""
        profile = self.folder / "profile"
        command = [self.command, *FLAGS, f"--user-data-dir={profile}", *flags, address]
        done = subprocess.run(command, capture_output=True, text=True, timeout=180, check=True)
        shutil.rmtree(profile, ignore_errors=True)
        lines = [line for line in done.stderr.splitlines() if ":CONSOLE:" in line and HARMLESS not in line]
        return done.stdout, lines

    def probe(self, page: str, script: str, *flags: str) -> Any:
        """What `script`, the body of an async function, returns when the page is ready."""
        document, _ = self.run(page.replace("</body>", PROBE % script), "--dump-dom", *(flags or NO_GL))
        found = re.search(r'<pre id="probe">(.*?)</pre>', document, re.DOTALL)
        assert found is not None, "the page never became ready"
        return json.loads(html.unescape(found[1]))

    def phone(self, page: str, script: str) -> Any:
        """What `script`, the body of a function, returns when the page is ready on a screen 400 pixels wide."""
        inner = html.escape(page.replace("</body>", ON_PHONE % script), quote=True)
        return self.probe(PHONE % inner, "return window.seen;")


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("full") and os.environ.get("FASTCAL_TEST_FULL") != "1":
        pytest.skip("only in ./test --full")


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Browser:
    command = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if command is None:
        missing = "no chromium on this machine (Debian: apt-get install chromium)"
        if os.environ.get("FASTCAL_DATA_REQUIRED") == "1":
            pytest.fail(missing)
        pytest.skip(missing)
    return Browser(command, tmp_path_factory.mktemp("browser"))


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """Debian's Chromium, driven by Playwright."""
    playwright = pytest.importorskip("playwright.sync_api")
    command = shutil.which("chromium") or shutil.which("google-chrome")
    if command is None:
        if os.environ.get("FASTCAL_DATA_REQUIRED") == "1":
            pytest.fail("no chromium on this machine (Debian: apt-get install chromium)")
        pytest.skip("no chromium on this machine")
    # Drawn in software, scenes in space cost more than all else: only where somebody will look at them.
    flags = ["--no-sandbox", *(SOFTWARE_GL if os.environ.get("FASTCAL_STUDIO_SHOTS") else NO_GL)]
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=command, args=flags, timeout=120_000)
        browser.timeout = playwright.TimeoutError
        yield browser
        browser.close()


def axe_core() -> str | None:
    """The script of axe-core, which ./setup --test installs; None where it is missing."""
    package = importlib.util.find_spec("axe_playwright_python")
    if package is None or package.origin is None:
        return None
    return (Path(package.origin).parent / "axe.min.js").read_text(encoding="utf-8")


def inaccessible(page: Any, axe: str) -> list[tuple[str, str, str]]:
    """What axe-core finds serious or critical in a page: the rule, the element, what to do about it."""
    page.evaluate(axe)
    found = page.evaluate("axe.run({ resultTypes: ['violations'] })")["violations"]
    return [
        (each["id"], node["html"], node["failureSummary"])
        for each in found
        if each["impact"] in ("serious", "critical")
        for node in each["nodes"]
    ]


@pytest.fixture(scope="session")
def axe() -> str | None:
    """The script of axe-core; None where it is missing."""
    return axe_core()


@pytest.fixture(scope="session")
def accessible(axe: str | None) -> Callable[[Any], None]:
    """Asserts that axe-core finds nothing serious in a page that Playwright shows."""
    if axe is None:
        pytest.skip("axe-core is missing (axe-playwright-python): ./setup --test installs it")
    return lambda page: assert_accessible(page, axe)


def assert_accessible(page: Any, axe: str) -> None:
    """Nothing that axe-core finds in the page is serious or critical."""
    assert inaccessible(page, axe) == []


class SharedData:
    """Measurement sets by their names: those beside the repository, else the sample that is committed.

    Without a set the test that asks for it is skipped, or fails where all are due.
    """

    beside = Path(__file__).resolve().parents[3] / "shared" / "data"
    sample = Path(__file__).parent / "data" / "shared"

    def __truediv__(self, name: str) -> Path:
        for folder in (self.beside, self.sample):
            if (folder / name).exists():
                return folder / name
        missing = f"the measurement set {name} is not at {self.beside}, and not of the sample that is committed"
        if os.environ.get("FASTCAL_DATA_REQUIRED") == "1":
            pytest.fail(missing)
        pytest.skip(missing)


@pytest.fixture(scope="session")
def shared_data() -> SharedData:
    """The measurement sets, each by its name."""
    return SharedData()


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


@dataclass(frozen=True)
class HiddenBacklash:
    """A robot file whose arm has backlash that the file does not know, and its measurements."""

    robot: Robot
    data: Dataset
    test: Dataset
    gap: float
    sigma: float


@pytest.fixture(scope="session")
def hidden_backlash() -> HiddenBacklash:
    """PMC arm, joint 3 with 4e-4 rad of backlash, noise 0.04 mm; 90 poses and 30 others."""
    robot, gap, sigma = load_robot("pmc6va030"), 4e-4, 4e-5
    lost = {"effect": "backlash", "owner": "joint3", "parameters": {"gap_rad": {"value": gap, "std": None}}}
    true = Robot({**robot.spec, "effects": [lost]})
    sets = []
    for count, seed in ((90, 1), (30, 2)):
        side = np.where(np.random.default_rng(seed).random((count, robot.joint_count)) < 0.5, -1.0, 1.0)
        sent = Dataset.from_arrays(random_poses(robot, count, seed=seed), approach=side)
        sets.append(simulate(true, sent, noise=sigma, seed=seed))
    return HiddenBacklash(robot, *sets, gap, sigma)
