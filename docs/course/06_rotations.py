# %% [markdown]
# # 6. Big rotations in space
#
# *After it you can* work with quaternions past full turns, and explain why angles fail. *Time:* at the board 20 min
# idea and picture, 25 form, 15 by hand; at the computer 20 min rodfem, 40 exercises.
#
# ## Idea
#
# A small rotation is a vector. A big one is not: turns about different axes do not commute, and a full turn changes
# nothing. Any three numbers for all rotations fail somewhere: angles have a pole, a rotation vector is ambiguous from
# length $2\pi$ on. Four numbers do not fail. The unit quaternion
#
# $$q = (\cos\tfrac{\varphi}{2},\; e\,\sin\tfrac{\varphi}{2}), \qquad |q| = 1,$$
#
# is a point of a sphere and stands for the turn by $\varphi$ about the unit vector $e$. As $\varphi$ grows it moves on
# along a great circle, and $\varphi = 2\pi$ is nothing special. The price is a constraint, $|q| = 1$.
#
# The rod has directors $d_i(s) = R(q(s))\,e_i$. Its strains are the components *in the body* of how the position and
# the directors change along it: shear, shear, stretch and bending, bending, twist,
#
# $$v_i = r'\cdot d_i, \qquad d_i' = k\times d_i, \qquad k = 2\,\mathrm{vec}(\bar q\,q')/|q|^2.$$
#
# Our rod is an inextensible shaft ($r' = d_3$) between clamps, one of which is turned by $\varphi$ about the axis, and
# may slide along it. How far can one twist it before it buckles?

# %% [markdown]
# ## Picture
#
# The quaternion of the turned end. After one turn it is $-1$, after two it is $1$: all of these are the same clamp.

# %%
from math import pi

import numpy as np

from lesson.pictures import axes, show

phi = np.linspace(0, 4 * pi, 200)
ax = axes(r"turns of the end, $\varphi/2\pi$", "quaternion of the end")
ax.plot(phi / (2 * pi), np.transpose([np.cos(phi / 2), np.sin(phi / 2)]), lw=2, label=["$q_0$", "$q_3$"])
ax.legend(frameon=False)
show(ax.figure, "06_quaternion")

# %% [markdown]
# ## Form
#
# The energy needs nothing but $k$. That the end stays on the axis is two integrals,
# $\int d_3\cdot e_1 = \int d_3\cdot e_2 = 0$. An observer who turns by $p$ sees $p\,q$ in place of $q$. The energy is
# the same for both, and so is its discretisation: strains are computed from $q$ itself; no increments are added up.
#
# A neighbour of $q$ on the sphere is $q + \delta q$ with $\delta q = \frac12\theta q$: the *spin* $\theta$ is a vector,
# as small rotations are. At the twisted shaft no constraint carries a force, so that the second variation of $E$ alone
# is counted, on those spins that keep the end on the axis.

# %%
from scipy.linalg import eigvalsh, null_space
from ufl import as_vector, cos, derivative, dot, dx, sin

from lesson.by_hand import arclengths, assemble, fields, spins
from rodfem.forms.energy import bending_and_twist
from rodfem.forms.rotation import conjugate, product, rotation, vector_part


def energy(q):
    k = 2 * vector_part(product(conjugate(q), q.dx(0))) / dot(q, q)
    return bending_and_twist(k, (1.0, 1.0, 1.0)) * dx


q, at = fields(4)  # four fields, and where their nodal values are: (4, n)
s = arclengths()
q.x.array[at] = np.cos(2 * s), 0.3 * s, 0.2 * s**2, np.sin(3 * s)  # any rod
seen = assemble(energy(product(as_vector([0.1, 0.7, -0.5, 0.5]), q)))
assert abs(seen - assemble(energy(q))) < 1e-12 * seen


