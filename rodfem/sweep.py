"""Frequencies against the load for a rod under loads without a potential, and the loads at which they become unstable.

At each load the equilibrium is solved for, and the left-most eigenvalues ``mu = omega^2`` of its pencil are
found.  Where two real ones collide and become a complex pair, the square of half their difference ``D = ((mu1 -
mu2)/2)^2`` passes through zero.  Unlike the eigenvalues, which have a square root there, ``D`` is a smooth
function of the load: the discriminant of the pencil projected on the two of them.  Its zero is found by Chebyshev
interpolation, at spectral accuracy and without ever solving at the double eigenvalue.  Where a single real one
passes through zero the rod diverges: the eigenvalue itself is smooth there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.polynomial import chebyshev
from petsc4py import PETSc
from scipy.optimize import brentq, newton

from rodfem.accuracy import Transfer
from rodfem.branch import DIVERGENCE, END, FLUTTER, USER, Branch, Point, Special
from rodfem.continuation import Equilibria
from rodfem.errors import ConvergenceError, SceneError
from rodfem.locate import real_root, zero_uncertainty
from rodfem.plan import Plan
from rodfem.report import Report
from rodfem.stability.vibration import Frequencies, Vibration
from rodfem.system import System

LOADS = 101
"""Number of loads at which a range is sampled."""
FREQUENCIES = 6
"""Number of frequencies recorded at each load where nobody asks for another."""
SEEN = 0.5
"""A pair within this fraction of the distance from the origin to the farthest eigenvalue found was found again."""
SAME = 1e-9
"""Loads, or eigenvalues, that differ by less than this, relative to them, are one."""
DRIVEN = 1e-7
"""Drift, over the rod's lowest bending eigenvalue, above which loads drive a motion that nothing holds."""
REAL = 1e-7
"""An imaginary part smaller than this, relative to the eigenvalue, is round-off of a real one."""


