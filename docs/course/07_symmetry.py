# %% [markdown]
# # 7. Symmetry: circles of states
#
# *After it you can* recognise a zero eigenvalue that belongs to a symmetry, and fix it by a phase condition. *Time:* at
# the board 20 min idea and picture, 25 form, 15 by hand; at the computer 20 min rodfem, 40 exercises.
#
# ## Idea
#
# Turn a rod that nothing holds: its energy does not notice. Whatever motion $g_\varepsilon$ leaves the energy of
# *every* state as it is, takes an equilibrium to an equilibrium. States come in circles, or in larger families, and
# along such a family the energy is flat. Hence a zero eigenvalue in the second variation, for ever, at all loads. It
# says nothing about stability. It must be recognised and counted apart.
#
# The proof is two lines. Let $\xi q = \frac{d}{d\varepsilon}\, g_\varepsilon q$ be the velocity of the motion.
# Differentiate $E[g_\varepsilon q] = E[q]$ in $\varepsilon$, then once more in $q$ in any direction $\eta$:
#
# $$E'(q)[\xi q] = 0 \;\text{ for all } q, \qquad E''(q)[\xi q, \eta] + E'(q)[\xi\eta] = 0 .$$
#
# At an equilibrium the last term vanishes: $\xi q$ is a null vector, unless $\xi q = 0$. The more symmetric the state,
# the *fewer* zero eigenvalues it has. And where a symmetric state loses stability, eigenvalues cross zero in pairs.

# %% [markdown]
# ## Picture
#
# Michell's ring: a rod with a natural twist $t_0$ is closed to a circle of radius 1, without twist. In its energy
# $\frac12[k_1^2 + k_2^2 + C(k_3 - t_0)^2]$ the torque $C t_0$ is locked in. At some torque the circle leaves its plane.

# %%
import numpy as np

import rodfem
from lesson.pictures import show
from rodfem import Ordinate, Parameter, Plan, Ring, Scene
from rodfem.forms.energy import bending_and_twist


def circle(s):  # quaternions of a turn by s about e2
    return np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1)


ring = Scene(
    name="ring",
    interval=(0.0, 2 * np.pi),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist((k[0], k[1], k[2] - c.t0), (1.0, 1.0, c.C)),
    parameters={"t0": Parameter(0.0, "t_0", words="natural twist"), "C": Parameter(1.5)},
    load="t0",
    ends=Ring(),
    start=circle,
    states="circle",
    ordinate=Ordinate("twist in turns", s=None, of=lambda x, c: x.k[2] / (2 * np.pi)),
    span=(0.0, 1.6),
)
diagram = rodfem.trace(ring, plan=Plan(depth=1))
show(diagram.plot(), "07_ring")

# %% [markdown]
# ## Form
#
# Which motions are symmetries? Ask the form, as in the first line of the proof: move *any* state by $\varepsilon$, and
# differentiate. A rotation of space is $q \to g\,q$, of the cross-sections $q \to q\,g$, with the turn $g$ by
# $\varepsilon$ about $e_i$.

# %%
from ufl import diff, dot, dx, variable

from lesson.by_hand import arclengths, assemble, constant, fields
from rodfem.forms.rotation import conjugate, product, turn, vector_part

q, at = fields(4, 0.0, 2 * np.pi)
s = arclengths(0.0, 2 * np.pi)
q.x.array[at] = np.cos(s / 2), 0.4 * np.sin(s), np.sin(s / 2), 0.01 * s**2


def W(q, B):
    k = 2 * vector_part(product(conjugate(q), q.dx(0))) / dot(q, q)
    return bending_and_twist((k[0], k[1], k[2] - 1), B)


epsilon = variable(constant(q, 0.0))
moved = {f"space about e{i + 1}": product(turn(epsilon, i), q) for i in range(3)}
moved |= {f"sections about d{i + 1}": product(q, turn(epsilon, i)) for i in range(3)}
symmetries = {}
for name, B in (("round", (1.0, 1.0, 1.5)), ("oval", (1.0, 2.0, 1.5))):
    slope = {motion: assemble(diff(W(gq, B), epsilon) * dx) for motion, gq in moved.items()}
    symmetries[name] = [motion for motion, value in slope.items() if abs(value) < 1e-10]
    print(name, symmetries[name])

# %% [markdown]
# Space may turn about three axes. The cross-sections of a round rod may turn about $d_3$, those of an oval rod not. A
# ring has one symmetry more: it may move along itself, $q(s) \to q(s + \varepsilon)$. A round ring has five in all.

# %% [markdown]
# ## Program
#
# rodfem finds the symmetries as we did, and reports the zero eigenvalues in `zero`, apart from the index. The circle
# has four, not five: turned about its axis it looks as if moved along itself. The buckled ring has lost that, and has
# five.

# %%
zeros = {branch.name: {p.zero for p in branch.points} for branch in diagram}
print(zeros)  # six where a pair of eigenvalues vanishes besides
for special in diagram.special():
    print(special, "with", special.multiplicity, "null vector(s) beside those of the symmetries")

# %% [markdown]
# ## Number
#
# Perturb the circle out of its plane by $\sin ns$. The second variation vanishes at $C t_0 = \sqrt{n^2 - 1}$. The mode
# $n = 1$ is a rotation, a symmetry. The first that deforms the ring is $n = 2$: $C t_0 = \sqrt 3$ (Michell 1889; Zajac
# 1962). The index goes from 0 to 2, since $\cos 2s$ comes with $\sin 2s$.

# %%
(critical,) = diagram.special("branch point", "circle")
answer = 1.5 * critical.point.load  # C t0
assert abs(answer - np.sqrt(3)) < 1e-9
assert (critical.negative_before, critical.negative_after, critical.multiplicity) == (0, 2, 2)
assert len(symmetries["round"]) == 4 and len(symmetries["oval"]) == 3
assert zeros == {"circle": {4, 6}, "branch 1": {5, 6}}
print(f"C t0 = {answer:.10f} (exact {np.sqrt(3):.10f})")

# %% [markdown]
# ## Exercises
#
# A circle of radius 1 and stiffness 1 is pressed in its plane (`planar="e2"`) by a force $p$ per length. At which $p$
# does it become an oval? It depends on how the force behaves when the ring moves:
#
# **7.1** a fluid: the force stays normal to the rod (`rodfem.forms.loads.pressure`, in `Scene(potential=...)`);
#
# **7.2** weights on strings over far pulleys: the force keeps its direction (`Scene(distributed=...)`). Which index has
# the circle below that load, and why not 0?
#
# **7.3** strings to the centre: the potential is $p$ times the distance from the centre, which is at $(1, 0, 0)$.

# %% [markdown]
# ## Where it breaks
#
# Rotations are symmetries of the mesh too; to move along itself is not one. The corresponding eigenvalue is only as
# small as the discretisation error. On a coarse mesh the phase condition then needs a force to hold the state, the
# *drift*, and rodfem stops there, saying so, instead of following a branch that does not exist:

# %%
for warning in diagram.again(rodfem.Discretization(elements=8, degree=4), error_bars=False).warnings:
    print(warning)
