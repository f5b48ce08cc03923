"""Arrays and texts as a page holds them: single precision in base64, JSON that closes no element."""

from __future__ import annotations

import json
from base64 import b64encode
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Packed = dict[str, Any]

ESCAPES = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}
"""Characters that could end a script, or begin a comment, as JSON also writes them."""


def packed(array: ArrayLike) -> Packed:
    """Shape and values of an array, as ``data.js`` unpacks them: little-endian single precision."""
    values = np.asarray(array, dtype="<f4")
    return {"shape": list(values.shape), "f32": b64encode(values.tobytes()).decode()}


def plain(values: ArrayLike) -> list[float | None]:
    """Numbers (n,) as JSON has them: null where one is not finite."""
    return [float(x) if np.isfinite(x) else None for x in np.asarray(values, dtype=float)]


def script_json(data: Any) -> str:
    """JSON that may stand within a script element, whatever its texts are; raises ValueError for nan."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for character, escape in ESCAPES.items():
        text = text.replace(character, escape)
    return text
