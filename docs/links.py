"""Links of the pages into the code: the name in the text of a link is defined in the file that it leads to.

A link is written ``[`rodfem.forms.rotation.product`](../forms/rotation.py#L30)``: its text is a module, or a function,
method, class or constant of it.  With a line it is that of the definition.  ``python docs/links.py`` writes the lines
of today into all pages; a test compares.
"""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

HOME = Path(__file__).parents[1]
LINK = re.compile(r"\[`(?P<name>[\w.]+)`\]\((?P<file>[\w./-]+\.py)(?P<line>#L\d+)?\)")


def pages() -> list[Path]:
    """All pages of the documentation, and those beside it."""
    return [*sorted(HOME.glob("*.md")), *sorted((HOME / "docs").rglob("*.md"))]


@cache
def lines(path: Path) -> dict[str, int]:
    """Line of each function, class, constant and method of a module, and of the module itself, by its full name.

    The folder ``forms`` is the package ``rodfem.forms``.
    """
    inside = Path("rodfem", path.relative_to(HOME)) if path.is_relative_to(HOME / "forms") else path.relative_to(HOME)
    module = ".".join(inside.with_suffix("").parts)
    found = {module: 1}
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found |= {f"{module}.{target.id}": node.lineno for target in targets if isinstance(target, ast.Name)}
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found[f"{module}.{node.name}"] = node.lineno
        for child in node.body if isinstance(node, ast.ClassDef) else ():
            if isinstance(child, ast.FunctionDef):
                found[f"{module}.{node.name}.{child.name}"] = child.lineno
    return found


def refreshed(page: Path) -> str:
    """Text of a page with the lines of today in its links; raises :class:`KeyError` for a name that is not defined."""

    def renewed(link: re.Match[str]) -> str:
        line = lines((page.parent / link["file"]).resolve())[link["name"]]
        return f"[`{link['name']}`]({link['file']}{f'#L{line}' if link['line'] else ''})"

    return LINK.sub(renewed, page.read_text())


if __name__ == "__main__":
    for path in pages():
        path.write_text(refreshed(path))
