# %% [markdown]
# # Michell's ring
#
# ## Idea
#
# A thin rod whose natural state is twisted is bent to a circle, and its ends are joined. The link of the ring is fixed
# from then on, so that the circle has no twist, and is under a torque. At a critical one it leaves its plane, like a
# kinked cable.
#
# ## Form
#
# The rod has round cross-sections and the natural twist $t_0$:
#
# $$W = \tfrac12\,[k_1^2 + k_2^2 + C\,(k_3 - t_0)^2] .$$
#
# A ring may go anywhere: rotations, the turning of its cross-sections and the motion along itself are zero eigenvalues
# at every state. They are found from the equations, and counted apart.
#
# The diagram shows the twist, $\int k_3\,ds/2\pi$, which tells all states apart: 0 on the first circle, 2 on the last
# one, and in between the link less the writhe, as long as the rod does not pass through itself.

# %% [markdown]
# ## Program
#
# `Ring()` takes the place of two ends, and `start` is the circle. The argument of the function is an option:
# `rodfem run demos/ring.py --twisting 0.7`.

# %%
from math import inf, pi, sqrt

import numpy as np

import rodfem
import rodfem.app.script as script
from rodfem import Ordinate, Parameter, Ring, Scene
from rodfem.forms.energy import bending_and_twist

TWIST = r"twist $\int k_3\,ds/2\pi$"


def circle(s):
    """Quaternions of the circle of radius 1 in the plane of e1 and e3: a turn by s about e2, no twist."""
    return np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1)


def ring(twisting: float = 1.5) -> Scene:
    """A closed rod whose natural state is twisted.

    Parameters
    ----------
    twisting
        Stiffness C of twist over that of bending.
    """
    return Scene(
        name="ring",
        title="Michell's ring",
        interval=(0.0, 2 * pi),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist((k[0], k[1], k[2] - c.t0), (1.0, 1.0, c.C)),
        parameters={
            "t0": Parameter(0.0, "t_0", words="natural twist"),
            "C": Parameter(twisting, admissible=(0.0, inf), words="twisting stiffness"),
        },
        load="t0",
        ends=Ring(),
        start=circle,
        states="circle",
        ordinate=Ordinate("twist in turns", s=None, of=lambda x, c: x.k[2] / (2 * pi), label=TWIST),
        span=(0.0, 1.6),
    )


# %% [markdown]
# ## Number
#
# A ring of radius 1 leaves its plane where $C t_0 = \sqrt{n^2 - 1}$, $n = 2, 3, \dots$, at $\sqrt 3$ first
# (Michell 1889; Zajac, J. Appl. Mech. 29 (1962) 136). What leaves there leads, past a figure of eight, to a circle with
# another link, in which the rod has passed through itself.

# %%
if script.lesson(__name__):
    diagram = rodfem.trace(ring())
    print(diagram.in_words())
    diagram.save("results/ring")  # rodfem view results/ring
    diagram.plot("results/ring/diagram.png")
    kink = diagram.special("branch point", "circle")[0]
    print(f"C t0 = {1.5 * kink.point.load:.10f}, exact sqrt(3) = {sqrt(3):.10f}; {kink.point.zero} zero eigenvalues")
    assert abs(1.5 * kink.point.load - sqrt(3)) < 1e-8

# %% [markdown]
# ## Exercises
#
# * `rodfem run demos/ring.py --twisting 0.7 --range 0 3`: at which $t_0$ does a ring that is soft in twist leave its
#   plane?
# * `rodfem run demos/ring.py --range 0 2.5`: where does the circle become unstable in a third way? (Take $n = 3$.)
#
# ## Where it breaks
#
# The rod passes through itself in the figure of eight: a real ring is stopped there by contact.
