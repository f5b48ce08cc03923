"""Texts and arrays as a page holds them: labels in TeX as HTML, JSON that closes no element, arrays in base64."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from html import escape, unescape
from html.entities import html5
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

SIGNS = {
    **{"infty": "∞", "partial": "∂", "cdot": "·", "to": "→", "sqrt": "√", "varphi": "φ", "varepsilon": "ε"},
    **dict.fromkeys((",", ";", ":", " ", "quad"), " "),
    **dict.fromkeys(("!", "left", "right", "mathrm", "mathbf", "mathit", "text", "rm", "bf"), ""),
}
"""Commands of TeX and the characters for them, where HTML has no entity of their name."""
COMMAND = re.compile(r"\\([a-zA-Z]+|.) ?")
RAISED = re.compile(r"([_^])(?:\{([^{}]*)\}|(.))")
TAGS = {"_": "sub", "^": "sup"}
FRACTION = re.compile(r"\\d?frac\{([^{}]*)\}\{([^{}]*)\}")
MATHS = re.compile(r"\$([^$]*)\$")
ESCAPES = str.maketrans({"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"})
"""Characters that could end a script, or begin a comment, as JSON also writes them."""


def html_of(label: str, always: bool = False) -> str:
    """HTML of a label with TeX between dollars; ``always``, also of one without dollars, is TeX as a whole."""
    text = escape(label)
    if "$" in text:
        return MATHS.sub(lambda found: _maths(found[1]), text)
    return _maths(text) if always or "\\" in text else text


def plain_of(label: str, always: bool = False) -> str:
    """The same as text without elements, escaped for none: for buttons and titles."""
    return unescape(re.sub(r"</?(?:sub|sup)>", "", html_of(label, always)))


def _maths(text: str) -> str:
    text = FRACTION.sub(r"\1/\2", text)
    text = COMMAND.sub(lambda found: SIGNS.get(found[1], html5.get(f"{found[1]};", found[1])), text)
    text = RAISED.sub(lambda found: f"<{TAGS[found[1]]}>{found[2] or found[3]}</{TAGS[found[1]]}>", text)
    return text.replace("{", "").replace("}", "")


def packed(array: ArrayLike) -> dict[str, Any]:
    """Shape and values of an array, as ``data.js`` unpacks them: little-endian single precision."""
    values = np.asarray(array, dtype="<f4")
    return {"shape": list(values.shape), "f32": b64encode(values.tobytes()).decode()}


def plain(values: ArrayLike) -> list[float | None]:
    """Numbers (n,) as JSON has them: null where one is not finite."""
    return [float(x) if np.isfinite(x) else None for x in np.asarray(values, dtype=float)]


def script_json(data: Any) -> str:
    """JSON that may stand within a script element, whatever its texts are; raises ValueError for nan."""
    return json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":")).translate(ESCAPES)
