# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The chain that the core reads from the text of a URDF."""

from __future__ import annotations

import re
from typing import Any

from fastcal import _core
from fastcal.io.xml_text import declared_as_utf8

# Comments and character data as they are; or a start tag, in which a > inside quotes is text.
_MARKUP = re.compile(r"""<!--.*?-->|<!\[CDATA\[.*?\]\]>|<[A-Za-z_:](?:[^>"']|"[^"]*"|'[^']*')*>""", re.DOTALL)
_BLANKS = str.maketrans("\t\r\n", "   ")


def read_chain(xml: str, base_link: str = "", tip_link: str = "") -> dict[str, Any]:
    """Joints, links and notes of the arm between two links, as `_core.read_urdf` gives them.

    Tabs and line ends within an attribute count as blanks (XML 1.0, section 3.3.3); urdfdom splits
    numbers at these alone.

    Raises:
        InvalidInput: The text holds no serial arm; the sentence says why.
    """
    text = _MARKUP.sub(lambda match: match[0] if match[0].startswith("<!") else match[0].translate(_BLANKS), xml)
    chain: dict[str, Any] = _core.read_urdf(declared_as_utf8(text), base_link, tip_link)
    return chain