class Sweep:
    """Sweeps the load of a scene over a range from its start state; used like the explorer of conservative scenes."""

    def __init__(self, solver: Equilibria, plan: Plan, report: Report, finished: Callable[[], None]) -> None:
        """Allocate the pencil; the plan must have passed its check."""
        self.solver, self.plan, self.report, self.finished = solver, plan, report, finished
        self.vibration = Vibration(solver.system)
        self.number = plan.spectrum or FREQUENCIES
        self.pairs: list[complex] = []
        self.branches: list[Branch] = []

    @property
    def solvers(self) -> Sequence[Equilibria]:
        """The one solver, as the points' mesh number 0 names it."""
        return [self.solver]

    def run(self) -> list[Branch]:
        """Sweep, locate flutter, estimate errors."""
        scene = self.solver.system.scene
        branch = Branch(scene.states, None, 0)
        self.branches.append(branch)
        self.report.branch(branch)
        a, b = self.plan.span
        loads = np.unique([*np.linspace(a, b, LOADS), *self.plan.at])
        x, _ = self.solver.first(a)
        for motion in self.solver.system.free_motions():
            self.report.say(f"  nothing holds the rod against the {motion}: its frequency, zero, is left out")
        for load in loads if a < b else loads[::-1]:
            x = self._state(x, float(load))
            before = self.pairs
            point = self._point(x)
            for notice in self.solver.system.verification.read():
                self.report.warn(notice)
            if branch.points:
                self._between(branch, branch.points[-1], point, before, self.pairs)
            branch.points.append(point)
            if load in self.plan.at:
                self._special(branch, Special(USER, point, point.negative, point.negative, 1e-12 * max(1.0, abs(load))))
            self.report.progress(branch, point)
        branch.ended = "end of range"
        last = branch.points[-1]
        branch.special.append(Special(END, last, last.negative, last.negative, 1e-12 * max(1.0, abs(last.load))))
        branch.renumber()
        if self.plan.error_bars:
            self._error_bars(branch)
        self.report.finished(branch)
        rank, size = self.vibration.asymmetry()
        self.report.say(
            f"  the load makes the tangent matrix non-symmetric by a matrix of rank {rank} "
            f"(largest entry {size:.1e} of |S|):\n"
            f"  factors of the symmetric part and {rank} more solves would do for it (Sherman-Morrison-Woodbury)"
        )
        self.finished()
        return self.branches

    def _state(self, guess: PETSc.Vec, load: float) -> PETSc.Vec:
        return at_load(self.solver, guess, load)

    def _point(self, x: PETSc.Vec) -> Point:
        solver, system = self.solver, self.solver.system
        found = self._leftmost(x)
        values = found.values
        self.pairs = [complex(v) for v in values if v.imag > 0]
        unstable = found.unstable(REAL * max(1.0, float(abs(values).min())))
        load = system.scalar(x)
        return Point(
            x=x,
            tangent=None,
            arclength=abs(load - self.plan.span[0]),
            load=load,
            ordinate=solver.shape.ordinate(x),
            energy=solver.energy(x),
            stretch=solver.shape.stretch(x),
            negative=unstable,
            zero=int((abs(values) < REAL).sum()) + system.active_drifts(),
            slope=float("nan"),
            drift=0.0,
            error=0.0,
            omega2=[[float(v.real), float(v.imag)] for v in values[: self.number]],
            motion=list(found.kinds[: self.number]),
        )

    def _leftmost(self, x: PETSc.Vec) -> Frequencies:
        """Left-most eigenvalues: those near the origin, and what became of the complex ones before.

        A complex shift looks for a pair that may be farther from the origin than all that the real shift found.
        """
        self.vibration.assemble(x)
        near = self.vibration.near(max(self.number, FREQUENCIES) + 6, -1e-3)
        reach = SEEN * abs(near.values).max()
        found = list(zip(near.values, near.errors, near.kinds, strict=True))
        for pair in (p for p in self.pairs if abs(p) > reach):
            beside = self.vibration.near(2, pair * (1 + 1e-4))
            for value, error, kind in zip(beside.values, beside.errors, beside.kinds, strict=True):
                for v in (value, value.conjugate()) if abs(value.imag) > REAL * abs(value) else (value,):
                    if all(abs(v - other) > 1e-7 * max(1.0, abs(v)) for other, _, _ in found):
                        found.append((v, error, kind))
        real = [(complex(v.real) if abs(v.imag) < REAL * abs(v) else complex(v), *rest) for v, *rest in found]
        values, errors, kinds = zip(*sorted(real, key=lambda f: (round(f[0].real, 6), f[0].imag)), strict=True)
        return Frequencies(np.array(values), np.array(errors), kinds)

    def _between(self, branch: Branch, a: Point, b: Point, before: list[complex], after: list[complex]) -> None:
        """Locate flutter between two loads, where the number of complex pairs changes; else divergence."""
        pairs = [before, after]
        if len(before) == len(after):
            self._diverging(branch, a, b)
            return
        with self.solver.system.clock.purpose("location"):
            few, many = sorted(pairs, key=len)
            new = max(many, key=lambda v: min((abs(v - w) for w in few), default=np.inf))
            middle = (a.load + b.load) / 2
            try:
                located = locate_flutter(
                    lambda load, center: discriminant(self.solver, self.vibration, load, center, a.x),
                    middle,
                    abs(b.load - a.load),
                    new.real,
                )
            except ConvergenceError as trouble:
                self.report.warn(f"{len(few)} complex pairs become {len(many)} near {middle:.6g}: {trouble}")
                self.pairs = after
                return
            load, uncertainty, mu = located
            x = self._state(a.x, load)
            point = self._point(x)
            self.pairs = after
        special = Special(FLUTTER, point, a.negative, b.negative, uncertainty, omega2=mu)
        branch.points.append(point)
        self._special(branch, special)

    def _diverging(self, branch: Branch, a: Point, b: Point) -> None:
        """Locate the loads between two at which a real eigenvalue passes through zero; equal ones are one point."""
        pairs, loads = len(self.pairs), sorted((a.load, b.load))
        first, last = (p.negative - 2 * pairs for p in (a, b))
        with self.solver.system.clock.purpose("location"):
            found: list[float] = []
            for number in range(min(first, last), max(first, last)):

                def mu(load: float, number: int = number) -> float:
                    return self._real(a.x, load)[number]

                try:
                    load = float(brentq(mu, *loads, xtol=1e-12 * max(map(abs, loads))))
                except (ConvergenceError, IndexError, ValueError):
                    self.report.warn(
                        f"Divergence between {a.load:.6g} and {b.load:.6g} could not be located: use a smaller range."
                    )
                    return
                found.append(load)
            groups: list[list[float]] = []
            for load in sorted(found, reverse=b.load < a.load):
                if groups and abs(load - groups[-1][0]) < SAME * max(1.0, abs(load)):
                    groups[-1].append(load)
                else:
                    groups.append([load])
            before, kept = a.negative, self.pairs
            for group in groups:
                point = self._point(self._state(a.x, group[0]))
                after = before + (len(group) if last > first else -len(group))
                branch.points.append(point)
                located_to = 1e-11 * max(1.0, abs(point.load))
                self._special(branch, Special(DIVERGENCE, point, before, after, located_to, omega2=0.0))
                before = after
            self.pairs = kept

    def _real(self, guess: PETSc.Vec, load: float) -> list[float]:
        """Real eigenvalues at a load near the origin, in ascending order."""
        return sorted(v.real for v in self._leftmost(self._state(guess, load)).values if v.imag == 0)

    def _special(self, branch: Branch, special: Special) -> None:
        branch.special.append(special)
        self.report.special(branch, special)

    def _error_bars(self, branch: Branch) -> None:
        with self.solver.system.clock.purpose("error bars"):
            system = self.solver.system
            d = system.fields.discretization
            richer = Equilibria(
                System(system.scene, replace(d, degree=d.degree + 1), system.comm, system.clock, system.fields.mesh)
            )
            vibration, transfer = Vibration(richer.system), Transfer(system, richer.system)
            for s in branch.special:
                floor = max(s.located_to, 1e-12 * max(1.0, abs(s.point.load)))
                guess = transfer(s.point.x, state=True)
                x = at_load(richer, guess, s.point.load)
                s.ordinate_error = max(abs(richer.shape.ordinate(x) - s.point.ordinate), floor)
                s.error_estimate = s.ordinate_error
                if s.kind == FLUTTER:
                    load, _, mu = self._richer_flutter(richer, vibration, guess, s)
                    s.error_estimate = max(abs(load - s.point.load), floor)
                    s.omega2_error = max(abs(mu - s.omega2), 1e-12 * abs(mu))
                elif s.kind == DIVERGENCE:
                    s.error_estimate = max(abs(_zero(richer, vibration, x, s.point.load) - s.point.load), floor)
                asked = self.plan.accuracy
                if asked is not None and s.error_estimate > asked * max(1.0, abs(s.point.load)):
                    s.note = s.note or f"accuracy {asked:g} not reached"

    @staticmethod
    def _richer_flutter(
        richer: Equilibria, vibration: Vibration, guess: PETSc.Vec, s: Special
    ) -> tuple[float, float, float]:
        """Flutter load on the richer discretisation, its uncertainty, and the double eigenvalue."""

        def f(load: float, center: float) -> tuple[float, float]:
            return discriminant(richer, vibration, load, center, guess)

        return locate_flutter(f, s.point.load, 0.05 * abs(s.point.load), s.omega2)


