"""Matrices of Kumar & Healey (2010) as their text states them, and what docs/paper.md says of them.

Linear elements; the constraints ``C`` of the pointwise formulation have multipliers at nodes, as the paper's.
"""

from pathlib import Path

import demo_cases
import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import brentq
from small_states import plain

import rodfem
from rodfem import Discretization, Plan
from rodfem.kumar_healey.coordinates import Coordinates
from rodfem.kumar_healey.reduction import cayley_shift
from rodfem.stability.dependence import smallest_singular

PAGE = (Path(__file__).parents[2] / "docs" / "paper.md").read_text()
MIDPOINT = [(0.5, 1.0)]
EXACT = [(0.5 - 12**-0.5, 0.5), (0.5 + 12**-0.5, 0.5)]
TABLE_5 = {50: 0.2105, 100: 0.2079, 150: 0.2219, 200: 0.2220}
"""Ratios of the smallest singular value to h by number of elements of a rod of length 6."""
Rule = list[tuple[float, float]]
RULES = MIDPOINT, EXACT


def nodal(n: int, stretch: float, rule: Rule, directors: tuple[int, ...], length: float = 6.0) -> np.ndarray:
    """``C`` of (18): ``int (eta' - psi x r') . d_a lambda_a ds`` of a straight rod.

    Shape (n + 1, 2, 3, n + 1, directors): ``eta`` and ``psi`` at each node by multipliers at each node.
    """
    h, r_s = length / n, stretch * np.eye(3)[2]
    C = np.zeros((n + 1, 2, 3, n + 1, len(directors)))
    for x, weight in rule:
        hats, slopes = (1 - x, x), (-1 / h, 1 / h)
        for e in range(n):
            for i, j, column in np.ndindex(2, 2, len(directors)):
                d = np.eye(3)[directors[column]]
                C[e + i, 0, :, e + j, column] += h * weight * slopes[i] * hats[j] * d
                C[e + i, 1, :, e + j, column] += h * weight * hats[i] * hats[j] * np.cross(d, r_s)
    return C


def hemitropic(n: int, stretch: float, rule: Rule) -> np.ndarray:
    """``C`` of section 5.2, 6 (n - 1) x 2 (n + 1): both ends are held."""
    return nodal(n, stretch, rule, (0, 1))[1:-1].reshape(6 * (n - 1), 2 * (n + 1))


def cord(n: int, rule: Rule, length: float = 6.0) -> np.ndarray:
    """``C`` of section 5.1, (6n - 5) x (3n + 2): the end may move along e3, where the axial force is known."""
    C = nodal(n, 1.0, rule, (0, 1, 2), length).reshape(n + 1, 6, 3 * (n + 1))[..., :-1]
    return np.vstack([C[1:-1].reshape(6 * (n - 1), 3 * n + 2), C[-1, 2:3]])


def ratio(n: int, stretch: float, rule: Rule) -> float:
    return float(np.linalg.svd(hemitropic(n, stretch, rule), compute_uv=False)[-1] * n / 6)


@pytest.mark.parametrize(("n", "printed"), TABLE_5.items())
def test_table_5_is_a_third_of_the_stretch(n: int, printed: float) -> None:
    """With exact integrals; the page has the values at the stretch 2/3, and the range in which the table lies."""
    found = ratio(n, 2 / 3, EXACT)
    assert f"| {6 / n:.2f} | {printed:.4f} | {found:.4f} |" in PAGE
    assert ratio(n, 1 / 3, EXACT) == pytest.approx(found / 2, rel=2e-3)  # proportional to the stretch
    assert found == pytest.approx(2 / 9 * np.sqrt((n - 1) / (n + 1)), rel=1e-3)
    assert 0.63 < 2 / 3 * printed / found < 0.671


def test_the_midpoint_rule_does_not_see_alternating_multipliers() -> None:
    """Two columns depend on the others; with exact integrals none does."""
    n = 50
    alternating = np.outer((-1.0) ** np.arange(n + 1), [1, 0]).ravel()
    assert abs(hemitropic(n, 2 / 3, MIDPOINT) @ alternating).max() < 1e-15
    for midpoint, exact in ((hemitropic(n, 2 / 3, r) for r in RULES), (cord(n, r) for r in RULES)):
        assert np.linalg.matrix_rank(exact) == exact.shape[1]
        assert np.linalg.matrix_rank(midpoint) == midpoint.shape[1] - 2


