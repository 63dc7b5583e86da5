# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Patches that take one effect out of a model file again, each for itself and in any order."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from fastcal.io.yaml_text import yaml_text
from fastcal.robot.robot import Spec

if TYPE_CHECKING:
    from fastcal.diagnosis.result import Finding

PATTERN = "without_*.patch"


def removal_patches(text: str, spec: Spec, findings: Iterable[Finding], model_file: str) -> dict[str, str]:
    """Name and content of a patch for each finding: `patch model.yaml NAME` takes its entry out of the model.

    Geometry stays as it was identified with the effect; recalibrating lets it take up what it can.

    Args:
        text: The model file; `spec` as written there.
        spec: What `text` holds.
        findings: Effects that are in it.
        model_file: Its name.
    """
    findings = list(findings)
    if not findings:
        return {}
    lines = text.splitlines(keepends=True)
    first = lines.index("effects:\n") + 1
    sizes = [len(_block(entry)) for entry in spec["effects"]]
    out = {}
    for finding in findings:
        at = first
        for entry, size in zip(spec["effects"], sizes, strict=True):
            if _is_same(entry, finding):
                gone = lines[at : at + size]
                head = f"--- {model_file}\n+++ {model_file}\n@@ -{at + 1},{size} +{at},0 @@\n"
                out[patch_name(finding)] = head + "".join(f"-{line}" for line in gone)
                break
            at += size
    return out


def patch_name(finding: Finding) -> str:
    """without_EFFECT@OWNER.patch, with the order of a wave; the arrow of a coupling, which shells take, in words."""
    order = finding.parameters.get("order")
    wave = f"_order_{order.value:g}" if order else ""
    return f"without_{finding.effect}@{finding.owner.replace('<-', '_from_')}{wave}.patch"


def _block(entry: Spec) -> list[str]:
    """The lines of one entry in the list of effects."""
    return yaml_text({"effects": [entry]}).splitlines()[1:]


def _is_same(entry: Spec, finding: Finding) -> bool:
    if (entry["effect"], entry["owner"]) != (finding.effect, finding.owner):
        return False
    order = finding.parameters.get("order")
    return order is None or entry["parameters"]["order"]["value"] == order.value
