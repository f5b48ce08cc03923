"""Classical problems of the stability of rods, each stated by the public interface; explored once each.

Lengths, bending stiffness and mass per length are one unless a scene says otherwise.  Material constants are
parameters, so that scenes that differ in numbers only share their compiled forms.
"""

from collections.abc import Callable
from math import cos, hypot, pi, sin
from typing import Any

import numpy as np
import ufl
from rows import verify

from rodfem import (
    Attachment,
    Constraint,
    Diagram,
    Discretization,
    End,
    Inertia,
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
)
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.kinds import BRANCH_POINT
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist

RIGID = "unshearable and inextensible"
FORMULATIONS = ("reduced", "pointwise")
WIDE = StepControl(first=0.05, largest=0.15)
BEAM = Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.0))
Vector = Callable[[Any], tuple[Any, ...]]


# --- computing ------------------------------------------------------------------------------------------------------


class Found:
    """Branches of a scene, and what computed them."""

    def __init__(self, diagram: Diagram) -> None:
        self.solver, self.branches = diagram.solvers[0], diagram.branches

    def special(self, kind: str = BRANCH_POINT, branch: int = 0) -> list[SpecialPoint]:
        """Special points of one kind along a branch."""
        return [s for s in self.branches[branch].special if s.kind == kind]

    def loads(self, kind: str = BRANCH_POINT, branch: int = 0) -> list[float]:
        """Loads of those."""
        return [s.point.load for s in self.special(kind, branch)]

    def sample(self, branch: int = 0, load: float | None = None) -> dict[str, Any]:
        """State at the end of a branch, or at a load that was asked for."""
        points = [s.point for s in self.special("user", branch) if s.point.load == load]
        return self.solver.shape.sample((points or self.branches[branch].points)[-1].x)


def explore(
    scene: Scene, formulation: str = "auto", elements: int = 8, depth: int = 0, stops: tuple[float, ...] = ()
) -> Found:
    """Trace the branches of a conservative scene."""
    plan = Plan(at=stops, depth=depth, steps=WIDE, error_bars=False)
    found = Found(trace(scene, Discretization(formulation, elements, 6), plan))
    verify(found.solver, found.branches)
    return found


def sweep(scene: Scene, elements: int = 4) -> Found:
    """Frequencies over the range of loads of a scene that is not conservative."""
    return Found(trace(scene, Discretization("auto", elements, 6), Plan(error_bars=False)))


# --- columns --------------------------------------------------------------------------------------------------------


def push(c: Any) -> tuple[Any, ...]:
    """A dead thrust P."""
    return (0.0, 0.0, -c.P)


