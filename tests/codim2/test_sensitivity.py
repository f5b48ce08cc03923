"""Derivatives of critical loads, against closed forms and loads of other rods located."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import pi
from pathlib import Path
from typing import Any

import classics
import demo_cases
import hemitropic_cases
import numpy as np
import pytest
import ufl
from closed_forms import double
from literature.test_viscous import FILAMENT, flutters

import rodfem
from rodfem import Discretization, Inertia, Ordinate, Parameter, Plan, Scene, clamped, free, pinned, sliding
from rodfem.errors import ConvergenceError, InputError
from rodfem.forms.energy import bending_and_twist

PLAN = Plan(depth=0, error_bars=False)
DIFFERENCE = np.array([1.0, -8.0, 8.0, -1.0]) / 12
"""Weights of a central difference of the fourth order."""


def column(push: float = 0.0) -> Scene:
    """A column between clamps with two bending stiffnesses, and a force across its end."""
    return Scene(
        name="column",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist(k, (c.A, c.B, 1.0)),
        parameters={
            "P": Parameter(0.0),
            "A": Parameter(1.0),
            "B": Parameter(3.0, words="stiffness B"),
            "H": Parameter(push),
        },
        load="P",
        ends=(clamped(), sliding(lambda c: (None, 0.0, None), force=lambda c: (c.H, 0.0, -c.P))),
        ordinate=Ordinate("shortening", s=1.0, of=lambda r, q: 1 - r[2]),
        span=(0.0, 45.0),
    )


def test_of_a_column_and_along_it() -> None:
    """w = 1 - cos 2 pi s of A at 4 pi^2 A, 1 - cos pi s of B at pi^2 B: density w''^2 / int w'^2."""
    diagram = rodfem.trace(column(), depth=0)
    for special, waves, name, other in zip(diagram.special("branch point"), (1, 2), "BA", "AB", strict=False):
        found = special.derivative(name, along_the_rod=True)
        a, b, k = found.ends[:-1], found.ends[1:], waves * pi
        means = 2 * k**2 * (0.5 + (np.sin(2 * k * b) - np.sin(2 * k * a)) / (4 * k * (b - a)))
        assert abs(found.value - k**2) <= found.error < 1e-7
        assert abs(found.density - means).max() <= found.density_error < 1e-4
        assert abs(special.derivative(other).value) < 1e-12
    with pytest.raises(ConvergenceError, match="has no derivative: H is an imperfection"):
        diagram.special("branch point")[0].derivative("H")
    with pytest.raises(InputError, match="has no locus"):
        diagram.special("end")[0].derivative("A", along_the_rod=True)


@pytest.mark.parametrize("name", ["hemitropic", "cord"])
def test_against_differences_of_located_loads(name: str) -> None:
    """Of the fourth order, over a hundredth of the constant; at a double point and at single ones."""
    scene = hemitropic_cases.scene() if name == "hemitropic" else demo_cases.scene(name)
    parameter = {"hemitropic": "C", "cord": "k0"}[name]
    value, h = scene.parameters[parameter].value, 1e-3 * abs(scene.parameters[parameter].value)

    def loads(at: float) -> np.ndarray:
        traced = rodfem.trace(scene.varying(**{parameter: at}), plan=PLAN)
        return np.array([special.point.load for special in traced.special("branch point")])

    diagram = rodfem.trace(scene, depth=0)
    near = [loads(value + i * h) for i in (-2, -1, 1, 2)]
    differences = (near[0] - 8 * near[1] + 8 * near[2] - near[3]) / (12 * h)
    for special, slope in zip(diagram.special("branch point"), differences, strict=True):
        found = special.derivative(parameter)
        assert abs(found.value - slope) <= 1e-10 * abs(slope) + found.error < 1e-6


def test_of_a_fold_is_the_sum_along_the_rod() -> None:
    """The tangent of the singular system, and the work of each element along the null vector."""
    diagram = rodfem.trace(hemitropic_cases.scene(), depth=1)
    fold = diagram.special("fold")[0]
    for name in "AC":
        found = fold.derivative(name, along_the_rod=True)
        assert abs(found.density @ np.diff(found.ends) - found.value) <= found.error


