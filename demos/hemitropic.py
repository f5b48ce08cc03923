# %% [markdown]
# # Compression of a hemitropic rod
#
# ## Idea
#
# A hemitropic rod twists when it is stretched, as a rope or a strand of DNA does. Compressed between clamps it buckles,
# like any column. But its twist tells left from right, and makes it buckle earlier, into a shape in space.
#
# ## Form
#
# The stored energy of an unshearable rod couples stretch and twist,
#
# $$W = 5\,(v_3 - 1)^2 + A\,(v_3 - 1)\,k_3 + \tfrac{B}{2} k_3^2 + \tfrac{C}{2}\,(k_1^2 + k_2^2) .$$
#
# Both ends are clamped, and pushed towards each other to $r = \mp(1 - \lambda)\, l\, e_3$, $l$ half the length. The
# straight rod is an equilibrium at every $\lambda$. Nothing in the problem prefers a direction across the rod. Hence
# every buckled state is one of a circle of states, its second variation has one zero eigenvalue, and at the straight
# state eigenvalues cross zero in pairs.
#
# Kumar & Healey, Comput. Methods Appl. Mech. Engrg. 199 (2010) 1805-1815, section 5.2 and figures 5 and 6.

# %% [markdown]
# ## Program
#
# A `Scene` states energy, ends, load, and the number that the diagram shows. The arguments of the function are options:
# `rodfem run demos/hemitropic.py --coupling -2`.

# %%
from math import hypot, inf

import rodfem
import rodfem.app.script as script
from rodfem import Ordinate, Parameter, Scene, clamped
from rodfem.forms.energy import hemitropic


def hemitropic_rod(
    coupling: float = -3.0, twisting: float = 1.0, bending: float = 1.0, half_length: float = 3.0
) -> Scene:
    """A rod whose stretch and twist are coupled, compressed between clamps.

    Parameters
    ----------
    coupling
        A, of stretch and twist.
    twisting
        Stiffness B.
    bending
        Stiffness C.
    half_length
        l, half the rod's length.
    """
    return Scene(
        name="hemitropic",
        title="Compressed hemitropic rod",
        interval=(-half_length, half_length),
        rod="unshearable",
        energy=lambda v, k, c: hemitropic(v, k, stretching=10.0, coupling=c.A, twisting=c.B, bending=c.C),
        parameters={
            "lam": Parameter(0.0, r"\lambda", admissible=(-inf, 1.0), words="end shortening"),
            "A": Parameter(coupling, words="coupling"),
            "B": Parameter(twisting, words="twisting stiffness"),
            "C": Parameter(bending, words="bending stiffness"),
        },
        load="lam",
        ends=(
            clamped(lambda c: (0.0, 0.0, -half_length * (1 - c.lam))),
            clamped(lambda c: (0.0, 0.0, +half_length * (1 - c.lam))),
        ),
        ordinate=Ordinate("transverse displacement of the mid point", s=0.0, of=lambda r, q: hypot(r[0], r[1])),
        span=(0.0, 0.95),
    )


# %% [markdown]
# ## Number
#
# Linear theory has the straight rod buckle where, with $a = A\lambda/2C$, $\Omega^2 = a^2 + 10\lambda(1 - \lambda)/C$,
# $p = l\,(a - \Omega)$ and $q = l\,(a + \Omega)$,
#
# $$\sin(q - p) = (q - p)\,\sin p\,\sin q\,/\,(p q) : \qquad \lambda = 0.1143042145 \text{ at first.}$$

# %%
if script.lesson(__name__):
    diagram = rodfem.trace(hemitropic_rod())
    print(diagram.in_words())
    diagram.save("results/hemitropic")  # rodfem view results/hemitropic
    diagram.plot("results/hemitropic/diagram.png")
    buckling = diagram.special("branch point", "straight")[0]
    print(f"lam = {buckling.point.load:.12f} +- {buckling.error_estimate:.0e}, index 0 to {buckling.negative_after}")
    assert abs(buckling.point.load - 0.1143042145) < 1e-10 and buckling.negative_after == 2

# %% [markdown]
# ## Exercises
#
# * `rodfem run demos/hemitropic.py --coupling 3`: why is nothing different?
# * `rodfem run demos/hemitropic.py --coupling 0`: at which load does a rod that is not chiral buckle? Where does its
#   branch 1 bifurcate again, which the hemitropic one does not?
# * `rodfem run demos/hemitropic.py --locus A -3.1 -0.5`: how does the critical load depend on the coupling?
#
# ## Where it breaks
#
# The energy is convex for $A^2 < 10\,B$ only; beyond that the scene is refused. Under strong compression a branch may
# end where the stretch vanishes.
