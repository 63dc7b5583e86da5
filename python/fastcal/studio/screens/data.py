# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Data: the files of instrument and controller dropped in, the roles of their columns, the joined list, the misfit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import events, run, ui

from fastcal.importers.orientation import CONVENTIONS
from fastcal.place import joint_position
from fastcal.report.formatting import plural, significant
from fastcal.report.language import _, retold
from fastcal.robots import available
from fastcal.said import said
from fastcal.studio import reading
from fastcal.studio.project import MEASUREMENTS, TEST
from fastcal.studio.shell import card, command_line, decimals, drop_here, onward, table, told
from fastcal.studio.state import Studio
from fastcal.units import from_si

_COLOURS = {"good": "text-positive", "doubtful": "text-warning", "bad": "text-negative", "": ""}
_UNITS = (("q", said("Joints in"), ("deg", "rad")), ("x", said("Points in"), ("mm", "m", "in")))
_WORDS = {
    "good": said("As a nominal arm fits: the list is read right."),
    "doubtful": said("More than most arms are off: look at the rows that miss most."),
    "bad": said("No arm is built that badly: a unit, a sign, a joint or the join is wrong."),
    "": "",
}


def build(studio: Studio) -> None:
    """Builds the screen."""
    _Screen(studio)


class _Screen:
    """The screen, whose parts are shown anew as an answer changes."""

    def __init__(self, studio: Studio) -> None:
        self.studio, self.project, self.asked = studio, studio.project, 0
        with card(_("1  Arm"), _("Choose it from the list, or give its own file.")), ui.row().classes("gap-4"):
            self._arm()
        hint = _("Drop them as the instrument and the controller wrote them, or press +; what each holds decides.")
        with card(_("2  Files"), hint):
            with ui.row().classes("w-full gap-4"):
                _drop(_("Points of the instrument"), "instrument", self._take("instrument"))
                _drop(_("Joints of the controller, if apart"), "controller", self._take("controller"))
            self.files()
        hint = _("What each column is; change one, and the misfit below says whether it was better.")
        with card(_("3  Columns"), hint):
            self.columns()
        with card(_("4  Does it fit?"), _("The nominal arm on the joined list, base and tool fitted.")):
            self.toggles()
            with ui.row().classes("items-center") as self.busy:
                ui.spinner(size="sm")
                ui.label(_("checking the files"))
            self.result = ui.column().classes("w-full")
        ui.timer(0.05, self.show, once=True)

    async def show(self) -> None:
        """Reads anew what the project has, beside the window; of several answers the last question's is shown."""
        self.asked += 1
        asked, self.busy.visible = self.asked, True
        found = await run.io_bound(reading.understand, self.project)
        if found is None or asked != self.asked:  # the window was closed, or something was changed meanwhile
            return
        self.busy.visible = False
        self.result.clear()
        with self.result:
            _result(self.studio, found)

    def changes(self, act: Callable[..., Any]) -> Callable[..., Any]:
        """A handler that acts, says what went wrong, and shows the screen anew."""

        async def handler(first: Any, *more: Any) -> None:  # NiceGUI gives the event where one is expected
            with told():
                act(first, *more)
            for part in (self.files, self.columns, self.toggles):
                part.refresh()
            await self.show()

        return handler

    def _arm(self) -> None:
        given = self.project.answers.get("robot")
        names = list(dict.fromkeys([*available(), *([given] if given else [])]))
        choose = self.changes(lambda event: self.project.choose_robot(event.value))
        arm = ui.select(names, value=given, label=_("Shipped arm"), on_change=choose, with_input=True)
        arm.classes("w-64").props('data-test="arm"')

        def own(name: str, content: bytes) -> None:
            self.project.choose_robot(self.project.receive(name, content))

        _drop(_("or a .yaml, .urdf or .xacro"), "robot-file", self.changes(own))

    def _take(self, kind: str) -> Callable[[str, bytes], Any]:
        """Takes a dropped file as the instrument's or the controller's."""

        def take(name: str, content: bytes) -> None:
            path = self.project.receive(name, content)
            of = reading.kind_of(self.project, path, kind)
            if of != kind:
                ui.notify(_moved(path.partition("/")[2], of))
            for other in ("instrument", "controller"):
                if path in reading.files_of(self.project, other):
                    _forget(self.project, other, path)
            given = reading.files_of(self.project, "instrument")
            self.project.answer(of, path if of == "controller" else [*given, path])
            self.project.answer("columns", {})  # what was said of other files is of no use

        return self.changes(take)

    @ui.refreshable_method
    def files(self) -> None:
        """The files that were dropped, each with a button that takes it out."""
        kinds = ("instrument", "controller")
        given = [(kind, name) for kind in kinds for name in reading.files_of(self.project, kind)]
        with ui.row():
            for kind, name in given:
                label = _("instrument") if kind == "instrument" else _("controller")
                with ui.chip(f"{label}: {name.partition('/')[2]}", removable=False).props("outline"):
                    forget = self.changes(lambda _, kind=kind, name=name: _forget(self.project, kind, name))
                    button = ui.button(icon="close", on_click=forget).props("flat dense round size=xs")
                    button.props(f'aria-label="{_("Remove {name}", name=name)}"')

    @ui.refreshable_method
    def columns(self) -> None:
        """Each column with its first cells and its role."""
        found: list[reading.FileColumn] = []
        with told():
            found = reading.columns_of(self.project)
        if not found:
            ui.label(_("No file yet."))
        count = self.project.robot().joint_count if self.project.has_robot else 7
        options = {role: role or _("(not used)") for role in reading.roles(count)}
        with ui.row().classes("gap-2"):
            for column in found:
                given = options if column.role in options else {column.role: column.role, **options}
                with ui.column().classes("gap-0 border border-gray-300 rounded p-2"):
                    title = column.title or _("column {number}", number=column.number)
                    ui.label(title).classes("font-medium").tooltip(column.file)
                    ui.label("  ".join(column.cells[:2])).classes("text-xs text-gray-600 dark:text-gray-300")
                    act = self.changes(lambda event, of=column: reading.assign(self.project, of, event.value))
                    role = ui.select(given, value=column.role, on_change=act, label=_("role")).classes("w-32")
                    role.props(f'dense options-dense data-test="role-{title}"')

    @ui.refreshable_method
    def toggles(self) -> None:
        """Units, convention, and how the controller counts."""
        found: list[reading.FileColumn] = []
        with told():
            found = reading.columns_of(self.project)
        if not found:
            return
        with ui.row().classes("items-center gap-6"):
            for quantity, label, units in _UNITS:
                ui.label(_(label))
                act = self.changes(lambda event, of=quantity: reading.in_unit(self.project, of, event.value))
                value = reading.unit_of(found, quantity)
                toggle = ui.toggle(list(units), value=value if value in units else None, on_change=act)
                toggle.props(f'dense data-test="unit-{quantity}"')
            options = {"": _("as the file says"), **{name: name for name in CONVENTIONS}}
            act = self.changes(lambda event: self.project.answer("orientation", event.value or None))
            given = self.project.answers.get("orientation") or ""
            ui.select(options, value=given, on_change=act, label=_("Three angles are")).classes("w-44").props("dense")
        if self.project.has_robot:
            _signs(self.studio, self.changes)


