"""Rods in a viscous fluid, without inertia: rates of decay, and loads at which an oscillation or a motion grows."""

from dataclasses import replace
from math import acos, pi
from pathlib import Path
from typing import Any

import classics
import numpy as np
import pytest
from closed_forms import column, tip
from hard.loci import LONG
from scipy.optimize import fsolve

import rodfem
from rodfem import Attachment, Discretization, Drag, Inertia, Ordinate, Plan, clamped, free
from rodfem.errors import SceneError
from rodfem.forms.energy import bending_and_twist

FILAMENT = classics.column(
    "filament",
    (clamped(), free(force=lambda c: (0.0, 0.0, (c.part - 1) * c.F), follower=lambda c: (0.0, 0.0, -c.part * c.F))),
    (0.0, 60.0), load="F", constants={"F": 0.0, "part": 1.0, "B2": 1.0}, inertia=Drag(across=1.0), planar="e2",
    ordinate=Ordinate("deflection", s=1.0, of=lambda r, q: r[0]),
)  # fmt: skip
IN_SPACE = replace(
    FILAMENT, planar=None, span=(36.69543084032, 39.19543084032)
)  # with the critical one among its loads

pytestmark = pytest.mark.usefixtures("few_loads")


def test_a_follower_load_in_space() -> None:
    """By shooting: both planes flutter at once.  In a plane, and along the rod, docs/trades has it."""
    (found,) = rodfem.trace(IN_SPACE).special("flutter")
    assert (found.negative_before, found.negative_after) == (0, 4)
    assert abs(found.point.load - 37.69543084032) < found.error_estimate + 1e-11 < 1e-8
    assert abs(found.omega2 - 191.25863576525**2) < found.omega2_error + 1e-8 < 1e-5


def test_an_oscillation_between_two_loads() -> None:
    """The push rises above the critical one for a third of a step of the sweep, between its loads."""

    def pull(c: Any) -> tuple[float, float, Any]:
        return (0.0, 0.0, 4e4 * (c.F - 0.503) ** 2 - 37.69543084032 - 0.004)

    rod = replace(FILAMENT, ends=(clamped(), free(follower=pull)))
    first, last, _ = rodfem.trace(rod, plan=Plan((0.48, 0.53), error_bars=False))[0].special
    assert (first.negative_after, last.negative_after) == (2, 0)
    for special, load in ((first, 0.503 - 1e-7**0.5), (last, 0.503 + 1e-7**0.5)):
        assert abs(special.point.load - load) < 1e-11


def flutters(load: float, frequency: float, part: float) -> np.ndarray:
    """Load that follows the end in part, and frequency, near these, where an oscillation neither decays nor grows."""

    def equations(z: np.ndarray) -> list[float]:
        value = tip(1j * z[1], z[0], part)
        return [value.real, value.imag]

    return fsolve(equations, [load, frequency], xtol=1e-13)


def test_a_load_that_follows_in_part() -> None:
    """It diverges, is stable again, and flutters."""
    diagram = rodfem.trace(FILAMENT.varying(part=0.45))
    diverges, recovers, flutter, _ = diagram[0].special
    assert [s.kind for s in diagram[0].special] == ["divergence", "divergence", "flutter", "end"]
    assert [s.negative_after for s in diagram[0].special] == [1, 0, 2, 2]
    w = acos(-0.45 / 0.55)
    for special, load in ((diverges, w**2), (recovers, (2 * pi - w) ** 2)):
        assert abs(special.point.load - load) < special.error_estimate + 1e-10 < 1e-6
    load, frequency = flutters(flutter.point.load, flutter.omega2**0.5, 0.45)
    assert abs(flutter.point.load - load) < flutter.error_estimate + 1e-10 < 1e-6
    assert frequency == pytest.approx(flutter.omega2**0.5, rel=1e-7)
    assert not diagram.warnings
    assert "flutters: an oscillation ceases to decay" in diagram.in_words()


def test_locus_of_flutter() -> None:
    """Where the load follows in part the mean of two conjugate rates vanishes."""
    diagram = rodfem.trace(replace(FILAMENT, span=(35.0, 40.0)), plan=Plan(error_bars=False))
    found = diagram.locus(diagram.special("flutter")[0], "part", (0.8, 1.0), (20.0, 45.0), steps=LONG)
    assert found.ended == ("part = 0.8, its bound", "part = 1, its bound") and found.lower == -1
    assert (found.index == [0, 2]).all() and np.nanmax(found.error[:, 0]) < 1e-8
    for (load, part), omega2 in zip(found.values[[0, -2]], found.omega2[[0, -2]], strict=True):
        assert flutters(load, omega2**0.5, part) == pytest.approx((load, omega2**0.5), rel=1e-7)


def test_what_a_method_counts(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    plan = Plan((37.0, 38.0), at=(38.0,), method="dense", error_bars=False)
    rodfem.run(FILAMENT, Discretization(elements=4), plan, tmp_path / "out")
    said = capsys.readouterr().out
    assert "unstable, rates of negative real part: 2" in said and "frequencies" not in said


def test_drag_along_and_across() -> None:
    """A bar that stretches: rates are those of bending over the drag across, and of its length over that along."""
    bar = replace(
        FILAMENT, rod="unshearable", ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.F))),
        energy=lambda v, k, c: 25 * (v[2] - 1) ** 2 + bending_and_twist(k, (1.0, 1.0, 1.0)),
        inertia=Drag(across=2.0, along=0.5),
    )  # fmt: skip
    diagram = rodfem.trace(bar, Discretization(elements=4), Plan((0.0, 1.0), depth=0, spectrum=3))
    bending = [column(mu, 0.0).real / 2 for mu in (12.4, 485.0)]
    assert np.allclose(diagram[0].points[0].spectrum, [*bending, 50 * (np.pi / 2) ** 2 / 0.5], rtol=1e-6)


def test_sentences() -> None:
    with pytest.raises(SceneError, match=r"A mass is attached at s = 0.5 to a rod with drag"):
        replace(FILAMENT, attachments=(Attachment(0.5, mass=1.0),))
    with pytest.raises(SceneError, match="of -1 is negative"):
        replace(FILAMENT, inertia=Drag(along=-1.0))
    assert FILAMENT.inertia != Inertia()
