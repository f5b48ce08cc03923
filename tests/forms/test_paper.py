"""The second variation by hand against UFL's: pointwise, and the equations of the paper to the letter."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from test_forms import value

from rodfem import compat
from rodfem.fem import form_compiler
from rodfem.forms import paper
from rodfem.forms.inertia import rotary
from rodfem.forms.kinematics import RODS, UNDEFORMED, curvature
from rodfem.forms.lagrangian import pointwise, reduced
from rodfem.forms.loads import follower_work
from rodfem.forms.rotation import product, rotation


def energy(v: Any, k: Any) -> Any:
    """Of no particular form: all of v and k are coupled."""
    coupled = (v[0] * k[1] - 0.3 * v[2] * k[2]) ** 2
    return 0.7 * ufl.inner(v, v) ** 2 + ufl.dot(v, k) + coupled + ufl.exp(0.2 * k[0]) + k[2] ** 4


SIZES = {"x": 17, "a": 15, "b": 15, "along a": 17, "along b": 17, "which": 7}


class Pointwise:
    """Derivatives at one point of a rod by UFL and by hand; all that varies is a dolfinx Constant."""

    def __init__(self, formulation: str) -> None:
        mesh = compat.interval_mesh(MPI.COMM_SELF, 1, 0.0, 1.0)
        self.numbers = {name: fem.Constant(mesh, np.zeros(size)) for name, size in SIZES.items()}
        x = ufl.variable(ufl.as_vector([self.numbers["x"][i] for i in range(17)]))
        q, q_s, v, n, r_s = (part(x, *span) for span in ((0, 4), (4, 8), (8, 11), (11, 14), (14, 17)))
        R, k = rotation(q), curvature(q, q_s)
        has_centreline = formulation == "pointwise"
        chord = ufl.as_vector([0.1, 0.2, 0.3])
        L = pointwise(energy(v, k), R, v, r_s, n) if has_centreline else reduced(energy(v, k), R, v, n, chord)
        state, one, other = paper.state(energy, R, v, k, n), self.perturbation("a"), self.perturbation("b")
        if not has_centreline:
            r_s, one, other = chord, replace(one, dr_s=0 * chord), replace(other, dr_s=0 * chord)
        first = ufl.dot(ufl.diff(L, x), self.numbers["along a"])
        second = ufl.dot(ufl.diff(first, x), self.numbers["along b"])
        zero = 0 * chord
        bracket = paper.Perturbation(
            ufl.cross(one.theta, other.theta) / 2,
            (ufl.cross(one.theta_s, other.theta) + ufl.cross(one.theta, other.theta_s)) / 2,
            zero,
            zero,
            zero,
        )
        found = [
            first,
            paper.first_variation(state, r_s, one),
            second,
            paper.second_variation(state, one, other),
            paper.linearized_balance(state, one, other),
            paper.first_variation(state, r_s, bracket),
            ufl.dot(ufl.diff(paper.first_variation(state, r_s, one), x), self.numbers["along b"]),
        ]
        integrand = sum(self.numbers["which"][i] * f for i, f in enumerate(found))
        (self.form,) = form_compiler.compile_forms([integrand * ufl.dx(domain=mesh, metadata={"quadrature_degree": 0})])

    def perturbation(self, name: str) -> paper.Perturbation:
        return paper.Perturbation(*(part(self.numbers[name], 3 * i, 3 * i + 3) for i in range(5)))

    def values(self, rod: str, seed: int) -> np.ndarray:
        """All seven at a random state of a rod of that kind, in random directions."""
        rng = np.random.default_rng(seed)
        stiff = [i for i in range(3) if i not in RODS[rod]]
        for name in ("x", "a", "b"):
            self.numbers[name].value[:] = rng.normal(size=self.numbers[name].value.size)
        self.numbers["x"].value[[8 + i for i in stiff]] = [UNDEFORMED[i] for i in stiff]
        for name in ("a", "b"):
            self.numbers[name].value[[6 + i for i in stiff]] = 0.0
            p, q, q_s = self.numbers[name].value, self.numbers["x"].value[:4], self.numbers["x"].value[4:8]
            theta, theta_s = np.append(0.0, p[:3]), np.append(0.0, p[3:6])
            dq, dq_s = hamilton(theta, q) / 2, (hamilton(theta_s, q) + hamilton(theta, q_s)) / 2
            self.numbers[f"along {name}"].value[:] = np.concatenate([dq, dq_s, p[6:]])
        found = []
        for i in range(7):
            self.numbers["which"].value[:] = np.arange(7) == i
            found.append(float(np.real(fem.assemble_scalar(self.form))))
        return np.array(found)


def part(x: Any, first: int, last: int) -> Any:
    return ufl.as_vector([x[i] for i in range(first, last)])


@cache
def at_a_point(formulation: str) -> Pointwise:
    return Pointwise(formulation)


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
@pytest.mark.parametrize("rod", RODS)
def test_pointwise_it_is_exact_in_any_state(rod: str, formulation: str) -> None:
    for seed in range(5):
        first, first_by_hand, second, second_by_hand, *_ = at_a_point(formulation).values(rod, seed)
        assert first_by_hand == pytest.approx(first, rel=1e-11, abs=1e-11)
        assert second_by_hand == pytest.approx(second, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("rod", RODS)
def test_linearized_balance_differs_by_a_multiple_of_the_equations(rod: str) -> None:
    for seed in range(5):
        *_, second, balance, equations, _ = at_a_point("pointwise").values(rod, seed)
        assert balance - second == pytest.approx(equations, rel=1e-11, abs=1e-11)
        assert abs(equations) > 1e-3


@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
@pytest.mark.parametrize("rod", RODS)
def test_linearized_balance_is_the_linearisation_of_the_weak_form(rod: str, formulation: str) -> None:
    """The paper's (17)-(19): the weak form with a fixed test spin, differentiated in the state by UFL."""
    for seed in range(5):
        *_, second, balance, _, linearised = at_a_point(formulation).values(rod, seed)
        assert balance == pytest.approx(linearised, rel=1e-11, abs=1e-11)
        assert abs(second - linearised) > 1e-3


