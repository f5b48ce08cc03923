"""Eigenvalues that are followed from load to load, against SLEPc's at every load of every sweep, and nearer shifts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import classics
import numpy as np
import pytest
from fem.test_free_motion import scene as pinned
from golden_cases import NOT_CONSERVATIVE, cases
from hard.fuzz import scenes as fuzz
from literature.test_free_rods import floating
from scipy.linalg import eig
from scipy.optimize import linear_sum_assignment

import rodfem
from rodfem import Discretization, Plan, Scene, free
from rodfem.continuation.branch import Branch, Point
from rodfem.diagram import frequency_rows
from rodfem.diagram.frequency_rows import FrequencyRows, Row
from rodfem.diagram.held import at_load
from rodfem.diagram.solver import Solver
from rodfem.stability.finite_pairs import SHIFT, SPARE
from rodfem.stability.followed_pairs import GUARDS, FollowedPairs
from rodfem.stability.frequencies import Frequencies
from rodfem.stability.nonsymmetric import NonsymmetricPencil, NonsymmetricSolver
from rodfem.stability.subspaces import Subspaces

pytestmark = pytest.mark.alone
THRUST = (free(), free(follower=lambda c: (0.0, 0.0, -c.P)))
SCENES: dict[str, Callable[[], Scene]] = {name: cases()[name] for name in NOT_CONSERVATIVE} | {
    "Leipholz": classics.leipholz,
    "divergence": lambda: classics.partly_following(0.4, (0.0, 25.0)),
    "double": lambda: classics.partly_following(0.2, (0.0, 25.0), 1.0),
    "double flutter": lambda: classics.partly_following(1.0, (0.0, 25.0), 1.0),
    "torque": lambda: replace(classics.torque("follower_moment"), span=(-1.0, 9.0)),
    "pins": lambda: pinned("follower_moment"),
    "floating": lambda: floating(THRUST, (0.0, 130.0), distributed=lambda c: (0.0, 0.0, c.P)),
}
CLAIMED = 1e-10
"""Difference of inverse eigenvalues, next to the shift, over the greatest: SLEPc has far ones to that."""


FEW = ("demo follower", "double flutter", "floating", "pins")
"""Scenes of which SLEPc finds the eigenvalues of the first load; all others are proved."""


class Watched(FrequencyRows):
    """Counts the rows that were certified without SLEPc, and the loads that it was asked for."""

    followed_rows = 0
    asked = 0

    def _close(self) -> list[Row]:
        Watched.followed_rows += sum(not row.anew for row in self._open)
        return super()._close()


def swept(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> Branch:
    """A sweep over the range of a scene."""
    Watched.followed_rows = 0
    monkeypatch.setattr("rodfem.diagram.sweep.FrequencyRows", Watched)
    return rodfem.trace(scene, Discretization("pointwise", 2, 6), Plan(error_bars=False))[0]


def short() -> Scene:
    return replace(SCENES["demo follower"](), span=(0.0, 15.0))


@pytest.fixture(scope="module")
def solved_anew() -> Branch:
    """The sweep of that scene without eigenvalues that are followed."""
    with pytest.MonkeyPatch.context() as anew:
        anew.setattr(FollowedPairs, "begin", lambda *given: None)
        return swept(short(), anew)


def difference(p: Point, q: Point, one: float) -> float:
    """Largest difference of inverse eigenvalues over the greatest; of a pair, which may be cut, either one."""
    a, b = (np.array([1.0 / (mu + 1j * abs(other) - SHIFT * one) for mu, other in x.omega2]) for x in (p, q))
    apart = abs(a[:, None] - b)
    return float(apart[linear_sum_assignment(apart)].max() / abs(b).max())


def same(followed: Branch, anew: Branch, one: float) -> None:
    """Assert that two sweeps have the same rows and special points.

    Two eigenvalues that are one, at a special point, have the root of the accuracy, and round-off makes them a pair.
    """
    special = {s.row for s in anew.special if s.kind in ("flutter", "divergence")}
    rows = [(p, q) for i, (p, q) in enumerate(zip(followed.points, anew.points, strict=True)) if i not in special]
    assert [p.negative for p, _ in rows] == [q.negative for _, q in rows]
    assert [p.zero for p in followed.points] == [p.zero for p in anew.points]
    assert [p.motion for p in followed.points] == [p.motion for p in anew.points]
    assert [(s.kind, s.negative_before, s.negative_after) for s in followed.special] == [
        (s.kind, s.negative_before, s.negative_after) for s in anew.special
    ]
    assert [s.point.load for s in followed.special] == pytest.approx([s.point.load for s in anew.special], rel=1e-9)
    for p, q in rows:
        assert difference(p, q, one) < CLAIMED, p.load


TWICE = ("classic Beck", "docs leipholz", "Leipholz")
"""Scenes much like the demo under a force that follows."""


@pytest.mark.few(4)
@pytest.mark.parametrize("name", [pytest.param(x, marks=[pytest.mark.long] * (x in TWICE)) for x in SCENES])
def test_every_row_is_that_of_solving_anew(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frequencies, motions and the numbers of unstable eigenvalues; most loads need no SLEPc.

    In :data:`FEW` it finds the eigenvalues of the first load, and all others are proved.
    """
    scene, asked, right = SCENES[name](), list[str](), frequency_rows.leftmost

    def leftmost(pencil: NonsymmetricPencil, *given: object) -> Frequencies:
        asked.append(name)
        return right(pencil, *given)

    with monkeypatch.context() as counted:
        counted.setattr(frequency_rows, "leftmost", leftmost)
        followed = swept(scene, counted)
    assert Watched.followed_rows > 0.6 * len(followed.points)
    assert len(asked) <= 2 or name not in FEW
    monkeypatch.setattr(FollowedPairs, "begin", lambda *given: None)
    anew = swept(scene, monkeypatch)
    assert Watched.followed_rows == 0
    same(followed, anew, scene.units.omega2)


