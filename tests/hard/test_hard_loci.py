"""Every hard case of a locus in small: each row to its uncertainty, and the curve ends where its special point does."""

from typing import Any

import pytest
from hard import loci
from hard.case import Case
from hard.cases import CASES
from hard.test_hard_cases import APART, value_of

from rodfem.codim2.locus import COARSE


@pytest.mark.parametrize(("case", "value"), [value_of(case, value) for case in CASES[APART] for value in case.few])
def test_a_hard_locus(case: Case, value: Any) -> None:
    found = case.measure(value)
    assert found.right, f"{found.error:.3g} {found.wrong} {found.said}"


@pytest.mark.long
def test_a_locus_of_a_point_that_the_mesh_does_not_resolve_says_so() -> None:
    """One of two eigenvalues that are one for the rod: its curve has another index."""
    found = loci.modulated(0.15)
    assert COARSE in found.said
