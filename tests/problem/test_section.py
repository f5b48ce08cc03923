"""Cross-sections: stiffnesses against integrals, double series and tables that the package does not use."""

from math import pi

import classics
import numpy as np
import pytest

import rodfem
from rodfem import Discretization, InputError, Plan, section

STEEL = {"E": 210e9, "nu": 0.3, "density": 7850.0}


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("made", "inside"),
    [
        (section.circle(0.7, **STEEL), lambda x, y: x**2 + y**2 < 0.49),
        (section.tube(0.9, 0.5, **STEEL), lambda x, y: (x**2 + y**2 < 0.81) & (x**2 + y**2 > 0.25)),
        (section.rectangle(1.6, 0.6, **STEEL), lambda x, y: (abs(x) < 0.8) & (abs(y) < 0.3)),
        (section.ellipse(1.8, 0.8, **STEEL), lambda x, y: (x / 0.9) ** 2 + (y / 0.4) ** 2 < 1),
    ],
)
def test_areas_and_second_moments(made: section.Section, inside) -> None:
    """By the mid-point rule: x is along d1, y along d2, and I1 is the integral of y^2."""
    x, y = np.meshgrid(*[(np.arange(2000) + 0.5) / 1000 - 1] * 2)
    here, part = inside(x, y), 1e-6
    expected = [(np.ones_like(x) * here).sum() * part, (y**2 * here).sum() * part, (x**2 * here).sum() * part]
    assert [made.area, made.I1, made.I2] == pytest.approx(expected, rel=2e-3)
    assert made.mass == pytest.approx(7850 * made.area) and made.stretching == pytest.approx(210e9 * made.area)
    assert made.rotary_inertia[2] == pytest.approx(sum(made.rotary_inertia[:2]))


@pytest.mark.parametrize("ratio", [1.0, 1.7, 10.0, 1e4])
def test_torsion_of_a_rectangle(ratio: float) -> None:
    """Prandtl's stress function as a double Fourier series, summed over one index in closed form for long ones."""
    made, turned = section.rectangle(ratio, 1.0, **STEEL), section.rectangle(1.0, ratio, **STEEL)
    assert made.J == pytest.approx(turned.J, rel=1e-15)
    if ratio > 100:
        assert made.J == pytest.approx(ratio / 3 * (1 - 0.630249 / ratio), rel=1e-9)  # Timoshenko & Goodier, 10.3
        return
    m, n = np.meshgrid(*[np.arange(1, 3000, 2.0)] * 2)
    series = 256 / pi**6 * ratio * (1 / (m**2 * n**2 * ((m / ratio) ** 2 + n**2))).sum()
    assert made.J == pytest.approx(series, rel=1e-6)


def test_without_dimensions_and_back() -> None:
    """A steel strip a metre long, and in its own units: Euler's load, and the lowest frequency of a cantilever."""
    strip, length = section.rectangle(30e-3, 1e-3, **STEEL), 1.0
    scales = strip.scales(length)
    plain = strip.scaled(scales)
    assert (plain.bending[0], plain.mass) == pytest.approx((1.0, 1.0), rel=1e-14)
    assert plain.bending[1] == pytest.approx(900.0, rel=1e-12)
    for name in ("twisting", "stretching", "shearing"):
        ratio = np.array(getattr(strip, name)) / strip.bending[0] * (1.0 if name == "twisting" else length**2)
        np.testing.assert_allclose(getattr(plain, name), ratio, rtol=1e-12)
    second = 30e-3 * 1e-9 / 12
    assert pi**2 / 4 * scales.force == pytest.approx(pi**2 / 4 * 210e9 * second, rel=1e-14)
    by_hand = 1.875104068711961**2 * np.sqrt(210e9 * second / (7850.0 * 30e-6))
    assert 1.875104068711961**2 * scales.frequency == pytest.approx(by_hand, rel=1e-14)
    with pytest.raises(InputError, match="no density"):
        section.circle(1.0, E=1.0, nu=0.3).scales(1.0).frequency  # noqa: B018
    with pytest.raises(InputError, match="length is -1"):
        strip.scales(-1.0)


def test_limits() -> None:
    """An ellipse of equal axes, and a tube of a small bore, are circles; a thin tube has half its area in shear."""
    circle = section.circle(0.5, **STEEL)
    for other in (section.ellipse(1.0, 1.0, **STEEL), section.tube(0.5, 1e-6, **STEEL)):
        for name in ("area", "I1", "I2", "J"):
            assert getattr(other, name) == pytest.approx(getattr(circle, name), rel=1e-9)
        assert other.shear == pytest.approx(circle.shear, rel=1e-9)
    assert section.tube(1.0, 0.9999, **STEEL).shear[0] == pytest.approx(2 * 1.3 / (4 + 3 * 0.3), rel=1e-6)  # Cowper
    assert section.ellipse(1.0, 0.001, E=1.0, nu=0.0).shear[0] == pytest.approx(0.9, rel=1e-4)  # of a thin blade


@pytest.mark.long
@pytest.mark.parametrize("rod", ["flexible", "unshearable", "inextensible", "unshearable and inextensible"])
def test_a_column_in_metres_and_newtons(rod: str) -> None:
    """Euler's load of a steel strip, 30 mm by 2 mm, one metre long, of an unshearable one pi^2 E I / 4; no warning."""
    strip = section.rectangle(0.030, 0.002, **STEEL)
    euler = pi**2 / 4 * 210e9 * 0.030 * 0.002**3 / 12
    supports, span = classics.SUPPORTS["clamped-free"], (0.0, 1.5 * euler)
    scene = classics.column("strip", supports, span, rod=rod, energy=strip.energy(rod), inertia=strip.inertia())
    diagram = rodfem.trace(scene, Discretization(elements=4, degree=6), Plan(depth=0, error_bars=False))
    assert not diagram.warnings and not scene.ignored_strains
    (found,) = diagram.special("branch point")
    EA, GA = strip.stretching, strip.shearing[1]
    extensible, shearable = (1 / EA if "inextensible" not in rod else 0.0), (0.0 if "unshearable" in rod else 1 / GA)
    load = found.point.load
    assert load * (1 - load * extensible + load * shearable) == pytest.approx(euler, rel=1e-9)  # Haringx, Engesser


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: section.circle(-1.0, E=1.0, nu=0.3), "radius is -1: give a number above zero"),
        (lambda: section.circle("1 mm", E=1.0, nu=0.3), "radius is '1 mm'"),
        (lambda: section.circle(1.0, E=1.0, nu=0.7), "nu is 0.7"),
        (lambda: section.circle(1.0, E=0.0, nu=0.3), "E is 0"),
        (lambda: section.circle(1.0, E=1.0, nu=0.3, density=-1.0), "density is -1"),
        (lambda: section.tube(1.0, 1.0, E=1.0, nu=0.3), "inner is 1"),
        (lambda: section.circle(1.0, E=1.0, nu=0.3).energy("stiff"), "rod is 'stiff'"),
        (lambda: section.circle(1.0, E=1.0, nu=0.3).energy("flexible", (1.0, 2.0)), "natural"),
        (lambda: section.circle(1.0, E=1.0, nu=0.3).inertia(), "no density"),
    ],
)
def test_mistakes(call, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call()