def index(phi):
    """Negative eigenvalues of the second variation of the straight shaft, twisted by phi."""
    q.x.array[at] = np.cos(phi * s / 2), 0 * s, 0 * s, np.sin(phi * s / 2)
    K = assemble(derivative(derivative(energy(q), q), q))
    off_axis = np.array([assemble(derivative(rotation(q)[i, 2] * dx, q)) for i in (0, 1)])
    T = spins(q, at)  # from spins at the nodes to changes of their quaternions; the ends are held
    T = T @ null_space(off_axis @ T)
    return int((eigvalsh(T.T @ K @ T) < 0).sum())


print(by_hand := {turns: index(2 * pi * turns) for turns in (0.5, 1.0, 1.43, 1.431)})  # index by turns

# %% [markdown]
# ## Program
#
# The load is the angle, and the clamp a function of it.

# %%
import rodfem
from rodfem import Ordinate, Parameter, Plan, Scene, Solver, clamped, sliding

shaft = Scene(
    name="shaft",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.0, c.C)),
    parameters={"phi": Parameter(0.0, r"\varphi"), "C": Parameter(1.0)},
    load="phi",
    ends=(clamped(), sliding(lambda c: (0.0, 0.0, None), lambda c: (cos(c.phi / 2), 0.0, 0.0, sin(c.phi / 2)))),
    ordinate=Ordinate("end shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(0.0, 13.0),
)
diagram = rodfem.trace(shaft, plan=Plan(depth=0))
(critical,) = diagram.special("branch point")
print(critical)

# %% [markdown]
# ## Number
#
# Write $\theta_1 + i\theta_2$ for the spin across the axis. Under the moment $M = C\varphi$ it obeys
# $\theta'' - iM\theta' = \mathrm{const}$, vanishes at both clamps, and has mean zero. Such a $\theta$ exists where
# $\tan(M/2) = M/2$: Greenhill's shaft between clamps (1883) buckles at $M = 8.98681891582$, here after 1.43 turns. Two
# eigenvalues pass zero, as no direction is preferred.

# %%
from scipy.optimize import brentq

exact = 2 * brentq(lambda x: np.sin(x) - x * np.cos(x), pi, 1.5 * pi, xtol=1e-15)
answer = critical.point.load  # M = C phi with C = 1
assert abs(answer - exact) < 1e-9 and abs(answer - 8.98681891582) < 1e-9
assert by_hand == {0.5: 0, 1.0: 0, 1.43: 0, 1.431: 2} and (critical.negative_before, critical.negative_after) == (0, 2)
print(f"M = {answer:.10f} (exact {exact:.10f})")

# %% [markdown]
# ## Exercises
#
# **6.1** A shaft that resists twist more, $C = 2$. By which angle can it be turned? Which quantity is as before?
#
# **6.2** A tension 10 pulls at the sliding end (`force=`). At which angle does the shaft buckle now ($C = 1$)?
#
# **6.3** A benchmark (Bathe & Bolourchi 1979): a clamped arc of 45 degrees and radius 100, section $1\times 1$,
# $E = 10^7$, $GJ = EI$, $GA = 5\cdot 10^6$. A force 600 acts across its plane. How far does the tip move along it?

# %% [markdown]
# ## Where it breaks
#
# The clamp is the same for $\varphi$ and $\varphi + 2\pi$. An angle of the end does not name a state; only a path does.
# Asked for the equilibrium at $2\pi$, starting anew, `Solver` rightly finds the rod that is not twisted at all:

# %%
again, followed = Solver(shaft).equilibrium(2 * pi), diagram.at(2 * pi)[0]
assert abs(again.energy) < 1e-12 < 19.7 < followed.energy
print(f"energy {followed.energy:.3f} along the path, {again.energy:.3f} from a new start")

# %% [markdown]
# After *two* turns the shaft, unstable by now, can even be moved into the one without twist with its ends held (Dirac's
# belt trick). And a mesh of linear elements fails where the rod turns by $2\pi$ in one of them: it takes the shorter
# way round.
