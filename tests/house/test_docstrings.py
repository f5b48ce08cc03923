"""Docstrings of the interface name what it takes and raises; pages name files, functions and tests that exist."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import rodfem

HOME = Path(__file__).parents[2]
MANY = 4
"""Number of parameters from which a docstring describes all of them."""
OWN = ("__init__", "__post_init__", "__call__")
"""Methods whose parameters the docstring of the class may describe."""


def interface() -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef, str]]:
    """Place, node and docstring of each public function, class and method of the interface."""
    pages = {HOME / "rodfem" / f"{home.replace('.', '/')}.py" for home in rodfem._HOMES.values()} - {
        HOME / "rodfem" / "problem.py"
    }
    for path in sorted({*pages, *(HOME / "forms").glob("*.py")}):
        for node in ast.parse(path.read_text()).body:
            if not isinstance(node, (ast.FunctionDef, ast.ClassDef)) or node.name.startswith("_"):
                continue
            if path in pages and node.name not in rodfem._HOMES:
                continue
            text = ast.get_docstring(node) or ""
            yield f"{path.relative_to(HOME)}:{node.lineno} {node.name}", node, text
            for child in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(child, ast.FunctionDef) and (not child.name.startswith("_") or child.name in OWN):
                    own = text if child.name in OWN else ""
                    yield (
                        f"{path.relative_to(HOME)}:{child.lineno} {node.name}.{child.name}",
                        child,
                        ((ast.get_docstring(child) or "") + own),
                    )


def parameters(node: ast.FunctionDef | ast.ClassDef) -> list[str]:
    """Parameters of a function, if there are many: a field of a class is described where its name does not say it."""
    if isinstance(node, ast.ClassDef):
        return []
    given = node.args
    found = [a.arg for a in (*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg) if a]
    found = [x for x in found if x not in ("self", "cls") and not x.startswith("_")]
    return found if len(found) >= MANY else []


def describes(text: str, parameter: str) -> bool:
    """Whether a docstring has a name in double backticks, or in a numpydoc list."""
    return bool(
        re.search(rf"``[^`]*\b{parameter}\b[^`]*``", text)
        or re.search(rf"^[\w, *]*\b{parameter}(, [*\w]+)*$", text, flags=re.MULTILINE)
    )


def test_parameters_and_exceptions_are_described() -> None:
    missing = []
    for place, node, text in interface():
        absent = [p for p in parameters(node) if not describes(text, p)]
        made = (n.exc.func for n in ast.walk(node) if isinstance(n, ast.Raise) and isinstance(n.exc, ast.Call))
        errors = {ast.unparse(x).split(".")[-1] for x in made} if isinstance(node, ast.FunctionDef) else set()
        absent += sorted(x for x in errors - {"AttributeError", "NotImplementedError"} if x not in text)
        missing += [f"{place}: {', '.join(absent)}"] if absent else []
    assert not missing, "describe\n" + "\n".join(missing)


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
