# %% [markdown]
# # A rod under a follower load
#
# ## Idea
#
# A rod is clamped at one end, and pushed at the other by a force $P$ that stays tangent to it, as a rocket does. The
# straight rod is an equilibrium at every $P$, and the only one near it: nothing ever buckles. Still it does not stay
# straight. The load has no potential, so that stability is a matter of motion, and the mass of the rod counts.
#
# ## Form
#
# The rod is unshearable and inextensible, $m = (k_1, 10\,k_2, k_3)$. The tangent matrix $S$ of a load without a
# potential is not symmetric. Two frequencies of
#
# $$S x = \mu M x, \qquad \mu = \omega^2,$$
#
# approach each other as $P$ grows, meet, and become a complex pair: oscillations that grow. This is *flutter*.
#
# Kumar & Healey, Comput. Methods Appl. Mech. Engrg. 199 (2010) 1805-1815, section 5.4 and figure 11.

# %% [markdown]
# ## Program
#
# `follower` gives the components of a force along the directors. The scene has an `Inertia` besides. The arguments of
# the function are options: `rodfem run demos/follower.py --rotary-inertia 0.001 0.001 0.001`.

# %%
from math import hypot, inf

import rodfem
import rodfem.app.script as script
from rodfem import Discretization, Inertia, InputError, Ordinate, Parameter, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist


def pushed_rod(
    stiffness: tuple[float, float, float] = (1.0, 10.0, 1.0),
    mass: float = 1.0,
    rotary_inertia: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Scene:
    """A rod clamped at one end, and pushed at the other along its own tip.

    Parameters
    ----------
    stiffness
        B1, B2 and B3.
    mass
        Mass per unit length.
    rotary_inertia
        J1, J2 and J3.
    """
    b1, b2, b3 = stiffness
    j1, j2, j3 = rotary_inertia
    if min(j1, j2, j3) < 0:
        raise InputError(f"A rotary inertia of {min(j1, j2, j3):g} is negative: give zero or more.")
    return Scene(
        name="follower",
        title="Rod under a follower load",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist(k, (c.B1, c.B2, c.B3)),
        parameters={
            "P": Parameter(0.0, "P", words="follower force"),
            "B1": Parameter(b1, words="bending stiffness"),
            "B2": Parameter(b2, words="bending stiffness"),
            "B3": Parameter(b3, words="twisting stiffness"),
            "m": Parameter(mass, admissible=(0.0, inf), words="mass per length"),
            "J1": Parameter(j1, words="rotary inertia"),
            "J2": Parameter(j2, words="rotary inertia"),
            "J3": Parameter(j3, words="rotary inertia"),
        },
        load="P",
        ends=(clamped(), free(follower=lambda c: (0.0, 0.0, -c.P))),
        inertia=Inertia(rho_A=lambda c: c.m, rho_I=lambda c: (c.J1, c.J2, c.J3)),
        ordinate=Ordinate("transverse displacement of the tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
        span=(0.0, 25.0),
    )


def mesh(**_: object) -> Discretization:
    """Four elements are enough for a straight rod."""
    return Discretization(elements=4)


# %% [markdown]
# ## Number
#
# Without rotary inertia flutter begins at $P = 20.0509536190$ (Beck 1952; lesson 9 of the course solves the frequency
# equation), more than eight times the load $\pi^2/4$ under which the rod buckles if the force keeps its direction.

# %%
if script.lesson(__name__):
    diagram = rodfem.trace(pushed_rod(), mesh())
    print(diagram.in_words())
    diagram.save("results/follower")  # rodfem view results/follower
    diagram.plot("results/follower/diagram.png")
    flutter = diagram.special("flutter")[0]
    print(f"P = {flutter.point.load:.10f} +- {flutter.error_estimate:.0e}, where omega^2 = {flutter.omega2:.6f}")
    assert abs(flutter.point.load - 20.05095361897) < 1e-8

# %% [markdown]
# ## Exercises
#
# * `rodfem run demos/follower.py --mass 4`: which of the two numbers changes, the load or the frequency?
# * `rodfem run demos/follower.py --rotary-inertia 0.001 0.001 0.001`: by how much does rotary inertia lower the load?
# * `rodfem run demos/follower.py --stiffness 1 1 1`: a round rod flutters in any plane. What do its
#   frequencies look like?
#
# ## Where it breaks
#
# A little damping may lower the load by a finite amount (Ziegler 1952), and damping is not part of the model.