class Literal:
    """A random state of a rod, with test fields ``eta'``, ``psi``, and perturbations that fulfil its constraints."""

    def __init__(self, rod: str, seed: int) -> None:
        rng = np.random.default_rng(seed)
        free = list(RODS[rod])
        stiff = [i for i in range(3) if i not in free]
        self.kept = [*free, 3, 4, 5]
        R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        self.R = R * np.linalg.det(R)
        self.v, A = np.array(UNDEFORMED), rng.normal(size=(6, 6))
        self.v[free], self.H = rng.normal(size=len(free)), A + A.T
        self.n, self.m, self.eta_s, self.psi, self.psi_s, self.theta, self.theta_s = rng.normal(size=(7, 3))
        self.r_s = self.R @ self.v
        self.dv, self.test_dv = rng.normal(size=3), self.R.T @ (self.eta_s - np.cross(self.psi, self.r_s))
        self.dv[stiff] = self.test_dv[stiff] = 0.0
        self.dr_s = np.cross(self.theta, self.r_s) + self.R @ self.dv
        self.dn_body = np.where(np.isin(np.arange(3), stiff), rng.normal(size=3), 0.0)  # of the reactions

    def balance(self, one: list[np.ndarray], other: list[np.ndarray]) -> float:
        """``linearized_balance`` of perturbations ``theta, theta_s, dv, dn, dr_s``."""
        H = self.H[:3, :3], self.H[:3, 3:], self.H[3:, 3:]
        state = paper.State(*map(constant, (self.R, self.v, self.n, self.m, self.R.T @ self.n, *H)))
        tests, fields = (paper.Perturbation(*map(constant, each)) for each in (one, other))
        return float(value(paper.linearized_balance(state, tests, fields)))

    def geometry(self) -> np.ndarray:
        """``(0 -n x; 0 -m x) (dr, theta)``."""
        return np.concatenate([-np.cross(self.n, self.theta), -np.cross(self.m, self.theta)])


