# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Small copies of pictures for pages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.camera.opencv import opencv
from fastcal.errors import FastcalError
from fastcal.io.regular_file import read_bytes

MOST_BYTES = 256_000_000
_SIDE = 320  # pixels of the larger side
_QUALITY = 70


def small_jpeg(cv2: Any, grey: NDArray[np.uint8]) -> bytes:
    """A small JPEG of a grey picture (height, width)."""
    scale = min(_SIDE / max(grey.shape), 1.0)
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1])


def thumbnail(path: Path) -> bytes:
    """A small JPEG of a picture; none where it is not there, or no OpenCV that could make one."""
    try:
        cv2 = opencv()
        content = np.frombuffer(read_bytes(path, MOST_BYTES), np.uint8)
    except FastcalError:
        return b""
    grey = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE) if len(content) else None
    return b"" if grey is None else small_jpeg(cv2, grey)
