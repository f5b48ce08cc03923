"""Special points and indices of all demos, classical problems and scenes of the documentation, against a record.

The record guards the numbers while the code changes its shape.  It is no oracle: the other tests have those.
"""

from typing import Any

import golden_cases as golden
import pytest
from every_row import disagreements
from golden_cases import DEMOS, FAMILIES, NOT_CONSERVATIVE, REPEATED, VARIED, cases, single_branches
from literature.test_classics import CRITICAL
from mpi4py import MPI
from work import counted, size
from work import recorded as recorded_work

NUMBERS = golden.numbers()
NOISE = 1.05
"""Factor by which work may differ where libraries and processors round differently."""


def test_all_cases_are_recorded() -> None:
    assert list(NUMBERS) == list(cases())
    scenes = {name: scene() for name, scene in cases().items()}
    assert {name for name, scene in scenes.items() if not scene.conservative} == set(NOT_CONSERVATIVE)
    families = {name for name, scene in scenes.items() if scene.name in FAMILIES}
    assert {case.values[0] for case in single_branches()} == set(golden.distinct()) - families - set(NOT_CONSERVATIVE)
    assert len(golden.distinct()) == len(scenes) - len(REPEATED)


def marked(name: str) -> Any:
    """A case with the runs that have it besides the serial one; those that state another once more are long.

    So are classical problems of a closed form, which ``tests/literature/test_classics.py`` compares with it.
    """
    marks = [] if name in VARIED else [pytest.mark.alone]
    kind, _, scene = name.partition(" ")
    again = scene in REPEATED if kind == "docs" else kind == "classic" and scene in CRITICAL and name not in VARIED
    marks += [pytest.mark.long] if again else []
    return pytest.param(name, marks=[*marks, pytest.mark.versions] if name.removeprefix("demo ") in DEMOS else marks)


@pytest.mark.ranks
@pytest.mark.parametrize("name", [marked(name) for name in NUMBERS])
def test_nothing_has_changed(name: str) -> None:
    """Bars, which nobody compares, are computed of varied cases: of the others they would take half of the time.

    Nor does it cost more: counts of work are compared on one rank, and may only fall.
    """
    with counted() as work:
        diagram = golden.trace(cases()[name](), error_bars=name in VARIED)
    found, known = golden.recorded(diagram), NUMBERS[name]
    for key in ("name", "ended", "indices"):
        assert [b[key] for b in found] == [b[key] for b in known]
    for branch, old in zip(found, known, strict=True):
        for key in ("kind", "index", "zero"):
            assert [s[key] for s in branch["special"]] == [s[key] for s in old["special"]], branch["name"]
        for s, t in zip(branch["special"], old["special"], strict=True):
            allowed = max(t["bar"], 1e-10 * max(1.0, abs(t["load"])))
            assert s["load"] == pytest.approx(t["load"], abs=allowed, rel=0), branch["name"]
            assert s.get("omega2") == (pytest.approx(t["omega2"], rel=1e-8) if "omega2" in t else None)
    most = {kind: NOISE * count + 2 for kind, count in recorded_work()[name].items()}
    work |= size(diagram)
    assert MPI.COMM_WORLD.size > 1 or {kind: count for kind, count in work.items() if count > most[kind]} == {}


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    ["demo hemitropic", "demo ring", *(pytest.param(f"demo {x}", marks=pytest.mark.long) for x in ("cord", "ruler"))],
)
def test_index_of_every_row(name: str) -> None:
    """By three other methods; ``python -m tests.every_row`` does the same for all conservative scenes."""
    rows, wrong = disagreements(name)
    assert rows > 30
    assert not wrong