def constant(numbers: np.ndarray) -> Any:
    return ufl.as_tensor(numbers.tolist())


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("rod", RODS)
def test_17_to_19_to_the_letter(rod: str, seed: int) -> None:
    """``[Pi H Pi^t E^t + (0 -n x; 0 -m x)](dr, theta) . E^t (eta, psi) + (n x dr') . psi``, and reactions."""
    x = Literal(rod, seed)
    E, E_test = (  # E^t (dr, theta) = (dr' - theta x r', theta')
        np.concatenate([r - np.cross(spin, x.r_s), spin_s])
        for r, spin, spin_s in ((x.dr_s, x.theta, x.theta_s), (x.eta_s, x.psi, x.psi_s))
    )
    Pi = np.kron(np.eye(2), x.R)[:, x.kept]
    stress = Pi @ x.H[np.ix_(x.kept, x.kept)] @ Pi.T @ E + x.geometry()
    literal = stress @ E_test + np.cross(x.n, x.dr_s) @ x.psi + x.R @ x.dn_body @ E_test[:3]
    dn = np.cross(x.theta, x.n) + x.R @ x.dn_body
    tests, fields = [x.psi, x.psi_s, x.test_dv, 0 * x.n, x.eta_s], [x.theta, x.theta_s, x.dv, dn, x.dr_s]
    assert x.balance(tests, fields) == pytest.approx(literal, rel=1e-12)


def test_16_and_20_to_the_letter() -> None:
    """The mass ``R I Rt``, and what the rotation of an end adds under a follower force, ``-(theta x n) . eta``."""
    rng = np.random.default_rng(0)
    q, (theta, psi, eta, force) = rng.normal(size=4), rng.normal(size=(4, 3))
    q /= np.linalg.norm(q)
    dq, dp = (hamilton(np.append(0.0, spin), q) / 2 for spin in (theta, psi))
    R, inertia = value(rotation(constant(q))), [0.3, 0.5, 0.7]
    found = rotary(constant(q), constant(dq), constant(dp), tuple(ufl.as_ufl(x) for x in inertia))
    assert float(value(found)) == pytest.approx(theta @ R @ np.diag(inertia) @ R.T @ psi, rel=1e-13)

    def work(eps: float) -> float:
        turned = rotation(constant(q + eps * dq))
        return float(value(follower_work(turned, constant(force), constant(eta))))

    assert (work(1e-5) - work(-1e-5)) / 2e-5 == pytest.approx(np.cross(theta, R @ force) @ eta, rel=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_40_to_the_letter(seed: int) -> None:
    """The mixed formulation: ``beta`` and ``lambda`` test the stretch ``v3`` and the constant force."""
    x, (dn, lam) = Literal("unshearable", seed), np.random.default_rng(seed).normal(size=(2, 3))
    d3, dv3, beta = x.R[:, 2], x.dv[2], x.test_dv[2]
    H = x.H[np.ix_(x.kept, x.kept)]
    strain, test = (np.append(v, x.R.T @ spin_s) for v, spin_s in ((dv3, x.theta_s), (beta, x.psi_s)))
    change = dv3 * d3 + x.v[2] * np.cross(x.theta, d3)  # (41)-(42): dr'
    literal = test @ H @ strain + x.geometry() @ np.append(beta * d3, x.psi_s) - np.cross(change, x.n) @ x.psi
    literal -= dn @ (beta * d3 + np.cross(x.psi, x.v[2] * d3)) + lam @ change
    tests, fields = [x.psi, x.psi_s, x.test_dv, lam, 0 * dn], [x.theta, x.theta_s, x.dv, dn, 0 * dn]
    assert x.balance(tests, fields) == pytest.approx(literal, rel=1e-12)
    np.testing.assert_allclose(change, x.dr_s, rtol=1e-12)
    assert d3 @ (x.eta_s - np.cross(x.psi, x.r_s)) == pytest.approx(beta)  # (43)


@pytest.mark.parametrize("seed", range(3))
def test_acceleration_of_the_curve_is_a_change_of_length(seed: int) -> None:
    """Polarised, it is ``-1/4 theta1 . theta2 q``: the unit norm term's share in the Hessian, times minus eta."""
    rng = np.random.default_rng(seed)
    q = rng.normal(size=4)
    spins = [np.append(0.0, rng.normal(size=3)) for _ in range(2)]
    a, b = (hamilton(theta, q) / 2 for theta in spins)
    acceleration = (hamilton(spins[0], hamilton(spins[1], q)) + hamilton(spins[1], hamilton(spins[0], q))) / 8
    np.testing.assert_allclose(acceleration, -spins[0] @ spins[1] / 4 * q, rtol=1e-13)
    assert a @ q == pytest.approx(0, abs=1e-15)
    assert a @ b == pytest.approx(-acceleration @ q, rel=1e-13)


def hamilton(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    return value(product(*(ufl.as_vector([float(c) for c in x]) for x in (p, q))))
