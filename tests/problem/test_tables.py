"""Tables along the rod and paths of the load, against analytic functions and a boundary value problem."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import hypot, pi
from typing import Any

import classics
import numpy as np
import pytest
import ufl
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from rodfem import Attachment, Diagram, Discretization, Inertia, Ordinate, Plan, Scene, path, tabulated, trace
from rodfem.errors import SceneError
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.ends import clamped, free

MESH = Discretization("auto", 8, 6)
TIP = Ordinate("tip", s=1.0, of=lambda r, q: hypot(r[0], r[1]))
MIDDLE = Ordinate("middle", s=0.5, of=lambda r, q: hypot(r[0], r[1]))
FIXED = (1.0, 0.0, 0.0, 0.0)
COLLOCATION = 15**0.5
A = np.array(
    [
        [5 / 36, 2 / 9 - COLLOCATION / 15, 5 / 36 - COLLOCATION / 30],
        [5 / 36 + COLLOCATION / 24, 2 / 9, 5 / 36 - COLLOCATION / 24],
        [5 / 36 + COLLOCATION / 30, 2 / 9 + COLLOCATION / 15, 5 / 36],
    ]
)
"""Gauss's method of order six."""


def buckling(EI: Callable[[np.ndarray], np.ndarray], knots: np.ndarray, pieces: int) -> float:
    """Dead load at which a cantilever of length one buckles whose stiffness is smooth between ``knots``.

    ``theta' = M / EI``, ``M' = -P theta``, ``theta(0) = M(1) = 0`` (Euler), by Gauss's method in so many ``pieces``.
    """
    at, weights = A.sum(axis=1), np.array([5, 8, 5]) / 18
    ends = np.append((knots[:-1, None] + np.diff(knots)[:, None] * np.arange(pieces) / pieces).ravel(), knots[-1])
    h = np.diff(ends)
    values = EI((ends[:-1, None] + h[:, None] * at).ravel()).reshape(-1, 3)

    def moment(P: float) -> float:
        slope = np.zeros((len(h), 3, 2, 2))
        slope[..., 0, 1], slope[..., 1, 0] = 1 / values, -P
        system = np.eye(6) - np.einsum("n,ij,niab->niajb", h, A, slope).reshape(-1, 6, 6)
        stages = np.linalg.solve(system, slope.reshape(-1, 6, 2)).reshape(-1, 3, 2, 2)
        state = np.array([0.0, 1.0])
        for step in np.eye(2) + np.einsum("n,i,niab->nab", h, weights, stages):
            state = step @ state
        return float(state[1])

    return float(brentq(moment, 2.4, 2.7, xtol=1e-15))


def wave(s: Any) -> Any:
    """The stiffness of which most tables are."""
    return 1 + np.sin(7 * s) / 2


def column(EI: Callable[[Any], Any], length: float = 1.0, size: float = 1.0) -> Scene:
    """Cantilever under a dead load, of a length and a stiffness in any units."""
    return classics.column(
        "column", classics.SUPPORTS["clamped-free"], (0.0, 4 * size / length**2), interval=(0.0, length),
        energy=lambda v, k, c: bending_and_twist(k, (EI(c.s), 20.0 * size, size)),
        ordinate=Ordinate("tip", s=length, of=TIP.of),
    )  # fmt: skip


def found(scene: Scene, mesh: Discretization = MESH, *, sure: bool = True) -> tuple[float, float, list[str]]:
    """Load of the first branch point, the bound of its error, and what is warned of."""
    diagram = trace(scene, mesh, Plan(depth=0))
    special = diagram.special("branch point")[0]
    assert special.error_estimate is not None and (special.resolved or not sure)
    return special.point.load, special.error_estimate, diagram.warnings


@pytest.mark.ranks
@pytest.mark.parametrize(
    ("rows", "pieces", "says"), [(30, 8, 2.578878879037), (1001, 1, 2.577330385411), (10_000, 1, 0)]
)
def test_linear_between_rows(rows: int, pieces: int, says: float) -> None:
    """Few knots are vertices of the mesh; many are in one element."""
    s = np.linspace(0.0, 1.0, rows)
    expected = buckling(lambda x: np.interp(x, s, wave(s)), s, pieces)
    assert not says or expected == pytest.approx(says, abs=1e-12)
    load, error, warnings = found(column(tabulated(s, wave(s))))
    assert abs(load - expected) <= error < 1e-9 and not warnings


@pytest.mark.ranks
def test_cubic_splines() -> None:
    """Between 30 rows the spline is another function than the sine, between 400 the same one."""
    s = np.linspace(0.0, 1.0, 30)
    load, error, warnings = found(column(tabulated(s, wave(s), order=3)))
    assert abs(load - buckling(CubicSpline(s, wave(s)), s, 8)) <= error < 1e-9 and not warnings
    s = np.linspace(0.0, 1.0, 400)
    load, error, warnings = found(column(tabulated(s, wave(s), order=3)))
    sine = found(column(lambda s: 1 + ufl.sin(7 * s) / 2))
    assert abs(load - sine[0]) <= error < 1e-9 and not warnings


