# %% [markdown]
# # 8. Chirality: DNA and telephone cords
#
# *After it you can* say what chirality does to an energy, and find buckling loads of chiral rods in closed form.
# *Time:* at the board 15 min idea and picture, 25 form, 20 by hand; at the computer 20 min rodfem, 40 exercises and the
# page.
#
# ## Idea
#
# In a mirror a right-handed helix is left-handed. A reflection across $d_1$ keeps stretch and the curvature $k_1$, and
# changes the sign of $k_2$ and of the twist $k_3$. A rod whose energy changes under every such reflection is *chiral*:
# it tells left from right. The simplest chiral energy of a rod that is the same all around (*hemitropic*) is
#
# $$W = \tfrac{10}{2}(v_3-1)^2 + A\,(v_3-1)\,k_3 + \tfrac12 k_3^2 + \tfrac12(k_1^2 + k_2^2) .$$
#
# Pull it, and it turns, as a rope does. DNA with its coupling $A < 0$ winds up when it is pulled gently.
#
# A telephone cord is the opposite case. Its natural state is curved, $W = \frac12[k_1^2 + (k_2 - k_0)^2 + k_3^2]$,
# which a reflection across $d_2$ leaves as it is. Such a cord prefers no hand. Clamped and slack it must choose, and
# the link that its clamps keep at zero allows only as much left as right: it coils to the left, turns over in a
# *perversion*, and coils to the right. The material is symmetric, the state is not.

# %% [markdown]
# ## Picture
#
# A cord of $k_0 = 3\pi$ under a tension 40, seen from two sides. Its right half (orange) is the mirror image of its
# left half: the two loops have opposite hands.

# %%
from math import hypot, inf, pi

import numpy as np

import rodfem
from lesson.pictures import panels, show
from rodfem import Discretization, Ordinate, Parameter, Plan, Scene, clamped, sliding
from rodfem.forms.energy import bending_and_twist, hemitropic

