"""All hard cases, and for which values each is measured; their words are in ``cases.md``.

Some are problems for an accuracy that is asked for, too: ``Plan(accuracy=...)``.
"""

from collections.abc import Callable
from functools import partial

from hard import (
    bifurcations,
    endurance,
    loci,
    published,
    snapping,
    stiffness,
    sweeps,
    writhing,
)
from hard.case import ASKED, Case, Measured, check
from hard.stiffness import EULER
from literature.test_classics import CRITICAL

from rodfem import Discretization

POWERS = tuple(10.0**-i for i in range(2, 13))

STIFFNESS = (
    Case("shear and stretch stiffer than bending", stiffness.haringx, (2, 8, 12, 14), tuple(range(2, 15))),
    Case("bending ratio", stiffness.ratio, (1.0, 100.0), (1.0, 10.0, 100.0, 1e3, 1e4)),
    Case(
        "number of linear elements",
        lambda number: stiffness.euler(Discretization("reduced", number, 1)),
        (1, 3, 100),
        (1, 2, 3, 10, 100, 1000, 10_000, 100_000),
    ),
    Case("degree", lambda p: stiffness.euler(Discretization("reduced", 4, p)), (1, 5, 12), tuple(range(1, 13))),
    Case("graded meshes", stiffness.graded, (1e-3, 1e-5), (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)),
    Case("rotations past 2 pi and 4 pi", stiffness.turned, (2.0, 0.6), (4.0, 2.0, 1.2, 0.8, 0.6)),
    Case("a stiffness that varies along the rod", stiffness.uneven_stiffness, (3, 4), tuple(range(10))),
    Case("a weight that varies along the rod", stiffness.uneven_weight, (7,), tuple(range(10))),
    Case("a foundation that varies along the rod", stiffness.uneven_bed, (5,), tuple(range(10))),
    Case(
        "an end nearly free to turn",
        stiffness.soft,
        (1e-6, -1e-8, -1e-10),
        (1e-5, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12, -1e-12, -1e-10, -1e-8, -1e-6, -1e-5),
    ),
)
BIFURCATIONS = (
    Case("two branch points near each other", bifurcations.neighbours, (1e-4, 1e-8, 0.0), (*POWERS[::2], 0.0)),
    Case("a fold pair", bifurcations.folds, (1e-2, 1e-6), POWERS[:5:2]),
    Case("a dent of a spring", bifurcations.dent, (3e-2,), (1e-1, 3e-2, 1e-2)),
    Case("a cusp", bifurcations.cusp, (1e-5,), (1e-1, 1e-3, 1e-5)),
    Case("an eigenvalue that passes zero and comes back", bifurcations.crossings, (1e-3, 1e-4), POWERS[:3]),
    Case(
        "two eigenvalues that cross in opposite directions",
        partial(bifurcations.opposite, 0),
        (1e-4, 1e-6, 1e-8),
        (*POWERS, 0.0),
    ),
    Case("the same, the index 2 between", partial(bifurcations.opposite, 2), (1e-4, 1e-8), (*POWERS, 0.0)),
    Case("a transcritical point", bifurcations.transcritical, (0.1, 1.0), (0.1, 1.0, 3.0)),
    Case(
        "a fold beside a branch point",
        bifurcations.fold_with_branch_point,
        (1e-3, 0.0, -1e-3),
        (1e-1, 1e-3, 1e-6, 0.0, -1e-6, -1e-3),
    ),
    Case("an imperfection", bifurcations.imperfect, (1e-9,), (1e-3, 1e-6, 1e-9, 1e-12, 1e-13)),
    Case("an isola", bifurcations.isola, (1e-2, 1e-6), (1e-1, 1e-2, 1e-4, 1e-6, 1e-7, 1e-8)),
    Case(
        "a range about a branch point",
        lambda half: bifurcations.within(EULER - half, EULER + half),
        (1e-6, 1e-9),
        (1e-12, 1e-9, 1e-6, 1e-3, 1.0),
    ),
    Case(
        "the same, downwards",
        lambda half: bifurcations.within(EULER + half, EULER - half),
        (1e-6, 1e-9),
        (1e-9, 1e-6, 1e-3, 1.0),
    ),
    Case(
        "a range between branch points",
        lambda short: bifurcations.within(EULER + short, 2 * EULER - short),
        (1e-6,),
        (1e-6, 1e-3, 0.1),
    ),
    Case("a range that ends just before a fold", bifurcations.turning, (1e-3, 0.5), (1e-3, 1e-2, 0.1, 0.5, 0.9, 1.5)),
    Case(
        "a range that ends between two folds",
        partial(bifurcations.turning, height=bifurcations.LOW),
        (0.5,),
        (0.3, 0.5, 0.9, 1.5),
    ),
    Case("a load asked for at a branch point", bifurcations.asked, (0.0, -1e-9), (0.0, 1e-12, -1e-12, 1e-9, -1e-9)),
    Case(
        "two to four branch points in two planes, at random",
        bifurcations.random_crossings,
        (70072, 93209),
        tuple(range(60)),
    ),
    Case("two to five branch points in a cluster, at random", bifurcations.random_cluster, (3,), tuple(range(100))),
)
ABOVE = (1e-2, 1e-4, -1e-4)
"""Greatest thrust of a sweep, less the critical one."""
SWEEPS = (
    Case("flutter of two planes", sweeps.two_planes, (1e-6, 1e-10), (2e-2, 1e-2, 1e-3, 1e-6, 1e-9, 1e-10)),
    Case(
        "a flutter load that is asked for",
        sweeps.asked,
        (4e-13,),
        (0.0, 1e-14, -1e-14, 1e-13, -1e-13, 4e-13, -4e-13, 1e-11, -1e-11, 1e-9),
    ),
    Case("flutter of a stiff rod on soft springs", sweeps.soft_springs, (1e-7,), (1e-5, 1e-6, 3e-7, 1e-7)),
    *(
        Case(f"{kind} that comes and goes{where}", partial(sweeps.pair, kind, at), few, ABOVE)
        for kind in ("flutter", "divergence")
        for at, where, few in ((sweeps.BETWEEN, "", (1e-4,)), (sweeps.AT_ROW, ", at a row", (1e-2,)))
    ),
    Case(
        "a fold of the path",
        lambda given: sweeps.snapping(*given),
        ((3.0, 0.02),),
        ((3.0, 0.02), (3.0, 0.05), (4.0, 0.1), (5.0, 0.02), (5.0, 0.2), (8.0, 0.1)),
    ),
    Case("an imperfect column", sweeps.bends, (1e-3, 1e-7), (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)),
    Case(
        "a floating ring under loads that follow",
        sweeps.floats,
        ((1e-3, 8), (1e-1, 6)),
        tuple((waves, elements) for waves in (1e-1, 1e-2, 1e-3) for elements in (6, 8, 11)),
    ),
)
LOCI = (
    *(
        Case(f"a gap between two loci of {kind}s", partial(loci.gap, kind), few, widths)
        for kind, few, widths in (
            ("branch point", (1e-3, 0.0), (0.1, 2e-2, 1e-3, 1e-5, 0.0)),
            ("fold", (5e-3,), (0.05, 5e-3, 1e-4)),
        )
    ),
    *(
        Case(f"a {kind} of both planes that becomes two", partial(loci.split, kind), few, (2, 3, 4, 6))
        for kind, few in (("branch point", (4,)), ("divergence", (2,)), ("flutter", (4,)))
    ),
    Case("a parameter that is an imperfection", loci.imperfect, (1e-2, 1e-8), tuple(10.0**-i for i in range(2, 12))),
    Case("flutter on a foundation", loci.founded, (1e5,), (1e2, 1e3, 1e4, 1e5, 1e6)),
    Case("a small closed locus", loci.island, (2e-2,), (0.2, 0.1, 0.05, 2e-2)),
    Case("a cusp in wide bounds", loci.cusp, (1e2,), (1.0, 1e1, 1e2, 1e3, 1e4)),
    Case("folds that pass a branch point", loci.passes, (0.0, 0.2), (0.0, 0.1, 0.2)),
    Case("folds that end on two branch points at once", loci.end_on_ring, (1.6,), (1.6, 2.2, 2.5)),
    Case("a stiffness followed over decades", loci.convex, (1e6,), (1e2, 1e3, 1e4, 1e5, 1e6)),
    Case("a ring whose stiffness varies", loci.modulated, (0.0,), (0.0, 0.05, 0.1, 0.2)),
)

