# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows from a ROS 2 topic of std_msgs/String: the header line of a measurement file, then rows; where rclpy is there.

A message holds a line or more; the answers, a message each, are published on TOPIC/answer.
"""

from __future__ import annotations

import importlib
import importlib.util
from threading import Event, Thread
from typing import Any

from fastcal.errors import InvalidInput
from fastcal.live.lines import Lines
from fastcal.live.session import LiveSession

_DEPTH = 1000  # messages that may wait
_PATIENCE = 0.2  # a wait for messages ends after so long, so that `stop` is seen [s]


def has_ros() -> bool:
    """Can topics be read here: is rclpy, which comes with ROS 2, to be found?"""
    return all(importlib.util.find_spec(name) is not None for name in ("rclpy", "std_msgs"))


class RowTopic:
    """Feeds a session with what is published.

    Args:
        session: What takes the rows.
        topic: Its name.
    """

    def __init__(self, session: LiveSession, topic: str) -> None:
        self._lines, self.topic = Lines(session), topic
        self._ended = Event()
        self._thread: Thread | None = None

    def start(self) -> RowTopic:
        """Begins to listen.

        Raises:
            InvalidInput: There is no rclpy here, or no topic can have this name.
        """
        if not has_ros():
            raise InvalidInput(
                f"topic {self.topic}: expected rclpy, which comes with ROS 2, and it is not there; source ROS 2's "
                f"setup.bash and start again"
            )
        self._ros = importlib.import_module("rclpy")
        self._string = importlib.import_module("std_msgs.msg").String
        # A context of its own: neither signals nor another node of this process are touched.
        self._context = importlib.import_module("rclpy.context").Context()
        self._ros.init(args=[], context=self._context)
        self._node = self._ros.create_node("fastcal", context=self._context)
        try:
            self._answers = self._node.create_publisher(self._string, f"{self.topic}/answer", _DEPTH)
            self._node.create_subscription(self._string, self.topic, self._came, _DEPTH)
        except ValueError as error:  # rclpy's own kinds of it
            self._close()
            raise InvalidInput(f"topic {self.topic}: {' '.join(str(error).split())}") from error
        self._executor = importlib.import_module("rclpy.executors").SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = Thread(target=self._spin, daemon=True)
        self._thread.start()
        return self

    def stop(self) -> None:
        """Ends; rows that came are written."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
            self._executor.shutdown()
            self._close()

    def _spin(self) -> None:
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=_PATIENCE)

    def _came(self, message: Any) -> None:
        for line in message.data.splitlines():
            answer = self._lines.answer(line)
            if answer is not None:
                said = self._string()
                said.data = answer
                self._answers.publish(said)

    def _close(self) -> None:
        self._node.destroy_node()
        self._ros.shutdown(context=self._context)
