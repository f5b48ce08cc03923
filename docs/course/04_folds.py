# %% [markdown]
# # 4. Loads that go back: folds
#
# *After it you can* follow a curve of equilibria around a fold, and say what a dead load and a machine see there.
# *Time:* at the board 15 min idea and picture, 20 form, 25 by hand; at the computer 20 min rodfem, 40 exercises.
#
# ## Idea
#
# Press on an arch. It yields, and at some load it jumps. Up to there a stable equilibrium went along with the load;
# there it meets an unstable one, both disappear, and beyond there is nothing nearby. The load has a maximum along the
# curve of equilibria: a *fold*. There the load is the wrong coordinate; the curve is smooth in its arclength.

# %% [markdown]
# ## Picture
#
# One degree of freedom will do: the energy $\frac14(x^2-1)^2 - px$ of a shallow truss with its apex at $x$. As $p$
# grows, valley (black) and hill (white) approach, merge at $p = 2/\sqrt{27}$, and are gone. The apex jumps.

# %%
import numpy as np

from lesson.pictures import axes, equilibria, shapes, show

ax = axes("place $x$ of the apex", "energy, each load shifted")
for shift, p in enumerate((0.0, 0.2, 2 / np.sqrt(27), 0.6)):
    energy = np.poly1d([0.25, 0, -0.5, -p, 0.25 - 0.7 * shift])
    ax.plot(x := np.linspace(-1.55, 1.65, 200), energy(x), lw=2, label=f"$p = {p:.3f}$")
    for root in energy.deriv().roots:
        if abs(root.imag) < 1e-6:
            ax.plot(root.real, energy(root.real), "ko", mfc="k" if energy.deriv(2)(root.real) > 1e-6 else "w", ms=7)
ax.legend(frameon=False)
ax.set_yticks([])
show(ax.figure, "04_truss")

# %% [markdown]
# ## Form
#
# A circular arch of radius 1 and 215°, clamped on the left and pinned on the right, with a dead load $P$ at its crown.
# Its natural curvature is 1. The multipliers $N_1, N_3$ hold the right foot:
#
# $$L = \int\tfrac12(\theta' - 1)^2 + N_1\sin\theta + N_3\cos\theta\,ds - P\int_{s<0}\sin\theta\,ds - 2N_3\sin 107.5°.$$
#
# Equilibria solve $F(y) = 0$ with $y = (\theta, N_1, N_3, P)$: one equation less than unknowns, a curve. Its tangent
# $t$ spans the null space of $F'$. *Pseudo-arclength continuation*: predict along $t$, correct by Newton's method on
# the plane across $t$. The matrix of $F'$ with the row $t^t$ below is regular even at a fold.

# %%
from ufl import SpatialCoordinate, conditional, cos, derivative, dx, lt, sin

from lesson.by_hand import angle, assemble, constant, nodes

HALF = np.radians(107.5)
FOOT, DEPTH = np.sin(HALF), 1 - np.cos(HALF)
theta = angle(-HALF, HALF)
N1, N3, P = (constant(theta, 0.0) for _ in range(3))
s = SpatialCoordinate(theta.function_space.mesh)[0]
across, along, crown = sin(theta) * dx, cos(theta) * dx, conditional(lt(s, 0.0), sin(theta), 0 * theta) * dx
dL = derivative((theta.dx(0) - 1) ** 2 / 2 * dx + N1 * across + N3 * along - P * crown, theta)
d2L = derivative(dL, theta)
gradients = [derivative(form, theta) for form in (across, along, crown)]
unknown = nodes(theta) > -HALF + 1e-9
theta.x.array[:] = nodes(theta)  # the arch as it is made


def equations(y):  # F(y) and F'(y)
    theta.x.array[unknown], (N1.value, N3.value, P.value) = y[:-3], y[-3:]
    c1, c3, load = (assemble(form)[unknown] for form in gradients)
    F = np.concatenate([assemble(dL)[unknown], [assemble(across), assemble(along) - 2 * FOOT]])
    K, C = assemble(d2L)[np.ix_(unknown, unknown)], np.vstack([c1, c3])
    return F, np.block([[K, C.T, -load[:, None]], [C, np.zeros((2, 3))]])


def tangent(dF, before):  # unit vector of the null space of F', on the side of the one before
    t = np.linalg.solve(np.vstack([dF, before]), np.eye(len(before))[-1])
    return t / np.linalg.norm(t)