@pytest.mark.ranks
def test_what_elements_do_not_see_is_said() -> None:
    """A stiffness with noise of one percent buckles as its harmonic mean, polynomials bend as its arithmetic one."""
    s = np.linspace(0.0, 1.0, 1001)
    EI = 1 + 0.01 * np.random.default_rng(1).standard_normal(len(s))
    load, _, (words,) = found(column(tabulated(s, EI)))
    assert "varies by 0.007 of its size within the elements" in words and "loads by about 6e-05" in words
    assert load / buckling(lambda x: np.interp(x, s, EI), s, 1) - 1 == pytest.approx(6e-5, rel=0.2)


@pytest.mark.ranks
def test_curvature_load_and_mass() -> None:
    def helix(s: Any, sin: Any, cos: Any) -> tuple[Any, ...]:
        return (2 * cos(3 * s), 6 + sin(5 * s), 1 + 0 * s)

    def coil(k0: Callable[[Any], Any], weight: Callable[[Any], Any]) -> Diagram:
        scene = classics.column(
            "coil", (clamped(), free(lambda c: (0.0, 0.0, c.P))), (20.0, 10.0),
            energy=lambda v, k, c: bending_and_twist([k[i] - k0(c.s)[i] for i in range(3)], (1.0, 1.0, 0.7)),
            distributed=lambda c: (0.0, weight(c.s), 0.0), inertia=Inertia(rho_A=lambda c: weight(c.s)),
        )  # fmt: skip
        return trace(scene, Discretization("auto", 12, 6), Plan(depth=0))

    s = np.linspace(0.0, 1.0, 1001)
    by_rows = coil(tabulated(s, np.transpose(helix(s, np.sin, np.cos)), 3), tabulated(s, 1 + s**2, 3))
    by_sine = coil(lambda s: helix(s, ufl.sin, ufl.cos), lambda s: 1 + s**2)
    last, other = by_rows.branches[0].points[-1], by_sine.branches[0].points[-1]
    assert last.ordinate == pytest.approx(other.ordinate, abs=1e-11) and len(by_rows.branches[0].points) > 3
    mu = [float(diagram.modes(point, 1).value[0]) for diagram, point in ((by_rows, last), (by_sine, other))]
    assert mu[0] == pytest.approx(mu[1], rel=1e-9)


# --- paths of the load ----------------------------------------------------------------------------------------------


def moved(place: Callable[[Any], Any], turn: Any, push: Any, span: Sequence[float], **plan: Any) -> Diagram:
    """Rod whose right end is moved and turned, and which is pushed in its middle, as functions of ``t``."""
    scene = classics.column(
        "moved", (clamped(), clamped(lambda c: place(c.t), (lambda c: turn(c.t)) if turn else FIXED)),
        (span[0], span[1]), rod="unshearable", load="t", constants={"t": 0.0}, ordinate=MIDDLE,
        energy=lambda v, k, c: 100 * (v[2] - 1) ** 2 + bending_and_twist(k, (1.0, 2.0, 1.0)),
        attachments=(Attachment(0.5, force=lambda c: (0.0, push(c.t), 0.0)),) if push else (),
    )  # fmt: skip
    return trace(scene, MESH, Plan(depth=0, **plan))


@pytest.mark.ranks
def test_a_smooth_path_is_its_function() -> None:
    """Every row, with its tangent and the work of the load, is that of the same scene with UFL's functions."""
    t = np.linspace(0.0, 1.0, 1000)
    q = np.transpose([np.cos(t), 0 * t, np.sin(t), 0 * t]) * np.where(t < 0.3, -2.0, 3.0)[:, None]
    r = np.transpose([0.3 * np.sin(2 * t), 0.2 * t**2, 1 - 0.4 * t])
    by_rows = moved(path(t, r), path(t, q), path(t, t**2), (0.0, 1.0)).branches[0].points
    by_function = moved(
        lambda t: (0.3 * ufl.sin(2 * t), 0.2 * t**2, 1 - 0.4 * t), lambda t: (ufl.cos(t), 0.0, ufl.sin(t), 0.0),
        lambda t: t**2, (0.0, 1.0),
    ).branches[0].points  # fmt: skip
    for p, q in zip(by_rows, by_function, strict=True):
        assert (p.load, p.ordinate, p.slope, p.index) == pytest.approx((q.load, q.ordinate, q.slope, q.index), abs=1e-7)
        assert (p.energy, p.conjugate) == pytest.approx((q.energy, q.conjugate), rel=1e-6, abs=1e-7)


