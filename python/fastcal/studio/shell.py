# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The frame of every page: the screens at the left, the project above, and what all screens use."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

from nicegui import ui

from fastcal.errors import FastcalError
from fastcal.report.language import _, language, retold
from fastcal.said import said, sentence_of
from fastcal.studio.state import Studio

# Address, name, icon, what it is for, module.
SCREENS = (
    ("/", said("Data"), "table_chart", said("files in, joined and understood"), "data"),
    ("/arm", said("Arm"), "precision_manufacturing", said("the skeleton beside the pendant"), "arm"),
    ("/plan", said("Plan"), "route", said("which poses to measure"), "plan"),
    ("/live", said("Live"), "sensors", said("rows checked as they arrive"), "live"),
    ("/result", said("Result"), "fact_check", said("how good, and what is missing"), "result"),
    ("/program", said("Program"), "code", said("targets the arm will reach"), "program"),
    ("/fleet", said("Fleet"), "grid_view", said("all arms at once"), "fleet"),
)
EVERY = 0.3  # [s] between looks at work in the background


def add_pages(studio: Studio) -> None:
    """Registers a page a screen."""
    ui.add_css(_STYLE, shared=True)
    ui.add_head_html(f"<script>{_FOR_ALL.replace('LANGUAGE', language.get())}</script>", shared=True)
    for address, title, _icon, purpose, module in SCREENS:
        ui.page(address, title=f"{_(title)} · fastcal studio")(_page(studio, address, title, purpose, module))


def _page(studio: Studio, address: str, title: str, purpose: str, module: str) -> Callable[[], None]:
    def page() -> None:
        ui.colors(primary="#1f5f8b", positive="#2e7d4f", negative="#b3261e", warning="#9a6700")
        with ui.header().classes("studio-header"):
            menu = (
                ui.button(icon="menu").props(f'flat dense color=white aria-label="{_("Screens")}"').classes("md:hidden")
            )
            ui.label("fastcal studio").classes("text-lg font-bold")
            _projects(studio)
        with (
            ui.left_drawer(value=False, bordered=True)
            .props("width=190 breakpoint=768 show-if-above")
            .classes("p-2") as drawer
        ):
            for to, name, icon, _purpose, _module in SCREENS:
                chosen = " studio-chosen" if to == address else ""
                with ui.link(target=to).classes(f"studio-screen{chosen}").props(f'data-screen="{to}"'):
                    ui.icon(icon).classes("text-xl")
                    ui.label(_(name))
        menu.on_click(drawer.toggle)
        with ui.column().classes("w-full max-w-screen-xl mx-auto gap-3 p-2"):
            with ui.row().classes("items-baseline gap-3"):
                ui.label(_(title)).classes("text-2xl").props("role=heading aria-level=1")
                ui.label(_(purpose)).classes("text-gray-600 dark:text-gray-300")
            importlib.import_module(f"fastcal.studio.screens.{module}").build(studio)

    return page


def _projects(studio: Studio) -> None:
    """The name of the project; a click lists those beside it, and begins a new one."""

    def go(name: str) -> None:
        with told():
            studio.open(name)
            ui.navigate.to("/")

    with ui.button(studio.project.name, icon="folder_open").props("flat dense color=white") as button:
        button.props('data-test="projects"').tooltip(str(studio.project.folder))
        with ui.menu():
            for name in studio.project.beside():
                ui.menu_item(name, on_click=lambda name=name: go(name)).props(f'data-test="project-{name}"')
            ui.separator()
            with ui.row().classes("items-center no-wrap p-2"):
                fresh = ui.input(_("New project")).props('dense data-test="new-project"')
                begin = ui.button(icon="add", on_click=lambda: go(fresh.value)).props("flat dense round")
                begin.props(f'aria-label="{_("Begin a new project")}"')


@contextmanager
def card(title: str, hint: str = "") -> Iterator[None]:
    """A part of a screen with its heading."""
    with ui.card().classes("w-full"):
        ui.label(title).classes("text-base font-medium").props("role=heading aria-level=2")
        if hint:
            ui.label(hint).classes("text-sm text-gray-600 dark:text-gray-300")
        yield


@contextmanager
def told() -> Iterator[None]:
    """Shows the sentence of an error instead of failing."""
    try:
        yield
    except FastcalError as error:
        refuse(retold(sentence_of(error)))


def refuse(sentence: str) -> None:
    """Shows why something was not done, until it is closed."""
    close = {"label": _("Close"), "color": "white"}
    ui.notify(sentence, type="negative", multi_line=True, actions=[close], timeout=0)


def table(options: dict[str, Any]) -> ui.aggrid:
    """A table of rows, which says in the language of the screen where it has none."""
    columns = {"wrapHeaderText": True, "autoHeaderHeight": True} | options.get("defaultColDef", {})
    words = {"noRowsToShow": _("no row yet")}
    return ui.aggrid({**options, "defaultColDef": columns, "localeText": words}, theme="balham").classes("w-full")


