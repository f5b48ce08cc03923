"""Hard by their numbers: stiff against bending, meshes of any size and degree, rotations of many turns."""

from math import inf, pi, sqrt

import classics
import numpy as np
from classics import SUPPORTS, column
from closed_forms import TORQUE
from hard.case import Change, Measured, compare, run, said, singular
from stability.test_soft_modes import nearly_free

from rodfem import Discretization, Solver

EULER = pi**2 / 4
"""Buckling load of a cantilever of length and bending stiffness one."""


def haringx(exponent: float, formulation: str = "reduced") -> Measured:
    """``P (1 - P/EA + P/GA) = pi^2/4``, EA = 2 GA."""
    GA = 10.0**exponent
    slope = 0.5 / GA  # 1/GA - 1/EA
    load = 2 * EULER / (1 + sqrt(1 + 4 * slope * EULER))
    scene = classics.shearable("flexible", GA, 2 * GA)
    diagram = run(scene, Discretization(formulation, 8, 6))
    return compare(singular(diagram[0]), [Change(load, 0, 1)], said(diagram))


def ratio(B2: float) -> Measured:
    """Rods of bending ratio B2 about the load of the stiff plane: (2n - 1)^2 weak modes are below."""
    low, high = 0.9991 * EULER * B2, 1.0009 * EULER * B2
    weak = [(2 * n - 1) ** 2 * EULER for n in range(1, 200)]
    loads = sorted([*weak, *(B2 * x for x in weak)])
    index = sum(x < low for x in loads)
    inside = [x for x in loads if low < x < high]
    expected = [Change(x, index + i, index + i + 1) for i, x in enumerate(inside)]
    scene = column("ratio", SUPPORTS["clamped-free"], (low, high), constants={"B2": B2})
    diagram = run(scene, Discretization("reduced", 24, 6))
    return compare(singular(diagram[0]), expected, said(diagram))


def euler(mesh: Discretization) -> Measured:
    diagram = run(column("mesh", SUPPORTS["clamped-free"], (0.0, 4.0)), mesh)
    return compare(singular(diagram[0]), [Change(EULER, 0, 1)], said(diagram))


def graded(smallest: float) -> Measured:
    """Elements that shrink by equal factors towards the clamp, down to ``smallest``."""
    vertices = (0.0, *np.geomspace(smallest, 1.0, 12))
    return euler(Discretization("reduced", 12, 6, vertices))


def turned(C: float) -> Measured:
    """Twisted between clamps until the moment C phi is Greenhill's: by 2 pi and more where C is small."""
    scene = classics.greenhill()
    scene = scene.varying("phi", (0.0, 1.03 * TORQUE / C), C=C)
    diagram = run(scene)
    return compare(singular(diagram[0]), [Change(TORQUE / C, 0, 2)], said(diagram))


def soft(spring: float) -> Measured:
    """A spring at a ball joint, about three axes: of each rotation it is the eigenvalue, and its sign the stability."""
    point = Solver(nearly_free(spring), Discretization("reduced", 4, 4)).equilibrium(0.0)
    undecided = tuple(str(mode) for mode in point.soft if not mode.decided)
    index = 0 if undecided or spring > 0 else 3
    if len(point.soft) != 3 or (point.negative, point.undecided) != (index, len(undecided)):
        return Measured(inf, 1.0, undecided, repr(point))
    return Measured(max(abs(mode.value - spring) / mode.uncertainty for mode in point.soft), 1.0, undecided)
