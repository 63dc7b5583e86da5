# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What many tests need."""

import copy
import fcntl
import importlib.util
import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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

SOFTWARE_GL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NO_GL = ["--disable-gpu", "--disable-3d-apis"]
# A hint about speed, which the software renderer draws from the browser itself.
HARMLESS = "Canvas2D: Multiple readback operations"
SIZE = {"width": 1280, "height": 2400}  # of the screen that most tests look at [CSS pixels]
PATIENCE = 120_000  # on a busy machine [ms]


class Browser:
    """Shows a page in a profile of its own: what it becomes, what it says, what a script finds there."""

    def __init__(self, chromium: Any, folder: Path) -> None:
        self.chromium, self.folder = chromium, folder

    @contextmanager
    def shown(self, page: str, width: int = SIZE["width"]) -> Iterator[tuple[Any, list[str]]]:
        """A page of fastcal or another document, once its scripts ran, and the lines of its console."""
        path = self.folder / "page.html"
        path.write_text(page, encoding="utf-8")
        with self.visited(path.as_uri(), 'body[data-state="ready"]' if "data-state" in page else "body", width) as out:
            yield out

    @contextmanager
    def visited(self, address: str, ready: str, width: int = SIZE["width"]) -> Iterator[tuple[Any, list[str]]]:
        """The same of a page that has an address and is ready with the first element that `ready` selects."""
        context = self.chromium.new_context(viewport=SIZE | {"width": width})
        said: list[str] = []
        try:
            page = context.new_page()
            page.on("console", lambda message: said.append(message.text))
            page.on("pageerror", lambda error: said.append(str(error)))
            page.goto(address)
            page.locator(ready).first.wait_for(state="attached", timeout=PATIENCE)
            yield page, said
        finally:
            context.close()

    def run(self, page: str) -> tuple[str, list[str]]:
        """The document after its scripts ran, and the lines of the console."""
        with self.shown(page) as (shown, said):
            return shown.content(), [line for line in said if HARMLESS not in line]

    def probe(self, page: str, script: str, width: int = SIZE["width"]) -> Any:
        """What `script`, the body of an async function, returns when the page is ready."""
        with self.shown(page, width) as (shown, _):
            return shown.evaluate(f"async () => {{ {script} }}")

    def phone(self, page: str, script: str) -> Any:
        """The same on a screen 400 pixels wide."""
        return self.probe(page, script, 400)

    def printed(self, page: str) -> tuple[bytes, list[str]]:
        """The page as a PDF, and the lines of the console."""
        with self.shown(page) as (shown, said):
            return shown.pdf(prefer_css_page_size=True), [line for line in said if HARMLESS not in line]


# Files that take minutes, and rooms with many that take half a minute: begun first, so that no process ends with one.
LONG = ("test_examples", "report/test_every_page", "studio/", "report/test_german", "papers/", "cells/", "diagnosis/")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    def place(item: pytest.Item) -> int:
        name = item.path.as_posix()
        return next((k for k, begins in enumerate(LONG) if f"tests/python/{begins}" in name), len(LONG))

    items.sort(key=place)


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("full") and os.environ.get("FASTCAL_TEST_FULL") != "1":
        pytest.skip("only in ./test --full")


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


@pytest.fixture(scope="session")
def browser(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Browser:
    return Browser(chromium, tmp_path_factory.mktemp("browser"))


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


def made_once(folder: Path, name: str, make: Callable[[], Any]) -> Any:
    """What `make` returns, as JSON keeps it: made by the first test process that asks, read by the others."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent  # that of all processes of this run
    kept = folder / f"{name}.json"
    with (folder / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not kept.exists():
            kept.write_text(json.dumps(make()))
    return json.loads(kept.read_text())


@pytest.fixture(scope="session")
def first_kr500(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the KR500 study measures of its first arm: the cheapest of all studies, and half a minute all the same."""
    from fastcal_studies import kuka_kr500

    run: dict[str, Any] = made_once(tmp_path_factory.getbasetemp(), "kr500", lambda: kuka_kr500.one_arm(0, full=False))
    return run


@pytest.fixture
def known_kr500(first_kr500: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """The KR500 study takes its first arm as measured; all that follows from it is done."""
    from fastcal_studies import kuka_kr500

    measure = kuka_kr500.one_arm
    monkeypatch.setattr(
        kuka_kr500,
        "one_arm",
        lambda seed, full: measure(seed, full=full) if seed or full else copy.deepcopy(first_kr500),
    )


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