def column(name: str, ends: tuple[End, End], span: tuple[float, float], **more: Any) -> Scene:
    """A straight inextensible rod, bent about d1 more easily than about d2 by a factor B2; what else is given."""
    given: dict[str, Any] = {
        "interval": (0.0, 1.0),
        "rod": RIGID,
        "energy": lambda v, k, c: bending_and_twist(k, (c.B1, c.B2, c.C)),
        "load": "P",
        "ordinate": Ordinate("tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
    }
    constants = {"P": 0.0, "B1": 1.0, "B2": 2.0, "C": 1.0, "k": 0.0} | more.pop("constants", {})
    parameters = {n: Parameter(x) for n, x in constants.items()}
    return Scene(name=name, ends=ends, span=span, parameters=parameters, **given | more)


ON_AXIS: Vector = lambda c: (0.0, 0.0, None)  # noqa: E731
SUPPORTS = {
    "clamped-free": (clamped(), free(push)),
    "pinned-pinned": (pinned(), pinned(ON_AXIS, push)),
    "clamped-pinned": (clamped(), pinned(ON_AXIS, push)),
    "clamped-clamped": (clamped(), sliding(ON_AXIS, force=push)),
    "hinged-clamped": (hinged((1.0, 0.0, 0.0)), sliding(ON_AXIS, force=push)),
}


def euler(supports: str) -> Scene:
    return column(supports, SUPPORTS[supports], (0.0, 45.0))


def turning_in_plane() -> Scene:
    """Pinned ends, in the plane across e2: the straight rod may turn about its axis, and buckles in the plane only."""
    kept = (everywhere(lambda x, c: x.r[1], strain=False),)
    return column("turning", SUPPORTS["pinned-pinned"], (0.0, 90.0), constraints=kept)


def elastica(most: float) -> Scene:
    return column("elastica", SUPPORTS["clamped-free"], (0.0, most))


def shearable(rod: str, GA: float, EA: float, constraints: tuple[Constraint, ...] = ()) -> Scene:
    """Stiff sections that shear and stretch."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        return (
            0.5 * c.GA * (v[0] ** 2 + v[1] ** 2)
            + 0.5 * c.EA * (v[2] - 1) ** 2
            + bending_and_twist(k, (c.B1, c.B2, c.C))
        )

    return column(
        "shearable", SUPPORTS["clamped-free"], (0.0, 4.0), rod=rod, energy=energy, constraints=constraints,
        constants={"GA": GA, "EA": EA},
    )  # fmt: skip


def timoshenko(GA: float) -> Scene:
    """Engesser's and Timoshenko's column: not the sections' distance but the centreline's length is kept."""
    length = everywhere(lambda x, c: ufl.dot(x.v, x.v) - 1.0, strain=True)
    return shearable("flexible", GA, 100.0, (length,))


def heavy() -> Scene:
    return column("heavy", (clamped(), free()), (0.0, 10.0), distributed=push)


def winkler() -> Scene:
    """Pinned ends on a foundation."""
    return column(
        "winkler", SUPPORTS["pinned-pinned"], (0.0, 60.0), constants={"k": 300.0},
        potential=lambda x, c: loads.spring(x.r, (c.k, c.k, 0.0)),
    )  # fmt: skip


def tip_spring() -> Scene:
    """Clamped below, a spring across at the tip."""
    ends = (clamped(), elastic(lambda c: (c.k, c.k, 0.0), force=push))
    return column("tip spring", ends, (0.0, 15.0), constants={"k": 10.0})


def foot_spring() -> Scene:
    """Free above, an elastic joint at the foot."""
    foot = End(position=lambda c: (0.0, 0.0, 0.0), energy=lambda x, c: loads.rotational_spring(x.q, c.k))
    return column("foot spring", (foot, free(push)), (0.0, 4.0), constants={"k": 3.0})


def point_load(s: float) -> Scene:
    return column("point load", (clamped(), free()), (0.0, 3.0 / s**2), attachments=(Attachment(s, force=push),))


def stepped(s: float) -> Scene:
    """Below ``s`` twice as stiff as above."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        factor = ufl.conditional(ufl.lt(c.s, c.k), 2.0, 1.0)
        return factor * bending_and_twist(k, (c.B1, c.B2, c.C))

    return column(
        "stepped", SUPPORTS["clamped-free"], (0.0, 6.0), energy=energy, breaks=(s,), constants={"k": s}
    )  # fmt: skip


def tip_on_plane() -> Scene:
    return column("plane", SUPPORTS["clamped-free"], (0.0, 22.0), constraints=(at(1.0, lambda x, c: x.r[1]),))


def middle_on_line() -> Scene:
    kept = tuple(at(0.5, lambda x, c, i=i: x.r[i]) for i in range(2))
    return column("line", SUPPORTS["pinned-pinned"], (0.0, 45.0), constraints=kept)


def no_mean_deflection() -> Scene:
    kept = tuple(integral(lambda x, c, i=i: x.r[i]) for i in range(2))
    return column("mean deflection", SUPPORTS["clamped-clamped"], (0.0, 100.0), constraints=kept)


def no_mean_curvature() -> Scene:
    kept = tuple(integral(lambda x, c, i=i: x.k[i]) for i in range(2))
    return column("mean curvature", SUPPORTS["clamped-free"], (0.0, 22.0), constraints=kept)


def on_plane() -> Scene:
    kept = (everywhere(lambda x, c: x.r[1], strain=False),)
    return column("in a plane", SUPPORTS["clamped-free"], (0.0, 6.0), constraints=kept)


def unbendable() -> Scene:
    kept = (everywhere(lambda x, c: x.k[0], strain=True),)
    return column("one curvature", SUPPORTS["clamped-free"], (0.0, 6.0), constraints=kept)


def bow() -> Scene:
    """The ends at a prescribed distance d."""
    return column(
        "bow", (pinned(), free()), (0.9, 0.1), load="d", constants={"d": 0.9},
        constraints=(at(1.0, lambda x, c: x.r[2] - c.d), at(1.0, lambda x, c: x.r[0]), at(1.0, lambda x, c: x.r[1])),
        start=lambda s: np.stack([np.cos(0.3 * np.cos(pi * s)), np.sin(0.3 * np.cos(pi * s)), 0 * s, 0 * s], axis=1),
    )  # fmt: skip


def lateral(planar: str | None = None) -> Scene:
    """A load across, in the stiff plane: out of it the rod bends and twists."""
    ends = (clamped(), free(lambda c: (c.P, 0.0, 0.0)))
    return column("lateral", ends, (0.0, 6.0), constants={"B2": 10.0}, planar=planar)


def planar_column() -> Scene:
    """Stiff about d2: what buckles in the plane is not what buckles first."""
    return column("planar", SUPPORTS["clamped-free"], (0.0, 12.0), constants={"B2": 2.0}, planar="e2")


def rolled(kind: str) -> Scene:
    """A moment on the end of a cantilever that stays in its plane, where every moment has a potential."""
    ends = (clamped(), End(**{kind: lambda c: (0.0, c.P, 0.0)}))
    return column("rolled", ends, (0.0, 8 * pi), planar="e2")


def chain(planar: str | None) -> Scene:
    """A heavy cable of length 1 between supports 0.8 apart, that bends ever more easily."""
    return column(
        "chain", (pinned(), pinned(lambda c: (0.0, 0.0, 0.8))), (1e-2, 1e-5), load="k", planar=planar,
        constants={"k": 1e-2}, energy=lambda v, k, c: bending_and_twist(k, (c.k, c.k, c.k)),
        distributed=lambda c: (1.0, 0.0, 0.0), ordinate=Ordinate("sag", s=0.5, of=lambda r, q: r[0]),
    )  # fmt: skip


# --- torques --------------------------------------------------------------------------------------------------------


def turned(c: Any) -> tuple[Any, ...]:
    """Rotation by the angle phi about e3."""
    return (ufl.cos(c.phi / 2), 0.0, 0.0, ufl.sin(c.phi / 2))


def greenhill() -> Scene:
    """Clamped ends, one of which turns and slides along the axis."""
    return column(
        "greenhill", (clamped(), sliding(ON_AXIS, turned)), (0.0, 5.0), load="phi",
        constants={"phi": 0.0, "B2": 1.0, "C": 2.0},
    )  # fmt: skip


def semi_tangential() -> Scene:
    """A torque by dead forces on crossed arms."""
    ends = (clamped(), End(energy=lambda x, c: loads.semi_tangential(x.d1, x.d2, c.P)))
    return column("semi-tangential", ends, (0.0, 5.0), constants={"B2": 1.0, "C": 10.0})


def torque(kind: str) -> Scene:
    """A rod of equal stiffness under an end moment without potential: dead, or turning with the end."""
    end = End(**{kind: lambda c: (0.0, 0.0, c.P)})
    return column("torque", (clamped(), end), (0.3, 1.5), constants={"P": 0.3, "B2": 1.0}, inertia=BEAM)


def circle(s: np.ndarray) -> np.ndarray:
    """Directors of a circle of radius one in the plane across e2, from e3 on."""
    return np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1)


