# %% [markdown]
# # 1. Equilibrium is a stationary point
#
# *After it you can* derive equilibrium, natural boundary conditions included, from an energy, and solve it by elements.
# *Time:* at the board 15 min idea and picture, 25 form, 20 by hand; at the computer 20 min rodfem, 40 exercises.
#
# ## Idea
#
# A loaded rod could take any shape. It takes one at which its energy does not change, to first order, whichever way the
# shape is varied a little. This one sentence contains the differential equation and the boundary conditions. Nothing
# else has to be derived.
#
# Our rod is an *elastica*: of length 1, inextensible, in a plane, clamped at $s = 0$. Its shape is the angle
# $\theta(s)$ between tangent and axis, $r' = (\sin\theta, \cos\theta)$. Bending costs $\frac12\theta'^2$ per length
# (the stiffness is 1). A dead load $P$ pushes the tip down the axis; its potential is $P$ times the height of the tip,
# $\int_0^1 \cos\theta\,ds$:
#
# $$\Pi[\theta] = \int_0^1 \tfrac12\,\theta'^2 + P\cos\theta \; ds, \qquad \theta(0) = 0.$$

# %% [markdown]
# ## Picture
#
# A glimpse of $\Pi$ along one path through the space of shapes: $\theta = a\sin(\pi s/2)$, for two loads. Where the
# curve is flat there may be an equilibrium; we cannot be sure, since one path does not show all variations.

# %%
import numpy as np

from lesson.pictures import axes, show

EULER = np.pi**2 / 4  # the load at which lesson 2 finds the straight rod unstable
x, w = np.polynomial.legendre.leggauss(20)
a = np.linspace(-2.6, 2.6, 201)
bend = a[:, None] * np.sin(np.pi * (x + 1) / 4)  # theta at the Gauss points of (0, 1)
ax = axes("amplitude $a$ of the shape", r"energy $\Pi(a) - \Pi(0)$")
for load in (0.8, 1.5):
    energy = (a * np.pi / 4) ** 2 + load * EULER * (np.cos(bend) - 1) @ w / 2
    ax.plot(a, energy, lw=2, label=f"$P = {load}\\,\\pi^2/4$")
ax.legend(frameon=False)
show(ax.figure, "01_energy")

# %% [markdown]
# ## Form
#
# Vary $\theta$ by $\varepsilon\eta$, where $\eta(0) = 0$ as the clamp holds, and differentiate at $\varepsilon = 0$.
# The *first variation* must vanish for every $\eta$: this is the weak form.
#
# $$\delta\Pi = \int_0^1 \theta'\eta' - P\sin\theta\;\eta\; ds = 0 .$$
#
# Integration by parts gives $\theta'' + P\sin\theta = 0$, and at the free tip $\theta'(1) = 0$: no moment acts there.
# That condition is called *natural*, since nobody had to impose it. UFL differentiates for us; a second derivative is
# the matrix of Newton's method.

# %%
from ufl import cos, derivative, dx, sin

from lesson.by_hand import angle, assemble, constant, nodes

theta = angle()  # piecewise polynomial on (0, 1)
P = constant(theta, 1.5 * EULER)
Pi = (theta.dx(0) ** 2 / 2 + P * cos(theta)) * dx
dPi = derivative(Pi, theta)  # the weak form, for all test functions
d2Pi = derivative(dPi, theta)

s = nodes(theta)
unknown = s > 0  # the clamp holds theta(0)
theta.x.array[:] = 1.6 * np.sin(np.pi * s / 2)  # the picture's best guess
for step in range(8):
    residual, tangent = assemble(dPi)[unknown], assemble(d2Pi)[np.ix_(unknown, unknown)]
    theta.x.array[unknown] -= np.linalg.solve(tangent, residual)
    print(f"Newton step {step}: residual {abs(residual).max():.1e}")
along, across = assemble(cos(theta) * dx), assemble(sin(theta) * dx)  # the tip is the integral of r'
print(f"tip at ({along:.10f}, {across:.10f})")

# %% [markdown]
# ## Program
#
# The same rod in rodfem. A `Scene` is a statement: energy, ends, load, and the number that we watch. In a plane
# `planar="e2"` the curvature `k[1]` is $\theta'$. `Solver` finds one equilibrium, from a start near the one we want.

# %%
from rodfem import Discretization, Ordinate, Parameter, Scene, Solver, clamped, free
from rodfem.forms.energy import bending_and_twist


def bent(s):  # quaternions of the rotation by theta(s) about e2
    half = 0.8 * np.sin(np.pi * s / 2)
    return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)


elastica = Scene(
    name="elastica",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"P": Parameter(1.5 * EULER)},
    load="P",
    ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("tip, across", s=1.0, of=lambda r, q: r[0]),
    span=(1.5 * EULER, 2 * EULER),
    planar="e2",
    start=bent,
)
point = Solver(elastica, Discretization(elements=8, degree=6)).equilibrium(1.5 * EULER)
print(point)

# %% [markdown]
# ## Number
#
# Euler knew the answer in elliptic integrals. With $m = \sin^2(\theta(1)/2)$ the load is $K(m)^2$, and the tip is at
# $(2E/K - 1,\; 2\sqrt{m}/K)$ (Love, *Mathematical Theory of Elasticity*, §263). At $P = 1.5\,\pi^2/4$ it is at
# (0.3635882249, 0.7885758057): the tip has moved sideways by more than three quarters of the length.

# %%
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

m = brentq(lambda m: ellipk(m) ** 2 - 1.5 * EULER, 0.1, 0.9, xtol=1e-15)
exact = 2 * ellipe(m) / ellipk(m) - 1, 2 * np.sqrt(m) / ellipk(m)
answer = point.ordinate
assert abs(along - exact[0]) < 1e-9 and abs(across - exact[1]) < 1e-9  # by hand
assert abs(answer - 0.7885758057) < 1e-10  # rodfem
print(f"across: {answer:.10f} (exact {exact[1]:.10f})")

# %% [markdown]
# ## Exercises
#
# **1.1** Replace the load by a moment $M = \pi/2$ at the tip. What is its potential, and what is natural now? Where is
# the tip, across the axis? (`End(moment=...)`; a moment has a potential in the plane, but not in space: lesson 9.)
#
# **1.2** A dead force $F = 1$ at the tip, across the axis. By how much does the tip go across? (Linear theory: 1/3.)
#
# **1.3** Remove the clamp, and hold the angle by a spring of stiffness 4 instead: add $\frac12\,4\,\theta(0)^2$ to the
# energy, in UFL by `ds`. Which load is now the smallest with a bent equilibrium? Guess from the natural condition.
#
# `python docs/course/check.py 1.2 mine.py` runs your program and judges the number that it assigns to `answer`.

# %% [markdown]
# ## Where it breaks
#
# Start Newton's method from $\theta = 0$: it stays there. The straight rod is an equilibrium too, at any load; "not
# changing to first order" does not say whether the energy is least. From a wild guess Newton finds yet other shapes, or
# none. Which of them does one see in the laboratory? That is decided by the second variation.