def test_matrices_of_the_cord_have_the_load_of_rodfem_s_mesh() -> None:
    """(19) on 40 elements by the midpoint rule: ``K`` on the null space of ``C^t`` is singular at rodfem's load."""
    n, tension, moment = 40, cross([0.0, 0.0, 1.0]), cross([0.0, -3 * np.pi, 0.0])
    mean, slope = np.full(2, 0.5), np.array([-n, n])
    fixed, scaled = np.zeros((2, n + 1, 2, 3, n + 1, 2, 3))  # rows, columns: node, (r, theta), component
    for e in range(n):
        nodes = slice(e, e + 2)
        spins = np.einsum("i,j,ab->iajb", slope, slope, np.eye(3)) - np.einsum("i,j,ab->iajb", slope, mean, moment)
        fixed[nodes, 1, :, nodes, 1, :] += spins / n
        scaled[nodes, 0, :, nodes, 1, :] -= np.einsum("i,j,ab->iajb", slope, mean, tension) / n
        scaled[nodes, 1, :, nodes, 0, :] += np.einsum("i,j,ab->iajb", mean, slope, tension) / n
        scaled[nodes, 1, :, nodes, 1, :] += np.einsum("i,j,ab->iajb", mean, mean, tension @ tension) / n
    kept = np.append(np.arange(6, 6 * n), 6 * n + 2)
    K0, K1 = (A.reshape(6 * (n + 1), -1)[np.ix_(kept, kept)] for A in (fixed, scaled))
    Z = scipy.linalg.null_space(cord(n, MIDPOINT, length=1.0).T)
    assert Z.shape == (6 * n - 5, 3 * n - 5)
    np.testing.assert_allclose(Z.T @ (K0 + 40 * K1) @ Z, Z.T @ (K0 + 40 * K1).T @ Z, atol=1e-10)
    load = brentq(lambda lam: np.linalg.eigvalsh(Z.T @ (K0 + lam * K1) @ Z)[0], 45.0, 52.0, xtol=1e-10)
    diagram = rodfem.trace(demo_cases.scene("cord"), Discretization("pointwise", n, 1), Plan((52.0, 45.0), depth=0))
    assert load == pytest.approx(diagram.special("branch point")[0].point.load, abs=1e-7)


def cross(a: list[float]) -> np.ndarray:
    """Matrix of ``a x``."""
    return np.cross(a, np.eye(3)).T


def test_multipliers_in_each_element_have_the_stretch() -> None:
    """rodfem's, on 50 elements: the value of docs/stability.md, of the undeformed rod, times the stretch."""
    system, x = plain("hemitropic", "pointwise", 50, 1, 1 / 3)
    C = Coordinates(system, "compatible").assemble(x).C
    assert C.shape == (6 * 49, 100)
    assert smallest_singular(C)[0] * 50 / 6 == pytest.approx(2 / 3 * 0.98935, rel=1e-3)


def test_constraints_of_the_mixed_formulation_grow_over_h() -> None:
    """(40): ``int (d3 beta + psi x v3 d3) . lambda ds``, three columns; sigma / h is no constant."""
    ratios = []
    for n in (50, 200):
        across = np.full(n - 1, 2 / 3 * 6 / n)  # the integral of a hat times the stretch, at the nodes inside
        along = np.append(np.full(n - 1, 6 / n), [3 / n, 3 / n])
        ratios.append(min(np.linalg.norm(across), np.linalg.norm(along)) * n / 6)
    assert ratios[1] / ratios[0] == pytest.approx(2, rel=0.02)


def test_cayley_transform() -> None:
    """(29), with the parameters of section 5, of the eigenvalues themselves."""
    values = np.array([-3.0, 0.5, 0.7, 4.0, 50.0])
    a1 = cayley_shift(values)
    first, second, *beyond = (values - (2 * values[1] - a1)) / (values - a1)
    assert (first, second) == pytest.approx((3, -1))
    assert np.max(np.abs(beyond)) < 1


@pytest.mark.parametrize(("load", "index"), [(3.0, 0), (6.0, 1), (11.0, 2)])
def test_the_multiplier_of_44_does_not_change_the_index(load: float, index: int) -> None:
    """Of the ruler in its plane, with the constitutive law of the axial force at its end as a constraint, or not."""
    system, x = plain("ruler", "reduced", 24, 1, load)
    pencil = Coordinates(system).assemble(x)
    K, where = pencil.K.toarray(), pencil.where
    assert pencil.C.shape == (4 * 24, 0)
    state = system.at(x)
    v3 = float(state.values("v").ravel()[-1])
    q = state.values("q")[-1].ravel()[-4:]
    d3 = np.array([2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]), 1 - 2 * (q[1] ** 2 + q[2] ** 2)])
    gradient = np.zeros(len(K))
    gradient[where["v"][-1]] = 20 / v3
    gradient[where["theta"][-3:]] = -load * np.cross(d3, [1.0, 0.0, 0.0])  # theta . (d3 x e1) = (theta x d3) . e1
    assert abs(20 * np.log(v3) - load * d3[0]) < 0.05 * load  # zero but for the last element's size
    free = np.linalg.svd(gradient[None])[2][1:].T
    for matrix in (K, free.T @ K @ free):
        assert (np.linalg.eigvalsh((matrix + matrix.T) / 2) < 0).sum() == index
