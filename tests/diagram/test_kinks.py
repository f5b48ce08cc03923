"""Kinks of an energy in the state: no error bar where one is inside of the rod, no index where the state is on one."""

from io import StringIO
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from classics import column, push
from mpi4py import MPI

from rodfem import Diagram, Discretization, Inertia, Ordinate, Plan, clamped, free, load, trace
from rodfem.app.terminal import Report
from rodfem.output.pieces import pieces_of, typical_state
from rodfem.output.words import words_of


def one_sided(where: Any = ufl.ge) -> Diagram:
    """A column with a spring at its tip, on one side."""
    spring = lambda x, c: ufl.conditional(where(x.r[0], 0.0), 20 * x.r[0] ** 2, 0.0)  # noqa: E731
    rod = column(
        "one-sided", (clamped(), free(push, energy=spring)), (0.0, 15.0), constants={"B1": 20.0},
        ordinate=Ordinate("x", s=1.0, of=lambda r, q: r[0]),
    )  # fmt: skip
    return trace(rod, Discretization(elements=3, degree=4), Plan(depth=0, at=(6.0,)))


@pytest.mark.ranks
@pytest.mark.parametrize("where", [ufl.ge, ufl.gt])
def test_a_spring_at_the_tip_on_one_side(where: Any) -> None:
    """The column is on the kink at all loads; to the free side it falls at 2 pi^2/4: it was called stable to 15."""
    found = one_sided(where)
    said = [x for x in found.warnings if "have a kink at the very state at P = 0 to 15" in x]
    assert len(said) == 1 and "undecided" in said[0]
    assert all(point.stable is None for point in found[0].points)


@pytest.mark.long
def test_the_reason_is_the_kink_wherever_one_reads_it(tmp_path: Path) -> None:
    """No eigenvalue is near zero at P = 6: the least one is that of a load 9 or 1 below a critical one."""
    found = one_sided()
    at = "a kink of the equations"
    (state,) = (s.point for s in found[0].special if s.point.load == 6.0)
    verdict = found.assess(state, number=1)
    assert verdict.stable is None and abs(verdict.values[0]) > 1.0 and at in str(verdict)
    again = load(found.save(tmp_path), found.scene)
    words = [
        words_of(found.data["branches"][0])[row].sentence
        for row in (0, next(s.row for s in found[0].special if s.point is state))
    ]
    stream = StringIO()
    Report(MPI.COMM_SELF, stream).verdict("straight", "P = 6", verdict)
    (asked,) = found.at(6.5)
    told = [repr(state), repr(again[0].points[0]), repr(asked), found.in_words(), stream.getvalue(), *words]
    assert "undecided" in typical_state(found.data)[2] and "side of a kink" in typical_state(found.data)[2]
    for text in told:
        assert at in text and "undecided" in text and "near zero" not in text, text
    assert {p.undecided for p in found[0].points} == {0} and "undecided" not in found.data["branches"][0]["columns"]
    assert {x.verdict for x in words_of(found.data["branches"][0])} <= {"undecided", "critical"}
    assert {p.kind for p in pieces_of(found.data["branches"][0])} == {"stability undecided"}


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_a_sweep_has_no_bar_beyond_a_kink() -> None:
    soft = lambda k: ufl.conditional(ufl.lt(abs(k), 1.0), 0.5 * k**2, 0.1 * k**2 + 0.8 * abs(k) - 0.4)  # noqa: E731
    rod = column(
        "follower", (clamped(), free(follower=lambda c: (0.0, -c.P, 0.0))), (0.0, 2.0),
        energy=lambda v, k, c: soft(k[0]) + k[1] ** 2 + k[2] ** 2, inertia=Inertia(rho_A=lambda c: 1.0),
    )  # fmt: skip
    found = trace(rod, Discretization("auto", 6, 4))
    assert isnan(found[0].special[-1].ordinate_error)
    assert any("does not integrate the equations" in said for said in found.warnings)


def lateral(threshold: float) -> Diagram:
    """A strip under a force across, which buckles sideways; softer in its plane beyond a curvature."""

    def soft(k: Any) -> Any:
        a = abs(k)
        return ufl.conditional(ufl.lt(a, threshold), 5 * k**2, 2 * k**2 + 6 * threshold * a - 3 * threshold**2)

    rod = column(
        "strip", (clamped(), free(lambda c: (0.0, -c.P, 0.0))), (0.0, 6.0),
        energy=lambda v, k, c: soft(k[0]) + 0.5 * k[1] ** 2 + 0.5 * c.C * k[2] ** 2,
        ordinate=Ordinate("x", s=1.0, of=lambda r, q: r[0]),
    )  # fmt: skip
    return trace(rod, Discretization(elements=4, degree=4), Plan(depth=0))


@pytest.mark.long
def test_loci_and_modes_have_no_bar_beyond_a_kink() -> None:
    for threshold, kink in ((10.0, False), (0.2, True)):
        found = lateral(threshold)
        special = found.special("branch point")[0]
        locus = found.locus(special, "C", (0.9, 1.1))
        assert np.isfinite(locus.error).any() != kink
        assert ("does not integrate the equations" in locus.note) == kink
        assert (locus.note in locus.text()) and locus.data()["note"] == locus.note
        modes = found.modes(special)
        assert np.isfinite(modes.error).any() != kink
        assert ("does not integrate the equations" in modes.note) == kink
