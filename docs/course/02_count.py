# %% [markdown]
# # 2. Stable means minimum: count
#
# *After it you can* say what an index is, and count it without an eigenvalue. *Time:* at the board 15 min idea and
# picture, 20 form, 25 by hand; at the computer 20 min rodfem, 40 exercises.
#
# ## Idea
#
# Push the straight rod gently. If every small variation costs energy, it springs back: the equilibrium is *stable*. If
# one direction lowers the energy, it leaves. Near an equilibrium the first variation vanishes, so that the *second* one
# decides: a quadratic form, positive on all variations or not.
#
# The number of independent directions in which it is negative is the *index*. Stable is index 0. The index changes only
# when an eigenvalue passes through zero. So we need not compute eigenvalues at every load: it is enough to count the
# negative ones, and a count is an integer, which round-off cannot blur except very close to zero.

# %% [markdown]
# ## Picture
#
# The energy of the elastica of lesson 1 over two directions, $\theta = a_1\sin(\pi s/2) + a_2\sin(3\pi s/2)$, at three
# loads; red is more than that of the straight rod, in the middle, and blue is less. It is a minimum, then a saddle,
# then a maximum: index 0, 1, 2.

# %%
import numpy as np

from lesson.pictures import panels, show

EULER = np.pi**2 / 4
x, w = np.polynomial.legendre.leggauss(12)
s = (x + 1) / 2
a1, a2 = np.meshgrid(np.linspace(-1, 1, 81), np.linspace(-1, 1, 81))
shape = a1[..., None] * np.sin(np.pi * s / 2) + a2[..., None] * np.sin(3 * np.pi * s / 2)
slope = a1[..., None] * np.pi / 2 * np.cos(np.pi * s / 2) + a2[..., None] * 3 * np.pi / 2 * np.cos(3 * np.pi * s / 2)
drawn = panels(3, "amplitude $a_1$", "amplitude $a_2$", equal=True)
for ax, load, index in zip(drawn, (0.5, 5.0, 14.0), range(3), strict=True):
    energy = (slope**2 / 2 + load * EULER * (np.cos(shape) - 1)) @ w / 2
    ax.contourf(a1, a2, energy, levels=np.linspace(-abs(energy).max(), abs(energy).max(), 16), cmap="RdBu_r")
    if index == 1:
        ax.contour(a1, a2, energy, levels=[0.0], colors="0.3", linewidths=1)
    ax.plot(0, 0, "k.", ms=9)
    ax.set_title(f"$P = {load:g}\\,\\pi^2/4$: index {index}", fontsize=11)
    ax.grid(False)
show(drawn[0].figure, "02_index")

# %% [markdown]
# ## Form
#
# Differentiate twice along $\theta + \varepsilon\eta$, at the straight rod $\theta = 0$:
#
# $$\delta^2\Pi[\eta] = \int_0^1 \eta'^2 - P\,\eta^2\; ds, \qquad \eta(0) = 0 .$$
#
# Bending resists, the load pushes. The functions $\eta_n = \sin((2n - 1)\pi s/2)$ diagonalise this form, with
# eigenvalues $((2n-1)\pi/2)^2 - P$: as many are negative as there are critical loads $(2n-1)^2\pi^2/4$ below $P$.
#
# In finite elements the form is a symmetric matrix $K$. *Sylvester's law of inertia*: $K = LDL^t$ and $D$ have the same
# number of negative eigenvalues, whatever the triangle $L$. One factorisation counts; no eigenvalue is computed.

# %%
from scipy.linalg import ldl
from ufl import cos, derivative, dx

from lesson.by_hand import angle, assemble, constant, nodes

theta = angle()
P = constant(theta, 0.0)
Pi = (theta.dx(0) ** 2 / 2 + P * cos(theta)) * dx
d2Pi = derivative(derivative(Pi, theta), theta)  # at theta = 0, until we change theta
unknown = nodes(theta) > 0


def index(load):
    P.value = load
    _, D, _ = ldl(assemble(d2Pi)[np.ix_(unknown, unknown)])
    return int((np.linalg.eigvalsh(D) < 0).sum())  # D is diagonal, up to blocks of two


for load in (2.0, 10.0, 30.0, 100.0, 300.0):
    critical = (2 * np.arange(1, 9) - 1) ** 2 * EULER
    print(f"P = {load:5g}: index {index(load)} by factors, {(critical < load).sum()} by hand")
    assert index(load) == (critical < load).sum()

low, high = 0.0, 10.0  # a critical load, by counts only
while high - low > 1e-10:
    middle = (low + high) / 2
    low, high = (middle, high) if index(middle) == 0 else (low, middle)
print(f"the index changes at P = {low:.9f}")

# %% [markdown]
# ## Program
#
# `rodfem.trace` follows the equilibria as the load grows, counts at each of them, and locates the loads at which the
# count changes. There another branch leaves: it is followed too (`depth=1`), and counted. The picture has the index in
# the plane, and in parentheses that in space, where the rod can also bend sideways.

# %%
import rodfem
from rodfem import Ordinate, Parameter, Plan, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"P": Parameter(0.0, words="thrust")},
    load="P",
    ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("tip displacement", s=1.0, of=lambda r, q: abs(r[0])),
    span=(0.0, 30.0),
    planar="e2",
)
diagram = rodfem.trace(column, plan=Plan(depth=1))
print(*diagram.special("branch point"), sep="\n")
show(diagram.plot(), "02_diagram")

# %% [markdown]
# ## Number
#
# Euler (1744): the clamped column is unstable beyond $\pi^2/4$. Each special point has the bound of its error.

# %%
first = diagram.special("branch point")[0]
answer = first.point.load
assert abs(answer - EULER) < 1e-9 and abs(low - EULER) < 1e-6
assert (first.negative_before, first.negative_after) == (0, 1)
print(f"P = {answer:.12f} +- {first.error_estimate:.0e}, exact {EULER:.12f}")

# %% [markdown]
# ## Exercises
#
# **2.1** Pin both ends of the rod (`pinned()`, `pinned(lambda c: (0, 0, None), force)`). Find the critical load by
# counts only: bisect on `Solver(scene).equilibrium(P).index`.
#
# **2.2** A column under its own weight $q$ per length: $\Pi = \int \frac12\theta'^2 + q\,(1-s)\cos\theta\,ds$. Why
# $1-s$? How large may $q$ be? (Greenhill 1881: how tall may a tree grow?)
#
# **2.3** Let the column of this lesson leave its plane: leave out `planar`. What is its index at $P = 100$?

# %% [markdown]
# ## Where it breaks
#
# *At* a critical load the count is not defined: an eigenvalue is zero up to round-off, and its sign is noise. rodfem
# counts such eigenvalues apart, as `zero`, and locates the load from both sides. A coarse mesh has few unknowns and
# cannot have a large index. A count says nothing of how *far* one may push before the rod leaves. And it rests on an
# energy: a load that follows the tip has none, and there a rod of index 0 can flutter (lesson 9).
