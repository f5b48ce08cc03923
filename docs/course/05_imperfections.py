# %% [markdown]
# # 5. Branch points and imperfections
#
# *After it you can* derive a pitchfork's law from the Taylor series of the energy, and its imperfect version. *Time:*
# at the board 20 min idea and picture, 25 form, 15 by hand; at the computer 20 min rodfem, 40 exercises.
#
# ## Idea
#
# At Euler's load the straight rod and a bent one meet. Close by only one amplitude matters: all other directions are
# stiff and follow. So the energy of the rod is, locally, a function of one number $a$. Its Taylor series tells which
# branch leaves, on which side, whether it is stable, and what becomes of a rod that is not quite straight.
#
# No rod is. A branch point is a crossing of curves, and the smallest imperfection takes it apart: into a curve that
# every real rod follows, and another one with a fold. A fold survives imperfections, a branch point does not.

# %% [markdown]
# ## Picture
#
# The angle $a$ of the tip of the elastica: for a perfect rod (grey), and for one with a small transverse load
# $\varepsilon$, by the formula that the next section derives. Solid is stable.

# %%
import numpy as np

from lesson.pictures import axes, equilibria, show

EULER = np.pi**2 / 4


def near(a, eps):  # load of the amplitude a
    return EULER * (1 + a**2 / 8) - 4 * eps / (np.pi * a)


def at_fold(eps):  # size of a at the fold
    return (16 * eps / (np.pi * EULER)) ** (1 / 3)


ax = axes("load $P$", "angle $a$ of the tip")
a = np.linspace(1e-3, 1.5, 600)
for loads, angles, style in (([1.8, EULER], [0, 0], "-"), ([EULER, 3.2], [0, 0], ":"), (near(a, 0), [a, -a], "-")):
    ax.plot(loads, np.transpose(angles), color="0.65", lw=2, ls=style)
for eps, colour in ((0.02, "#0072B2"), (0.005, "#D55E00")):
    ax.plot(near(a, eps), a, color=colour, lw=2, label=f"$\\varepsilon = {eps}$")
    for part, style in ((a > at_fold(eps), "-"), (a <= at_fold(eps), ":")):
        ax.plot(near(-a[part], eps), -a[part], color=colour, lw=2, ls=style)
ax.set(xlim=(1.8, 3.2), ylim=(-1.5, 1.5))
ax.legend(frameon=False, loc="upper left")
show(ax.figure, "05_pitchfork")

# %% [markdown]
# ## Form
#
# The energy with a transverse dead load $\varepsilon$ at the tip, and its null vector at $P_1 = \pi^2/4$:
#
# $$\Pi[\theta] = \int_0^1 \tfrac12\theta'^2 + P\cos\theta - \varepsilon\sin\theta\;ds, \qquad \phi = \sin(\pi s/2).$$
#
# Insert $\theta = a\phi$ and expand in $a$, $P - P_1$ and $\varepsilon$ (*Lyapunov-Schmidt reduction*; other directions
# enter through $\Pi'''[\phi, \phi, \cdot]$, which vanishes as the energy is even in $\theta$):
#
# $$\Pi(a) \approx \tfrac12\Pi''_P\,(P - P_1)\,a^2 + \tfrac1{24}\Pi''''a^4 + \Pi'_\varepsilon\,\varepsilon\,a .$$
#
# Three numbers, derivatives in the direction $\phi$, which UFL takes. From $d\Pi/da = 0$ follows the load of an
# amplitude.

# %%
from ufl import cos, derivative, dx, sin

from lesson.by_hand import angle, assemble, constant, nodes

theta = angle()
phi = theta.copy()
phi.x.array[:] = np.sin(np.pi * nodes(theta) / 2)
P = constant(theta, EULER)


def along(form, times):  # derivative of a form at the straight rod
    for _ in range(times):
        form = derivative(form, theta, phi)
    return assemble(form)


fourth = along((theta.dx(0) ** 2 / 2 + P * cos(theta)) * dx, 4)
second_P, first_eps = along(cos(theta) * dx, 2), along(-sin(theta) * dx, 1)
curvature = -fourth / (6 * second_P) / EULER
tilt = -first_eps / second_P
print(f"P = P1 (1 + {curvature:.9f} a^2) {tilt:+.6f} eps/a")

