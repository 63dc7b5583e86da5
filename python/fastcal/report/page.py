# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One self-contained HTML page: templates, style, script and the figures' library, nothing fetched from anywhere.

The parts of Plotly's JavaScript that the figures use (`plotly/`, made by tools/plotly_bundle) are carried gzipped in
base64, 0.6 MB, and unpacked by the browser. A content security policy in the page forbids every connection, so
"self-contained" is enforced and not only meant.
"""

from __future__ import annotations

import base64
import functools
import importlib.resources
import json
import re
from datetime import datetime, timezone
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup, escape

import fastcal
from fastcal.report import figures, formatting
from fastcal.report.language import _, language

_SENTENCES = re.compile(r"(?<=[\w)%°]{2}\.) (?=[A-ZÄÖÜ])")


def render(template: str, **context: Any) -> str:
    """The page of `template` (a child of page.html); the context's texts are escaped, its figures drawn by page.js."""
    environment = _environment()
    scene, page, style = (
        environment.loader.get_source(environment, name)[0]  # type: ignore[union-attr]
        for name in ("scene.js", "page.js", "page.css")
    )
    return environment.get_template(template).render(
        script=Markup(scene + page),  # noqa: S704  our own file
        style=Markup(style),  # noqa: S704  our own file
        plotly=_plotly_base64(),
        dark=figures.DARK,
        version=fastcal.__version__,
        date=datetime.now(timezone.utc).date().isoformat(),
        language=language.get(),
        **context,
    )


def to_script_json(value: Any) -> Markup:
    """JSON that may stand inside a script element; numpy arrays become Plotly's typed arrays in single precision."""
    text = json.dumps(value, default=_encode, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))  # noqa: S704  escaped


def _encode(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        dtype = "i4" if np.issubdtype(value.dtype, np.integer) else "f4"
        data = base64.b64encode(np.ascontiguousarray(value, f"<{dtype}").tobytes()).decode("ascii")
        typed: dict[str, Any] = {"dtype": dtype, "bdata": data}
        if value.ndim > 1:
            typed["shape"] = ",".join(str(length) for length in value.shape)
        return typed
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a figure holds {type(value).__name__}, expected numbers, texts, lists or arrays")


def prose(text: str) -> Markup:
    """A sentence, escaped, in which what stands between two `backticks` is a command or a name in code.

    An option, such as -o, does not end a line behind its hyphen.
    """
    coded = re.sub("`([^`]+)`", r"<code>\1</code>", str(escape(text)))
    return Markup(re.sub(r"(?<=\s)--?[a-z][a-z-]*", r'<span class="option">\g<0></span>', coded))  # noqa: S704  escaped


def opening(text: str) -> tuple[str, str]:
    """A verdict's first sentence, and what it says besides; a full stop behind a single letter ends none (z. B.)."""
    first, _space, more = _SENTENCES.sub("\n", text, count=1).partition("\n")
    return first, more


@functools.cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("fastcal.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals["_"] = _
    environment.filters["script_json"] = to_script_json
    environment.filters["prose"] = prose
    environment.filters["opening"] = opening
    for name in ("count", "fixed", "percent", "plural", "significant"):
        environment.filters[name] = getattr(formatting, name)
    return environment


@functools.cache
def _plotly_base64() -> str:
    packed = importlib.resources.files("fastcal.report") / "plotly" / "plotly.min.js.gz"
    return base64.b64encode(packed.read_bytes()).decode("ascii")