def _moved(file: str, of: str) -> str:
    """Why a file is not taken as what it was dropped as."""
    if of == "controller":
        return _("{file} holds joints and no points: it is taken as the controller's", file=file)
    return _("{file} holds points: it is taken as the instrument's", file=file)


def _forget(project: Any, kind: str, name: str) -> None:
    """Takes a file out of the list; it stays in the folder."""
    left = [given for given in reading.files_of(project, "instrument") if given != name]
    project.answer(kind, left if kind == "instrument" else None)
    project.answer("columns", {})


def _drop(label: str, name: str, take: Callable[[str, bytes], Any]) -> None:
    """A place to drop a file."""

    async def arrived(event: events.UploadEventArguments) -> None:
        await take(event.file.name, await event.file.read())
        upload.reset()

    upload = ui.upload(label=label, auto_upload=True, multiple=True, on_upload=arrived)
    upload.props(f'flat bordered data-test="drop-{name}"').classes("w-80")
    drop_here(upload)


def _signs(studio: Studio, changes: Callable[..., Any]) -> None:
    """How the controller counts: a sign a joint, and what joint 3 is counted from."""
    robot = studio.project.robot()
    entries = {entry.joint: entry for entry in (robot.description.pendant or ())}
    signs = [int(entries[k + 1].sign) if k + 1 in entries else 1 for k in range(robot.joint_count)]
    three = entries.get(3)
    third = "own" if three is None else "plus" if three.plus else "minus" if three.minus else "own"

    def count(which: int, turned: bool) -> None:
        signs[which] = -1 if turned else 1
        reading.count_joints(studio.project, signs, third)

    with ui.row().classes("items-center gap-4"):
        ui.label(_("Turns the other way:"))
        for k, sign in enumerate(signs):
            act = changes(lambda e, k=k: count(k, e.value))
            ui.checkbox(f"J{k + 1}", value=sign < 0, on_change=act).props(f'dense data-test="sign-{k + 1}"')
        if robot.joint_count > 2:
            options = {
                "own": _("J3 by itself"),
                "plus": "q3 = J3 + J2 (FANUC)",
                "minus": _("q3 = J3 - J2 (parallelogram)"),
            }
            act = changes(lambda e: reading.count_joints(studio.project, signs, e.value))
            ui.select(options, value=third, on_change=act, label=_("Joint 3 is")).props('dense data-test="j3"').classes(
                "w-52"
            )


