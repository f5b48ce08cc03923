"""The ratchet: lines, files, constants, complex functions and places that warn may only fall.

When a figure has fallen for good, lower the one here.  What is added has to be paid with what is taken out elsewhere.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "rodfem"
MOST = {
    "lines of Python": 31491,
    "files of Python": 147,
    "lines of C": 1026,
    "module constants with a number": 244,
    "functions of a complexity above 10": 0,
    "functions of six parameters or more": 18,
    "places that warn": 21,
    "files that import internals of UFL and FFCx": 2,
}
DECISIONS = (ast.If, ast.For, ast.AsyncFor, ast.While, ast.ExceptHandler, ast.IfExp, ast.Assert, ast.match_case)
INTERNALS = ("ufl.", "ffcx.")


@cache
def modules() -> dict[Path, ast.Module]:
    """All modules of the package, parsed, without those of ``forms``."""
    paths = [path for path in sorted(PACKAGE.rglob("*.py")) if path.parent.name != "forms"]
    return {path: ast.parse(path.read_text()) for path in paths}


def nodes() -> Iterator[ast.AST]:
    """All nodes of all modules."""
    for tree in modules().values():
        yield from ast.walk(tree)


def lines(paths: list[Path]) -> int:
    return sum(len(path.read_text().splitlines()) for path in paths)


def complexity(function: ast.AST) -> int:
    """McCabe's number: one, and one for each decision; an ``and`` is one, and so is a condition of a comprehension."""
    number = 1
    for node in ast.walk(function):
        number += isinstance(node, DECISIONS)
        number += len(node.values) - 1 if isinstance(node, ast.BoolOp) else 0
        number += 1 + len(node.ifs) if isinstance(node, ast.comprehension) else 0
        number += isinstance(node, (ast.For, ast.AsyncFor, ast.While)) and bool(node.orelse)
    return number


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Number of parameters, ``self`` among them."""
    given = function.args
    return len(given.posonlyargs + given.args + given.kwonlyargs)


def numeric(statement: ast.stmt) -> bool:
    """Whether a statement assigns something with a number in it."""
    if not isinstance(statement, (ast.Assign, ast.AnnAssign)) or statement.value is None:
        return False
    constants = (node.value for node in ast.walk(statement.value) if isinstance(node, ast.Constant))
    return any(isinstance(value, (int, float)) and not isinstance(value, bool) for value in constants)


def warns(node: ast.AST) -> bool:
    """Whether this is a call of something whose name begins with ``warn``."""
    return isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2].lstrip("_").startswith("warn")


def internal(tree: ast.Module) -> bool:
    """Whether a module imports more than the packages ``ufl`` and ``ffcx`` themselves."""
    names: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names.append(node.module or "")
    return any(name.startswith(INTERNALS) or name == "ffcx" for name in names)


@cache
def figures() -> dict[str, int]:
    """What :data:`MOST` bounds, as it is."""
    functions = [node for node in nodes() if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
    return {
        "lines of Python": lines(list(modules())),
        "files of Python": len(modules()),
        "lines of C": lines(sorted(PACKAGE.rglob("*.c"))),
        "module constants with a number": sum(numeric(line) for tree in modules().values() for line in tree.body),
        "functions of a complexity above 10": sum(complexity(function) > 10 for function in functions),
        "functions of six parameters or more": sum(parameters(function) >= 6 for function in functions),
        "places that warn": sum(map(warns, nodes())),
        "files that import internals of UFL and FFCx": sum(map(internal, modules().values())),
    }


@pytest.mark.parametrize("name", MOST)
def test_nothing_grows(name: str) -> None:
    """Levels and circles of imports have the same rule, in ``test_imports.py``; work has it in ``test_golden.py``."""
    assert figures()[name] <= MOST[name]


if __name__ == "__main__":
    print(*(f"{number:6}  {name}" for name, number in figures().items()), sep="\n")