def test_deviations_of_a_load() -> None:
    """pi^2 B, and nothing of A: three hundredths of B = 3, and a mesh that is exact but for round-off."""
    buckling = rodfem.trace(column(), depth=0).special("branch point")[0]
    found = buckling.tolerance({"A": 0.1, "B": 0.09})
    assert found.parts["stiffness B"] == pytest.approx(0.09 * pi**2) and found.parts["A"] < 1e-12
    assert found.deviation == pytest.approx(0.09 * pi**2)
    assert str(found).startswith("29.61 +- 0.89 (stiffness B), +- ") and str(found).endswith(" (mesh)")
    with pytest.raises(InputError, match="give positive ones"):
        buckling.tolerance({"A": -0.1})
    with pytest.raises(InputError, match="'D' is no constant of the scene"):
        buckling.tolerance({"D": 0.1})


def test_deviations_of_a_load_by_those_of_a_field() -> None:
    """Correlated over L: of ``g = 2 pi^2 sin^2 pi s`` the root of ``int int g(s) g(t) exp(-|s - t| / L)``."""
    ends = (pinned(), pinned(lambda c: (None, 0.0, None), force=lambda c: (c.H, 0.0, -c.P)))
    rod = replace(column(), ends=ends, span=(0.0, 15.0), planar="e1")
    buckling = rodfem.trace(rod, depth=0).special("branch point")[0]
    x, w = np.polynomial.legendre.leggauss(200)
    s = (1 + x) / 2
    g = np.pi**2 * np.sin(np.pi * s) ** 2 * w
    for length in (0.1, 1.0, 100.0):
        exact = 0.03 * np.sqrt(g @ np.exp(-abs(s[:, None] - s) / length) @ g)
        assert buckling.tolerance({"A": (0.03, length)}).deviation == pytest.approx(exact, rel=5e-3)


def test_deviation_by_a_family(tmp_path: Path) -> None:
    """By the rods at the points of Gauss's rule for a normal A, within the second order of the deviation."""
    scene, deviation = hemitropic_cases.scene(), 0.02
    first = rodfem.trace(scene, depth=0).special("branch point")[0].tolerance({"C": deviation})
    x, w = np.polynomial.hermite_e.hermegauss(5)
    loads = rodfem.family(scene, {"C": 1.0 + deviation * x}, tmp_path, PLAN).first_loss.values
    w = w / w.sum()
    assert first.deviation == pytest.approx(np.sqrt(w @ (loads - w @ loads) ** 2), rel=deviation**2)


def test_of_the_coefficient_of_a_pitchfork() -> None:
    """P = B pi^2/4 (1 + a^2/8), a = pi x/2 of the tip: pi^4/128 B x^2 (Timoshenko & Gere, section 2.7)."""
    elastica = classics.column(
        "elastica", classics.SUPPORTS["clamped-free"], (1.0, 5.0), planar="e1", constants={"B": 1.5},
        energy=lambda v, k, c: bending_and_twist(k, (c.B, 1.0, 1.0)),
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[1]),
    )  # fmt: skip
    buckling = rodfem.trace(elastica, depth=1).special("branch point")[0]
    found = buckling.coefficient_derivative("B")
    assert abs(found.value - pi**4 / 128) <= found.error < 2e-6


def test_loads_of_a_double_point_split() -> None:
    """The column of one stiffness in two planes: pi^2 for B, and nothing for A, in some basis of the null vectors."""
    diagram = rodfem.trace(round_column(), plan=PLAN)
    (buckling,) = diagram.special("branch point")
    assert buckling.multiplicity == 2
    for name in "AB":
        found = buckling.derivative(name)
        assert abs(found.splitting - found.splitting.T).max() < 1e-9
        assert np.linalg.eigvalsh(found.splitting) == pytest.approx([0.0, 4 * pi**2], abs=1e-8)
        assert found.value == pytest.approx(2 * pi**2) and found.error < 1e-6


def round_column() -> Scene:
    """A column between clamps whose two stiffnesses are one by accident."""
    ends = clamped(), sliding(lambda c: (0.0, 0.0, None), force=lambda c: (0.0, 0.0, -c.P))
    return replace(column().varying(B=1.0), ends=ends)


