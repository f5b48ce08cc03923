"""The reduced stiffness matrix, against dense linear algebra; its crossings, against matrices whose zeros are known."""

import numpy as np
import pytest
import scipy.linalg
from classics import ON_AXIS, column, push
from golden_cases import cases, trace
from rows import regular

import rodfem
from rodfem import Discretization, Solver, pinned
from rodfem.continuation.arc import Piece
from rodfem.continuation.crossings import Node, Zeros, negative
from rodfem.linalg.matrices import gathered
from rodfem.stability.reduced_stiffness import Condensation


@pytest.mark.parametrize("load", [20.0, None])
def test_condensation_of_the_saddle_matrix(load: float | None) -> None:
    """H is the Schur complement of S on the amplitudes, its index is that of S; also at the load of the mesh itself."""
    rod = column("euler", (pinned(), pinned(ON_AXIS, push)), (0.0, 30.0), constants={"B2": 1.3})
    mesh = Discretization("reduced", 4, 3)
    singular = load or rodfem.trace(rod, mesh, depth=0, error_bars=False).special("branch point")[0].point.load
    states = Solver(rod, mesh)
    solver, x = states.equilibria, states.equilibrium(5.0).x
    solver.system.set_load(x, singular)
    condensation = Condensation(solver.inertia)
    phi = condensation.border(x)
    found = condensation.at(x, solver.axis, phi)
    S, M = (gathered(A).toarray() for A in (solver.inertia.at(x).matrix, solver.inertia.metric))
    B = M @ phi
    k = phi.shape[1]
    solved = np.linalg.solve(np.block([[S, B], [B.T, np.zeros((k, k))]]), np.eye(len(S) + k)[:, len(S) :])
    assert np.allclose(found.H, -solved[len(S) :], atol=1e-9)
    assert np.allclose(found.W, solved[: len(S)], atol=1e-7 * abs(found.W).max())
    above, below = scipy.linalg.eigvals(S, M, homogeneous_eigvals=True)
    kept = abs(below) > 1e-9 * abs(above)
    finite = (above[kept] / below[kept]).real
    assert found.far + negative(found.H) == (finite < 0).sum() or not load


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["demo hemitropic", "demo ring"])
def test_the_rate_is_the_derivative_along_the_branch(name: str) -> None:
    """Between rows of a branch, phase conditions included: the cubic through two rows is that of the row between."""
    diagram = trace(cases()[name](), error_bars=False)
    branch = diagram[-1]
    rows = [p for p in regular(branch) if p.tangent is not None]
    solver, (a, b) = diagram.solvers[rows[4].mesh], rows[4:6]
    condensation = Condensation(solver.inertia)
    piece = Piece(solver, condensation, a, b, condensation.border(a.x))
    p, q = piece.node(a.x, a.tangent), piece.node(b.x, b.tangent)
    middle = piece.solve(p, q, (p.s + q.s) / 2)
    near = piece.solve(p, middle, middle.s - 1e-3 * q.s), piece.solve(middle, q, middle.s + 1e-3 * q.s)
    difference = (near[1].H - near[0].H) / (near[1].s - near[0].s)
    assert np.allclose(middle.slope, difference, atol=2e-5 * abs(difference).max())


def polynomial(*coefficients: np.ndarray) -> tuple[Node, Node]:
    """Nodes at 0 and 1 of a matrix polynomial of degree three or less, with an index across the border of two."""
    A = [np.array(a, dtype=float) for a in coefficients]
    slope = sum(i * a for i, a in enumerate(A) if i)
    return Node(0.0, A[0], A[1], 2), Node(1.0, sum(A[1:], A[0]), slope, 2)


def test_a_pair_within_a_step_asks_for_one_state_between() -> None:
    """``(t - 0.5)^2 - d^2`` has its zeros in two halves then, which one state tells from ``(t - 0.5)^2 + d^2``."""
    for sign in (-1.0, 1.0):
        exact = lambda t, sign=sign: np.array([[(t - 0.5) ** 2 + sign * 1e-6]])  # noqa: E731
        asked, misses = [], list[Node]()

        def solve(a: Node, b: Node, s: float, exact=exact, asked=asked) -> Node:
            asked.append(s)
            return Node(s, exact(s), np.array([[2 * (s - 0.5)]]), 0)

        a, b = (Node(t, exact(t), np.array([[2 * (t - 0.5)]]), 0) for t in (0.0, 1.0))
        found = Zeros(solve, 1e-12, misses).crossings(a, b, np.zeros((1, 1)))
        assert [round(c.s, 9) for c in found] == ([0.499, 0.501] if sign < 0 else [])
        assert [(c.before, c.after) for c in found] == ([(0, 1), (1, 0)] if sign < 0 else [])
        assert len(asked) == 1
        assert len(misses) == (sign > 0)