# %% [markdown]
# ## Program
#
# rodfem computes the same numbers at every branch point (`law`: here in the tip's displacement $x \approx 2a/\pi$).
# With $\varepsilon$ a parameter of the scene, the imperfect rod is `varying`. From small loads it bends, and never sees
# a critical load. rodfem also finds the other curve, on which a rod that is bent the wrong way snaps at a fold as the
# load falls: near a least eigenvalue it looks for a branch point that an imperfection has taken apart.

# %%
import rodfem
from rodfem import Ordinate, Parameter, Plan, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"P": Parameter(1.0, words="thrust"), "eps": 0.0},
    load="P",
    ends=(clamped(), free(force=lambda c: (c.eps, 0.0, -c.P))),
    ordinate=Ordinate("tip displacement", s=1.0, of=lambda r, q: r[0]),
    span=(1.0, 4.0),
    planar="e2",
)

straight = rodfem.trace(column, plan=Plan(depth=1))
perfect = straight.special("branch point")[0]
print(perfect, perfect.law, sep="\n")
real = rodfem.trace(column.varying("P", (1.0, 4.0), eps=0.02))
(snap,) = real.special("fold", "detached 1")
show(equilibria({"perfect": straight, "real": real}, "thrust $P$", "tip displacement").figure, "05_snap")

# %% [markdown]
# ## Number
#
# $P = P_1(1 + a^2/8)$: the column carries more as it bends, a *supercritical* pitchfork (Timoshenko & Gere, §2.7).
# Folds go as $\varepsilon^{2/3}$, Koiter's law (1945), here up: $P_1(1 + \frac38(16\varepsilon/\pi P_1)^{2/3})$.
# Exactly it is at the least $P$ that solves $(P^2 + \varepsilon^2)^{1/4} = K(m) + F(\arcsin(\sin(\delta/2)/\sqrt m),
# m)$, $\tan\delta = \varepsilon/P$: 2.5764720698.

# %%
answer = perfect.law.coefficient * (2 / np.pi) ** 2 / EULER
assert abs(answer - 1 / 8) < 1e-6 and abs(curvature - 1 / 8) < 1e-6
assert real.special(branch="first branch") == [] and abs(snap.point.load - 2.5764720698) < 1e-8
print(f"curvature {answer:.9f} (1/8); fold at {snap.point.load:.10f}, by Koiter {near(-at_fold(0.02), 0.02):.4f}")

# %% [markdown]
# *150 robots.* [Two grippers](../trades/two-grippers.md) drove a rod along 150 helical paths (Tong et al. 2022).
# Each path ends at a pitchfork. If the coefficient of its law is positive the rod leaves gently, if it is negative it
# jumps: right in 146 of 150. It leaves 1.3 % early in the mean, as no rod is perfect.
# Its branch point is taken apart, but the law of the perfect rod tells what to expect.

# %% [markdown]
# ## Exercises
#
# **5.1** Hold the rod by $b \cdot \theta$, $b_i = s_i$: the stiffness $h = 1/(b \cdot S^{-1} b)$ has the slope
# $w \cdot S' w$, $w = h S^{-1} b$. Where is $P_1$, by a cubic from 2 to 3? (See [theory](../theory/special-points.md).)
#
# **5.2** A rigid column on a hinge, a horizontal spring at its top: its energy $\frac12\sin^2\theta + p\cos\theta -
# \varepsilon\sin\theta$ has a *subcritical* pitchfork. At which largest $p$ does it collapse for $\varepsilon = 0.01$?
#
# **5.3** A heavy column (exercise 2.2): $q = q_1(1 + c\,a^2)$. Find $c$, with $a$ the angle of the tip.
#
# **5.4** At which $\kappa$ does the rod of these robots leave $C_{11} = 0.65$, $C_{22} = 0$, and does it jump?

# %% [markdown]
# ## Where it breaks
#
# The law is local: at $\varepsilon = 0.02$ it is off by 0.06 %. Two modes at nearly one load, as of symmetric rods
# (lesson 7), make the reduced energy one of two amplitudes, more sensitive to imperfections.
