# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows from a ROS 2 topic, with stand-ins for rclpy and std_msgs whose functions take what the real ones take."""

from __future__ import annotations

import queue
import sys
from collections.abc import Callable, Iterator
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from fastcal.errors import InvalidInput
from fastcal.live import LiveSession, RowTopic, has_ros


class String:
    """As std_msgs.msg.String."""

    def __init__(self) -> None:
        self.data = ""


class Node:
    """As rclpy.node.Node, of topics that one process shares."""

    def __init__(self, name: str, context: Any, topics: dict[str, queue.Queue[String]]) -> None:
        self.name, self.context, self._topics = name, context, topics
        self.subscribed: list[tuple[str, Callable[[String], None]]] = []
        self.is_there = True

    def create_subscription(
        self, msg_type: type, topic: str, callback: Callable[[Any], None], qos_profile: int, *, raw: bool = False
    ) -> Any:
        assert msg_type is String
        assert qos_profile > 0
        if " " in topic:
            raise ValueError(f"Invalid topic name: must not contain characters other than alphanumerics: '{topic}'")
        self.subscribed.append((topic, callback))
        return SimpleNamespace(topic_name=topic, raw=raw)

    def create_publisher(self, msg_type: type, topic: str, qos_profile: int) -> Any:
        assert msg_type is String
        assert qos_profile > 0
        return SimpleNamespace(publish=self._topics.setdefault(topic, queue.Queue()).put)

    def destroy_node(self) -> None:
        self.is_there = False


class SingleThreadedExecutor:
    """As rclpy.executors.SingleThreadedExecutor."""

    def __init__(self, *, context: Any = None) -> None:
        self.context, self.nodes = context, []

    def add_node(self, node: Node) -> bool:
        self.nodes.append(node)
        return True

    def spin_once(self, timeout_sec: float | None = None) -> None:
        for node in self.nodes:
            for topic, callback in node.subscribed:
                try:
                    callback(node._topics.setdefault(topic, queue.Queue()).get(timeout=timeout_sec))
                except queue.Empty:
                    continue

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        return True


@pytest.fixture
def ros(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """The stand-ins; at the end no node and no context is left."""
    seen = SimpleNamespace(topics={}, nodes=[], running=set())

    def module(name: str, **content: Any) -> None:
        made = ModuleType(name)
        made.__spec__ = ModuleSpec(name, None, is_package=True)
        vars(made).update(content)
        monkeypatch.setitem(sys.modules, name, made)

    def init(*, args: list[str] | None = None, context: Any = None, domain_id: int | None = None) -> None:
        assert args == []
        seen.running.add(context)

    def shutdown(*, context: Any = None, uninstall_handlers: bool | None = None) -> None:
        seen.running.remove(context)

    def create_node(node_name: str, *, context: Any = None, namespace: str | None = None) -> Node:
        assert context in seen.running
        seen.nodes.append(Node(node_name, context, seen.topics))
        return seen.nodes[-1]

    module("rclpy", init=init, shutdown=shutdown, create_node=create_node)
    module("rclpy.context", Context=type("Context", (), {}))
    module("rclpy.executors", SingleThreadedExecutor=SingleThreadedExecutor)
    module("std_msgs")
    module("std_msgs.msg", String=String)
    yield seen
    assert seen.running == set()
    assert not any(node.is_there for node in seen.nodes)


def message(text: str) -> String:
    made = String()
    made.data = text
    return made


def test_rows_of_a_topic_are_answered(ros: Any, simulated: Any, tmp_path: Path) -> None:
    session = LiveSession(simulated.robot, tmp_path)
    header, rows = simulated.text()
    listened = RowTopic(session, "tracker/rows").start()
    ros.topics.setdefault("tracker/rows", queue.Queue())
    for text in (f"{header}\n{rows[0]}", rows[1], "1,2", rows[2]):
        ros.topics["tracker/rows"].put(message(text))
    said = [ros.topics["tracker/rows/answer"].get(timeout=30).data for _ in range(5)]
    listened.stop()
    assert said == ["ok", "ok", "ok", f"expected {len(header.split(','))} cells as the header has, got 2", "ok"]
    assert len(session.kept) == 3


def test_a_name_that_is_none_leaves_nothing_open(ros: Any, simulated: Any, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="topic two words: Invalid topic name"):
        RowTopic(LiveSession(simulated.robot, tmp_path), "two words").start()
    assert len(ros.nodes) == 1


def test_without_ros_it_says_what_to_do(simulated: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert not has_ros()
    with pytest.raises(InvalidInput, match=r"expected rclpy, which comes with ROS 2.*setup\.bash"):
        RowTopic(LiveSession(simulated.robot, tmp_path), "rows").start()
