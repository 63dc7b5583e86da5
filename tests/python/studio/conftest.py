# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A studio that runs, and a browser that looks at it and at nothing else."""

from __future__ import annotations

import functools
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from ..conftest import assert_accessible

# Where pictures of the screens are wanted, as docs/pictures/make.py wants them.
SHOTS = os.environ.get("FASTCAL_STUDIO_SHOTS")
# Plotly measures a chart that the page has just taken away, or has nothing to draw a scene with.
HARMLESS = ("Resize must be passed a displayed plot div element", "WebGL")
PATIENCE, SHORT = 120_000, 15_000  # [ms] on a busy machine; the former also of the browser's start


# Words that are shown in capitals, which no language writes so; the names of icons are no words.
SHOUTED = """() => [...document.querySelectorAll("body *:not(i)")].filter((each) =>
  each.checkVisibility() && getComputedStyle(each).textTransform === "uppercase" &&
  [...each.childNodes].some((part) => part.nodeType === Node.TEXT_NODE && part.textContent.trim())
).map((each) => each.textContent.trim())"""


@dataclass
class Running:
    """A studio in a process of its own."""

    folder: Path
    process: subprocess.Popen[str]
    address: str

    @property
    def base(self) -> str:
        """The address without the token."""
        return self.address.split("/?")[0]

    def kill(self) -> None:
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def end(self) -> None:
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait(30)
        assert self.process.stdout is not None
        self.process.stdout.close()


def start(folder: Path, *options: str, program: str = "") -> Running:
    """Starts the command, or a program with its arguments, and reads the address that it prints."""
    begun = ["-c", program] if program else ["-m", "fastcal"]
    command = [sys.executable, *begun, "studio", str(folder), "--port", "0", "--no-browser", *options]
    # By these variables NiceGUI takes itself for a part of a test.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    line = next((line for line in process.stdout if "token=" in line), "")
    assert line, "the studio ended before it printed its address"
    return Running(folder, process, line.rsplit(": ", 1)[1].strip())


@dataclass
class Looker:
    """A browser's page that notes what it asks of others and what its console says."""

    page: Any
    base: str
    timeout: type[Exception]
    axe: str | None
    foreign: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)

    def watch(self) -> None:
        self.page.on("request", lambda request: self._asked(request.url))
        self.page.on("websocket", lambda socket: self._asked(socket.url.replace("ws://", "http://")))
        self.page.on("console", lambda message: self.said.append(message.text) if message.type == "error" else None)
        self.page.on("pageerror", lambda error: self.said.append(str(error)))

    def _asked(self, url: str) -> None:
        if not url.startswith((self.base, "data:", "blob:", "about:")):
            self.foreign.append(url)

    def go(self, path: str) -> Any:
        self.page.goto(self.base + path)
        self.page.locator(".studio-header").wait_for()
        self.page.wait_for_function("window.did_handshake && window.socket.connected")
        return self.page

    def get(self, name: str) -> Any:
        """The element that a test knows by this name."""
        return self.page.locator(f'[data-test="{name}"]')

    def choose(self, label: str, name: str) -> None:
        """Types into a list that can be searched and takes the entry; again where the list closed meanwhile."""
        field = self.page.get_by_label(label, exact=True)
        option = self.page.get_by_role("option", name=name, exact=True)
        for _ in range(PATIENCE // SHORT):
            field.click()
            field.fill(name)
            try:
                option.wait_for(timeout=SHORT)
                option.dispatch_event("click")  # without waiting for the list to come to rest
            except self.timeout:
                self.page.keyboard.press("Escape")
                continue
            return
        raise AssertionError(f"{label} offers no {name}")

    def drop(self, name: str, *files: Path) -> None:
        self.get(f"drop-{name}").locator("input[type=file]").set_input_files([str(file) for file in files])

    def everybody(self) -> None:
        """What is shown can be used by everybody, in light and dark, as far as axe-core is there to say so."""
        assert self.page.evaluate(SHOUTED) == []
        if self.axe is None:
            return
        for scheme in ("light", "dark"):
            self.page.emulate_media(color_scheme=scheme)
            self.page.wait_for_function(
                f"document.body.classList.contains('body--dark') === {str(scheme == 'dark').lower()}"
            )
            self.page.wait_for_timeout(500)  # colours change slowly, on a busy machine very slowly
            self.page.wait_for_function("!document.getAnimations().some((each) => each instanceof CSSTransition)")
            assert_accessible(self.page, self.axe)
        self.page.emulate_media(color_scheme="light")

    def arrived(self, file: Path, text: str) -> None:
        """Waits until a dropped file is there: a click before that would take the one before."""
        for _ in range(600):
            if file.exists() and file.read_text() == text:
                break
            self.page.wait_for_timeout(100)

    def picture(self, name: str) -> None:
        if SHOTS:
            self.page.wait_for_timeout(1500)
            self.page.screenshot(path=f"{SHOTS}/{name}.png", full_page=True, timeout=PATIENCE)


def patiently(test: Callable[..., None]) -> Callable[..., None]:
    """The test once more where the browser did not answer in time: a busy machine is slow, not the studio wrong."""

    @functools.wraps(test)
    def again(look: Looker, **given: Any) -> None:
        try:
            test(look=look, **given)
        except look.timeout:
            test(look=look, **given)

    return again


@pytest.fixture(scope="session")
def studio_in() -> Any:
    """Starts a studio in a folder, with options of the command."""
    return start


@pytest.fixture(scope="module")
def look(chromium: Any, axe: str | None, studio: Any) -> Iterator[Looker]:
    """The browser at the module's studio; at the end it has asked nobody else, and its console is clean."""
    context = chromium.new_context(viewport={"width": 1300, "height": 850}, bypass_csp=True)
    context.set_default_timeout(PATIENCE)
    looker = Looker(context.new_page(), studio.base, chromium.timeout, axe)
    looker.watch()
    looker.page.goto(studio.address)
    yield looker
    context.close()
    assert looker.foreign == []
    assert [text for text in looker.said if not any(known in text for known in HARMLESS)] == []
