# %% [markdown]
# # 11. A strongest column
#
# *After it you can* say what a critical load depends on, and where; and shape a column that carries a third more.
# *Time:* at the board 20 min idea and picture, 25 form, 15 by hand; at the computer 25 min rodfem, 35 exercises.
#
# ## Idea
#
# A load at which a rod buckles is a minimum over all modes: of energy per work. If the rod is changed a little, its
# mode changes, too, but at a minimum that does not matter to first order. So the derivative of a critical load costs
# nothing: insert the old mode into the changed energy.
#
# A column of a given volume may be thick in one place and thin in another. If moving a little material from one place
# to another raises the load, move it. At the strongest column that pays nowhere: the derivative is the same all along.

# %% [markdown]
# ## Picture
#
# Similar cross-sections of an area $A(s)$ have the stiffness $A^2$. For the uniform column, clamped below and free
# above, the mode of the angle is $\phi = \sin(\pi s/2)$; material pays at the foot, and nothing at the tip.

# %%
import numpy as np

from lesson.pictures import axes, show

s = np.linspace(0, 1, 201)
ax = axes("arclength $s$", "$dP/dA$ of the uniform column")
ax.plot(s, np.pi**2 * np.cos(np.pi * s / 2) ** 2)
ax.axhline(np.pi**2 / 2, color="0.65", lw=2)
show(ax.figure, "11_density")

# %% [markdown]
# ## Form
#
# The second variation at the straight rod vanishes first at the least value of a quotient (Rayleigh's):
#
# $$P = \min_\phi \frac{\int_0^1 A^2\phi'^2\,ds}{\int_0^1\phi^2\,ds}, \qquad
# \frac{dP}{dA}(s) = \frac{2A\phi'^2}{\int\phi^2\,ds}.$$
#
# The volume is $\int A\,ds = 1$. The strongest column has $A\phi'^2 = c$. With the moment $M = A^2\phi'$ this is
# $A^3 = M^2/c$: thick where the moment is large. Solve for the mode, take the area from its moment, and again.

# %%
from ufl import derivative, dx

from lesson.by_hand import angle, assemble, nodes

phi = angle(elements=400, degree=1)
area = phi.copy()
order = np.argsort(nodes(phi))
at = nodes(phi)[order]
bending = derivative(derivative(area**2 * phi.dx(0) ** 2 / 2 * dx, phi), phi)
mass = assemble(derivative(derivative(phi**2 / 2 * dx, phi), phi))


def integral(f):  # from the foot to each node
    return np.append(0.0, np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(at)))


def buckled(A):  # load and angle of the first mode of a column
    area.x.array[order] = A
    held = order[1:]  # all nodes but the foot
    K, B = (matrix[np.ix_(held, held)] for matrix in (assemble(bending), mass))
    root = np.linalg.inv(np.linalg.cholesky(B))
    values, vectors = np.linalg.eigh(root @ K @ root.T)
    return values[0], np.append(0.0, root.T @ vectors[:, 0])


A = np.ones(len(at))
for _ in range(12):
    by_hand, mode = buckled(A)
    moment = integral(mode)[-1] - integral(mode)  # of the thrust about each place, over P
    A = abs(moment) ** (2 / 3)
    A /= integral(A)[-1]
print(f"by hand P = {by_hand:.5f}, the uniform column {buckled(np.ones(len(at)))[0]:.5f}")

# %% [markdown]
# ## Program
#
# `special.derivative` is that derivative at any special point of any rod, `along_the_rod` its density, and
# `rodfem.design` changes a field until no change pays. Here the area has nine values with lines in between.

# %%
import rodfem
from rodfem import Field, Ordinate, Parameter, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="tapered column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, c.A**2, 1.0)),
    parameters={"P": Parameter(0.5, words="thrust"), "A": Parameter(1.0, words="area")},
    load="P",
    ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("tip displacement", s=1.0, of=lambda r, q: r[0]),
    span=(0.5, 25.0),
    planar="e2",
)
uniform = rodfem.trace(column, depth=0).special("branch point")[0]
found = uniform.derivative("A", along_the_rod=True)
best = rodfem.design(column, {"A": Field(9, bounds=(0.05, 3.0), mean=1.0)})
ax = axes("arclength $s$", "area $A$ of the strongest column")
ax.plot(at, A, color="0.65", lw=2, label="by hand")
ax.plot(s, best.along("A", s), label="rodfem, nine values")
ax.legend(frameon=False)
show(ax.figure, "11_strongest")
print(uniform, found, best, sep="\n")

# %% [markdown]
# ## Number
#
# $P = \pi^2/3$, a third more than the $\pi^2/4$ of the uniform column (Keller 1960: $4\pi^2/3$ between pins). The area
# falls to zero at the tip, as $(1 - s)^{2/3}$, where the nine values are a little short of it.

# %%
answer = by_hand
assert abs(answer - np.pi**2 / 3) < 1e-3 and 0.99 < best.load / (np.pi**2 / 3) < 1
assert abs(found.value - np.pi**2 / 2) <= found.error + 1e-9
print(f"by hand {by_hand:.5f}, nine values {best.load:.5f}, exact {np.pi**2 / 3:.5f}")

# %% [markdown]
# ## Exercises
#
# **11.1** Where does a ring around the uniform column help most, and what is $dP/dA$ there, per length?
#
# **11.2** Only straight tapers can be turned: $A = 1 + t(1 - 2s)$. Which critical load has the best of them?

# %% [markdown]
# ## Where it breaks
#
# Between clamps the column that is best against its first mode alone is weak against the second: the strongest one has
# two modes at once, at 52.3563 (Olhoff & Rasmussen 1977), which was overlooked for fifteen years. At a double load the
# derivative is a matrix (`splitting`), and the best rod is at a kink. Real columns do not end in a point: tips yield.
