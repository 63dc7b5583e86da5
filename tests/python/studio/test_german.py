# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every word of the screens passes the translator: with a catalogue of blots nothing readable is left but names."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from typing import Any

import pytest

import fastcal
from fastcal.fleet import calibrate_many, read_list
from fastcal.fleet.page import write_fleet
from fastcal.io.results import write_json
from fastcal.studio.project import Project
from fastcal.studio.shell import SCREENS

from .conftest import patiently

# `fastcal` with a catalogue in which every letter of a message is a blot; placeholders stand.
BLOTTED = """
import re, sys
from fastcal.report import language
class Blotted(dict):
    def get(self, message, default=None):
        parts = re.split(r"(\\{.*?\\})", message)
        return "".join(part if k % 2 else re.sub(r"[^\\W\\d_]", "\\u00a4", part) for k, part in enumerate(parts))
language.catalogue = lambda name: Blotted()
from fastcal.cli import main
sys.exit(main(sys.argv[1:]))
"""
# What is seen and what a screen reader says; numbers, commands, the program's text and what
# files say themselves are not the screens' own words; what the web framework says is hidden, and German already.
SEEN = """() => {
  const OTHERS = "script, style, i, pre, .font-mono, .ag-body, .q-field__native, .said, .nicegui-error-popup, " +
    ".nicegui-scene, .no-webgl";
  const texts = [document.title];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const around = walker.currentNode.parentElement;
    if (around.checkVisibility() && !around.closest(OTHERS))
      texts.push(walker.currentNode.textContent);
  }
  for (const each of document.querySelectorAll("[aria-label]"))
    if (each.checkVisibility()) texts.push(each.getAttribute("aria-label"));
  return texts.join(" ; ");
}"""
NAMES = {"fastcal", "studio", "geometry", "joint", "compliance", "backlash", "deg", "rad", "payload", "temperature"}
NAMES |= {"name", "target", "Group", "Collection", "csv", "txt", "script", "yaml", "mod", "src", "dat", "urdf", "xacro"}
NAMES |= {"poses", "tracker", "joints", "demo", "arms", "calibration", "diagnosis", "model", "measurements", "cell"}
NAMES |= {"checks", "history"}  # folders of the project
NAMES |= {"Erweitern", "Sie"}  # the web framework's own, of what is folded
NAMES |= {
    "FANUC",
    "TCP",
    "RMS",
    "Target",
    "inputs",
    "plan",
    "live",
    "fixed",
    "abc",
    "xyz",
    "rpy",
    "robot",
    "data",
    "test",
}


@pytest.fixture(scope="module")
def studio(studio_in: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A demonstration with everything done once: a plan, a model, a diagnosis that leaves poses, a fleet."""
    folder = tmp_path_factory.mktemp("studio") / "demo"
    running = studio_in(folder, "--demo", "--page-language", "de", program=BLOTTED)
    project = Project(folder)
    robot = project.robot()
    shutil.copy(folder / "fleet_data" / "cell_1.csv", folder / "measurements.csv")
    data = fastcal.load_measurements(folder / "measurements.csv", robot)
    fastcal.calibrate(robot, data, effects="geometry,joint_compliance@joint2").save(folder / "calibration")
    shutil.copytree(folder / "calibration", folder / "diagnosis")
    gap = [{"train_rms_mm": 1.0}, {"train_rms_mm": 0.1}]
    write_json(folder / "diagnosis" / "diagnosis.json", {"gap": gap})
    planned = fastcal.Dataset.from_arrays(fastcal.random_poses(robot, 5, seed=3))
    (folder / "plan").mkdir()
    for name in ("diagnosis/next_poses.csv", "plan/poses.csv"):
        fastcal.write_measurements(folder / name, planned, robot.joint_types)
    arms = read_list(folder / "arms.csv")[:2]
    write_fleet(calibrate_many(arms, out=folder / "fleet", reports=True), folder / "fleet")
    yield running
    running.end()


def left_in_english(look: Any) -> str:
    """Words of three letters and more that no catalogue was asked for."""
    words = re.findall(r"[^\W\d_]{3,}", look.page.evaluate(SEEN))
    return " ".join(sorted({word for word in words if "¤" not in word} - NAMES))


@patiently
@pytest.mark.parametrize("address", [address for address, *_more in SCREENS])
def test_nothing_english_is_left_on_a_screen(look: Any, studio: Any, address: str) -> None:
    look.go(address)
    look.page.wait_for_timeout(1500)
    if address == "/":
        look.get("misfit").wait_for()
    elif address == "/plan":
        look.get("drivable").filter(has_text="¤").wait_for()
    elif address == "/program":
        look.get("compensate").click()
        look.get("taken").wait_for()
    elif address == "/live":
        assert left_in_english(look) == ""
        look.get("begin").click()
        look.get("address").wait_for()
        look.page.wait_for_timeout(1500)
    assert left_in_english(look) == ""
    assert look.page.evaluate("document.documentElement.lang") == "de"
