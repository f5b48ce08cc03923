"""Random conservative scenes, and a count of each of their states by dense linear algebra.

The oracle shares with rodfem the matrices of a state alone: the second variation is projected on the null space of the
constraints by a singular value decomposition, without phase conditions, and its eigenvalues are counted.

    python -m tests.fuzz --scenes 80 --seed 1 [--depth 1]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import StringIO
from itertools import pairwise
from math import hypot, pi
from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from forms import loads
from forms.energy import bending_and_twist, logarithmic_stretch
from rodfem import (
    Attachment,
    Constraint,
    Discretization,
    End,
    Ordinate,
    Parameter,
    Plan,
    Ring,
    Scene,
    StepControl,
    at,
    clamped,
    elastic,
    everywhere,
    free,
    hinged,
    integral,
    pinned,
    sliding,
    trace,
)  # fmt: skip
from rodfem.app.terminal import Report
from rodfem.continuation.branch import Branch
from rodfem.continuation.solvers import BranchSolver
from rodfem.diagram.diagram import Diagram
from rodfem.errors import ConvergenceError, InputError, SceneError
from rodfem.fem.system import System
from rodfem.linalg.matrices import gathered
from rodfem.stability.pencil import assemble_pencil

ZERO, NEAR = 1e-7, 1e-4
"""An eigenvalue less than the first, over the lowest bending one, is zero; between the two it may be either."""
OF_A_RING = 1e-2
"""The second where a closed rod may move along itself: the mesh's eigenvalue of that motion."""


# --- scenes ---------------------------------------------------------------------------------------------------------


def energy_of(rng: np.random.Generator, rod: str) -> tuple[Callable[..., Any], dict[str, float]]:
    """Random convex energy: quadratic, cosh or both, round or elliptic, with a natural shape or without."""
    B = rng.uniform(0.5, 3.0, 3)
    if rng.random() < 0.4:
        B[1] = B[0]
    constants = {"B1": B[0], "B2": B[1], "C": B[2], "k0": 0.0, "t0": 0.0, "a": 0.0, "GA": 60.0, "EA": 40.0, "m": 0.0}
    constants["k0"] = rng.choice([0.0, 0.0, rng.uniform(0.1, 1.0)])
    constants["t0"] = rng.choice([0.0, 0.0, rng.uniform(0.1, 1.0)])
    constants["a"] = rng.choice([0.0, 0.5, 1.0])
    constants["m"] = rng.choice([0.0, 0.0, 0.3])
    stretching = rng.choice(["quadratic", "logarithmic"])

    def energy(v: Any, k: Any, c: Any) -> Any:
        turned = (k[0], k[1] - c.k0, k[2] - c.t0)
        out = bending_and_twist(turned, (c.B1, c.B2, c.C)) + c.m * turned[0] * turned[2] * 0.5
        out += c.a * sum(ufl.cosh(0.7 * x) - 1 for x in turned)
        if rod in ("flexible", "inextensible"):
            out += 0.5 * c.GA * (v[0] ** 2 + v[1] ** 2)
        if rod in ("flexible", "unshearable"):
            out += logarithmic_stretch(v, c.EA) if stretching == "logarithmic" else 0.5 * c.EA * (v[2] - 1) ** 2
        return out

    return energy, constants


def push(c: Any) -> tuple[Any, ...]:
    return (c.H, 0.0, -c.P)


def ends_of(rng: np.random.Generator) -> tuple[End, End]:
    """Random ends, of which the right one is pushed along e3."""
    axis: Any = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8)][rng.integers(3)]

    def on_axis(c: Any) -> tuple[Any, ...]:
        return (0.0, 0.0, None)

    def turned(c: Any) -> tuple[Any, ...]:
        return (ufl.cos(0.05 * c.P), 0.0, 0.0, ufl.sin(0.05 * c.P))

    left = [clamped(), clamped(), pinned(), hinged(axis)][rng.integers(4)]
    stiff = float(rng.uniform(1.0, 30.0))
    right = [
        free(push),
        elastic(lambda c: (stiff, stiff, 0.0), force=push),
        elastic(lambda c: (stiff, 2 * stiff, 0.0), lambda c: stiff, (0.0, 0.0, 1.0), force=push),
        pinned(on_axis, push),
        sliding(on_axis, force=push),
        sliding(lambda c: (0.0, None, None), force=push),
        sliding(on_axis, turned, force=push),
        hinged(axis, on_axis, force=push),
    ]
    allowed = slice(0, None) if left.fixed_rotation is not None else slice(1, None)
    choices = right[allowed]
    return left, choices[rng.integers(len(choices))]