ROUND = {"interval": (0.0, 2 * pi), "ordinate": Ordinate("width", s=pi, of=lambda r, q: float(np.linalg.norm(r)))}


def michell() -> Scene:
    """A ring cut open, turned by phi and joined again: held at the cut."""
    return column(
        "michell", (clamped(), clamped(rotation=lambda c: (-ufl.cos(c.phi / 2), 0.0, 0.0, -ufl.sin(c.phi / 2)))),
        (0.0, 12.5), load="phi", constants={"phi": 0.0, "B2": 1.0, "C": 1.5}, start=circle, **ROUND,
    )  # fmt: skip


def ring() -> Scene:
    """A closed ring of intrinsic twist k."""
    return column(
        "ring", Ring(odd=True), (0.0, 2.2), load="k", constants={"B2": 1.0, "C": 1.5}, start=circle, **ROUND,
        energy=lambda v, k, c: bending_and_twist((k[0], k[1], k[2] - c.k), (c.B1, c.B2, c.C)),
    )  # fmt: skip


# --- curved rods ----------------------------------------------------------------------------------------------------


def pressed_ring() -> Scene:
    return column(
        "pressed ring", Ring(), (0.0, 5.0), start=circle, planar="e2", constants={"B2": 1.0}, **ROUND,
        potential=lambda x, c: loads.pressure(x.r, x.dr, c.P),
    )  # fmt: skip


