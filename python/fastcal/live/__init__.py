# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measuring with the robot at hand: rows as they come, each checked at once, and what to measure next."""

from fastcal.live.folder import WatchedFolder
from fastcal.live.session import Answer, LiveSession
from fastcal.live.tcp import RowServer
from fastcal.live.topic import RowTopic, has_ros

__all__ = ["Answer", "LiveSession", "RowServer", "RowTopic", "WatchedFolder", "has_ros"]
