r"""Cross-sections of a homogeneous, isotropic material: stiffnesses and inertia from dimensions, in any units.

    wire = section.circle(0.5e-3, E=70e9, nu=0.33, density=6450.0)  # metres, pascals, kilograms per cubic metre
    rod = Scene(..., rod="unshearable", energy=wire.energy("unshearable"), inertia=wire.inertia())

Dimensions are along the directors ``d1`` and ``d2``.  Bending about ``d1`` has the stiffness ``E I1``; ``I1`` is the
integral of ``y2^2``.  Torsion is Saint-Venant's, ``G J`` with ``G = E / (2 (1 + nu))``: Timoshenko & Goodier, *Theory
of Elasticity*, 3rd ed. (1970), chapter 10.  Shear factors are those of G. R. Cowper, J. Appl. Mech. 33 (1966) 335-340.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import exp, inf, pi, sqrt
from typing import Any

from rodfem.errors import InputError
from rodfem.forms.energy import bending_and_twist, shear_and_stretch
from rodfem.forms.kinematics import RODS
from rodfem.problem.arguments import Check, checked, finite, reals
from rodfem.problem.scene import Inertia

NO_DENSITY = "The section has no density: give one, as in density=7850.0."


@dataclass(frozen=True)
class Scales:
    """Units in which a rod has the length, the bending stiffness about ``d1`` and the mass per length one.

    A number without dimension times its unit is the number itself: a load ``P`` is ``P * scales.force``.  The unit of
    ``force`` is ``E I1 / length^2``, that of ``time`` ``length^2 sqrt(mass / E I1)``, zero for a section without a
    density.
    """

    length: float
    force: float
    time: float

    @property
    def moment(self) -> float:
        """Unit of moments and of energy, ``E I1 / length``."""
        return self.force * self.length

    @property
    def frequency(self) -> float:
        """Unit of circular frequencies; raises :class:`InputError` without a density."""
        if not self.time:
            raise InputError(NO_DENSITY)
        return 1 / self.time


@dataclass(frozen=True)
class Section:
    """A cross-section and its material; all numbers in one set of units.

    ``I1`` and ``I2`` are the second moments of its ``area`` about ``d1`` and ``d2``, ``J`` is the torsion constant
    (twisting moment over ``G`` times twist), ``shear`` are the shear factors along ``d1`` and ``d2``, ``E, nu,
    density`` Young's modulus, Poisson's ratio and mass per volume (zero: not given).
    """

    area: float
    I1: float
    I2: float
    J: float
    shear: tuple[float, float]
    E: float
    nu: float
    density: float = 0.0

    @property
    def G(self) -> float:
        """Shear modulus."""
        return self.E / (2 * (1 + self.nu))

    @property
    def bending(self) -> tuple[float, float]:
        """Bending stiffnesses ``E I1``, ``E I2`` about ``d1`` and ``d2``, force times length squared."""
        return self.E * self.I1, self.E * self.I2

    @property
    def twisting(self) -> float:
        """Torsional stiffness ``G J``, force times length squared."""
        return self.G * self.J

    @property
    def stretching(self) -> float:
        """Stiffness ``E A`` in stretch, a force."""
        return self.E * self.area

    @property
    def shearing(self) -> tuple[float, float]:
        """Stiffnesses in shear along ``d1`` and ``d2``, forces."""
        return self.shear[0] * self.G * self.area, self.shear[1] * self.G * self.area

    @property
    def mass(self) -> float:
        """Mass per length."""
        return self.density * self.area

    @property
    def rotary_inertia(self) -> tuple[float, float, float]:
        """Rotary inertia per length about the directors."""
        return self.density * self.I1, self.density * self.I2, self.density * (self.I1 + self.I2)

    def energy(self, rod: str, natural: Sequence[float] = (0.0, 0.0, 0.0)) -> Callable[[Any, Any, Any], Any]:
        """Quadratic stored energy ``W(v, k, c)`` of a rod of the kind ``rod``, with the strains that it is free in.

        ``natural`` (3,) are the curvatures and the twist of the natural state, per length.  Raises :class:`InputError`
        for an unknown kind of rod, and for what is no natural state.
        """
        if rod not in RODS:
            raise InputError(f"rod is {rod!r}: choose one of {', '.join(RODS)}.")
        rest = reals("natural", natural, (0.0, 2.0, 0.0), 3)
        stiffness = (*self.bending, self.twisting)
        shear1, shear2 = (x if 0 in RODS[rod] else 0.0 for x in self.shearing)
        stretch = self.stretching if 2 in RODS[rod] else 0.0

        def stored(v: Any, k: Any, c: Any) -> Any:
            bent = bending_and_twist([k[i] - rest[i] for i in range(3)], stiffness)
            return bent + shear_and_stretch(v, (shear1, shear2, stretch)) if RODS[rod] else bent

        return stored

    def scales(self, length: float) -> Scales:
        """Units of a rod of this section and a ``length``; raises :class:`InputError` for what is no length."""
        L = LENGTH("length", length)
        return Scales(L, self.bending[0] / L**2, L**2 * sqrt(self.mass / self.bending[0]))

    def scaled(self, scales: Scales) -> Section:
        """The same section in other units; in its own ``scales`` its ``E I1`` is one."""
        L = scales.length
        density = self.density * L**4 / (scales.force * scales.time**2) if scales.time else 0.0
        second = {name: getattr(self, name) / L**4 for name in ("I1", "I2", "J")}
        return replace(self, area=self.area / L**2, E=self.E * L**2 / scales.force, density=density, **second)

    def inertia(self) -> Inertia:
        """Mass and rotary inertia for a scene; raises :class:`InputError` without a density."""
        if not self.density:
            raise InputError(NO_DENSITY)
        return Inertia(rho_A=lambda c: self.mass, rho_I=lambda c: self.rotary_inertia)


def _bounded(example: float, least: float, most: float, words: str, *, open_below: bool = True) -> Check:
    """Check for a finite number above ``least``, or at least that, and at most ``most``."""

    def check(name: str, value: Any) -> float:
        number = finite(example)(name, value)
        if number > most or number < least or (open_below and number == least):
            raise InputError(f"{name} is {number:g}: {words}.")
        return number

    return check


LENGTH = _bounded(1.0, 0.0, inf, "give a number above zero")
MATERIAL = {
    "E": LENGTH,
    "nu": _bounded(0.3, -1.0, 0.5, "an isotropic material has a Poisson's ratio above -1, at most 0.5"),
    "density": _bounded(1.0, 0.0, inf, "give zero or more", open_below=False),
}
"""Checks of what all sections need."""


@checked(radius=LENGTH, **MATERIAL)
def circle(radius: float, *, E: float, nu: float, density: float = 0.0) -> Section:
    """A solid circle of a ``radius``; ``E, nu, density`` are Young's modulus, Poisson's ratio and mass per volume."""
    second, shear = pi * radius**4 / 4, 6 * (1 + nu) / (7 + 6 * nu)
    return Section(pi * radius**2, second, second, 2 * second, (shear, shear), E, nu, density)


@checked(outer=LENGTH, inner=LENGTH, **MATERIAL)
def tube(outer: float, inner: float, *, E: float, nu: float, density: float = 0.0) -> Section:
    """A circular tube with the radii ``outer`` and ``inner``; ``E, nu, density`` are as for :func:`circle`."""
    if not inner < outer:
        raise InputError(f"inner is {inner:g}: give a radius below the outer one, {outer:g}.")
    second, m = pi * (outer**4 - inner**4) / 4, (inner / outer) ** 2
    shear = 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)
    return Section(pi * (outer**2 - inner**2), second, second, 2 * second, (shear, shear), E, nu, density)


@checked(width=LENGTH, height=LENGTH, **MATERIAL)
def rectangle(width: float, height: float, *, E: float, nu: float, density: float = 0.0) -> Section:
    """A rectangle of a ``width`` along ``d1`` and a ``height`` along ``d2``."""
    long, short = max(width, height), min(width, height)
    # the sum of tanh(n pi long / 2 short) / n^5, which converges slowly, by that of its difference from 1 / n^5
    # the seventh term is below 1e-17 in a square
    decays = ((n, exp(-n * pi * long / short)) for n in range(1, 12, 2))
    series = 1.0045237627951384 - sum(2 * x / (1 + x) / n**5 for n, x in decays)  # 31/32 zeta(5), over odd n
    J = long * short**3 * (1 / 3 - 64 / pi**5 * short / long * series)
    shear = 10 * (1 + nu) / (12 + 11 * nu)
    return Section(width * height, width * height**3 / 12, height * width**3 / 12, J, (shear, shear), E, nu, density)


@checked(width=LENGTH, height=LENGTH, **MATERIAL)
def ellipse(width: float, height: float, *, E: float, nu: float, density: float = 0.0) -> Section:
    """A solid ellipse whose axes are ``width`` along ``d1`` and ``height`` along ``d2``, twice the semi-axes."""
    a, b = width / 2, height / 2

    def shear(along: float, across: float) -> float:
        p, q = along**2, across**2
        return 12 * (1 + nu) * p * (3 * p + q) / ((40 + 37 * nu) * p**2 + (16 + 10 * nu) * p * q + nu * q**2)

    J = pi * a**3 * b**3 / (a**2 + b**2)
    return Section(pi * a * b, pi * a * b**3 / 4, pi * b * a**3 / 4, J, (shear(a, b), shear(b, a)), E, nu, density)