def arch(half: float, dead: bool) -> Scene:
    """A circular arch of radius one between hinges, pressed, or under a radial dead load."""
    load: dict[str, Any] = {"potential": lambda x, c: loads.pressure(x.r, x.dr, c.P)}
    if dead:
        load = {"distributed": lambda c: (c.P * ufl.cos(c.s), 0.0, -c.P * ufl.sin(c.s))}
    return column(
        "arch", (pinned(lambda c: (0.0, 0.0, -ufl.sin(c.k))), pinned(lambda c: (0.0, 0.0, ufl.sin(c.k)))),
        (0.0, 12.0), interval=(-half, half), start=circle, planar="e2", constants={"B2": 1.0, "k": half},
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (c.B1, c.B2, c.C)), **load,
        ordinate=Ordinate("crown", s=0.0, of=lambda r, q: float(r[0])),
    )  # fmt: skip


def deep_arch() -> Scene:
    """A circular arch of 215 degrees and radius one, clamped and hinged, with a dead load at its crown."""
    half = 215 * pi / 360
    foot, depth = sin(half), 1 - cos(half)
    return column(
        "deep arch",
        (clamped(lambda c: (depth, 0.0, -foot), (cos(half / 2), 0.0, -sin(half / 2), 0.0)),
         pinned(lambda c: (depth, 0.0, foot))),
        (0.0, 12.0), interval=(-half, half), start=circle, planar="e2", constants={"B2": 1.0},
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (c.B1, c.B2, c.C)),
        attachments=(Attachment(0.0, force=lambda c: (c.P, 0.0, 0.0)),),
        ordinate=Ordinate("crown", s=0.0, of=lambda r, q: float(r[0])),
    )  # fmt: skip


def bathe() -> Scene:
    """The bend of 45 degrees of Bathe and Bolourchi, loaded out of its plane (here e2)."""
    E, GA, radius = 1e7, 5e6, 100.0
    EI = E / 12

    def energy(v: Any, k: Any, c: Any) -> Any:
        stretching = 0.5 * GA * (v[0] ** 2 + v[1] ** 2) + 0.5 * E * (v[2] - 1) ** 2
        return stretching + bending_and_twist((k[0], k[1] - 1 / radius, k[2]), (EI, EI, EI))

    length = radius * pi / 4
    return column(
        "45 degree bend", (clamped(), free(lambda c: (0.0, c.P, 0.0))), (0.0, 600.0), interval=(0.0, length),
        rod="flexible", energy=energy, ordinate=Ordinate("tip", s=length, of=lambda r, q: float(r[1])),
        start=lambda s: circle(s / radius),
    )  # fmt: skip


def helix(curvature: float, most: float = 6.0, strains: Vector = lambda c: (0.0, 1.0), **more: Any) -> Scene:
    """A straight rod that clamps on a helix hold in one, of a torsion that is the load, with ``strains`` v2, v3."""

    def angle(c: Any) -> Any:
        return ufl.sqrt(c.k**2 + c.t**2)

    def position(c: Any) -> tuple[Any, ...]:
        w, (v2, v3) = angle(c), strains(c)
        part = ufl.sin(w) / w
        axial = (v2 * c.k + v3 * c.t) / w**2 * (1 - part)
        return ((1 - ufl.cos(w)) / w**2 * (c.k * v3 - c.t * v2), axial * c.k + part * v2, axial * c.t + part * v3)

    def rotation(c: Any) -> tuple[Any, ...]:
        w = angle(c)
        return (ufl.cos(w / 2), 0.0, ufl.sin(w / 2) * c.k / w, ufl.sin(w / 2) * c.t / w)

    constants = {"t": 0.0, "k": curvature, "B2": 1.0, "C": 0.6} | more.pop("constants", {})
    return column(
        "helix", (clamped(), clamped(position, rotation)), (0.0, most), load="t", constants=constants,
        start=lambda s: circle(curvature * s), **more,
    )  # fmt: skip


