"""Loci in the plane of two parameters against closed forms, and against shooting where the state depends on both."""

import json
from dataclasses import replace
from functools import cache
from math import pi
from pathlib import Path

import classics
import closed_form_hemitropic
import numpy as np
import pytest
import ufl
from closed_forms import flutter
from demo_cases import explored as demo
from hard.two_freedoms import scene as two_freedoms
from hemitropic_cases import explored, follower, specials
from mpi4py import MPI
from scipy.optimize import brentq

from rodfem import Discretization, InputError, Locus, Plan, SpecialPoint, StepControl, run, trace
from rodfem.codim2.follow import STEPS, locus
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist
from rodfem.output.plot_locus import _subtitle, draw_locus
from rodfem.problem.ends import pinned
from rodfem.problem.scene import Ordinate
from rodfem.report.branches import loci_of

PLANE = ((0.01, 0.9), (-3.1, 1.0))
WIDE = StepControl(first=0.05, largest=0.15)


@cache
def straight() -> Locus:
    """Second buckling load of the hemitropic rod against the coupling A."""
    return locus(follower(), specials(explored()[0], "branch point")[1], "A", PLANE, WIDE)


def root(f, guess: float) -> float:  # type: ignore[no-untyped-def]
    return float(brentq(f, guess - 1e-3, guess + 1e-3, xtol=1e-15, rtol=1e-14))


@pytest.mark.long
def test_buckling_of_the_straight_rod() -> None:
    """On the closed form all along, with two turning points in the load, and bounds that are met exactly."""
    found = straight()
    exact = np.array(
        [root(lambda x, A=A: closed_form_hemitropic.buckling(x, A, 1, 1, 3), lam) for lam, A in found.values]
    )
    miss, known = abs(found.values[:, 0] - exact), ~np.isnan(found.error[:, 0])
    assert miss.max() < 1e-10
    assert known.sum() >= 5
    assert np.all(miss[known] <= 3 * found.error[known].sum(axis=1))
    assert found.error[known, 0].max() < 1e-9
    # Of turning points along the curve, too: the slope of a load known to some 1e-14 in a window of 0.016, over a
    # curvature of 0.02.  That is another round-off on each machine: 2e-9 to 1.1e-8 were seen.
    assert found.error[known, 1].max() < 5e-8
    assert found.ended == ("A = -3.1, its bound", "A = 1, its bound")
    assert (found.values[0, 1], found.values[-1, 1]) == (-3.1, 1.0)
    assert found.values[found.start] == pytest.approx([closed_form_hemitropic.loads(-3, 1, 1, 3)[1], -3.0], abs=1e-10)
    assert {tuple(pair) for pair in found.index.tolist()} == {(2, 4)}
    assert [m.kind for m in found.marks] == ["turns in lam"] * 2
    for lam, A in (found.values[m.row] for m in found.marks):
        before, after = (closed_form_hemitropic.buckling(lam, A + h, 1, 1, 3) for h in (-1e-4, 1e-4))
        assert abs(after - before) < 1e-10
    assert abs(found.values[found.marks[1].row, 1]) <= found.error[found.marks[1].row, 1]


@pytest.mark.long
def test_fold_of_the_cord_by_shooting() -> None:
    """The state depends on both parameters; the fold by shooting is where its determinant vanishes, in the moment."""
    cord = demo("cord")
    (fold,) = specials(cord["branch 2"], "fold")
    found = locus(cord.solvers[0], fold, "k0", ((4.0, 13.0), (8.0, 11.0)), steps=WIDE, error_bars=3)
    assert found.values[[0, -1], 0].tolist() == [4.0, 13.0]
    assert found.values[found.start, 0] == pytest.approx(7.8065554232, abs=1e-8)
    for row, k0, ordinate in ((0, 9.214886767184174, 0.05941250596462), (-1, 9.706795361170355, 0.09569501952778)):
        beyond = found.values[row] - found.values[1 if row == 0 else -2]
        at_this_load = found.error[row] @ [abs(beyond[1] / beyond[0]), 1.0]  # errors are measured across the curve
        assert abs(found.values[row, 1] - k0) <= 3 * at_this_load <= 1e-7
        assert found.ordinate[row] == pytest.approx(ordinate, abs=1e-7)
    assert {tuple(pair) for pair in found.index.tolist()} == {(1, 2)}


@pytest.mark.long
def test_each_special_point_has_its_locus_where_loads_are_small(tmp_path: Path) -> None:
    """Of a DNA molecule in metres and newtons: Euler's loads about either axis, pi^2/4 B/L^2, as the thickness grows.

    The loads are 1e-12 N, and all ordinates are zero.
    """
    length, stiffness = 1e-8, 2e-28
    force = stiffness / length**2
    rod = classics.column(
        "DNA", classics.SUPPORTS["clamped-free"], (0.0, 6.0 * force), interval=(0.0, length),
        energy=lambda v, k, c: bending_and_twist(k, tuple(c.thickness * stiffness * x for x in (1, 1.5, 1))),
        constants={"thickness": 1.0},
        ordinate=Ordinate("deflection of the tip", s=length, of=lambda r, q: float(r[0])),
    )  # fmt: skip
    plan = Plan(depth=0, error_bars=False, locus=("thickness", 0.9, 1.1))
    run(rod, Discretization("reduced", 4, 5), plan, tmp_path, figures=False, quiet=True)
    found = [json.loads((tmp_path / f"locus-{number}.json").read_text())["columns"] for number in (1, 2)]
    for one, factor in zip(found, (1.0, 1.5), strict=True):
        expected = factor * pi**2 / 4 * np.array(one["thickness"]) * force
        np.testing.assert_allclose(one[rod.load], expected, rtol=1e-8)
    data = json.loads((tmp_path / "diagram.json").read_text())
    rows = [special["row"] for special in data["branches"][0]["special"] if special["kind"] == "branch point"]
    assert [one["special"] for one in loci_of(tmp_path, data)] == [[[0, row]] for row in rows]


