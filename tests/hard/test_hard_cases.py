"""Every hard case in small: it is right, or it says what it could not decide, where that is what is promised."""

import re
from pathlib import Path
from typing import Any

import pytest
from hard import bifurcations
from hard.case import Case, words
from hard.cases import CASES, problem_at

CONTRACT = Path(__file__).parents[2] / "docs" / "resolution.md"
APART = "loci"
"""A group that has a file of its own."""
EVERY = [(case, value) for name, group in CASES.items() if name != APART for case in group for value in case.few]


def value_of(case: Case, value: Any) -> Any:
    """A value of a case, as it is tested: ``make test`` has the first one of each."""
    marks = [] if value == case.few[0] else [pytest.mark.long]
    return pytest.param(case, value, marks=marks, id=f"{case.name}-{value}")


def test_every_case_is_tested() -> None:
    assert all(case.few for group in CASES.values() for case in group)


def test_every_case_is_one_of_the_contract() -> None:
    """It names the row of "Promised" in docs/resolution.md that it tests."""
    promised = CONTRACT.read_text().partition("## Promised")[2].partition("\n\n|")[2].partition("\n\n")[0]
    rows = set(re.findall(r"^\|? ?([^|]+?) \|", promised, flags=re.MULTILINE))
    assert {row["row of the contract"] for row in words().values()} <= rows
    assert list(words()) == [case.name for group in CASES.values() for case in group]


@pytest.mark.parametrize(("case", "value"), [value_of(*every) for every in EVERY])
def test_a_hard_case(case: Case, value: Any) -> None:
    found = case.measure(value)
    assert found.right or (case.may_say and found.said), f"{found.error:.3g} {found.wrong} {found.said}"


@pytest.mark.parametrize("width", [1e-2, 7e-3, 3e-3])
def test_a_branch_goes_on_beyond_a_bend_of_a_fifth_of_a_step(width: float) -> None:
    """The polynomial through its last rows has another tangent there."""
    found = bifurcations.dent(width)
    assert found.right and not found.said, f"{found.error:.3g} {found.wrong} {found.said}"


@pytest.mark.few(2)
@pytest.mark.parametrize("accuracy", [1e-4, 1e-9])
@pytest.mark.parametrize("name", ["greenhill", "cord of 2 turns", "deep arch"])
def test_an_accuracy_is_kept(name: str, accuracy: float) -> None:
    found = problem_at(accuracy, name)
    assert found.right, f"{found.error:.3g} {found.wrong} {found.said}"


def test_an_accuracy_of_a_ring_is_kept() -> None:
    """Where a state breaks a ring's motion along itself by less than 1e-3 that is one zero less: meshes refine on."""
    found = problem_at(1e-6, "dead ring")
    assert found.right and not found.said, f"{found.error:.3g} {found.wrong} {found.said}"


@pytest.mark.long
@pytest.mark.parametrize("name", ["dead ring", "cord of 2 turns"])
def test_where_round_off_forbids_an_accuracy_it_is_said(name: str) -> None:
    """Off by 1.7e-11 of the load and by 4.3e-11; one of the two had another note, and said nothing of its accuracy."""
    found = problem_at(1e-11, name)
    assert found.right or found.said, f"{found.error:.3g} {found.wrong}"
    assert found.wrong == ""