y = np.append(theta.x.array[unknown], [0.0, 0.0, 0.0])
t, step = np.eye(len(y))[-1], 0.5
while step > 1e-4:
    t = tangent(equations(y)[1], t)
    new = y + step * t
    for _ in range(4):
        F, dF = equations(new)
        new -= np.linalg.solve(np.vstack([dF, t]), np.append(F, 0.0))
    y, step = (new, step) if tangent(dF, t)[-1] > 0 else (y, step / 2)  # shorter steps once the load goes back
fold = y[-1]
mu, modes = np.linalg.eigh(equations(y)[1][:, :-1])  # the saddle matrix of lesson 3, with two constraints
work = modes[:, abs(mu).argmin()] @ equations(y)[1][:, -1]  # null vector . F_P
print(f"P = {fold:.6f}: index {(mu < -1e-3).sum() - 2}, eigenvalue {min(abs(mu)):.0e}, work {work:.2f}")

# %% [markdown]
# At a fold the null vector does work with the load: $\phi\cdot F_P \ne 0$. Otherwise it is a branch point: lesson 5.
#
# ## Program
#
# In rodfem the same arch is a wide strip, stiff across its plane, and the load an `Attachment`. A *machine* prescribes
# the displacement $w$ of the crown instead. That is a constraint: lesson 3 says what to expect.

# %%
import rodfem
from rodfem import Attachment, Discretization, Ordinate, Plan, Scene, Solver, at, clamped, pinned
from rodfem.forms.energy import bending_and_twist

TURNED = (np.cos(HALF / 2), 0.0, -np.sin(HALF / 2), 0.0)  # quaternion of the left tangent
arch = {
    "interval": (-HALF, HALF),
    "rod": "unshearable and inextensible",
    "energy": lambda v, k, c: bending_and_twist((k[0], k[1] - 1, k[2]), (50.0, 1.0, 50.0)),
    "ends": (clamped(lambda c: (DEPTH, 0.0, -FOOT), TURNED), pinned(lambda c: (DEPTH, 0.0, FOOT))),
    "ordinate": Ordinate("displacement of the crown", s=0.0, of=lambda r, q: r[0]),
    "planar": "e2",
    "start": lambda s: np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1),
    "states": "arch",
}
push, hold = Attachment(0.0, force=lambda c: (c.P, 0.0, 0.0)), at(0.0, lambda x, c: x.r[0] - c.w)
dead = Scene(name="dead load", parameters={"P": 0.0}, load="P", span=(0.0, 12.0), attachments=(push,), **arch)
machine = Scene(name="machine", parameters={"w": 0.0}, load="w", span=(0.0, 1.5), constraints=(hold,), **arch)

mesh = Discretization(elements=8, degree=8)
diagram = rodfem.trace(dead, mesh, Plan(depth=0))
solver, held = Solver(machine, mesh), None
for w in np.linspace(0.0, 1.18, 13):
    held = solver.equilibrium(w, guess=held)
pushed = next(p for p in diagram["arch"].points if p.ordinate > 1.18)
ax = equilibria({"": diagram}, "dead load $P$", "displacement of the crown")
first = diagram.special("fold")[0]
shapes(ax, diagram, {"as made": diagram[0].points[0], "at the fold": first.point, "beyond it": pushed})
show(ax.figure, "04_arch")
print(f"the crown at 1.18: index {pushed.index} under the dead load, {held.index} in the machine")

# %% [markdown]
# ## Number
#
# DaDeppo and Schmidt (J. Appl. Mech. 42, 1975) found $P = 8.97$; to more digits it is 8.973089969728.

# %%
answer = first.point.load
assert abs(answer - 8.973089969728) < 1e-8 and abs(fold - answer) < 2e-4 and (pushed.index, held.index) == (1, 0)
print(f"P = {answer:.9f} +- {first.error_estimate:.0e}, index {first.negative_before} -> {first.negative_after}")

# %% [markdown]
# ## Exercises
#
# **4.1** At which $p$ does the truss of the picture snap? (By hand. Then: what is its index on either side?)
#
# **4.2** The machine moves the crown slowly down. At which $w$ does the arch jump nevertheless?

# %% [markdown]
# ## Where it breaks
#
# A step too long jumps to another curve. A fold gives no warning from afar: the index is 0 up to the last moment. And a
# symmetric arch may leave by a branch point before it reaches its fold (lesson 5).