def _result(studio: Studio, found: reading.Understood) -> None:
    """The misfit, what is suspected, the joined list, and the button that saves it."""
    project = studio.project
    reach = project.robot().reach if project.has_robot else 1.0
    grade = found.grade(reach)
    rows = reading.table(found)
    if found.rms is not None:
        with ui.row().classes("items-baseline gap-x-3 gap-y-0"):
            ui.label(f"{significant(from_si(found.rms, 'mm'))} mm").classes(f"studio-number {_COLOURS[grade]}").props(
                f'data-test="misfit" data-grade="{grade}"'
            )
            count = len(found.data or [])
            ui.label(_("RMS of the uncalibrated arm over {count} poses.", count=count))
            ui.label(_(_WORDS[grade])).classes("font-medium")
    if found.problem:
        ui.label(retold(found.problem)).classes("text-warning").props('data-test="problem"')
    if found.suspicion:
        ui.label(retold(found.suspicion)).classes("text-negative").props('data-test="suspicion"')
    for note in found.notes:
        ui.label(f"• {retold(note)}").classes("text-sm").props('data-test="note"')
    if not rows:
        return
    line = ui.column().classes("w-full")

    def keep(place: str) -> None:
        with told():
            command, count = reading.save(project, found, place)
            line.clear()
            with line:
                ui.label(_("{file}: {rows}. This command does the same:", file=place, rows=plural(count, "row")))
                command_line(command)
                onward(_("Next: calibrate on the screen Result"), "/result")

    with line, ui.row():
        save = ui.button(_("Save the measurements"), on_click=lambda: keep(MEASUREMENTS), icon="save")
        save.props('data-test="save"')
        other = ui.button(_("Save as test poses"), on_click=lambda: keep(TEST), icon="rule").props("outline")
        other.props('data-test="save-test"').tooltip(_("Poses that no fit sees: they show how good the model is."))
    kinds = project.robot().joint_types if project.has_robot else []
    _joined(rows, {joint_position(k): "mm" if kind == "prismatic" else "°" for k, kind in enumerate(kinds)})


def _joined(rows: list[dict[str, Any]], units: dict[str, str]) -> None:
    """The joined list; `units`: of its joints."""
    titles = {"row": _("row"), "name": _("name"), "misfit": _("misfit mm")}
    units = {
        key: f"{key} {'mm' if key in 'xyz' else units.get(key, '')}".strip() for key in rows[0] if key not in titles
    }
    columns = [
        {"headerName": (titles | units)[key], "field": key, "sortable": True}
        for key in ("row", "name", *units, "misfit")
    ]
    for column in columns[2:]:
        column[":valueFormatter"] = decimals(3)
    table({"columnDefs": columns, "rowData": rows, "defaultColDef": {"flex": 1, "minWidth": 75}}).classes("h-72").props(
        'data-test="joined"'
    )
