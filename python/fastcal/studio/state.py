# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the studio holds while it runs: the project, the work in the background, the session of measuring."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastcal.live import LiveSession, RowServer, RowTopic, WatchedFolder
from fastcal.measurements.dataset import Dataset
from fastcal.studio.jobs import Job
from fastcal.studio.project import LIVE, Project
from fastcal.units import to_si


class Studio:
    """The project that is open, and what runs in it.

    Attributes:
        project: Its folder.
        jobs: The last work of each screen, by the screen's name.
        session: Of measuring; None before it is begun.
        rows_server: Where rows come by TCP.
        watched: The folder that is watched for rows.
        topic: The ROS 2 topic that rows come from.
    """

    def __init__(self, project: Project) -> None:
        self.project = project
        self.jobs: dict[str, Job] = {}
        self.session: LiveSession | None = None
        self.rows_server: RowServer | None = None
        self.watched: WatchedFolder | None = None
        self.topic: RowTopic | None = None

    def open(self, name: str) -> None:
        """Opens another project beside this one, which is made where it is not there; what runs in this one ends.

        Raises:
            InvalidInput: The name is none of a folder.
        """
        project = Project(self.project.folder.parent / Project.plain_name(name))
        self.close()
        self.jobs.clear()
        project.answer("opened", True)  # so that it is one, and is listed, from now on
        self.project = project

    def start(self, screen: str, title: str, task: str, **arguments: Any) -> Job:
        """Starts a task of a screen; what that screen had running is stopped."""
        if screen in self.jobs:
            self.jobs[screen].stop()
        self.jobs[screen] = Job(title, task, self.project.folder, **arguments)
        return self.jobs[screen]

    def measure(self, port: int, goal_mm: float | None, sigma_mm: float, plan: Dataset | None) -> LiveSession:
        """Begins the session of measuring, or goes on with it, and listens for rows."""
        self.stop_measuring()
        goal = None if goal_mm is None else to_si(goal_mm, "mm")
        folder = self.project.path(LIVE)
        self.session = LiveSession(self.project.robot(), folder, goal=goal, sigma=to_si(sigma_mm, "mm"), plan=plan)
        self.rows_server = RowServer(self.session, port).start()
        return self.session

    def watch(self, folder: str) -> None:
        """Watches a folder for rows too; an empty name ends that."""
        if self.watched is not None:
            self.watched.stop()
            self.watched = None
        if folder and self.session is not None:
            self.watched = WatchedFolder(self.session, Path(folder).expanduser()).start()

    def listen(self, topic: str) -> None:
        """Takes rows from a ROS 2 topic too; an empty name ends that."""
        if self.topic is not None:
            self.topic.stop()
            self.topic = None
        if topic and self.session is not None:
            self.topic = RowTopic(self.session, topic).start()

    def stop_measuring(self) -> None:
        """Listens no longer; the session's files stay."""
        self.watch("")
        self.listen("")
        if self.rows_server is not None:
            self.rows_server.stop()
            self.rows_server = None
        self.session = None

    def close(self) -> None:
        """Ends everything that runs."""
        self.stop_measuring()
        for job in self.jobs.values():
            job.stop()
