"""Docstrings name what a function takes and what it raises; the page on the architecture names files that exist."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

HOME = Path(__file__).parents[2]
MANY = 4
"""Number of parameters from which a docstring describes all of them."""
UNDESCRIBED, UNSAID = 0, 0
"""Functions that leave out a parameter, and an exception: lower these when there are fewer, never raise them."""
OWN = ("__init__", "__post_init__", "__call__")
"""Methods whose parameters the docstring of the class may describe."""
ABSENT = ("AttributeError", "NotImplementedError")
"""Exceptions of Python's own protocols, of which nothing need be said."""

pytestmark = pytest.mark.alone

Function = tuple[str, ast.FunctionDef, str]


def inherited(trees: list[ast.Module]) -> set[tuple[str, str]]:
    """Classes and their methods that override a method of a class of the package, which describes the parameters."""
    classes = [node for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)]
    methods = {(node.name, child.name) for node in classes for child in node.body if isinstance(child, ast.FunctionDef)}
    return {
        (node.name, child.name)
        for node in classes
        for child in node.body
        if isinstance(child, ast.FunctionDef) and child.name not in OWN
        if any((ast.unparse(base), child.name) in methods for base in node.bases)
    }


def public(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef, str]]:
    """Name, node and docstring of each public function, class and method of a module."""
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
            text = ast.get_docstring(node) or ""
            yield node.name, node, text
            for child in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(child, ast.FunctionDef) and (not child.name.startswith("_") or child.name in OWN):
                    shared = text if child.name in OWN else ""
                    yield f"{node.name}.{child.name}", child, (ast.get_docstring(child) or "") + "\n" + shared


def parameters(name: str, node: ast.FunctionDef | ast.ClassDef) -> list[str]:
    """Parameters of a function; of a class its fields that have no docstring of their own, if there are many."""
    if isinstance(node, ast.FunctionDef):
        arguments = node.args
        found = [argument.arg for argument in (*arguments.posonlyargs, *arguments.args)]
        bound = "." in name and "staticmethod" not in map(ast.unparse, node.decorator_list)
        more = [argument.arg for argument in (*arguments.kwonlyargs, arguments.vararg, arguments.kwarg) if argument]
        found = found[bound:] + more
        return found if len(found) >= MANY else []
    made = " ".join(map(ast.unparse, (*node.decorator_list, *node.bases)))
    fields = [
        (child.target.id, isinstance(after, ast.Expr))
        for child, after in zip(node.body, [*node.body[1:], None], strict=True)
        if isinstance(child, ast.AnnAssign) and isinstance(child.target, ast.Name)
    ]
    many = len(fields) >= MANY and ("dataclass" in made or "NamedTuple" in made)
    return [field for field, described in fields if many and not described]


def describes(text: str, parameter: str) -> bool:
    """Whether a docstring has a name in double backticks, or in a numpydoc list."""
    return bool(
        re.search(rf"``[^`]*\b{parameter}\b[^`]*``", text)
        or re.search(rf"^[\w, *]*\b{parameter}(, [*\w]+)*$", text, flags=re.MULTILINE)
    )


def raised(node: ast.AST) -> set[str]:
    """Classes of exceptions that a body raises itself."""
    made = {ast.unparse(n.exc.func) for n in ast.walk(node) if isinstance(n, ast.Raise) and isinstance(n.exc, ast.Call)}
    return {name.split(".")[-1] for name in made} - set(ABSENT)


def failing() -> tuple[list[str], list[str]]:
    """Public functions and classes with a parameter that is not described, and with an exception that is not named."""
    undescribed, unsaid = [], []
    paths = [path for package in ("rodfem", "forms") for path in sorted((HOME / package).rglob("*.py"))]
    trees = [ast.parse(path.read_text()) for path in paths]
    overriding = inherited(trees)
    for path, tree in zip(paths, trees, strict=True):
        for name, node, text in public(tree):
            where = f"{path.relative_to(HOME)}:{node.lineno} {name}"
            asked = [] if tuple(name.split(".")) in overriding else parameters(name, node)
            missing = [p for p in asked if not p.startswith("_") and not describes(text, p)]
            undescribed += [f"{where}: {', '.join(missing)}"] if missing else []
            own = raised(node) if isinstance(node, ast.FunctionDef) else set()
            silent = sorted(x for x in own if x not in text)
            unsaid += [f"{where}: {', '.join(silent)}"] if silent else []
    return undescribed, unsaid


def test_parameters_are_described() -> None:
    undescribed, _ = failing()
    assert len(undescribed) <= UNDESCRIBED, "describe all parameters of\n" + "\n".join(undescribed)


def test_exceptions_are_named() -> None:
    _, unsaid = failing()
    assert len(unsaid) <= UNSAID, "say what these raise\n" + "\n".join(unsaid)


def test_the_check_finds_what_is_missing() -> None:
    source = '''
def f(a, b, c, dd):
    """Of ``a`` and ``b + c`` only; raises :class:`KeyError`."""
    raise ValueError(a)
'''
    ((name, node, text),) = public(ast.parse(source))
    assert [p for p in parameters(name, node) if not describes(text, p)] == ["dd"]
    assert raised(node) == {"ValueError"}
    assert describes("Parameters\n----------\na, dd\n    Both.", "dd")


def test_the_page_names_files_that_exist() -> None:
    """Paths in backticks are below the project or the package."""
    text = (HOME / "docs" / "architecture.md").read_text()
    named = sorted({n for n in re.findall(r"`([\w/.-]+)`", text) if re.search(r"/|\.(py|md)$", n)})
    rooms = [HOME, HOME / "rodfem", *(path for path in (HOME / "rodfem").iterdir() if path.is_dir())]
    missing = [n for n in named if not any((room / n).exists() or (room / f"{n}.py").exists() for room in rooms)]
    assert named and not missing, missing


@pytest.mark.parametrize("page", sorted((HOME / "docs" / "decisions").glob("*-*.md")), ids=lambda page: page.stem)
def test_decisions_name_what_there_is(page: Path) -> None:
    """Files, functions and tests that a page of a decision names in backticks."""
    text = page.read_text()
    where = text.split("**Where.**")[1].split("\n\n")[0]
    for file, names in re.findall(r"`((?:rodfem|forms)/[\w/]+\.\w+)`(?: \(([^)]*)\))?", where):
        source = (HOME / file).read_text()
        missing = [name for name in re.findall(r"`(\w+)`", names) if not re.search(rf"\b{name}\b", source)]
        assert not missing, f"{file} has no {', '.join(missing)}"
    tests = "\n".join(path.read_text() for path in (HOME / "tests").rglob("test_*.py"))
    missing = [name for name in re.findall(r"`(test_\w+)`", text) if f"def {name}(" not in tests]
    assert not missing
