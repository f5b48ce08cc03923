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
LONG = {
    ("metres and newtons of a molecule, and of a pipeline", "greenhill"),
    ("branches beside each other", 1e-2),
    ("flutter that comes and goes", 1e-6),
    ("a peak of the load between two rows", 1e-3),
    ("a peak of the load between two rows", 1e-6),  # tests/diagram/test_load_steps.py has it, too
    ("a floating ring under loads that follow", (1e-1, 6)),
    ("critical loads with closed forms", "greenhill"),
    ("strips, clamps turned alike", 0.8),
    ("pressed rings on springs that repeat n times", 4),
}
"""Values that are the same once more, of a second and more: at least one other of each case is tested always."""


def value_of(case: Case, value: Any) -> Any:
    """A value of a case, as it is tested."""
    marks = [pytest.mark.long] if (case.name, value) in LONG else []
    return pytest.param(case, value, marks=marks, id=f"{case.name}-{value}")


def test_every_case_is_tested() -> None:
    names = {(case.name, value) for case, value in EVERY}
    assert names >= LONG and {name for name, _ in names - LONG} == {case.name for case, _ in EVERY}


@pytest.mark.parametrize(("case", "value"), [value_of(*every) for every in EVERY])
def test_a_hard_case(case: Case, value: Any) -> None:
    found = case.measure(value)
    assert found.right or (case.promised == SAID and found.said), f"{found.error:.3g} {found.wrong} {found.said}"


def test_steps_are_shortened_about_a_narrow_bend() -> None:
    """Two folds 3e-4 apart in load are found, not only said to be missing perhaps."""
    found = bifurcations.dent(3e-4)
    assert found.right and not found.said, f"{found.error:.3g} {found.wrong} {found.said}"
