"""Sweeps of frequencies: which eigenvalue goes on from which, flutter at the start of a range, the picture."""

from dataclasses import replace
from io import StringIO

import classics
import numpy as np
import pytest
from closed_forms import column, flutter
from hemitropic_cases import specials

from rodfem import Branch, Discretization, Scene, Solver, compat, trace
from rodfem.app.terminal import Report
from rodfem.errors import ConvergenceError
from rodfem.output.plot_frequencies import curves, figure_of, ranges_of
from rodfem.stability.nonsymmetric import NonsymmetricSolver


def swept(scene: Scene, monkeypatch: pytest.MonkeyPatch, loads: int = 26) -> tuple[Branch, dict, str]:
    """Frequencies over the range of a scene: branch, diagram, and what the terminal shows."""
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", loads)
    out = StringIO()
    diagram = trace(scene, Discretization("pointwise", 4, 6), observer=Report(stream=out))
    return diagram[0], diagram.data, out.getvalue()


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.parametrize(
    ("span", "loads"),
    [((-1.0, 1.0), 11), *(pytest.param(*x, marks=pytest.mark.alone) for x in [((0.0, 1.0), 11), ((0.0, 36.0), 61)])],
)
def test_flutter_at_any_torque(span: tuple[float, float], loads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nicolai: the frequencies of a cantilever are double without torque, Euler's and Bernoulli's, and complex with it.

    At great torques more pairs come near than were known before, complex already.
    """
    scene = replace(classics.torque("follower_moment"), span=span)
    branch, _, said = swept(scene, monkeypatch, loads)
    found = specials(branch, "flutter")
    assert [s.point.load for s in found] == [0.0] * (2 if span[0] < 0 else 1)
    after = found[-1]
    assert after.negative_before == 0 < after.negative_after
    assert "flutter at every P > 0 next to it" in after.note
    assert after.omega2 == pytest.approx(1.8751040687119611**4, abs=1e-8)
    assert after.error_estimate < 1e-11
    assert "!" not in said
    assert all(p.negative > 0 for p in branch.points if p.load != 0.0)
    hidden = [line for line in said.splitlines() if "eigenvalues that are complex at" in line]
    assert len(set(hidden)) == len(hidden)  # one note of a step


def test_curves_go_on_where_they_cross(monkeypatch: pytest.MonkeyPatch) -> None:
    """The strong plane's frequency passes between those of the weak one, each a curve of one motion: Beck's column."""
    branch, data, _ = swept(classics.partly_following(1.0, (0.0, 25.0)), monkeypatch)
    motions: dict[int, set[str]] = {}
    for p in branch.points:
        for (mu, other), name, number in zip(p.omega2, p.motion, p.curve, strict=True):
            motions.setdefault(number, set()).add(name)
            if abs(p.load - 20.05) > 0.2 and other == 0:
                EI = {"bending about d1": 1.0, "bending about d2": 10.0}[name]
                assert abs(column(mu, p.load, EI) - mu) < 1e-6 * mu
    assert {len(names) for names in motions.values()} == {1}
    first = branch.points[0]
    (strong,) = {n for (mu, _), n in zip(first.omega2, first.curve, strict=True) if abs(mu - 123.6) < 1}
    (line,) = [c for c in curves(data["branches"][0]) if abs(c.roots[0] ** 2 - 123.6) < 1]
    assert motions[strong] == {line.motion} == {"bending about d2"}
    assert len(line.loads) >= len(branch.points) - 1
    (axes,) = figure_of(data).axes
    assert "flutter at 20.051" in {text.get_text() for text in axes.get_legend().get_texts()}


@pytest.mark.long
def test_ranges_of_one_kind_of_instability(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thrust that follows in part: one plane diverges, holds again and flutters, before the other one diverges."""
    share, strong = 0.45, 3.0
    _, data, _ = swept(classics.partly_following(share, (0.0, 30.0), strong), monkeypatch)
    first, meet = np.arccos(-share / (1 - share)), flutter(16.1, 37.0, share=share)[0]
    expected = [
        ("range of divergence", first**2, (2 * np.pi - first) ** 2),
        ("range of flutter", meet, strong * first**2),
        ("range of flutter and divergence", strong * first**2, 30.0),
    ]
    found = list(ranges_of(data["branches"][0]))
    assert [r.words for r in found] == [words for words, *_ in expected]
    assert [[r.low, r.high] for r in found] == [pytest.approx(loads, rel=1e-6) for _, *loads in expected]


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_a_load_that_the_richer_mesh_does_not_find_has_no_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bar of its ordinate, 1e-12 for a straight rod, is none of the load."""

    def lost(*given: object) -> object:
        raise ConvergenceError("There is none: use a smaller range.")

    monkeypatch.setattr("rodfem.diagram.sweep.located_flutter", lost)
    diagram = trace(classics.beck(span=(19.0, 21.0)), Discretization("pointwise", 4, 6))
    (point,) = specials(diagram[0], "flutter")
    assert np.isnan([point.error_estimate, point.ordinate_error]).all()
    assert any("No error of the flutter" in sentence for sentence in diagram.warnings)


def test_what_petsc_keeps_of_matrices_is_destroyed(monkeypatch: pytest.MonkeyPatch) -> None:
    """PETSc keeps what is destroyed until all ranks clean up: 39 kB a state here, unless they do."""
    solver, cleaned = Solver(classics.beck(), Discretization("pointwise", 4, 6)).equilibria, list[int]()
    x, eigensolver = solver.start(10.0), NonsymmetricSolver(solver.system)
    monkeypatch.setattr(compat, "destroy_garbage", lambda comm: cleaned.append(eigensolver.filled))
    for _ in range(128):
        eigensolver.at(x)
    assert cleaned == [64, 128]