def helix_directors(s: np.ndarray, curvature: float, torsion: float) -> np.ndarray:
    """Quaternions (m, 4) of the directors normal, binormal, tangent of a helix."""
    w = hypot(curvature, torsion)
    return np.stack([np.cos(w * s / 2), 0 * s, np.sin(w * s / 2) * curvature / w, np.sin(w * s / 2) * torsion / w], 1)


def spring(curvature: float, torsion: float) -> Scene:
    """A helical spring pulled along its axis e3 by arms at its ends, which turn about the axis without moment.

    The wire slides along an arm, which has the direction d1, and turns about it.
    """
    total = hypot(curvature, torsion)
    slope, radius = np.arctan2(curvature, torsion), curvature / total**2

    def coil(s: np.ndarray) -> np.ndarray:
        a, b = total * s / 2, slope / 2
        return np.stack([np.cos(a) * cos(b), np.cos(a) * sin(b), np.sin(a) * sin(b), np.sin(a) * cos(b)], axis=1)

    return column(
        "helical spring", (hinged((1.0, 0.0, 0.0), lambda c: (None, 0.0, 0.0)), free(lambda c: (0.0, 0.0, c.F))),
        (0.0, 30.0), load="F", start=coil,
        constants={"F": 0.0, "B2": 1.0, "C": 0.8, "k": curvature, "t": torsion, "r": radius},
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k, k[2] - c.t), (c.B1, c.B2, c.C)),
        constraints=(at(1.0, lambda x, c: x.d1[2]), at(1.0, lambda x, c: x.r[0] * x.d1[1] - x.r[1] * x.d1[0])),
        ordinate=Ordinate("length", s=1.0, of=lambda r, q: float(r[2])),
    )  # fmt: skip


def loop() -> Scene:
    """Clamped ends, one turned by phi, that come together by d."""
    turn, bow = 4.0, 0.64

    def start(s: np.ndarray) -> np.ndarray:
        a, b = bow / 2 * np.sin(2 * pi * s), turn * s / 2
        return np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.sin(b), np.sin(a) * np.cos(b), np.cos(a) * np.sin(b)], 1)

    return column(
        "loop", (clamped(), clamped(lambda c: (0.0, 0.0, 1.0 - c.d), turned)), (0.1, 1.1), load="d", start=start,
        constants={"d": 0.1, "phi": turn, "B2": 1.0},
    )  # fmt: skip


# --- follower loads -------------------------------------------------------------------------------------------------


def beck(tip: float = 0.0, middle: float = 0.0, span: tuple[float, float] = (10.0, 25.0)) -> Scene:
    """A follower load, and masses at the tip (Pflueger) and in the middle."""
    masses = (Attachment(0.5, mass=lambda c: c.k), Attachment(1.0, mass=lambda c: c.M))
    return column(
        "beck", (clamped(), free(follower=push)), span, attachments=masses, inertia=BEAM,
        constants={"P": span[0], "B2": 10.0, "k": middle, "M": tip},
    )  # fmt: skip


def partly_following(share: float, span: tuple[float, float], strong: float = 10.0) -> Scene:
    """A thrust on the tip, a ``share`` of which follows it; diverges where the share is below one half."""
    thrust = free(force=lambda c: (0.0, 0.0, -(1 - c.share) * c.P), follower=lambda c: (0.0, 0.0, -c.share * c.P))
    return column(
        "partly", (clamped(), thrust), span, inertia=BEAM,
        constants={"P": span[0], "B2": strong, "share": share},
    )  # fmt: skip


def imperfect_column() -> Scene:
    """An extensible column under a thrust and a constant force across it: its branch is curved from the first row."""
    return Scene(
        "imperfect column", (0.0, 1.0), "unshearable",
        lambda v, k, c: 50 * (v[2] - 1) ** 2 + bending_and_twist(k, (1.0, 2.0, 1.0)), {"P": 0.0}, "P",
        (clamped(), free(lambda c: (0.3, 0.0, -c.P))), Ordinate("tip", s=1.0, of=lambda r, q: r[0]), (0.0, 4.0),
        planar="e2",
    )  # fmt: skip