def column(rng: np.random.Generator, number: int) -> Scene:
    """Random rod between two ends."""
    rod = str(rng.choice(["flexible", "unshearable", "inextensible", "unshearable and inextensible"]))
    energy, constants = energy_of(rng, rod)
    planar = str(rng.choice(["e1", "e2"])) if rng.random() < 0.2 else None
    constants |= {"P": 0.0, "k": rng.uniform(20.0, 300.0), "w": rng.uniform(0.5, 5.0), "H": 0.0}
    if planar is not None:
        constants |= {"t0": 0.0, "m": 0.0, "k0": constants["k0"] if planar == "e2" else 0.0}
    ends = ends_of(rng)
    if planar is None or planar == "e2":
        constants["H"] = float(rng.choice([0.0, 0.0, 0.0, 0.05, 1e-4]))
    if planar is not None and any(e.hinge == (0.6, 0.0, 0.8) for e in ends):
        planar = None
    more: dict[str, Any] = {}
    extra = rng.choice(["", "", "foundation", "gravity", "spring", "constraint"])
    if extra == "foundation":
        stiffness = [1.0, 1.0, 0.0] if rng.random() < 0.6 else [1.0, 0.3, 0.0]
        more["potential"] = lambda x, c: loads.spring(x.r, [c.k * y for y in stiffness])
    elif extra == "gravity":
        more["distributed"] = lambda c: (0.0, 0.0, -c.w)
    elif extra == "spring":
        more["attachments"] = (Attachment(0.4, energy=lambda x, c: loads.spring(x.r, (c.k, c.k, 0.0))),)
    elif extra == "constraint":
        kept: list[Constraint] = [integral(lambda x, c: x.r[0])]
        if planar is None:
            kept += [at(0.5, lambda x, c: x.r[1]), everywhere(lambda x, c: x.k[0], strain=True)]
        more["constraints"] = (kept[rng.integers(len(kept))],)
    parameters = {n: Parameter(float(x)) for n, x in constants.items()}
    ordinate = Ordinate("middle", s=0.5, of=lambda r, q: hypot(r[0], r[1]))
    most = float(rng.uniform(8.0, 40.0))
    return Scene(f"column {number}", (0.0, 1.0), rod, energy, parameters, "P", ends, ordinate, (0.0, most),
                 planar=planar, **more)  # fmt: skip


def circle(s: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1)


def ring(rng: np.random.Generator, number: int) -> Scene:
    """Random closed rod: pressed, under a load of fixed direction that depends on the arclength, or twisted."""
    rod = str(rng.choice(["unshearable", "unshearable and inextensible"]))
    energy, constants = energy_of(rng, rod)
    planar = "e2" if rng.random() < 0.5 else None
    constants |= {"P": 0.2, "k0": 0.0, "t0": 0.0, "m": 0.0, "H": 0.0}
    more: dict[str, Any] = {}
    kind = rng.choice(["pressure", "radial", "wave", "foundation"])
    if kind == "pressure":
        more["potential"] = lambda x, c: loads.pressure(x.r, x.dr, c.P)
    elif kind == "radial":
        more["distributed"] = lambda c: (c.P * ufl.cos(c.s), 0.0, -c.P * ufl.sin(c.s))
    elif kind == "wave":
        waves = int(rng.integers(2, 5))
        more["distributed"] = lambda c: (c.P * ufl.cos(waves * c.s), 0.0, 0.0)
    else:
        more["potential"] = lambda x, c: c.P * (x.r[0] ** 2 + 0.4 * x.r[2] ** 2)
    parameters = {n: Parameter(float(x)) for n, x in constants.items()}
    ordinate = Ordinate("width", s=pi, of=lambda r, q: float(np.linalg.norm(r)))
    return Scene(f"ring {number}, {kind}", (0.0, 2 * pi), rod, energy, parameters, "P", Ring(), ordinate, (0.2, 5.0),
                 planar=planar, start=circle, **more)  # fmt: skip


def scenes(seed: int, count: int) -> Iterator[Scene]:
    """Random scenes, each of its own generator: number i of a seed is the same whatever is asked for besides."""
    made, number = 0, 0
    while made < count:
        rng = np.random.default_rng([seed, number])
        try:
            scene = (ring if rng.random() < 0.2 else column)(rng, number)
        except SceneError:  # no such rod can be: the next
            number += 1
            continue
        number, made = number + 1, made + 1
        yield scene


# --- the oracle -----------------------------------------------------------------------------------------------------


