"""Every hard case in small: it is right, or it says what it could not decide, where that is what is promised."""

import re
from pathlib import Path
from typing import Any

import pytest
from hard import bifurcations
from hard.case import Case, words
from hard.cases import CASES

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
