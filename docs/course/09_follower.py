# %% [markdown]
# # 9. Pushed along its own tip
#
# *After it you can* tell flutter from divergence, and say why no energy decides. *Time:* at the board 15 min idea and
# picture, 25 form, 20 by hand; at the computer 20 min rodfem, 40 exercises.
#
# ## Idea
#
# A dead force has a potential. A force that *turns with the rod*, the thrust of a rocket or the recoil of a jet of
# water, has none: move the tip aside, turn it, move it back, turn it back, and work has been gained. There is no energy
# to be minimal, no index to count. Equilibrium is now the principle of virtual work, stability a matter of motion:
#
# $$\delta E[q; \eta] + P\,f(q; \eta) = 0 \text{ for all } \eta, \qquad S x = \mu M x, \qquad \mu = \omega^2 .$$
#
# The tangent $S$ is not symmetric. While all $\mu$ are real and positive the rod vibrates. Stability is lost in one of
# two ways: a real $\mu$ passes through zero (*divergence*, the old buckling), or two of them meet and become a complex
# pair (*flutter*: oscillations that grow, fed by the load). A symmetric $S$ cannot flutter.

# %% [markdown]
# ## Picture
#
# Ziegler's double pendulum (1952), the smallest rod that flutters: two stiff links, springs in two hinges, masses 2 and
# 1, all constants 1, and a thrust $P$ along the last link. Its two values $\mu$ obey $2\mu^2 + (2P - 7)\mu + 1 = 0$.

# %%
import numpy as np
from scipy.linalg import eigvals

from lesson.pictures import axes, show


def ziegler(P):
    """Values mu of the double pendulum; the thrust enters the first row only."""
    stiffness, thrust, mass = np.array([[2, -1], [-1, 1]]), np.array([[-1, 1], [0, 0]]), np.array([[3, 1], [1, 1]])
    return np.sort_complex(eigvals(stiffness + P * thrust, mass))


loads = np.linspace(0, 3.5, 400)
mu = np.array([ziegler(P) for P in loads])
ax = axes("thrust $P$", r"$\mu = \omega^2$")
ax.plot(np.r_[loads, loads[::-1]], np.r_[mu.real[:, 1], mu.real[::-1, 0]], lw=2, label="real part")
ax.plot(loads, abs(mu.imag[:, 0]), "--", lw=2, label="imaginary part, of one of the pair")
ax.legend(frameon=False)
show(ax.figure, "09_ziegler")

# %% [markdown]
# ## Form
#
# Beck's column (1952): a straight cantilever, a thrust $P$ along its tip. Let $\theta$ be its small slope and $w$ its
# displacement, $w' = \theta$ with the multiplier $n$, the shear force. The load has an axial part, which works as a
# dead load does, and a transverse one, $-P\theta(1)$, which follows the tip: its virtual work is
# $-P\theta(1)\,\delta w(1)$.

# %%
from ufl import TestFunction, TrialFunction, derivative, ds, dx

from lesson.by_hand import assemble, fields

u, at = fields(3)
theta, w, n = u[0], u[1], u[2]
trial, test = TrialFunction(u.function_space), TestFunction(u.function_space)
E = (theta.dx(0) ** 2 / 2 + n * (w.dx(0) - theta)) * dx
free = np.delete(np.arange(at.size), at[:2, 0])  # the clamp holds theta(0) and w(0)
forms = derivative(derivative(E, u), u), -trial[0] * test[0] * dx, trial[0] * test[1] * ds, trial[1] * test[1] * dx
K, axial, follower, mass = (assemble(form)[np.ix_(free, free)] for form in forms)  # ds: w is held at the clamp
assert np.allclose(axial, axial.T) and not np.allclose(follower, follower.T)  # one has a potential, the other not


def beck(P):
    """The two smallest values mu; those of slope and force, which have no mass, are infinite."""
    values = eigvals(K + P * (axial + follower), mass)
    return np.sort_complex(values[abs(values) < 1e5])[:2]


print(beck(10.0), beck(20.0), beck(20.1), sep="\n")

# %% [markdown]
# ## Program
# `follower` gives the components along the directors. Stability needs a mass. The second stiffness keeps the motion of
# interest in one plane. rodfem sweeps the load, follows the frequencies and locates their collision.

# %%
from math import hypot

import rodfem
from rodfem import Inertia, Ordinate, Parameter, Scene, clamped
from rodfem import free as free_end
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="Beck's column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, 10.0, 1.0)),
    parameters={"P": Parameter(0.0, words="follower force")},
    load="P",
    ends=(clamped(), free_end(follower=lambda c: (0.0, 0.0, -c.P))),
    inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.0)),
    ordinate=Ordinate("displacement of the tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
    span=(0.0, 25.0),
)
diagram = rodfem.trace(column)
show(diagram.plot(), "09_beck")
(flutter,) = diagram.special("flutter")
print(flutter, "where omega^2 =", flutter.omega2)
for P in (10.0, 22.0):
    print(P, diagram.at(P)[0], diagram.assess(diagram.at(P)[0], number=2))

# %% [markdown]
# ## Number
#
# Separate variables in $w'''' + P w'' = \mu w$. With $\omega^2 = \mu$,
# $\alpha^2, \beta^2 = \sqrt{P^2/4 + \omega^2} \mp P/2$ the frequencies are the zeros of $g$ below, and they collide
# where $\partial g/\partial\omega = 0$ too: at $P = 20.0509536$ (Beck 1952), more than eight times Euler's $\pi^2/4$.
# Ziegler's pendulum flutters from $P = 7/2 - \sqrt 2$ on.

# %%
from scipy.optimize import fsolve


def g(omega, P):
    a, b = (np.sqrt(np.sqrt(P * P / 4 + omega * omega) + sign * P / 2) for sign in (-1, 1))
    return P * P + 2 * omega**2 * (1 + np.cosh(a) * np.cos(b)) + P * omega * np.sinh(a) * np.sin(b)


h = 1e-20  # derivative by a complex step
omega, exact = fsolve(lambda x: [g(*x).real, g(x[0] + 1j * h, x[1]).imag / h], [11.0, 20.0], xtol=1e-12)
answer = flutter.point.load
assert abs(answer - exact) < 1e-8 and abs(answer - 20.05095361897) < 1e-8 and abs(flutter.omega2 - omega**2) < 1e-6
for values, critical in ((ziegler, 3.5 - np.sqrt(2)), (beck, 20.051)):  # by hand
    assert np.isreal(values(critical - 1e-3)).all() and not np.isreal(values(critical + 1e-3)).any()
print(f"P = {answer:.10f} (exact {exact:.10f})")

# %% [markdown]
# ## Exercises
#
# **9.1** Give both hinges of Ziegler's pendulum a little damping, $b\,(2, -1; -1, 1)$ with $b \to 0$. At which $P$ does
# it lose stability? (Write $\ddot x = \dots$ as a system of first order.) The limit is not the value without damping.
#
# **9.2** Only 0.3 of the thrust follows the tip, the other 0.7 is dead. How is stability lost, and at which $P$?
#
# **9.3** A tangential thrust is spread uniformly along the column (Leipholz): `Scene(follower=...)`. When is there
# flutter?

# %% [markdown]
# ## Where it breaks
#
# Exercise 9.1 is a warning: arbitrarily small damping changes the flutter load by almost a third. The load also depends
# on masses and rotary inertia, as no buckling load does. What the oscillation grows to is beyond a linearisation, and
# beyond rodfem. And there is a debate whether columns are ever loaded that way (Koiter 1996; Elishakoff 2005): ask what
# makes your force turn.
