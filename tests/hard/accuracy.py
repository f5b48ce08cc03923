"""An accuracy asked for in place of a mesh, of scenes whose special points are known: ``Plan(accuracy=...)``."""

from collections.abc import Callable
from functools import partial

from hard import classical, published, snapping, springy_rings, stiffness, writhing
from hard.case import ASKED, Measured, compare, run, said, singular
from literature.test_classics import CRITICAL

Problem = Callable[[], Measured]


def critical(name: str) -> Measured:
    """Critical loads of a classical problem."""
    diagram = run(CRITICAL[name][0]())
    return compare(singular(diagram[0]), classical.changes(name), said(diagram))


PROBLEMS: dict[str, Problem] = {
    **{name: partial(critical, name) for name in classical.PROBLEMS},
    **{f"shear and stretch 1e{n} times": partial(stiffness.haringx, n) for n in (2, 4, 6)},
    **{f"bending ratio {B2:g}": partial(stiffness.ratio, B2) for B2 in (10.0, 1e3)},
    **{f"end turned, C = {C:g}": partial(stiffness.turned, C) for C in (2.0, 0.6)},
    **{f"spring {part:g}": partial(published.spring, part) for part in (0.1, 1e-3)},
    **{f"clamped spring {part:g}": partial(published.spring, part, "clamped-clamped") for part in (1e-2, -1e-4)},
    **{f"{load} ring": partial(published.ring, load) for load in published.RINGS},
    **{f"cord of {turns} turns": partial(published.cord, turns) for turns in (2, 10)},
    "deep arch": partial(published.arch, 6),
    **{f"strip {d:g}, {ratio:g}": partial(snapping.snapping, d, ratio) for d, ratio in ((0.9, 0.0), (0.6, 0.5))},
    **{f"strip {d:g}, -1": partial(snapping.opposite, d) for d in (0.9, 0.6)},
    **{f"strip {d:g}, 1": partial(snapping.alike, d) for d in (0.9, 0.6)},
    **{f"hysteresis {P:g}": partial(snapping.hysteresis, P) for P in (3.0, 8.0)},
    **{f"ring on {n} springs": partial(springy_rings.ring, n) for n in (3, 4)},
    **{f"elastica out of its plane, {C:g}": partial(writhing.shortened, C) for C in (1.25, 0.5)},
    "writhing": partial(writhing.turned, 0.5, 1.0),
    "heavy, curved": partial(writhing.heavy_shortened, 1.0, 20.0),
    "heavy, curved, writhing": partial(writhing.heavy_turned, 0.4, 2.0, 50.0),
}


def at(accuracy: float, name: str) -> Measured:
    """Largest error of a problem over an ``accuracy`` that is asked for."""
    before = ASKED.set(accuracy)
    try:
        return PROBLEMS[name]()
    finally:
        ASKED.reset(before)