class Oracle:
    """Counts by dense linear algebra, on every rank alike."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.matrix, self.mass = system.state_matrix(), system.metric_matrix()
        f = system.fields
        fields = [f.number[f.dofs[b.name]].ravel() for b in f.blocks if b.multiplier]
        mine = np.unique(np.concatenate([np.zeros(0, int), *fields]))
        every = np.concatenate(system.comm.allgather(mine[mine >= 0]))
        scalar = [f.scalars[x.name] for x in f.unknown_scalars if x.multiplier]
        self.constraints = np.unique(np.append(every, scalar).astype(int))
        none = [f.scalars["load"], *system.drifts]
        self.state = np.setdiff1d(np.arange(f.unknowns), np.append(self.constraints, none))
        self.scale = system.stiffness_scale

    def eigenvalues(self, x: PETSc.Vec) -> np.ndarray:
        """Eigenvalues of K on the null space of C, relative to the metric (strains: to a small one)."""
        assemble_pencil(self.system, x, self.matrix, self.mass)
        S = gathered(self.matrix).toarray()
        M = gathered(self.system.metric).toarray()
        K, C = S[np.ix_(self.state, self.state)], S[np.ix_(self.state, self.constraints)]
        u, s, _ = np.linalg.svd(C)
        Z = u[:, int((s > 1e-11 * s[0]).sum()) :] if s.size else np.eye(len(K))
        G = M[np.ix_(self.state, self.state)]
        G = G + 1e-3 * np.diag(np.where(np.diag(G) == 0, np.diag(G)[np.diag(G) > 0].mean(), 0.0))
        L = np.linalg.cholesky(Z.T @ G @ Z)
        half = np.linalg.solve(L, Z.T @ (K + K.T) / 2 @ Z)
        full = np.linalg.solve(L, half.T)
        return np.linalg.eigvalsh((full + full.T) / 2)


@dataclass
class Finding:
    """What one scene shows: rows compared, rows too near a critical state, and sentences on what differs."""

    scene: str
    rows: int = 0
    unclear: int = 0
    wrong: list[str] = field(default_factory=list)
    chain: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)


def compare(follower: BranchSolver, branch: Branch, finding: Finding) -> None:
    """Compare index and zeros of each row with the oracle's."""
    oracle = Oracle(follower.system)
    special = {id(s.point) for s in branch.special if s.kind in ("fold", "branch point")}
    for row, p in enumerate(branch.points):
        mu = oracle.eigenvalues(p.x) / oracle.scale
        along = any(s.along for s in follower.system.symmetries)
        near = OF_A_RING if along else NEAR
        unclear = ((abs(mu) > ZERO) & (abs(mu) < near)).any() or id(p) in special
        negative, zero = int((mu < -ZERO).sum()), int((abs(mu) <= ZERO).sum())
        finding.rows += 1
        if unclear:
            finding.unclear += 1
        elif (p.negative, p.zero) != (negative, zero):
            least = ", ".join(f"{m:.3g}" for m in mu[: negative + zero + 2])
            finding.wrong.append(
                f"{branch.name} row {row}, load {p.load:.8g}: recorded ({p.negative}, {p.zero}), dense "
                f"({negative}, {zero}) of {least}"
            )


def chain(branch: Branch, finding: Finding) -> None:
    """Whether from row to row the index changes by what the special points in between say."""
    special = sorted((s for s in branch.special if s.kind in ("fold", "branch point")), key=lambda s: s.point.arclength)
    at_special = {id(s.point) for s in special}
    least = min(p.zero for p in branch.points)  # a row with an eigenvalue near zero may have either index
    rows = [p for p in branch.points if id(p) not in at_special and p.zero == least]
    for a, b in pairwise(rows[1:] if branch.parent else rows):
        index = a.negative
        for s in (s for s in special if a.arclength < s.point.arclength < b.arclength):
            if s.negative_before != index:
                break
            index = s.negative_after
        else:
            if index == b.negative:
                continue
        finding.chain.append(f"{branch.name}, from {a.load:.8g} ({a.negative}) to {b.load:.8g} ({b.negative})")


def examine(scene: Scene, depth: int = 0, elements: int = 6, degree: int = 5) -> Finding:
    """Trace a scene coarsely and compare all of its rows."""
    finding, text = Finding(scene.name), StringIO()
    plan = Plan(scene.span, depth=depth, steps=StepControl(first=0.05, largest=0.2, most=40), error_bars=False)
    diagram: Diagram | None = None
    try:
        diagram = trace(scene, Discretization("auto", elements, degree), plan, Report(stream=text))
    except (InputError, ConvergenceError) as trouble:
        finding.said.append(f"{type(trouble).__name__}: {trouble}")
        diagram = getattr(trouble, "diagram", None)
    finding.said += [line.strip() for line in text.getvalue().splitlines() if line.startswith("  !")]
    for branch in diagram or ():
        if branch.points:
            compare(diagram.solvers[0], branch, finding)
            chain(branch, finding)
    return finding


def main() -> None:
    """Examine scenes, and print what differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--depth", type=int, default=0)
    given = parser.parse_args()
    found = []
    for scene in scenes(given.seed, given.scenes):
        finding = examine(scene, given.depth)
        found.append(finding)
        for kind in ("wrong", "chain", "said"):
            for sentence in getattr(finding, kind):
                print(f"{finding.scene}: {kind}: {sentence}", flush=True)
    rows, unclear = sum(f.rows for f in found), sum(f.unclear for f in found)
    print(
        f"{len(found)} scenes, {rows} dense counts ({unclear} too near a critical state): "
        f"{sum(len(f.wrong) for f in found)} differ, {sum(len(f.chain) for f in found)} links of chains are broken"
    )


if __name__ == "__main__":
    main()
