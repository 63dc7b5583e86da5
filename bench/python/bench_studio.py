# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A user's way through the studio, with a clock: from a tracker's and a controller's files to a compensated program.

    python bench/python/bench_studio.py [--exports FOLDER] [--program FILE] [--language de] [--shots FOLDER] [--json F]

Headless Chromium does what a user would: opens the address that `fastcal studio` prints, chooses the arm, drops the two
files, saves, calibrates, diagnoses, drops a program, compensates it and loads it down. Printed are the seconds of each
step, without the time in which a person reads and thinks; each screen is kept as a picture under --shots.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.sync_api import TimeoutError, sync_playwright  # noqa: A004 - a browser that does not answer

REPOSITORY = Path(__file__).resolve().parents[2]
EXPORTS = REPOSITORY.parent / "shared" / "data" / "exports" / "01_sa_points"
PROGRAM = REPOSITORY / "tests" / "python" / "data" / "programs" / "palletize.script"
PATIENCE, SHORT = 300_000, 15_000  # [ms]
SOFTWARE_GL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


class User:
    """Who uses the page, and the clock beside.

    Args:
        page: Playwright's.
        shots: Where pictures of the screens stay; None: nowhere.
    """

    def __init__(self, page: Any, shots: Path | None) -> None:
        self.page, self.shots = page, shots
        self.seconds: dict[str, float] = {}

    def does(self, what: str, act: Callable[[], None]) -> None:
        """One step, its time, and the picture of the screen after it."""
        start = time.perf_counter()
        act()
        self.seconds[what] = time.perf_counter() - start
        if self.shots is not None:
            self.page.evaluate("scrollTo(0, 0)")
            self.page.wait_for_timeout(1500)
            name = f"{len(self.seconds)}-{what.replace(' ', '-')}.png"
            self.page.screenshot(path=str(self.shots / name), full_page=True)

    def part(self, name: str) -> Any:
        """An element by the name that tests know it by."""
        return self.page.locator(f'[data-test="{name}"]')

    def drops(self, where: str, file: Path) -> None:
        """A file into its field."""
        self.part(f"drop-{where}").locator("input[type=file]").set_input_files(str(file))

    def chooses_arm(self, title: str, arm: str) -> None:
        """From the list that can be searched; once more where a busy machine closed it meanwhile."""
        field, option = self.page.get_by_label(title, exact=True), self.page.get_by_role("option", name=arm, exact=True)
        for _ in range(PATIENCE // SHORT):
            field.click()
            field.fill(arm)
            try:
                option.wait_for(timeout=SHORT)
            except TimeoutError:
                self.page.keyboard.press("Escape")
                continue
            option.dispatch_event("click")
            return
        raise SystemExit(f"{title} offers no {arm}")


def the_way(user: User, base: str, exports: Path, program: Path, words: dict[str, str]) -> None:
    """Data, Result with its diagnosis, Program."""
    user.does("arm", lambda: user.chooses_arm(words["arm"], "ur5"))

    def two_files() -> None:
        user.drops("instrument", exports / "ur5_sa.txt")
        user.part("problem").first.wait_for()
        user.drops("controller", exports / "joints.csv")
        user.part("joined").wait_for()
        user.page.locator('[data-test="misfit"][data-grade="good"]').wait_for()

    def save() -> None:
        user.part("save").click()
        user.part("command").first.wait_for()

    def result(button: str) -> None:
        user.page.goto(f"{base}/result")
        user.part(button).click()
        page = "page-calibration" if button == "calibrate" else "page-diagnosis"
        user.page.frame_locator(f'[data-test="{page}"]').locator("h1").first.wait_for()

    def compensate() -> None:
        user.page.goto(f"{base}/program")
        user.drops("program", program)
        user.part("compensate").click()
        user.part("taken").wait_for()
        with user.page.expect_download() as loaded:
            user.part("download").first.click()
        if not Path(loaded.value.path()).stat().st_size:
            raise SystemExit("the program is empty")

    user.does("two files", two_files)
    user.does("save", save)
    user.does("calibrate", lambda: result("calibrate"))
    user.does("diagnose", lambda: result("diagnose"))
    user.does("compensate", compensate)


def started(folder: Path, language: str) -> tuple[subprocess.Popen[str], str]:
    """The studio, and the address that it prints."""
    line = [sys.executable, "-m", "fastcal", "studio", str(folder), "--port", "0", "--no-browser"]
    environment = {**os.environ, "FASTCAL_LANGUAGE": language}
    process = subprocess.Popen(line, stdout=subprocess.PIPE, text=True, env=environment)
    if process.stdout is None:
        raise SystemExit("the studio says nothing")
    told = next((told for told in process.stdout if "token=" in told), "")
    if not told:
        raise SystemExit("the studio ended before it printed its address")
    return process, told.rsplit(": ", 1)[1].strip()


def main() -> None:
    """Prints the seconds of each step and of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--exports", type=Path, default=EXPORTS)
    parser.add_argument("--program", type=Path, default=PROGRAM)
    parser.add_argument("--language", choices=("en", "de"), default="en")
    parser.add_argument("--shots", type=Path, help="where pictures of the screens stay")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    if options.shots is not None:
        options.shots.mkdir(parents=True, exist_ok=True)
    words = {"arm": "Mitgelieferter Roboter" if options.language == "de" else "Shipped arm"}
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        begun = time.perf_counter()
        process, address = started(Path(folder) / "cell_7", options.language)
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", *SOFTWARE_GL])
        context = browser.new_context(viewport={"width": 1300, "height": 850})
        context.set_default_timeout(PATIENCE)
        user = User(context.new_page(), options.shots)
        try:

            def open_it() -> None:
                user.page.goto(address)
                user.page.wait_for_function("window.did_handshake && window.socket.connected")

            user.does("open", open_it)
            user.seconds["open"] = time.perf_counter() - begun
            the_way(user, address.split("/?")[0], options.exports, options.program, words)
        finally:
            browser.close()
            process.terminate()
            process.wait(30)
    found = {**user.seconds, "all": sum(user.seconds.values())}
    for what, seconds in found.items():
        print(f"{what:12s} {seconds:7.1f} s")
    if options.json:
        options.json.write_text(json.dumps({k: round(v, 1) for k, v in found.items()}, indent=2) + "\n")


if __name__ == "__main__":
    main()
