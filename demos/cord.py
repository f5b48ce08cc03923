# %% [markdown]
# # Perversion of a telephone cord
#
# ## Idea
#
# The natural state of a telephone cord is a coil: its intrinsic curvature about $d_2$ is $k_0 = 2\pi N$, $N$ turns over
# its length. Pulled straight, clamped at both ends, and let go, it does not coil back. The clamps keep its link at
# zero, so that it can only form coils of both hands, with a *perversion* between them.
#
# ## Form
#
# The cord is unshearable and inextensible, and a dead tension $\lambda$ pulls it along $e_3$ at $s = 1$:
#
# $$W = \tfrac12\,[k_1^2 + (k_2 - k_0)^2 + k_3^2], \qquad r(0) = 0, \quad R(0) = R(1) = I, \quad r_1(1) = r_2(1) = 0 .$$
#
# The straight cord is an equilibrium at every tension, with the constant moment $m_2 = -k_0$. No force acts along the
# cord, so the contact force is constant: $n_3 = \lambda$ is known, $n_1$ and $n_2$ are two scalar unknowns.
#
# Kumar & Healey, Comput. Methods Appl. Mech. Engrg. 199 (2010) 1805-1815, section 5.1 and figures 2 and 3.

# %% [markdown]
# ## Program
#
# A `Scene` states energy, ends, load, and the number that the diagram shows. The arguments of the function are options:
# `rodfem run demos/cord.py --turns 3`.

# %%
from math import ceil, isfinite, pi

import rodfem
import rodfem.app.script as script
from rodfem import Discretization, Ordinate, Parameter, Scene, clamped, sliding
from rodfem.forms.energy import bending_and_twist

MOST = 1e6  # turns beyond which mesh and tension stay as they are: no mesh holds them


def cord(turns: float = 1.5) -> Scene:
    """A telephone cord, pulled straight between clamps, and let go.

    Parameters
    ----------
    turns
        k0 = 2 pi N; more elements and tension for more.
    """
    return Scene(
        name="cord",
        title="Telephone cord",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k0, k[2]), (1.0, 1.0, 1.0)),
        parameters={
            "lam": Parameter(60.0, r"\lambda", words="tension"),
            "k0": Parameter(2 * pi * turns, words="natural curvature"),
        },
        load="lam",
        ends=(clamped(), sliding(lambda c: (0.0, 0.0, None), force=lambda c: (0.0, 0.0, c.lam))),
        ordinate=Ordinate("shortening 1 - r3(1)", s=1.0, of=lambda r, q: 1 - r[2], label="shortening $1 - r_3(1)$"),
        span=(max(60.0, 10.0 * ceil(0.11 * (2 * pi) ** 2 * (within(turns) ** 2 - 1))), 0.0),  # stable at first
    )


def mesh(turns: float = 1.5) -> Discretization:
    """Six elements a turn, of higher degree where many turns make tight loops."""
    elements = min(max(ceil(6 * within(turns)), 6), 600)
    return Discretization(elements=elements, degree=8 if within(turns) > 2 else 6)


def within(turns: float) -> float:
    """Number of turns, within what a mesh holds."""
    return min(abs(turns), MOST) if isfinite(turns) else 0.0


# %% [markdown]
# ## Number
#
# The straight cord loses stability at $\lambda = k_0^2 - w^2$ with $w = 2\pi n$ or $\tan(w/2) = w/2$: at
# $5\pi^2 = 49.3480220$ for one and a half turns. Then it buckles supercritically, and is stable on branch 1 as far as
# $\lambda = 35.80$, where its two loops meet in a plane.

# %%
if script.lesson(__name__):
    diagram = rodfem.trace(cord(), mesh())
    print(diagram.in_words())
    diagram.save("results/cord")  # rodfem view results/cord
    diagram.plot("results/cord/diagram.png")
    buckling = diagram.special("branch point", "straight")[0]
    print(f"lam = {buckling.point.load:.10f}, exact {5 * pi**2:.10f}")
    assert abs(buckling.point.load - 5 * pi**2) < 1e-8

# %% [markdown]
# ## Exercises
#
# * `rodfem run demos/cord.py --turns 3`: is the first loss of stability still supercritical?
# * `rodfem run demos/cord.py --at 40 --search 24`: which equilibria are on no branch?
# * `rodfem run demos/cord.py --at 20 --modes 3`: how does the straight cord start to coil?
#
# ## Where it breaks
#
# The rod passes through itself: the two loops of branch 1.2 lie on each other, and contact is not part of the model.
