# %% [markdown]
# # Lateral load on a ruler
#
# ## Idea
#
# A ruler bends easily about one axis and hardly about the other. Clamp it at $s = 0$, and push its free end sideways,
# by a dead force $\lambda$ along $e_1$, the way it resists. It bends in the plane of $e_1$ and $e_3$, up to a load at
# which it twists and falls to the side: *lateral buckling*. A force along $e_2$ bends it the easy way, and nothing else
# happens.
#
# ## Form
#
# The ruler is unshearable, and hard to stretch:
#
# $$n_3 = 20 \log v_3, \qquad m_1 = k_1, \quad m_2 = 10\,k_2, \quad m_3 = k_3 .$$
#
# The contact force is the dead force everywhere along the ruler: no force is unknown, and the centreline follows from
# the rotation. What is left are the rotation $q$, its multiplier $\eta$ and the stretch $v_3$. Bending and stretching
# before buckling are taken into account.
#
# Kumar & Healey, Comput. Methods Appl. Mech. Engrg. 199 (2010) 1805-1815, section 5.3 and figures 8 and 9.

# %% [markdown]
# ## Program
#
# A `Scene` states energy, ends, load, and the number that the diagram shows. The arguments of the function are options:
# `rodfem run demos/ruler.py --direction e2`.

# %%
import rodfem
import rodfem.app.script as script
from rodfem import InputError, Ordinate, Parameter, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist, logarithmic_stretch

DIRECTIONS = {"e1": (1.0, 0.0), "e2": (0.0, 1.0)}


def ruler(
    direction: str = "e1",
    stretching: float = 20.0,
    bending: tuple[float, float] = (1.0, 10.0),
    twisting: float = 1.0,
) -> Scene:
    """A ruler, clamped at one end and pushed sideways at the other.

    Parameters
    ----------
    direction
        Direction of the force, e1 or e2.
    stretching
        Stiffness E.
    bending
        Stiffnesses B1 and B2.
    twisting
        Stiffness B3.
    """
    if direction not in DIRECTIONS:
        raise InputError(f"Unknown direction {direction!r}: choose e1 or e2.")
    x, y = DIRECTIONS[direction]
    return Scene(
        name="ruler",
        title="Lateral load on a ruler",
        states="plane",
        interval=(0.0, 1.0),
        rod="unshearable",
        energy=lambda v, k, c: logarithmic_stretch(v, c.E) + bending_and_twist(k, (c.B1, c.B2, c.B3)),
        parameters={
            "lam": Parameter(0.0, r"\lambda", words="lateral force"),
            "E": Parameter(stretching, admissible=(0.0, float("inf")), words="stretching stiffness"),
            "B1": Parameter(bending[0], words="bending stiffness"),
            "B2": Parameter(bending[1], words="bending stiffness"),
            "B3": Parameter(twisting, words="twisting stiffness"),
        },
        load="lam",
        ends=(clamped(), free(force=lambda c: (x * c.lam, y * c.lam, 0.0))),
        ordinate=Ordinate("tip displacement out of the plane", s=1.0, of=lambda r, q: abs(y * r[0] - x * r[1])),
        span=(0.0, 12.0),
    )


# %% [markdown]
# ## Number
#
# Where bending in the plane is neglected, the load is $4.0126\,\sqrt{B_1 B_3}$: the first zero of $J_{-1/4}(\lambda/2)$
# (Prandtl 1899, Michell 1899). Here the ruler is curved, and longer, before it falls: $\lambda = 4.4259484$.

# %%
if script.lesson(__name__):
    diagram = rodfem.trace(ruler())
    print(diagram.in_words())
    diagram.save("results/ruler")  # rodfem view results/ruler
    diagram.plot("results/ruler/diagram.png")
    falling = diagram.special("branch point", "plane")[0]
    print(f"lam = {falling.point.load:.9f} +- {falling.error_estimate:.0e}; linear theory: 4.0126")
    assert abs(falling.point.load - 4.4259484) < 1e-7

# %% [markdown]
# ## Exercises
#
# * `rodfem run demos/ruler.py --direction e2`: the easy way. What does the index say?
# * `rodfem run demos/ruler.py --bending 1 1000 --stretching 1e6`: a ruler that hardly bends before it falls. How near
#   is Prandtl's number?
#
# ## Where it breaks
#
# A straight ruler pushed exactly in its plane is an idealisation: any imperfection rounds the corner of the diagram.
