"""Labels in TeX as plotly.js sets them: Greek letters, subscripts and superscripts, with all else escaped."""

from __future__ import annotations

import re
from html import escape

GREEK = (
    *("alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho".split()),
    *("final sigma tau upsilon phi chi psi omega".split()),
)
"""Names of the letters from U+03B1 on, in the order of Unicode; ``final`` is the sigma at the end of a word."""
SIGNS = {
    **{name: chr(0x3B1 + i) for i, name in enumerate(GREEK)},
    **{name.capitalize(): chr(0x391 + i) for i, name in enumerate(GREEK)},
    **{"varphi": "φ", "varepsilon": "ε", "vartheta": "ϑ", "int": "∫", "sum": "∑", "partial": "∂", "infty": "∞"},
    **{"cdot": "·", "times": "×", "pm": "±", "le": "≤", "ge": "≥", "to": "→", "sqrt": "√", "ell": "ℓ", "prime": "′"},
    **dict.fromkeys((",", ";", ":", " ", "quad"), " "),
    **dict.fromkeys(("!", "left", "right", "mathrm", "mathbf", "mathit", "text", "rm", "bf"), ""),
}
"""Commands of TeX and the characters for them."""
COMMAND = re.compile(r"\\([a-zA-Z]+|.) ?")
RAISED = re.compile(r"([_^])(?:\{([^{}]*)\}|(.))")
TAGS = {"_": "sub", "^": "sup"}
FRACTION = re.compile(r"\\d?frac\{([^{}]*)\}\{([^{}]*)\}")
MATHS = re.compile(r"\$([^$]*)\$")


def html_of(label: str, always: bool = False) -> str:
    """HTML of a label with TeX between dollars; ``always``, also of one without dollars, is TeX as a whole."""
    text = escape(label)
    if "$" in text:
        return MATHS.sub(lambda found: _maths(found[1]), text)
    return _maths(text) if always or "\\" in text else text


def plain_of(label: str, always: bool = False) -> str:
    """The same as text without elements, escaped for none: for buttons and titles."""
    text = re.sub(r"</?(?:sub|sup)>", "", html_of(label, always))
    for character, entity in (("<", "&lt;"), (">", "&gt;"), ('"', "&quot;"), ("'", "&#x27;"), ("&", "&amp;")):
        text = text.replace(entity, character)
    return text


def _maths(text: str) -> str:
    text = FRACTION.sub(r"\1/\2", text)
    text = COMMAND.sub(lambda found: SIGNS.get(found[1], found[1]), text)
    text = RAISED.sub(lambda found: f"<{TAGS[found[1]]}>{found[2] or found[3]}</{TAGS[found[1]]}>", text)
    return text.replace("{", "").replace("}", "")
