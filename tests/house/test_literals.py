"""A small number in the body of a function has a name, or a comment on its line."""

import ast
from collections.abc import Iterator
from pathlib import Path

HOME = Path(__file__).parents[2]
SMALL, FAINT = 1e-2, 1e-5
"""A literal below this has a name; in ``output``, where larger ones are sizes in drawings, below the latter."""


def nameless(source: str, small: float) -> Iterator[tuple[int, float]]:
    """Line and value of each float below ``small``, but for zero, in bodies of functions, without a comment."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.FunctionDef, ast.Lambda)):
            for child in (
                x for part in (node.body if isinstance(node.body, list) else [node.body]) for x in ast.walk(part)
            ):
                number = isinstance(child, ast.Constant) and isinstance(child.value, float) and 0 < child.value < small
                if number and " # " not in lines[child.lineno - 1]:
                    yield child.lineno, child.value


def test_small_numbers_have_names() -> None:
    found = {
        f"{path.relative_to(HOME)}:{line}: {value:g}"
        for path in sorted((HOME / "rodfem").rglob("*.py"))
        for line, value in nameless(path.read_text(), FAINT if path.parent.name == "output" else SMALL)
    }
    assert not found, "give these a name or a comment:\n" + "\n".join(sorted(found))
