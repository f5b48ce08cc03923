"""Tolerances have names: no small number stands in the body of a function."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

HOME = Path(__file__).parents[2]
SMALL, FAINT = 1e-2, 1e-5
"""A literal below this has a name; in ``output``, where larger ones are sizes in drawings, below the latter."""

pytestmark = pytest.mark.alone

Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda


def nameless(tree: ast.AST, small: float) -> Iterator[tuple[int, float]]:
    """Line and value of each float below ``small``, but for zero, in bodies of functions.

    Defaults of parameters are no part of a body: the parameter is their name, and a docstring describes it.
    """
    for node in ast.walk(tree):
        if isinstance(node, Function):
            body = [node.body] if isinstance(node, ast.Lambda) else node.body
            yield from {
                (child.lineno, child.value)
                for statement in body
                for child in ast.walk(statement)
                if isinstance(child, ast.Constant) and isinstance(child.value, float) and 0 < child.value < small
            }


def test_small_numbers_have_names() -> None:
    found = [
        f"{path.relative_to(HOME)}:{line}: {value:g}"
        for path in sorted((HOME / "rodfem").rglob("*.py"))
        for line, value in nameless(ast.parse(path.read_text()), FAINT if path.parent.name == "output" else SMALL)
    ]
    assert not found, "give these a name, in rodfem/tolerances.py or at the top of the file:\n" + "\n".join(found)


@pytest.mark.parametrize(
    ("source", "lines"),
    [
        ("EPS = 1e-9\n\ndef f(x, tolerance=1e-9):\n    return x < EPS * tolerance + 0.0 + 0.5", []),
        ("class A:\n    least: float = 1e-9", []),
        ("def f(x):\n    return x < -1e-9", [2]),
        ("class A:\n    def f(self, x):\n        return [y for y in x if y > 0.001]", [3]),
        ("near = lambda x, tolerance=1e-9: x < tolerance or x < 1e-8", [1]),
    ],
)
def test_the_check_finds_them(source: str, lines: list[int]) -> None:
    assert [line for line, _ in nameless(ast.parse(source), SMALL)] == lines
