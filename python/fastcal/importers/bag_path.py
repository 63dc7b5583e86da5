# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is a ROS bag, apart from their reading: every measurement file is asked, and few are one."""

from __future__ import annotations

import os
from pathlib import Path


def is_bag(path: str | os.PathLike[str]) -> bool:
    """Whether a path is a bag: a folder with metadata.yaml, or a file of one."""
    place = Path(path)
    return (place / "metadata.yaml").is_file() or (
        place.suffix.lower() in (".mcap", ".db3", ".bag") and place.is_file()  # and no pipe, which would be waited for
    )
