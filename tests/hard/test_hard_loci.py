"""Every hard case of a locus in small: each row to its uncertainty, and the curve ends where its special point does."""

from __future__ import annotations

from typing import Any

import pytest
from hard import loci, loci_codim2
from hard.case import Case
from hard.cases import CASES
from hard.test_hard_cases import APART, value_of

from rodfem.codim2.locus import COARSE
from rodfem.continuation.kinds import GAP

pytestmark = pytest.mark.alone


@pytest.mark.parametrize(("case", "value"), [value_of(case, value) for case in CASES[APART] for value in case.few])
def test_a_hard_locus(case: Case, value: Any) -> None:
    found = case.measure(value)
    assert found.right, f"{found.error:.3g} {found.wrong} {found.said}"


@pytest.mark.long
@pytest.mark.parametrize("kind", ["branch point", "fold"])
@pytest.mark.parametrize("width", [pytest.param(1e-6, marks=pytest.mark.long), 1e-7])
def test_a_gap_that_is_not_resolved_is_said(kind: str, width: float) -> None:
    """Narrower than the least step: the curve ends before it, or a crossing is said to be one or such a gap."""
    found = loci.gap(kind, width)
    assert any("no convergence" in said or f"within {GAP:g}" in said for said in found.said)


@pytest.mark.long
def test_a_locus_of_a_point_that_the_mesh_does_not_resolve_says_so() -> None:
    """One of two eigenvalues that are one for the rod: its curve has another index, and errors beyond its bars."""
    found = loci_codim2.modulated(0.15)
    assert not found.right and COARSE in found.said
