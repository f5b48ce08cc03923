# %% [markdown]
# # 3. Constraints change what is stable
#
# *After it you can* judge stability under constraints by counting a saddle matrix. *Time:* at the board 15 min idea and
# picture, 25 form, 20 by hand; at the computer 20 min rodfem, 40 exercises.
#
# ## Idea
#
# Hold the tip of a column on its axis, and it carries more. The energy is the same; there are fewer variations. A
# direction that lowers the energy does no harm if the constraint forbids it. So stability asks: is the second variation
# positive *on the variations that the constraints admit*?
#
# One could eliminate the constraints, and search for a basis of what is left. It is easier to keep them: give each a
# multiplier, take the second derivative of the Lagrangian in all unknowns, count its negative eigenvalues, and subtract
# the number of constraints.

# %% [markdown]
# ## Picture
#
# A rod between clamps, $\theta = a_1\sin\pi s + a_3\sin 3\pi s$, held on the axis at both ends: $\int\theta\,ds = 0$ is
# the line $3a_1 + a_3 = 0$. The quadratic energy is a saddle at both loads (red is positive, blue negative). On the
# line it has a minimum, then a maximum.

# %%
import numpy as np

from lesson.pictures import panels, show

a1, a3 = np.meshgrid(np.linspace(-1, 1, 81), np.linspace(-1, 1, 81))
drawn = panels(2, "amplitude $a_1$", "amplitude $a_3$", equal=True)
for ax, load in zip(drawn, (30.0, 85.0), strict=True):
    energy = ((np.pi**2 - load) * a1**2 + (9 * np.pi**2 - load) * a3**2) / 4
    shade = np.sign(energy) * np.sqrt(abs(energy))  # to see small values, too
    ax.contourf(a1, a3, shade, levels=np.linspace(-abs(shade).max(), abs(shade).max(), 22), cmap="RdBu_r")
    ax.contour(a1, a3, energy, levels=[0.0], colors="0.3", linewidths=1)
    ax.plot([-1 / 3, 1 / 3], [1, -1], "k", lw=2.5)
    ax.plot(0, 0, "k.", ms=11)
    word = "minimum" if load < 8.2 * np.pi**2 else "maximum"
    ax.set_title(f"$P = {load:g}$: {word} on the line", fontsize=11)
    ax.grid(False)
show(drawn[0].figure, "03_line")

# %% [markdown]
# ## Form
#
# Both ends clamped, the right one free to slide along the axis: $\theta(0) = \theta(1) = 0$ and $\int\sin\theta\,ds =
# 0$. With the multiplier $N$, the force of the guide, the Lagrangian is
#
# $$L[\theta, N] = \int_0^1 \tfrac12\theta'^2 + P\cos\theta + N\sin\theta\; ds .$$
#
# Its second derivative in $(\theta, N)$ is the *saddle matrix* $S$, where $c$ is the gradient of the constraint:
#
# $$S = \begin{pmatrix} K & c \\ c^t & 0 \end{pmatrix}, \quad K \sim \int \eta'^2 - P\,\eta^2, \quad c \sim \int\eta .$$
#
# *Index = negative eigenvalues of $S$ less the number of constraints.* Why: write $\eta = \eta_0 + \alpha c$ with
# $\eta_0$ admissible. The pair $(\alpha, N)$ is a block with a zero on its diagonal: one positive and one negative
# eigenvalue, whatever $K$ is. By Sylvester's law the rest is $K$ on the $\eta_0$.

# %%
from ufl import SpatialCoordinate, conditional, cos, derivative, dx, lt, sin

from lesson.by_hand import angle, assemble, constant, nodes