@pytest.mark.ranks
def test_corners_are_rows() -> None:
    """There and back: a row at each corner, and the same special point; rows as with the straight pieces alone."""
    t, r = [0.0, 0.3, 0.55, 1.0], np.array([[0, 0, 1], [0.3, 0, 0.8], [0.3, 0.4, 0.7], [0, 0.1, 0.6]])
    place = path(t, r, smooth=False)
    there = moved(place, None, None, (0.0, 1.0), at=(0.5,))
    back = moved(place, None, None, (1.0, 0.0), at=(0.5,))
    for diagram in (there, back):
        points = diagram.branches[0].points
        assert {0.3, 0.55} <= {p.load for p in points} and not diagram.warnings
        assert all((p.load - c) * (q.load - c) >= 0 for p, q in pairwise(points) for c in (0.3, 0.55))
        assert diagram.branches[0].ended == "end of range"
    loads = [[s.point.load for s in x.special("branch point")] for x in (there, back)]
    assert loads[0] == pytest.approx(loads[1], abs=1e-9) and len(loads[0]) > 0
    ((a,), (b,)) = (x.at(0.5) for x in (there, back))
    straight = moved(lambda t: tuple(r[1] + (t - 0.3) / 0.25 * (r[2] - r[1])), None, None, (0.3, 0.55), at=(0.5,))
    (c,) = straight.at(0.5)
    assert [a.ordinate, b.ordinate] == pytest.approx([c.ordinate] * 2, abs=1e-10)


@pytest.mark.ranks
@pytest.mark.long
def test_corners_in_a_sweep() -> None:
    """A follower load that grows in pieces: flutter where it is with a load that grows evenly."""

    def beam(load: Callable[[Any], Any], end: float) -> Diagram:
        ends = clamped(), free(follower=lambda c: (0.02 * load(c.P), 0.0, -load(c.P)))
        return trace(classics.column("beam", ends, (0.0, end), inertia=classics.BEAM), MESH, Plan(depth=0))

    force = path([0, 0.97, 2.03, 3], [0, 10, 12, 30], smooth=False)
    by_rows, evenly = beam(force, 3.0), beam(lambda t: t, 30.0)
    assert {0.97, 2.03} <= {p.load for p in by_rows.branches[0].points} and not by_rows.warnings
    ((a,), (b,)) = (x.special("flutter") for x in (by_rows, evenly))
    assert force(a.point.load) == pytest.approx(b.point.load, abs=1e-9)


# --- what is said of tables that are none -----------------------------------------------------------------------------

S = np.linspace(0.0, 1.0, 5)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: tabulated(S[::-1], S), r"does not increase from row 0 \(from 0\) to the next"),
        (lambda: tabulated([0, 1, 1], [1, 2, 3]), r"does not increase from row 1 \(from 0\)"),
        (lambda: tabulated(S, S[:4]), r"has the shapes \(5,\) and \(4,\): give n numbers"),
        (lambda: tabulated([0.0], [1.0]), r"has the shapes \(1,\) and \(1,\)"),
        (lambda: tabulated(S, [1, 2, np.nan, 3, 4]), r"Row 2 \(from 0\) of the values .* is not finite"),
        (lambda: tabulated("stiffness.txt", S), "are no numbers"),
        (lambda: tabulated(S, S, order=2), "has the order 2: choose 1 .* or 3"),
        (lambda: path(S, np.zeros((5, 4))), "or has a zero quaternion there"),
        (lambda: path(S, np.eye(5)[:, :4]), "turns by more than 120 degrees from row 0"),
        (lambda: column(tabulated(0.9 * S, 1 + S)), "rows from s = 0 to 0.9, but is needed from 0 to 1"),
        (lambda: column(lambda s: tabulated(S, 1 + S)(1 - s)), "stored energy calls .* with an expression"),
        (lambda: column(lambda s: tabulated(S, 1 + S)(ufl.sin(s))), "stored energy calls .* with an expression"),
        (lambda: moved(path(S, np.ones((5, 3))), None, None, (0.0, 2.0)), "from t = 0 to 1, but is needed from 0 to 2"),
        (lambda: moved(path(S, np.ones((5, 2))), None, None, (0.0, 1.0)), "position of the right end has 2 components"),
    ],
)  # fmt: skip
def test_sentences(make: Callable[[], Any], words: str) -> None:
    with pytest.raises(SceneError, match=words) as raised:
        make()
    assert str(raised.value).count("\n") == 0


@pytest.mark.ranks
def test_numbers() -> None:
    """With numbers a table is a function of numbers."""
    assert tabulated(S, S**2)(0.125) == 0.03125 and tabulated(S, S**3, 3)(0.3) == pytest.approx(0.027)
    assert path(S, np.transpose([S, S, S]), smooth=False)(0.4) == pytest.approx((0.4, 0.4, 0.4))
    turn = path([0, 1], [[1, 0, 0, 0], [-1, 0, 0, -1]], smooth=False)
    assert turn(0.5) == pytest.approx((np.cos(pi / 8), 0, 0, np.sin(pi / 8)))


def test_a_table_as_nested_conditionals_is_refused_in_a_sentence() -> None:
    def stiffness(s: Any) -> Any:
        value: Any = 1.0
        for i in range(1000):
            value = ufl.conditional(ufl.lt(s, i / 1000), 1.0 + i, value)
        return value

    with pytest.raises(SceneError, match=r"nested deeper than UFL can follow: give a table, as in rodfem.tabulated"):
        column(stiffness)