@pytest.mark.long
def test_flutter_of_a_rod_that_bends_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two pairs of frequencies meet at once: where each does in its plane, down to where the double one vanishes."""
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 6)
    scene, mesh = classics.partly_following(1.0, (15.0, 25.0), strong=1.0), Discretization("pointwise", 4, 6)
    diagram = trace(scene, mesh, Plan(error_bars=False))
    found = locus(diagram.solvers[0], diagram.special("flutter")[0], "share", ((15.0, 25.0), (0.0, 1.0)), error_bars=3)
    assert found.ended[0].startswith("the double eigenvalue vanishes: divergence near P = 17.06957")
    for (P, share), mu in list(zip(found.values, found.omega2, strict=True))[4::4]:
        assert flutter(P + 0.01, mu + 0.1, share=share) == pytest.approx((P, mu), rel=1e-9, abs=1e-7)
    assert np.nanmax(found.error[1:]) < 1e-9 and (found.error[0] < 1e-7).all()
    assert np.all(abs(found.values[0] - [17.0695747744975, 0.3543133021536]) <= found.error[0])
    assert found.index.tolist() == [[0, 4]] * len(found.values)


def test_errors_that_are_not_known_are_said_to_be_so() -> None:
    data = replace(straight(), error=np.full_like(straight().error, np.inf)).data()
    rows = len(data["columns"]["A"])
    assert data["without_estimate"] == list(range(rows)) and data["columns"]["error"][0] == [None, None]
    assert _subtitle([data]).endswith(f"the error could not be estimated at any of {rows} points")


def test_saved_and_drawn(folder: Path) -> None:
    found = straight()
    if MPI.COMM_WORLD.rank == 0:
        found.save(folder / "new" / "locus.json")  # in a new folder, as pictures may be
        data = json.loads((folder / "new" / "locus.json").read_text())
        assert data["columns"]["lam"] == found.values[:, 0].tolist()
        assert data["columns"]["error"][1] == [None, None]
        assert draw_locus([data], folder / "locus.png").stat().st_size > 20000
        text = found.text()
        assert "Locus of the branch point in lam and A" in text
        assert "turns in lam" in text
        with pytest.raises(ValueError, match="no locus"):
            draw_locus([], folder / "none.png")


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        (((0.01, 0.9), (1.0, -1.0)), "bounds 1, -1 of A are empty"),
        (((0.01, 0.9), (-4.0, 1.0)), "not convex"),
        (((0.2, 0.9), (-3.1, 1.0)), "outside the bounds: widen them"),
    ],
)
def test_mistakes(bounds: tuple, message: str) -> None:
    with pytest.raises(InputError, match=message):
        locus(follower(), specials(explored()[0], "branch point")[0], "A", bounds)


def test_no_locus_of_an_end() -> None:
    end: SpecialPoint = specials(explored()[0], "end")[0]
    with pytest.raises(InputError, match="has no locus"):
        locus(follower(), end, "A", ((0.01, 0.96), (-3.1, 1.0)))


@pytest.mark.long
def test_what_is_zero_all_along_is_not_counted() -> None:
    """A straight rod spins freely about its axis, whatever a foundation does to it across: ``P = pi^2 + k/pi^2``."""
    scene = classics.column(
        "foundation",
        (pinned(), pinned(classics.ON_AXIS, classics.push)),
        (0.0, 30.0),
        constants={"B2": 5.0, "k": 20.0},
        potential=lambda x, c: loads.spring(x.r, (0.0, c.k, 0.0)),
    )
    diagram = trace(scene, Discretization("auto", 8, 6), Plan(depth=0, error_bars=False))
    found = diagram.locus(diagram.special("branch point")[0], "k", (20.0, 100.0))
    load, k = np.array(found.values).T
    assert abs(load - pi**2 - k / pi**2).max() < 1e-9
    assert set(map(tuple, found.index.tolist())) == {(0, 1)}


@pytest.mark.long
def test_a_locus_that_bends_sharply_is_followed() -> None:
    """``P = 2 + sin(400 b)``: beyond a bend the polynomial through the last points has another tangent."""
    potential = lambda u, f2, c: (2 + ufl.sin(400 * c.b) - c.P) * u * u / 2 + u**4 / 4 + f2 / 2  # noqa: E731
    diagram = trace(two_freedoms(potential, (0.0, 4.0), b=0.1), Discretization("auto", 4, 3), Plan(error_bars=False))
    special = diagram.special("branch point")[0]
    found = locus(diagram.solvers[0], special, "b", ((0.0, 4.0), (0.0, 1.0)), replace(STEPS, most=16), error_bars=0)
    assert found.ended == ("16 points reached", "16 points reached")
    np.testing.assert_allclose(found.values[:, 0], 2 + np.sin(400 * found.values[:, 1]), atol=1e-8)
