r"""The second variation and the linearised balance by hand, to be read, and to check automatic derivatives against.

The Lagrangian of :mod:`rodfem.forms.lagrangian` is a function of rotations.  A perturbation is a *spin* ``theta`` in
the space frame, together with changes ``dr``, ``dv`` (body components), ``dn``::

    R_eps = exp(eps [theta x]) R,    q_eps = exp(eps theta / 2) q,    so that   dq = 1/2 theta q

(a quaternion product, ``theta`` standing for ``(0, theta)``).  To second order in eps, for a vector ``a`` in the body,

    R_eps a = R a + eps theta x R a + eps^2/2 theta x (theta x R a),
    k_eps   = k + R^t (eps theta' - eps^2/2 theta x theta'),

the latter from ``[k x] = R^t R'`` and ``exp(-X) (exp X)' = X' - 1/2 [X, X'] + ...``.  With the moment ``m = R W_k`` the
derivatives of ``L = int W + n . (r' - R v)`` along such a curve follow.  The first is the weak form of the equilibrium
equations ``m' + r' x n = 0``, ``n' = 0``, ``R^t n = W_v``, ``r' = R v``:

    G(theta, dr, dv, dn) = int W_v . dv + m . theta' + n . (dr' - theta x R v - R dv) + dn . (r' - R v);

dead loads are linear in ``r`` and enter here only.  The second, with ``dk = R^t theta'``, is

    d^2 L = int [ dv . W_vv dv + 2 dv . W_vk dk + dk . W_kk dk - m . (theta x theta')
                  - n . (theta x (theta x R v)) - 2 n . (theta x R dv) + 2 dn . (dr' - theta x R v - R dv) ].

In the first line is the material, then the geometry: moment and force at work on finite rotations.  The last term holds
the linearised constraints: ``dn`` multiplies ``dr' = theta x R v + R dv``.  :func:`second_variation` is its symmetric
bilinear form.

Kumar & Healey (2010) do not take this second variation.  They linearise the weak form ``G`` of the balance laws, their
(11)-(12), in test fields that stay as they are, among them a *fixed* test spin ``tau``: (17) with ``dv`` free
(flexible), (18) with ``dv = dv3 e3`` (unshearable), (19) with ``dv = 0`` (unshearable and inextensible); (16) is the
mass, (20) the terms of the ends.  :func:`linearized_balance` is that form for all rods at once, with
``dm = theta x m + R (W_kv dv + W_kk dk)``.  Theirs have ``dr`` and no ``dv``, which follows by (41)-(43) from
``dr' = theta x R v + R dv``.  For the mixed formulation, (40), whose functionals are (37) and (44), ``dr`` is gone,
``dn`` is constant and its equation is ``int theta x R v + R dv = 0``.  The two differ in

* symmetry: :func:`second_variation` is symmetric, :func:`linearized_balance` is not.  Because spins do not commute,
  they differ by a multiple of the equations ::

    linearized_balance(tau, theta) - second_variation(tau, theta) = 1/2 G(tau x theta),

  and agree at an equilibrium, for admissible ``tau x theta``, and only there;
* the force: the paper perturbs the components of ``n`` in the body frame, here ``dn`` is a vector in the space frame.
  With ``n = R N`` the latter is ``dn = theta x n + R dN``.

In what sense UFL's second derivative agrees (``tests/forms/test_paper.py``):

* Pointwise it does exactly, at any ``q`` and in any state, for directions ``dq = 1/2 theta q``, without the unit norm
  term.  The curve's acceleration, polarised, is ``-1/4 theta1 . theta2 q``: a change of length, to which ``R(q/|q|)``
  and ``k`` are blind.  The unit norm term ``eta/2 (|q|^2 - 1)`` adds ``eta/4 theta1 . theta2`` to the second
  derivative, and by the same blindness ``eta = 0`` at an exact equilibrium.
* On a finite element space lengths change at the nodes, and in between directions change with them: ``eta`` at a
  discrete equilibrium is an error of the discretisation.  ``T^t K T`` with the unit norm term in ``K`` is exactly the
  second derivative of the discrete energy along ``exp(eps theta_i / 2) q_i`` at all nodes i: that term's second
  derivative pays for the acceleration.
* The discrete ``dq`` interpolates ``1/2 theta q`` at the nodes, :func:`second_variation` uses it everywhere.  For
  smooth perturbations, elements of degree d and size h, the difference is O(h^{2d}).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import ufl
from ufl.core.expr import Expr

from rodfem.forms.rotation import product


@dataclass(frozen=True)
class State:
    """Rotation matrix ``R``, strain ``v``, contact force ``n`` and moment ``m`` (space frame), and elastic moduli.

    The moduli are the second derivatives of the stored energy, (3, 3) each: ``W_vv``, ``W_vk`` (rows: v), ``W_kk``.
    ``W_v`` (3,) is the first derivative in ``v``.
    """

    R: Expr
    v: Expr
    n: Expr
    m: Expr
    W_v: Expr
    W_vv: Expr
    W_vk: Expr
    W_kk: Expr


@dataclass(frozen=True)
class Perturbation:
    """Spin ``theta``, its derivative ``theta_s``, ``dv`` (body frame, zero where a rod is stiff), ``dn``, and ``dr_s``.

    All of shape (3,).  ``dr_s`` is the derivative of ``dr``: zero without a centreline (mixed formulation).
    """

    theta: Expr
    theta_s: Expr
    dv: Expr
    dn: Expr
    dr_s: Expr


def tangent(theta: Expr, q: Expr) -> Expr:
    """``dq = 1/2 theta q``, shape (4,)."""
    return product(ufl.as_vector([0, theta[0] / 2, theta[1] / 2, theta[2] / 2]), q)


def state(energy: Callable[[Expr, Expr], Expr], R: Expr, v: Expr, k: Expr, n: Expr) -> State:
    """State of a rod with the stored energy ``energy(v, k)``.

    ``R`` (3, 3) is its rotation, ``v`` (3,) and ``k`` (3,) are its strains, ``n`` (3,) its contact force.
    """
    v, k = ufl.variable(v), ufl.variable(k)
    W = energy(v, k)
    W_v, W_k = ufl.diff(W, v), ufl.diff(W, k)
    return State(R, v, n, ufl.dot(R, W_k), W_v, ufl.diff(W_v, v), ufl.diff(W_v, k), ufl.diff(W_k, k))


def first_variation(x: State, r_s: Expr, a: Perturbation) -> Expr:
    """Integrand of ``G``: weak form of the equilibrium equations, ``r_s`` the derivative of the centreline.

    Kumar & Healey (2010), (11)-(12).
    """
    return (
        ufl.dot(x.W_v, a.dv)
        + ufl.dot(x.m, a.theta_s)
        + ufl.dot(x.n, a.dr_s - ufl.cross(a.theta, ufl.dot(x.R, x.v)) - ufl.dot(x.R, a.dv))
        + ufl.dot(a.dn, r_s - ufl.dot(x.R, x.v))
    )


def second_variation(x: State, a: Perturbation, b: Perturbation) -> Expr:
    """Integrand of the symmetric bilinear form of ``d^2 L``, with moment and force at work on finite rotations.

    The form whose index decides stability; :func:`linearized_balance`, the paper's, agrees with it at equilibria.
    """
    dk_a, dk_b = ufl.dot(x.R.T, a.theta_s), ufl.dot(x.R.T, b.theta_s)
    tangent_v = ufl.dot(x.R, x.v)
    material = (
        ufl.dot(a.dv, ufl.dot(x.W_vv, b.dv))
        + ufl.dot(a.dv, ufl.dot(x.W_vk, dk_b))
        + ufl.dot(b.dv, ufl.dot(x.W_vk, dk_a))
        + ufl.dot(dk_a, ufl.dot(x.W_kk, dk_b))
    )
    moment = -0.5 * ufl.dot(x.m, ufl.cross(a.theta, b.theta_s) + ufl.cross(b.theta, a.theta_s))
    twice = ufl.cross(a.theta, ufl.cross(b.theta, tangent_v)) + ufl.cross(b.theta, ufl.cross(a.theta, tangent_v))
    force = -0.5 * ufl.dot(x.n, twice) - ufl.dot(
        x.n, ufl.cross(a.theta, ufl.dot(x.R, b.dv)) + ufl.cross(b.theta, ufl.dot(x.R, a.dv))
    )
    return material + moment + force + constraints(x, a, b.dn) + constraints(x, b, a.dn)


def constraints(x: State, a: Perturbation, dn: Expr) -> Expr:
    """Linearised kinematics ``dr' - theta x R v - R dv``, times ``dn``."""
    return ufl.dot(dn, a.dr_s - ufl.cross(a.theta, ufl.dot(x.R, x.v)) - ufl.dot(x.R, a.dv))


def linearized_balance(x: State, test: Perturbation, b: Perturbation) -> Expr:
    """Integrand of the weak form ``G`` in fixed test fields, linearised in the direction ``b``: not symmetric.

    Kumar & Healey (2010), (17)-(19), each for one kind of rod, but with ``dn`` as a vector in the space frame.
    """
    dk = ufl.dot(x.R.T, b.theta_s)
    dm = ufl.cross(b.theta, x.m) + ufl.dot(x.R, ufl.dot(x.W_vk.T, b.dv) + ufl.dot(x.W_kk, dk))
    dt = ufl.cross(b.theta, ufl.dot(x.R, x.v)) + ufl.dot(x.R, b.dv)  # change of R v
    return (
        ufl.dot(ufl.dot(x.W_vv, b.dv) + ufl.dot(x.W_vk, dk), test.dv)
        + ufl.dot(dm, test.theta_s)
        - ufl.dot(x.n, ufl.cross(test.theta, dt) + ufl.cross(b.theta, ufl.dot(x.R, test.dv)))
        + constraints(x, test, b.dn)
        + constraints(x, b, test.dn)
    )
