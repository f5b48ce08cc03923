"""Rotations, strains, energy and symmetry in pure UFL, against scipy's rotations and exact curves."""

from typing import Any

import numpy as np
import pytest
import ufl
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from rodfem.forms.energy import hemitropic
from rodfem.forms.inertia import rotary
from rodfem.forms.kinematics import RODS, curvature, strain
from rodfem.forms.lagrangian import pointwise, reduced
from rodfem.forms.rotation import product, rotation
from rodfem.forms.symmetry import cross, left, right

pytestmark = pytest.mark.versions

Q = np.array([0.9, -0.3, 0.5, 0.2]) * 1.7  # of no particular length
P = np.array([0.1, 0.7, -0.4, 0.6])


def vector(x: Any) -> Any:
    return ufl.as_vector([float(value) for value in x])


def value(expression: Any) -> np.ndarray:
    """Numbers of an expression of constants."""
    lowered = apply_derivatives(apply_algebra_lowering(expression))
    shape = lowered.ufl_shape
    return np.array([float(lowered((), component=i) if shape else lowered(())) for i in np.ndindex(*shape)]).reshape(
        shape
    )


def scipy_rotation(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(np.asarray(q)[[1, 2, 3, 0]])


def quaternion(turn: Rotation) -> np.ndarray:
    return turn.as_quat()[[3, 0, 1, 2]]


def test_rotation_is_that_of_the_normalised_quaternion() -> None:
    R = value(rotation(vector(Q)))
    np.testing.assert_allclose(R, scipy_rotation(Q).as_matrix(), atol=1e-15)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-15)


def test_product_composes_rotations() -> None:
    both = value(rotation(product(vector(P), vector(Q))))
    np.testing.assert_allclose(both, (scipy_rotation(P) * scipy_rotation(Q)).as_matrix(), atol=1e-15)


def test_curvature_of_a_helix() -> None:
    """Directors (normal, binormal, tangent) of a helix x(s) have the curvature (0, kappa, tau) of Frenet's formulas."""
    radius, pitch, s = 0.7, 0.4, 1.3
    size = np.hypot(radius, pitch)
    phase = s / size
    normal = -np.array([np.cos(phase), np.sin(phase), 0])
    tangent = np.array([-radius * np.sin(phase), radius * np.cos(phase), pitch]) / size
    frame = np.column_stack([normal, np.cross(tangent, normal), tangent])
    q = quaternion(Rotation.from_matrix(frame))
    dq = value(product(vector([0, 0, 0, 1 / (2 * size)]), vector(q)))  # the frame turns about the axis at speed 1/size
    k = value(curvature(vector(q), vector(dq)))
    np.testing.assert_allclose(k, [0, radius / size**2, pitch / size**2], atol=1e-15)


def test_curvature_knows_neither_observer_nor_length() -> None:
    dq = np.array([0.3, -1.1, 0.4, 0.8])
    k = value(curvature(vector(Q), vector(dq)))
    turned = [product(vector(P), vector(x)) for x in (Q, dq)]
    np.testing.assert_allclose(value(curvature(*turned)), k, rtol=1e-14)
    c, dc = -2.3, 0.9  # of c(s) q(s)
    np.testing.assert_allclose(value(curvature(vector(c * Q), vector(c * dq + dc * Q))), k, rtol=1e-14)


def test_strain_knows_no_observer() -> None:
    """``R(q)^t r'`` is the same when everything is turned by P, and the Lagrangian's integrands are."""
    dr, n, v, energy = np.array([0.2, -0.1, 1.1]), np.array([1.0, 2.0, -3.0]), np.array([0.1, 0.2, 0.9]), 0.7
    S = scipy_rotation(P).as_matrix()

    def integrands(q: np.ndarray, dr: np.ndarray, n: np.ndarray) -> list[float]:
        R, W = rotation(vector(q)), ufl.as_ufl(energy)
        full = pointwise(W, R, vector(v), vector(dr), vector(n))
        return [float(value(full)), float(value(reduced(W, R, vector(v), vector(n), vector(dr))))]

    expected = energy + n @ (dr - scipy_rotation(Q).as_matrix() @ v)
    np.testing.assert_allclose(integrands(Q, dr, n), expected, rtol=1e-14)
    turned = value(product(vector(P), vector(Q)))
    np.testing.assert_allclose(integrands(turned, S @ dr, S @ n), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("rod", "expected"), [("flexible", [7, 8, 9]), ("unshearable", [0, 0, 7]), ("inextensible", [7, 8, 1])]
)
def test_strain_puts_unknowns_in_their_places(rod: str, expected: list[float]) -> None:
    free = RODS[rod]
    np.testing.assert_array_equal(value(strain(free, [ufl.as_ufl(7.0 + i) for i in range(len(free))])), expected)


def test_rotary_inertia_of_a_spinning_body() -> None:
    """A body that spins at w (body frame) has ``q' = q (0, w)/2``."""
    q, w, inertia = Q / np.linalg.norm(Q), np.array([0.3, -0.8, 0.5]), np.array([1.0, 2.0, 5.0])
    dq = value(0.5 * product(vector(q), vector([0, *w])))
    energy = value(rotary(vector(q), vector(dq), vector(dq), tuple(ufl.as_ufl(x) for x in inertia)))
    np.testing.assert_allclose(energy, inertia @ w**2, rtol=1e-14)


def test_generators_are_derivatives_of_the_motions() -> None:
    """Their exponentials rotate space, ``q -> a q`` and ``r -> a r``, and the cross-sections, ``q -> q a``."""
    axis, angle = np.array([2.0, -1.0, 2.0]) / 3, 0.8
    turn = Rotation.from_rotvec(angle * axis)
    space, body, vectors = (expm(angle * np.array(matrix(tuple(axis)))) for matrix in (left, right, cross))
    r = np.array([1.0, 2.0, -0.5])
    np.testing.assert_allclose(vectors @ r, turn.apply(r), atol=1e-14)
    for found, expected in ((space @ Q, turn * scipy_rotation(Q)), (body @ Q, scipy_rotation(Q) * turn)):
        np.testing.assert_allclose(scipy_rotation(found).as_matrix(), expected.as_matrix(), atol=1e-14)


def test_hemitropic_constitutive_law() -> None:
    A, B, C = -3.0, 1.2, 0.8
    v, k = (ufl.variable(vector(x)) for x in ([0, 0, 0.6], [0.3, -0.4, 0.9]))
    W = hemitropic(v, k, stretching=10.0, coupling=A, twisting=B, bending=C)
    np.testing.assert_allclose(value(ufl.diff(W, v)), [0, 0, 10 * (0.6 - 1) + A * 0.9], rtol=1e-14)
    np.testing.assert_allclose(value(ufl.diff(W, k)), [C * 0.3, -C * 0.4, B * 0.9 + A * (0.6 - 1)], rtol=1e-14)
