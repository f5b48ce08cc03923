"""A straight rod that stretches by u and twists by f, and a potential of both at its end: any normal form, exactly.

The rod of length one is clamped at one end; the other slides along the axis and turns about it.  Bending is so stiff
that nothing bends.  Stretch and twist are uniform, so that the energy is ``u^2/2 + f^2/2 + U(u, f)``, a polynomial in
two variables, whatever the mesh.  ``U`` is given as ``V - u^2/2 - f^2/2``, where V is what is to be examined.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from classics import ON_AXIS, column

from rodfem import Ordinate, Scene, clamped, hinged

STIFF = 1e4
"""Bending stiffness; the least load that bends is 4 pi^2 times as much."""
Potential = Callable[[Any, Any, Any], Any]


def scene(potential: Potential, span: tuple[float, float], **constants: float) -> Scene:
    """Rod whose total energy is ``potential(u, f, c)``, even in the twist f (f^2 stands for 2 - 2 cos f)."""

    def at_end(x: Any, c: Any) -> Any:
        u, squared = x.r[2] - 1, 2 - 2 * x.d1[0]
        return potential(u, squared, c) - 0.5 * u**2 - 0.5 * squared

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * ((v[2] - 1) ** 2 + c.B1 * (k[0] ** 2 + k[1] ** 2) + k[2] ** 2)

    end = replace(hinged((0.0, 0.0, 1.0), ON_AXIS), energy=at_end)
    return column(
        "two freedoms", (clamped(), end), span, rod="unshearable", energy=energy,
        constants={"P": span[0], "B1": STIFF, "a": 0.0, "b": 0.0} | constants,
        ordinate=Ordinate("stretch", s=1.0, of=lambda r, q: r[2] - 1),
    )  # fmt: skip


def cubic(a: float, span: tuple[float, float]) -> Scene:
    """``u^3 - a u = P``: folds at ``u = -+(a/3)^(1/2)``, where P = +-2 (a/3)^(3/2); none for a negative ``a``."""
    return scene(lambda u, f2, c: 0.25 * u**4 - 0.5 * c.a * u**2 - c.P * u + 0.5 * f2, span, a=a)