def decimals(places: int) -> str:
    """How a table writes numbers: that many decimals, in the language of the screen; of what is missing nothing."""
    options = f"{{minimumFractionDigits: {places}, maximumFractionDigits: {places}, useGrouping: false}}"
    return f'p => p.value == null ? "" : p.value.toLocaleString("{language.get()}", {options})'


def onward(text: str, to: str) -> ui.button:
    """What comes next: a link to another screen that looks like a button."""
    return ui.button(text, icon="arrow_forward").props(f'href="{to}" data-test="onward"')


def drop_here(upload: ui.upload) -> None:
    """Says in the empty list of a place for files what to do there."""
    with upload.add_slot("list"):
        ui.label(_("drop here")).classes("text-sm text-gray-600 dark:text-gray-300")


def command_line(line: str) -> None:
    """A command that does what the screen did, to copy; a line of it does not end within a word."""
    whole = '<span class="inline-block max-w-full break-all">{}</span>'
    words = " ".join(whole.format(escape(word)) for word in line.split(" "))
    with ui.row().classes("w-full items-center no-wrap studio-command"):
        ui.icon("terminal")
        ui.html(words, sanitize=False).classes("font-mono text-sm").props('data-test="command"')
        copy = ui.button(icon="content_copy", on_click=lambda: ui.clipboard.write(line)).props("flat dense round")
        copy.props(f'aria-label="{_("Copy the command")}"')


def job_bar(studio: Studio, screen: str, done: Callable[[Any], object]) -> None:
    """Shows the work of a screen while it runs, with a button that stops it; `done` gets its result once."""
    seen: dict[str, Any] = {"job": None, "over": True}
    with ui.row().classes("w-full items-center") as bar:
        ui.spinner(size="sm")
        step = ui.label().props('data-test="step"')
        ui.button(_("Stop"), on_click=lambda: studio.jobs[screen].stop()).props("outline dense color=negative")
    failed = ui.label().classes("text-negative").props('data-test="failed" role=alert')
    bar.visible = failed.visible = False

    def look() -> None:
        job = studio.jobs.get(screen)
        if job is None or (seen["job"] is job and seen["over"]):
            return
        if seen["job"] is not job:
            seen.update(job=job, over=False)
        bar.visible = job.is_running
        step.text = f"{_(job.title)}: {retold(job.step)}"
        failed.visible = bool(job.error)
        failed.text = retold(job.error)
        if not job.is_running:
            seen["over"] = True
            if job.result is not None:
                done(job.result)

    ui.timer(EVERY, look)  # the first look comes when the page is built


_STYLE = """
/* Quasar's bar over the page has no name; long work shows its own progress. */
.q-loading-bar { display: none; }
.studio-header { padding: .4rem 1rem; align-items: center; gap: 1rem; }
.studio-screen { display: flex; width: 100%; gap: .6rem; align-items: center; padding: .5rem; border-radius: .4rem;
  color: inherit; text-decoration: none; }
.studio-screen:hover { background: rgba(127, 127, 127, .15); }
.studio-chosen { background: rgba(31, 95, 139, .18); font-weight: 600; }
.studio-command { background: rgba(127, 127, 127, .12); border-radius: .4rem; padding: .3rem .6rem; }
.q-btn, .q-tab { text-transform: none; } /* words as they are spoken, as on all pages */
/* Quasar's colours stand in a layer and are important: only their variables can be set from here. */
/* A scene in space has one ground: light and dark change places, colours stay what they are. */
.body--dark .nicegui-scene canvas { filter: invert(0.92) hue-rotate(180deg); }
.body--dark .text-primary { --q-primary: #7fb6dc; }
.body--dark .text-positive { --q-positive: #74c894; }
.body--dark .text-negative { --q-negative: #f2938c; }
.body--dark .text-warning { --q-warning: #e0b050; }
a.nicegui-link { color: #1f5f8b; opacity: 1 !important; } /* NiceGUI fades the one under the mouse: too pale */
.body--dark a.nicegui-link { color: #7fb6dc; }
.q-uploader__subtitle { display: none; } /* bytes and percent of what comes from this very machine */
.studio-number { font-size: 1.7rem; font-variant-numeric: tabular-nums; line-height: 1.1; }
"""

# What NiceGUI leaves out for those who use a keyboard or a screen reader: the language of the page, and a place to drop
# files whose button hides the field: the field takes the keyboard and says what it is for.
_FOR_ALL = """
document.documentElement.lang = "LANGUAGE";
const reachable = () => {
  for (const field of document.querySelectorAll(".q-uploader input[type=file]")) {
    if (field.tabIndex === 0) continue;
    field.tabIndex = 0;
    field.setAttribute("aria-label", field.closest(".q-uploader").querySelector(".q-uploader__title").textContent);
    const button = field.closest("a.q-btn");
    button.removeAttribute("tabindex");
    button.removeAttribute("role");
  }
};
new MutationObserver(reachable).observe(document.documentElement, { childList: true, subtree: true });
"""