@pytest.mark.long
def test_a_side_rests_with_the_error_of_a_prediction(monkeypatch: pytest.MonkeyPatch) -> None:
    """With that of later steps at the load before, rows from a tenth of this range on were up to 2.6e-5 off."""
    scene = fuzz.scene(30, 52)
    _, high = scene.span
    scene = scene.varying(scene.load, (0.0, 0.6 * high))  # with the rows that a hundred steps of the whole have
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 61)
    followed = swept(scene, monkeypatch)
    monkeypatch.setattr(FollowedPairs, "begin", lambda *given: None)
    for p, q in zip(followed.points, swept(scene, monkeypatch).points, strict=True):
        assert difference(p, q, scene.units.omega2) < CLAIMED, p.load


@pytest.mark.long
@pytest.mark.parametrize("wrong", ["another", "missing"])
def test_what_is_not_certified_is_solved_anew(wrong: str, solved_anew: Branch, monkeypatch: pytest.MonkeyPatch) -> None:
    """One followed eigenvalue is another, or left out, from some load on: no row has what was followed."""
    right = FollowedPairs.at

    def at(self: FollowedPairs, pencil: NonsymmetricPencil, load: float) -> Frequencies | None:
        found = right(self, pencil, load)
        if found is None or load < 7.0:
            return found
        values = found.values.copy()
        values[3] = values[3] * 1.001 if wrong == "another" else 2.0 * values[-1]
        return replace(found, values=values)

    monkeypatch.setattr(FollowedPairs, "at", at)
    same(swept(short(), monkeypatch), solved_anew, 1.0)


def exchanged(followed: FollowedPairs, pencil: NonsymmetricPencil, place: int) -> None:
    """Take an eigenvalue out of the bases that are followed, and the nearest one outside in; by dense matrices."""
    mass = pencil.mass_in_units().toarray()
    stiffness = pencil.matrix.copy().convert("dense").getDenseArray().real
    nu, left, right = eig(mass, stiffness - SHIFT * mass, left=True)
    order = np.argsort(-abs(nu))
    gone, new = order[place], order[followed.number + SPARE + GUARDS]
    for past, out, other, dual in zip(
        followed._past, (right, left.conj()), (right, left.conj()), (left.conj(), right), strict=True
    ):
        v, w, u = (x.real for x in (out[:, gone], other[:, new], dual[:, gone]))
        past.bases += (w / np.linalg.norm(w) - v / np.linalg.norm(v))[:, None] * (
            (u @ mass @ past.bases) / (u @ mass @ v / np.linalg.norm(v))
        )[:, None, :]


@pytest.mark.few(1)
@pytest.mark.parametrize(("place", "since", "seen_by"), [(2, 7.0, "probes"), (5, 7.0, "probes"), (5, 8.7, "proof")])
def test_an_eigenvalue_that_is_missing_is_found(
    place: int, since: float, seen_by: str, solved_anew: Branch, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From some load on another one is followed in its place: no row has what was followed.

    Without the probes the proof at load 9 sees it, before round-off brings it back.
    """
    if seen_by == "proof":
        monkeypatch.setattr(Subspaces, "outside", 0.0)
    right, done = FollowedPairs.at, list[float]()

    def at(self: FollowedPairs, pencil: NonsymmetricPencil, load: float) -> Frequencies | None:
        if load > since and not done:
            done.append(load)
            exchanged(self, pencil, place)
        return right(self, pencil, load)

    monkeypatch.setattr(FollowedPairs, "at", at)
    same(swept(short(), monkeypatch), solved_anew, 1.0)
    assert done


def test_accuracy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against SLEPc with a shift next to each eigenvalue: all digits, where a shift far off leaves seven."""
    scene = SCENES["demo follower"]()
    solver = Solver(scene, Discretization("pointwise", 2, 6)).equilibria
    eigensolver, followed = NonsymmetricSolver(solver.system), FollowedPairs(12, SHIFT)
    x, _ = solver.first(0.0)
    for load in np.linspace(0.0, 10.0, 41).tolist():
        x = at_load(solver, x, load)
        found = followed.at(eigensolver.at(x), load)
        if found is None:
            assert load == 0.0
            followed.begin(eigensolver.at(x), load)
    assert found is not None and len(found.values) == 14
    pencil = eigensolver.at(x)
    for value in found.values:
        near = pencil.near(1, value.real * (1 + 1e-4)).values
        assert abs(near - value).min() < 1e-11 * abs(value)


def test_near_and_agreed() -> None:
    def found(*values: complex) -> Frequencies:
        return Frequencies(np.array(values, dtype=complex), np.zeros(len(values)))

    assert frequency_rows.near(found(12.0, 12.001, 480.0), 3)
    assert frequency_rows.near(found(480.0, 50 + 1e-3j, 50 - 1e-3j), 3)
    assert not frequency_rows.near(found(12.0, 12.0 + 1e-9, 480.0), 3)
    assert not frequency_rows.near(found(480.0, 12.0, 12.001), 2)
    one, other = found(1.0, 1.0, 5.0), found(1.0, 5.0, 9.0)
    assert not frequency_rows.agree(one, other) and frequency_rows.agree(other, other)
