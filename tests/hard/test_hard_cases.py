"""Every hard case in small: it is right, or it says what it could not decide, where that is what is promised."""

from __future__ import annotations

from typing import Any

import pytest
from hard import bifurcations
from hard.case import Case
from hard.cases import CASES, SAID

pytestmark = pytest.mark.alone
APART = "loci"
"""A group that has a file of its own."""
EVERY = [(case, value) for name, group in CASES.items() if name != APART for case in group for value in case.few]


def value_of(case: Case, value: Any) -> Any:
    """A value of a case, as it is tested: ``make test`` has the first one of each."""
    marks = [] if value == case.few[0] else [pytest.mark.long]
    return pytest.param(case, value, marks=marks, id=f"{case.name}-{value}")


def test_every_case_is_tested() -> None:
    assert all(case.few for group in CASES.values() for case in group)


@pytest.mark.parametrize(("case", "value"), [value_of(*every) for every in EVERY])
def test_a_hard_case(case: Case, value: Any) -> None:
    found = case.measure(value)
    assert found.right or (case.promised == SAID and found.said), f"{found.error:.3g} {found.wrong} {found.said}"


def test_steps_are_shortened_about_a_narrow_bend() -> None:
    """Two folds 3e-4 apart in load are found, not only said to be missing perhaps."""
    found = bifurcations.dent(3e-4)
    assert found.right and not found.said, f"{found.error:.3g} {found.wrong} {found.said}"
