"""Kinds of special points: names with what tables, files and pictures know of them, in one place."""

import ast
import copy
import json
import re
from pathlib import Path

from rodfem.continuation.kinds import BRANCH_POINT, END, FOLD, KINDS, USER, Kind
from rodfem.output.plot_diagram import MARKERS
from rodfem.output.plot_locus import LINES

HOME = Path(__file__).parents[2]
NEUTRAL = {"user", "event", "end"}
"""Words that mean other things elsewhere."""


def test_a_kind_is_its_name() -> None:
    assert (FOLD, f"{FOLD:<6}", json.dumps([FOLD])) == ("fold", "fold  ", '["fold"]')
    assert KINDS["branch point"] is BRANCH_POINT
    assert copy.deepcopy(FOLD).code == "LP"
    assert isinstance(KINDS[json.loads(json.dumps(USER))], Kind)


def test_what_leaves_and_what_has_a_locus() -> None:
    """As AUTO-07p: branches are switched at BP alone; loci are of what happens, not of what was asked for."""
    assert [kind for kind in KINDS.values() if kind.branches] == [BRANCH_POINT]
    assert {name for name, kind in KINDS.items() if kind.request} == {USER, END}
    assert set(LINES) == {"branch point", "fold", "flutter", "divergence"}
    assert set(KINDS) - {END} == {name for name in MARKERS if name in KINDS}
    assert all(len(kind.code) == 2 for kind in KINDS.values())


def test_kinds_are_named_in_one_file() -> None:
    """No other module of the package compares with their names, and the page on files has them all."""
    for path in (HOME / "rodfem").rglob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        compared = [c for n in nodes if isinstance(n, ast.Compare) for c in (n.left, *n.comparators)]
        words = {node.value for node in compared if isinstance(node, ast.Constant)}
        assert not words & (set(KINDS) - NEUTRAL), path
    page = (HOME / "docs" / "files.md").read_text()
    rows = re.findall(r"^\| `kind` \| text \| \| (`branch point`, .*) \|$", page, flags=re.MULTILINE)
    every, loci = (set(re.findall(r"`([a-z ]+)`", row)) for row in rows)
    assert set(KINDS) <= every
    assert set(LINES) == loci
