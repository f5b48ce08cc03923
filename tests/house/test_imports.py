"""Imports go one way: what each module of the package may know of the others."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

HOME = Path(__file__).parents[2]
LEVELS = 14
"""Levels of the modules of ``rodfem``: lower it when there are fewer, never raise it."""
ROOMS = 11
"""Levels of its packages."""
MATRICES = {
    "rodfem.linalg.chain",
    "rodfem.linalg.compiled",
    "rodfem.linalg.factorization",
    "rodfem.linalg.matrices",
    "rodfem.linalg.orthogonal",
}
"""Linear algebra, which knows nothing of rods."""
COMMAND_LINE = ("rodfem.app.cli", "rodfem.app.main", "rodfem.app.console", "rodfem.app.script")
"""Beginnings of the names of modules that know options."""
BELOW_MATRICES = {"rodfem.errors", "rodfem.compat", "rodfem.tolerances", "rodfem.code_cache"}
"""Other modules that they may import."""
FORMS = "rodfem.forms"
"""The folder ``forms`` beside the package, as which it is installed."""
MATHEMATICS = ("ufl", FORMS, "__future__", "collections", "dataclasses", "typing")
"""All that the mathematics in ``forms`` may import; ``rodfem.forms.importing`` may import the standard library."""


@cache
def modules() -> dict[str, ast.Module]:
    """All modules, parsed; ``rodfem/forms`` is a link, which ``rglob`` does not follow everywhere."""
    found = {}
    for path in sorted([*(HOME / "rodfem").rglob("*.py"), *(HOME / "rodfem" / "forms").glob("*.py")]):
        name = ".".join(path.relative_to(HOME).with_suffix("").parts)
        found[name.removesuffix(".__init__")] = ast.parse(path.read_text())
    return found


def imports(node: ast.AST, functions: bool = True, annotations: bool = True) -> Iterator[str]:
    """Dotted names that a module imports when loaded, by its ``functions``, and for its ``annotations`` alone."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import):
            yield from (alias.name for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            assert child.level == 0, "imports are absolute"
            yield from (f"{child.module}.{alias.name}" for alias in child.names)
        elif isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)) and not functions:
            continue
        elif isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING" and not annotations:
            continue
        else:
            yield from imports(child, functions, annotations)


@cache
def arrows(functions: bool = False, annotations: bool = False) -> dict[str, set[str]]:
    """Modules of ``rodfem`` that each of its modules imports, but for the mathematics, which stands apart."""

    def home(name: str) -> str:
        while name and name not in modules():
            name = name.rpartition(".")[0]
        return name

    graph = {}
    for module, tree in modules().items():
        if not module.startswith(FORMS):
            found = {home(name) for name in imports(tree, functions, annotations)} - {module, ""}
            graph[module] = {name for name in found if not name.startswith(FORMS)}
    return graph


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Largest sets of modules each of which reaches all others of its set."""
    reached = {module: set(direct) for module, direct in graph.items()}
    for middle in graph:
        for module in graph:
            if middle in reached[module]:
                reached[module] |= reached[middle]
    found = {frozenset(b for b in reached[a] if a in reached[b]) for a in graph if a in reached[a]}
    return [set(circle) for circle in sorted(found, key=sorted)]


def levels(graph: dict[str, set[str]]) -> int:
    """Number of modules in the longest chain of imports."""

    @cache
    def level(module: str) -> int:
        return 1 + max(map(level, graph[module]), default=0)

    return max(map(level, graph))


@pytest.mark.long
def test_no_circle_of_imports() -> None:
    assert circles(arrows()) == []
    assert circles(arrows(functions=True)) == []


def test_no_more_levels() -> None:
    assert levels(arrows()) <= LEVELS


def rooms() -> dict[str, set[str]]:
    """Packages, and single modules beside them, that each imports."""

    def room(module: str) -> str:
        return ".".join(module.split(".")[:2])

    graph: dict[str, set[str]] = {}
    for module, found in arrows().items():
        if module != "rodfem":
            others = {room(other) for other in found if other != "rodfem"} - {room(module)}
            graph[room(module)] = graph.get(room(module), set()) | others
    return graph


def test_rooms_know_only_those_below() -> None:
    """As docs/architecture.md lists them, from top to bottom; the statement of a problem knows no dolfinx."""
    assert circles(rooms()) == []
    assert levels(rooms()) <= ROOMS
    page = (HOME / "docs" / "architecture.md").read_text()
    order = re.findall(r"^\| `([a-z0-9_]+)` \|", page[page.index("## The rooms") :], flags=re.MULTILINE)
    assert {f"rodfem.{name}" for name in order} == {
        name for name in rooms() if (HOME / name.replace(".", "/")).is_dir()
    }
    for place, name in enumerate(order):
        above = {f"rodfem.{other}" for other in order[:place]}
        assert not rooms()[f"rodfem.{name}"] & above, name
    for module, tree in modules().items():
        if module.startswith("rodfem.problem"):
            known = {name.split(".")[0] for name in imports(tree)}
            assert known.isdisjoint({"dolfinx", "petsc4py", "slepc4py", "mpi4py"}), module


def test_forms_are_ufl_alone() -> None:
    for module, tree in modules().items():
        if module.startswith(FORMS):
            allowed = ("ufl", *sys.stdlib_module_names) if module == "rodfem.forms.importing" else MATHEMATICS
            for name in imports(tree):
                assert any(name == other or name.startswith(f"{other}.") for other in allowed), (module, name)


def test_command_line_is_known_to_programs_alone() -> None:
    """Only modules that are run themselves read options, and nothing outside of the command line imports it."""
    for module, tree in modules().items():
        names = set(imports(tree))
        program = any(
            isinstance(statement, ast.If) and ast.unparse(statement.test) == "__name__ == '__main__'"
            for statement in tree.body
        )
        within = module.startswith(COMMAND_LINE)
        assert within or program or "argparse" not in names, module
        assert within or program or not any(name.startswith(COMMAND_LINE) for name in names), module


def test_matrices_know_no_rods() -> None:
    assert set(modules()) >= MATRICES
    for module in sorted(MATRICES):
        assert arrows(functions=True, annotations=True)[module] <= MATRICES | BELOW_MATRICES, module