def at_load(solver: Equilibria, guess: PETSc.Vec, load: float) -> PETSc.Vec:
    """Equilibrium at a load from a ``guess`` nearby; raises :class:`ConvergenceError` where there is none."""
    system, name = solver.system, solver.system.scene.load
    system.set_phase(guess)
    x, outcome = solver.at_load(guess, load)
    if not outcome.converged:
        raise ConvergenceError(f"No equilibrium at {name} = {load:g}: use a smaller range.")
    if system.drift(x) > DRIVEN * system.stiffness_scale:
        raise SceneError(
            f"There is no equilibrium at {name} = {load:g}: nothing holds the rod against the "
            f"{' or the '.join(system.free_motions())}, and the loads drive it; hold that motion at one end, or "
            "balance the loads."
        )
    return x


def _zero(solver: Equilibria, vibration: Vibration, guess: PETSc.Vec, load: float) -> float:
    """Load near ``load`` at which the eigenvalue nearest to the origin vanishes."""

    def mu(load: float) -> float:
        vibration.assemble(at_load(solver, guess, load))
        values = vibration.near(2, 0.0).values
        return float(values[np.argmin(abs(values))].real)

    return float(newton(mu, load, x1=load + 1e-4 * max(1.0, abs(load)), tol=1e-12 * max(1.0, abs(load))))