theta = angle()
P = constant(theta, 0.0)
s = SpatialCoordinate(theta.function_space.mesh)[0]
d2Pi = derivative(derivative((theta.dx(0) ** 2 / 2 + P * cos(theta)) * dx, theta), theta)
at_end = assemble(derivative(sin(theta) * dx, theta))  # gradient of the displacement of the end, across
in_middle = assemble(derivative(conditional(lt(s, 0.5), sin(theta), 0 * theta) * dx, theta))  # and of the middle
unknown = (nodes(theta) > 0) & (nodes(theta) < 1)


def index(load, *constraints):
    P.value = load
    K, C = assemble(d2Pi)[np.ix_(unknown, unknown)], np.array([c[unknown] for c in constraints])
    C = C.reshape(-1, len(K))
    S = np.block([[K, C.T], [C, np.zeros((len(C), len(C)))]])
    return int((np.linalg.eigvalsh(S) < 0).sum()) - len(C)


def critical(*constraints, low=1.0, high=150.0):
    while high - low > 1e-9:
        middle = (low + high) / 2
        low, high = (middle, high) if index(middle, *constraints) == 0 else (low, middle)
    return low


print(f"P = 30: index {index(30.0)} without the constraint, {index(30.0, at_end)} with it")
euler, held = critical(at_end), critical(at_end, in_middle)
print(f"critical: {critical():.6f} without, {euler:.6f} with, {held:.6f} with the middle held as well")

# %% [markdown]
# ## Program
#
# In rodfem a constraint is an equation: `at(0.5, ...)` holds the middle on the axis. Multipliers, gradients, and what
# is subtracted from the count follow from it.

# %%
import rodfem
from rodfem import Ordinate, Parameter, Plan, Scene, at, clamped, sliding
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="held in the middle",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (4.0, 1.0, 1.0)),
    parameters={"P": Parameter(20.0, words="thrust")},
    load="P",
    ends=(clamped(), sliding(lambda c: (0.0, 0.0, None), force=lambda c: (0.0, 0.0, -c.P))),
    constraints=(at(0.5, lambda x, c: x.r[0]),),
    ordinate=Ordinate("shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(20.0, 120.0),
    planar="e2",
)
diagram = rodfem.trace(column, plan=Plan(depth=1))
show(diagram.plot(), "03_diagram")

# %% [markdown]
# ## Number
#
# Between clamps Euler's load is $4\pi^2 = 39.4784$. With the middle held each half is clamped and pinned: $\tan w = w$,
# $P = (2w)^2 = 80.7629$ (Timoshenko & Gere, *Theory of Elastic Stability*, chapter 2). One point held, twice the load.

# %%
first = diagram.special("branch point")[0]
answer = first.point.load
w = 4.493409457909064
assert abs(np.tan(w) - w) < 1e-11 and abs(answer - 4 * w**2) < 1e-9
assert abs(euler - 4 * np.pi**2) < 1e-5 and abs(held - 4 * w**2) < 1e-4
print(f"P = {answer:.10f} +- {first.error_estimate:.0e}, exact {4 * w**2:.10f}")

# %% [markdown]
# ## Exercises
#
# **3.1** Clamp the left end only, and hold the right one on the axis, free to turn. What is natural? What is the
# critical load?
#
# **3.2** Pin both ends, and hold the middle. How does the load compare with $\pi^2$, and why?
#
# **3.3** A testing machine prescribes the *distance* $d$ of two clamps. The rod resists stretch: its energy is
# $500\,(v_3 - 1)^2$ besides that of bending, and it is `"unshearable"`. At which $d < 1$ does it buckle? (The thrust is
# the multiplier of the distance. Where does $d$ enter besides?)

# %% [markdown]
# ## Where it breaks
#
# Two constraints that say the same make $S$ singular: the gradients must be independent. A constraint can remove at
# most one direction, so the index with it is the one without, or one less: holding a rod never makes it less stable.
# But the *equilibrium* must be the same; held elsewhere the rod is bent, and another story begins. And the answer
# depends on how the load is applied: under a dead load and in a rigid machine the same shape may be unstable and stable
# (lesson 4).