cord = Scene(
    name="cord",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k0, k[2]), (1.0, 1.0, 1.0)),
    parameters={"lam": Parameter(60.0, r"\lambda"), "k0": Parameter(3 * pi)},
    load="lam",
    ends=(clamped(), sliding(lambda c: (0.0, 0.0, None), force=lambda c: (0.0, 0.0, c.lam))),
    ordinate=Ordinate("shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(60.0, 36.0),
)
slack = rodfem.trace(cord, Discretization(elements=18), Plan(depth=1))
(perversion,) = [point for point in slack.at(40.0) if point.stable]
r = slack.solvers[perversion.mesh].shape.sample(perversion.x)["r"]
drawn = panels(2, "along the axis, $r_3$", "across: $r_1$ (left), $r_2$ (right)", equal=True)
for column, ax in enumerate(drawn):
    for half in (r[: len(r) // 2 + 1], r[len(r) // 2 :]):
        ax.plot(half[:, 2], half[:, column], lw=2.5)
show(drawn[0].figure, "08_cord")

# %% [markdown]
# ## Form
#
# Compress a hemitropic rod of length 6 between clamps by the fraction $\lambda$. Straight, it has the stretch
# $1-\lambda$, no twist, the thrust $10\lambda$ and, being chiral, a moment $A\lambda$ about its axis. For a small
# rotation $\theta_1 + i\theta_2 = \theta$ of its cross-sections the second variation of the energy is
#
# $$\int |\theta'|^2 + A\lambda\;\mathrm{Im}(\bar\theta\,\theta') - P|\theta|^2\, ds, \qquad P = 10\lambda(1-\lambda),$$
#
# where $\theta = 0$ at the clamps, and $\int\theta\, ds = 0$ as they stay opposite each other.
#
# Reflection is $\theta_2 \to -\theta_2$. It changes the sign of the middle term alone, as $A \to -A$ does. So rods of
# either hand buckle at the same load, into shapes that are mirror images; and earlier than a rod without coupling.

# %%
from scipy.linalg import eigvalsh, null_space
from ufl import derivative, dot, dx

from lesson.by_hand import assemble, fields

theta, at = fields(2, -3.0, 3.0)
d = theta.dx(0)
K, S, M = (
    assemble(derivative(derivative(form * dx, theta), theta))
    for form in (dot(d, d) / 2, (theta[0] * d[1] - theta[1] * d[0]) / 2, dot(theta, theta) / 2)
)
mean = np.array([assemble(derivative(theta[i] * dx, theta)) for i in (0, 1)])
inner = np.sort(at[:, 1:-1].ravel())  # the clamps hold the first and the last node
Z = null_space(mean[:, inner])


def index(lam, A):
    """Negative eigenvalues of the straight rod's second variation."""
    H = (K + A * lam * S - 10 * lam * (1 - lam) * M)[np.ix_(inner, inner)]
    return int((eigvalsh(Z.T @ H @ Z) < 0).sum())


print(by_hand := {A: [index(0.1143042145 + shift, A) for shift in (-1e-8, 1e-8)] for A in (-3.0, 3.0, 0.0)})

# %% [markdown]
# ## Program

# %%
strand = Scene(
    name="hemitropic",
    interval=(-3.0, 3.0),
    rod="unshearable",
    energy=lambda v, k, c: hemitropic(v, k, stretching=10.0, coupling=c.A, twisting=1.0, bending=1.0),
    parameters={"lam": Parameter(0.0, r"\lambda", admissible=(-inf, 1.0)), "A": Parameter(-3.0)},
    load="lam",
    ends=(clamped(lambda c: (0.0, 0.0, -3 * (1 - c.lam))), clamped(lambda c: (0.0, 0.0, 3 * (1 - c.lam)))),
    ordinate=Ordinate("displacement of the middle", s=0.0, of=lambda r, q: hypot(r[0], r[1])),
    span=(0.0, 0.25),
)
(chiral,) = rodfem.trace(strand, plan=Plan(depth=0)).special("branch point")
(straight,) = slack.special("branch point", "straight")
print(chiral, straight, sep="\n")

# %% [markdown]
# ## Number
#
# With $a = A\lambda/2$, $\Omega^2 = a^2 + P$, $p = 3(a - \Omega)$, $q = 3(a + \Omega)$ the hemitropic rod buckles where
# $\sin(q-p) = (q-p)\,\sin p\,\sin q/(pq)$, at $\lambda = 0.1143042145$ for $A = \pm 3$. The straight cord loses
# stability at the tension $\lambda = k_0^2 - w^2$ with $w = 2\pi$: at $5\pi^2 = 49.3480220$.

# %%
from scipy.optimize import brentq


def condition(lam, A=-3.0):
    a = A * lam / 2
    p, q = (3 * (a + sign * np.sqrt(a * a + 10 * lam * (1 - lam))) for sign in (-1, 1))
    return np.sin(q - p) - (q - p) * np.sin(p) * np.sin(q) / (p * q)


exact = brentq(condition, 0.10, 0.13, xtol=1e-15)
assert abs(chiral.point.load - exact) < 1e-11 and abs(exact - 0.1143042145) < 1e-10
assert by_hand == {-3.0: [0, 2], 3.0: [0, 2], 0.0: [0, 0]}
answer = straight.point.load
assert abs(answer - 5 * pi**2) < 1e-8 and (straight.negative_before, straight.negative_after) == (0, 1)
print(f"cord: {answer:.8f} (exact {5 * pi**2:.8f}), hemitropic: {chiral.point.load:.12f} (exact {exact:.12f})")

# %% [markdown]
# ## Exercises
#
# **8.1** A rod without chirality, $A = 0$. At which $\lambda$ does it buckle? (Remember Euler's clamped column.)
#
# **8.2** Let the cord slacken further. At which tension does a second direction of the straight cord become unstable?
# Its $w$ is a number that you have met in lesson 6. Why?
#
# **8.3** For which $|A|$ does the hemitropic rod buckle at $\lambda = 0.12$?
#
# **8.4** On the page: `rodfem run demos/hemitropic.py`, `rodfem view results/hemitropic`. Click through the states of
# branch 2 while its index falls from 3 to 2, and watch the modes move. At which $\lambda$ does it fall, and what does
# the branch do there? (Hide the other branches by their squares in the legend.)

# %% [markdown]
# ## Where it breaks
#
# The energy is convex only for $A^2 < 10$. Beyond that the rod would gain energy by stretching and twisting without
# end, and rodfem refuses it. And the law is linear: real DNA unwinds again at large forces, where $A$ changes its sign.