def discriminant(
    solver: Equilibria, vibration: Vibration, load: float, center: float, guess: PETSc.Vec
) -> tuple[float, float]:
    """Discriminant ``((mu1 - mu2)/2)^2`` of the two eigenvalues nearest to ``center`` at ``load``, and their mean.

    ``guess`` is an equilibrium at a load nearby.  Where the rod bends alike in all planes each eigenvalue comes twice,
    its motion in any plane: of those no two equal ones are taken, and the names of the motions say nothing.
    """
    vibration.assemble(at_load(solver, guess, load))
    found = vibration.near(4, 0.97 * center)
    values = found.values
    repeated = [sum(abs(p - v) < SAME * abs(p) for v in values) > 1 for p in values]
    best: tuple[float, complex, complex] | None = None
    for i, p in enumerate(values):
        for j, q in enumerate(values[i + 1 :], start=i + 1):
            alike = found.kinds[i] == found.kinds[j] or (repeated[i] and repeated[j])
            both_real = abs(p.imag) + abs(q.imag) < REAL * abs(p) and alike and abs(p - q) >= SAME * abs(p)
            conjugate = abs(p - q.conjugate()) < REAL * abs(p)
            if both_real or conjugate:
                distance = abs((p + q) / 2 - center) + 0.1 * abs(p - q)
                if best is None or distance < best[0]:
                    best = (distance, p, q)
    if best is None:
        raise ConvergenceError(f"No pair of eigenvalues near {center:.6g} at load {load:.8g}: use a smaller range.")
    p, q = best[1], best[2]
    return float((((p - q) / 2) ** 2).real), float(((p + q) / 2).real)


def locate_flutter(
    f: Callable[[float, float], tuple[float, float]], load: float, width: float, center: float
) -> tuple[float, float, float]:
    """Load at which the discriminant ``f(load, center)`` vanishes, its uncertainty, and the double eigenvalue there.

    Chebyshev interpolation on a piece that is moved to the zero and shrunk until the last coefficient says that
    it is sharp.
    """
    half, best = width, (load, np.inf, center)
    for _ in range(12):
        t = np.cos(np.pi * (np.arange(6)[::-1] + 0.5) / 6)
        values = []
        for node in load + half * t:
            values.append(f(float(node), center))
        d, mean = np.array([v[0] for v in values]), np.array([v[1] for v in values])
        series = chebyshev.chebfit(t, d, 5)
        root = real_root(series, 0.0)
        if root is None:
            slope = (d[-1] - d[0]) / (2 * half)
            load += float(np.clip(-(d[0] + d[-1]) / 2 / slope, -2 * half, 2 * half))
            continue
        load += half * root
        center = float(chebyshev.chebval(root, chebyshev.chebfit(t, mean, 5)))
        uncertainty = max(half * zero_uncertainty(series, root), 1e-12 * abs(load))
        if abs(root) < 1 and uncertainty < best[1]:
            best = (load, uncertainty, center)
        elif best[1] < 1e-8 * abs(load):
            break
        if best[1] < 1e-11 * abs(load):
            break
        half /= 4
    if not np.isfinite(best[1]):
        raise ConvergenceError(f"The flutter load near {load:.6g} could not be located: use a smaller range.")
    return best