def test_of_an_ordinate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An arc of the curvature M / B + K: its end is (1 - cos k) / k off the tangent, and a sum over it is k."""
    arc = Scene(
        name="arc",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist((k[0] - c.K, k[1], k[2]), (c.B, 1.0, 1.0)),
        parameters={"M": Parameter(0.0), "B": Parameter(2.0), "K": Parameter(0.0)},
        load="M",
        ends=(clamped(), free(moment=lambda c: (c.M, 0.0, 0.0))),
        ordinate=Ordinate("deflection", s=1.0, of=lambda r, q: r[1]),
        span=(0.0, 3.0),
        planar="e1",
    )
    point = rodfem.Solver(arc).equilibrium(2.4)
    k = 1.2
    slope = (k * np.sin(k) - 1 + np.cos(k)) / k**2 * np.sign(point.ordinate)
    for name, factor in (("K", 1.0), ("B", -k / 2)):
        found = point.derivative(name)
        assert abs(found.value - factor * slope) <= found.error < 1e-7
    with pytest.raises(InputError, match="choose one of B, K"):
        point.derivative("M")
    along = point.derivative("K", along_the_rod=True)
    s, h = (along.ends[1:] + along.ends[:-1]) / 2, np.diff(along.ends)
    lever = (np.sin(k) - np.sin(k * s) * np.sinc(k * h / (2 * np.pi))) / k  # mean distance along the tangent to the end
    assert abs(abs(along.density) - lever).max() <= along.density_error < 1e-6
    assert along.density @ h == pytest.approx(along.value, abs=1e-8)
    asked = rodfem.run(arc, plan=Plan(at=(2.4,), sensitivity=True), output=tmp_path, figures=False)
    value, error = asked.special("user")[0].derivatives["K"]
    assert abs(abs(value) - abs(slope)) <= error < 1e-7
    assert "How fast the deflection at a load changes" in capsys.readouterr().out


def means(of: Callable[[np.ndarray], np.ndarray], ends: np.ndarray) -> np.ndarray:
    """Means (m,) of a function between ``ends`` (m + 1,)."""
    x, w = np.polynomial.legendre.leggauss(10)
    return of((ends[:-1] + ends[1:])[:, None] / 2 + np.diff(ends)[:, None] / 2 * x) @ w / 2


def test_of_flutter_along_the_rod() -> None:
    """Beck's column: ``-u'' w'' / int u'' w``, and of the mass ``mu u w / int u'' w``, by ``u`` and the adjoint ``w``.

    Both solve ``f_ssss + P f_ss = mu f`` and are zero with their slope at the clamp; at the tip ``u_ss = u_sss = 0``,
    and ``w_ss + P w = w_sss + P w_s = 0``.
    """
    (special,) = rodfem.trace(demo_cases.scene("follower")).special("flutter")
    P, mu = double(20.0, 120.0)
    a, b = (np.sqrt((np.sqrt(P**2 + 4 * mu) + sign * P) / 2) for sign in (-1, 1))

    def motion(load: float) -> tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
        """A motion with ``f_ss + load f = 0`` at the tip, and its second derivative."""
        one, two = load + a**2, load - b**2
        share = (one * np.cosh(a) - two * np.cos(b)) / (one * np.sinh(a) / a - two * np.sin(b) / b)

        def of(s: np.ndarray, grows: float = 1.0, waves: float = 1.0) -> np.ndarray:
            waves = waves * (share * np.sin(b * s) / b - np.cos(b * s))
            return grows * (np.cosh(a * s) - share * np.sinh(a * s) / a) + waves

        return of, partial(of, grows=a**2, waves=-(b**2))

    (u, u2), (w, w2) = motion(0.0), motion(P)
    (work,) = means(lambda s: u2(s) * w(s), np.array([0.0, 1.0]))
    for name, exact in (("B1", lambda s: -u2(s) * w2(s) / work), ("m", lambda s: mu * u(s) * w(s) / work)):
        found = special.derivative(name, along_the_rod=True)
        assert abs(found.density - means(exact, found.ends)).max() <= found.density_error < 1e-6
        assert found.density @ np.diff(found.ends) == pytest.approx(found.value, abs=1e-10)


def test_of_flutter_to_another_field() -> None:
    """The difference of the loads of two columns that are stiffer, and softer, between the clamp and the middle."""

    def beck(change: float) -> Scene:
        def energy(v: Any, k: Any, c: Any) -> Any:
            return bending_and_twist(k, (c.B1 + ufl.conditional(ufl.lt(c.s, 0.5), c.change, 0.0), 10.0, 1.0))

        constants = {"P": Parameter(19.0), "B1": Parameter(1.0), "change": Parameter(change)}
        return replace(demo_cases.scene("follower"), energy=energy, parameters=constants, inertia=Inertia(1.0))

    loads = [rodfem.trace(beck(change), plan=PLAN).special("flutter")[0].point.load for change in (-1e-3, 1e-3)]
    found = rodfem.trace(beck(0.0), plan=PLAN).special("flutter")[0].derivative("B1", along_the_rod=True)
    assert found.density @ (np.diff(found.ends) * (found.ends[1:] <= 0.5)) == pytest.approx(
        (loads[1] - loads[0]) / 2e-3, rel=1e-5
    )


@pytest.mark.parametrize("strong", [10.0, 1.0])
def test_of_divergence(strong: float) -> None:
    """``cos k = e/(e - 1)``, k = sqrt P, of a share e that follows; along the rod ``sin k (1 - s) cos k s``, times P.

    With one stiffness in both planes two loads vanish at once, each of which depends on that of its own.
    """
    rod, e = classics.partly_following(0.2, (0.0, 25.0), strong), 0.2
    for special in rodfem.trace(rod, Discretization("pointwise", 4, 6)).special("divergence"):
        P, count = special.point.load, 1 + (strong == 1.0)
        k = np.sqrt(P)
        found = special.derivative("share")
        assert found.value == pytest.approx(2 * k / np.sin(k) / (1 - e) ** 2, rel=1e-10)
        found = special.derivative("B1", along_the_rod=True)
        assert sorted(np.linalg.eigvals(found.splitting).real) == pytest.approx([0.0] * (count - 1) + [P], abs=1e-8)
        exact = means(lambda s, k=k: np.sin(k * (1 - s)) * np.cos(k * s), found.ends)  # type: ignore[misc]
        exact *= P / count / (exact @ np.diff(found.ends))
        assert abs(found.density - exact).max() <= found.density_error < 1e-5
        assert abs(found.value - P / count) <= found.error < 1e-7


def test_of_flutter_with_drag() -> None:
    """A filament in a viscous fluid: differences of the loads by shooting, and the load itself of the stiffness."""
    (special,) = rodfem.trace(replace(FILAMENT, span=(36.0, 40.0))).special("flutter")
    load, h = special.point.load, 1e-3
    found = special.derivative("part")
    difference = DIFFERENCE @ [flutters(load, 191.25863576525, 1.0 + side * h)[0] for side in (-2, -1, 1, 2)] / h
    assert abs(found.value - difference) <= found.error + 1e-8 * abs(difference)
    found = special.derivative("B2", along_the_rod=True)
    assert abs(found.value - load) <= found.error < 1e-6
    assert found.density @ np.diff(found.ends) == pytest.approx(load, abs=1e-9)


def test_of_flutter_in_the_stiffness(tmp_path: Path) -> None:
    """Beck's load is proportional to the stiffness; printed, saved, and loaded again."""
    scene = demo_cases.scene("follower")
    diagram = rodfem.run(scene, plan=Plan(sensitivity=True), output=tmp_path, figures=False, quiet=True)
    (flutter,) = diagram.special("flutter")
    value, error = flutter.derivatives["B1"]
    assert abs(value - flutter.point.load) <= error < 1e-6
    assert flutter.derivatives["J1"][0] == pytest.approx(-214.79555, abs=1e-5)  # of rods with J1 = 0, 1e-5, 2e-5, 3e-5
    saved = json.loads((tmp_path / "diagram.json").read_text())
    assert [value, error] in [s["derivatives"]["B1"] for s in saved["branches"][0]["special"] if s["derivatives"]]
    assert rodfem.load(tmp_path, scene).special("flutter")[0].derivatives["B1"] == (value, error)