PUBLISHED = (
    Case("critical loads with closed forms", published.critical, ("heavy", "greenhill"), published.PROBLEMS),
    Case("helical springs between hinges", published.spring, (1e-3, -1e-3), (1e-1, 1e-3, 1e-5, -1e-5)),
    Case(
        "helical springs between clamps",
        partial(published.spring, supports="clamped-clamped"),
        (1e-3,),
        (1e-2, 1e-4, -1e-4),
    ),
    Case("pressed rings", published.ring, ("dead",), tuple(published.RINGS)),
    Case("rolled up by an end moment", published.rolled, (2,), (1, 10)),
    Case("a shearable helix", published.locking, (1e4,), (10.0, 100.0, 1e3, 1e4)),
    Case("cords of many turns", published.cord, (2, 50), (2, 10, 50)),
    Case("a deep arch of 215 degrees", published.arch, (6,), (4, 6, 8)),
    Case("the deep arch in space", published.arch_in_space, (1.0,), (2.0, 1.0, 0.5, 0.2)),
    Case(
        "snapping strips",
        lambda given: snapping.snapping(*given),
        ((0.9, 0.0),),
        ((0.9, 0.0), (0.9, 0.5), (0.9, -0.5), (0.6, 0.0), (0.6, 0.5)),
    ),
    Case("snapping strips, clamps turned oppositely", snapping.opposite, (0.9,), (0.95, 0.9, 0.8, 0.6)),
    Case("strips, clamps turned alike", snapping.alike, (0.6, 0.8), (0.95, 0.9, 0.8, 0.6)),
    Case("a hysteresis", snapping.hysteresis, (5.0,), (3.0, 5.0, 8.0)),
    Case("pressed rings on springs that repeat n times", published.springy_ring, (7, 4), (0, 3, 4, 5, 6, 7)),
    Case("a ring deployed by 4 pi", published.deployed_ring, (9.0,), (100.0, 9.0, 4.0)),
    Case("a planar elastica lost out of its plane", writhing.shortened, (1.0,), (1.25, 1.0, 0.75, 0.5)),
    Case(
        "writhing of a clamped rod",
        lambda given: writhing.turned(*given),
        ((0.5, 1.0),),
        ((0.4, 1.0), (0.45, 1.0), (0.5, 1.0), (0.6, 1.0), (0.5, 0.75), (0.5, 2.0)),
    ),
    Case(
        "a heavy, curved rod lost out of its plane",
        lambda given: writhing.heavy_shortened(*given),
        ((1.0, 20.0),),
        ((1.0, 0.0), (1.0, 20.0), (1.0, 60.0), (3.0, 20.0), (3.0, 60.0), (5.0, 20.0)),
    ),
    Case(
        "writhing of a heavy, curved rod",
        lambda given: writhing.heavy_turned(*given),
        ((0.4, 2.0, 50.0),),
        ((0.5, 0.5, 10.0), (0.4, 2.0, 50.0), (0.4, 3.0, 50.0), (0.25, 5.0, 100.0), (0.25, 10.0, 20.0)),
    ),
)
ENDURANCE = (
    Case("long branches", endurance.rows, (300,), (300, 3000, 10_000)),
    Case("many scenes in one process", endurance.scenes, (20,), (100, 1000)),
)
CASES = {
    "stiffness": STIFFNESS,
    "bifurcations": BIFURCATIONS,
    "sweeps": SWEEPS,
    "loci": LOCI,
    "published": PUBLISHED,
    "endurance": ENDURANCE,
}

# --- an accuracy asked for in place of a mesh ------------------------------------------------------------------------

Problem = Callable[[], Measured]


def critical(name: str) -> Measured:
    """Critical loads of a classical problem."""
    return check(published.changes(name), CRITICAL[name][0]())


PROBLEMS: dict[str, Problem] = {
    **{name: partial(critical, name) for name in published.PROBLEMS},
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
    **{f"ring on {n} springs": partial(published.springy_ring, n) for n in (3, 4)},
    **{f"elastica out of its plane, {C:g}": partial(writhing.shortened, C) for C in (1.25, 0.5)},
    "writhing": partial(writhing.turned, 0.5, 1.0),
    "heavy, curved": partial(writhing.heavy_shortened, 1.0, 20.0),
    "heavy, curved, writhing": partial(writhing.heavy_turned, 0.4, 2.0, 50.0),
}


def problem_at(accuracy: float, name: str) -> Measured:
    """Largest error of a problem over an ``accuracy`` that is asked for."""
    before = ASKED.set(accuracy)
    try:
        return PROBLEMS[name]()
    finally:
        ASKED.reset(before)
