# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What mkdocs needs to build a site of docs/ as it is: pages of the checkout outside docs/, and lists of folders."""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
# File of the checkout that is a page of the site, and the page's place.
OUTSIDE = {"README.md": "readme.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
STYLE = "stylesheets/site.css"
WORKER = "javascripts/iframe-worker.js"
FOLDERS = {"effects": "Effects", "observations": "Observations"}
LINK = re.compile(r"\]\(([^)\s#]*)(#[^)\s]*)?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages from outside docs/ and a list for each folder of pages."""
    for source, place in OUTSIDE.items():
        text = (ROOT / source).read_text(encoding="utf-8").replace("](docs/", "](")
        for other, page in OUTSIDE.items():
            text = text.replace(f"]({other}", f"]({page}")
        files.append(File.generated(config, place, content=text))
    files.append(File.generated(config, STYLE, abs_src_path=str(ROOT / "tools" / "site.css")))
    files.append(File.generated(config, WORKER, abs_src_path=str(ROOT / "tools" / "site_worker.js")))
    for folder, title in FOLDERS.items():
        pages = sorted(path for path in (ROOT / "docs" / folder).glob("*.md"))
        lines = [f"- [{path.stem}]({path.name}): {_first_sentence(path)}" for path in pages]
        files.append(File.generated(config, f"{folder}/index.md", content="\n".join([f"# {title}", "", *lines])))
    return files


def _first_sentence(page: Path) -> str:
    paragraphs = page.read_text(encoding="utf-8").split("\n\n")
    text = next((part for part in paragraphs[1:] if part[:1].isalpha()), "")
    return LINK.sub("", " ".join(text.split()).replace("[", "")).split(". ")[0].rstrip(".") + "."


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Points links to the checkout at the site's pages; a link to a source file, which the site lacks, is its text."""
    folder = (ROOT / "docs" / page.file.src_uri).parent

    def mended(match: re.Match[str]) -> str:
        target, anchor = match[1], match[2] or ""
        if not target or "://" in target or target.startswith("mailto:"):
            return match[0]
        path = Path(folder / target).resolve()
        inside = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else ""
        if inside in OUTSIDE:
            up = "../" * page.file.src_uri.count("/")
            return f"]({up}{OUTSIDE[inside]}{anchor})"
        if path.parent == ROOT / "docs" and path.name in FOLDERS:
            return f"]({target.rstrip('/')}/index.md)"
        if inside and not inside.startswith("docs/"):
            return f"](#source:{inside})"
        return match[0]

    mended_text = LINK.sub(mended, markdown)
    return re.sub(r"\[([^\]]*)\]\(#source:[^)]*\)", r"\1", mended_text)
