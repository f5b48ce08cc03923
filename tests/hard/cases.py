"""All hard cases: what makes each hard, what is promised, where it comes from, and for which values it is measured."""

from functools import partial

from hard import (
    bifurcations,
    classical,
    endurance,
    loci,
    loci_codim2,
    paths,
    planes,
    published,
    ranges,
    snapping,
    springy_rings,
    stiffness,
    thrusts,
    uneven,
    writhing,
)
from hard.case import Case
from hard.stiffness import EULER

from rodfem import Discretization

ROW, INDEX, STEP, POINTS = "a row", "its index", "the step between two rows", "special points in a step"
IMPERFECT, LOAD, SWEEP = "an imperfect branch point", "the load of a special point", "flutter and divergence"
ASKED, ALONG = "a requested load", "a function along the rod, or of the state"
LOCUS, LONG = "a locus in two parameters", "a long run"
EXACT = "all special points, each within its error bar, with the index on either side"
SAID = f"{EXACT}; or a sentence that says what is not decided"
POWERS = tuple(10.0**-i for i in range(2, 13))

STIFFNESS = (
    Case(
        LOAD, "shear and stretch stiffer than bending", "entries of the matrix differ by up to 1e14", SAID,
        "Haringx' column, P (1 - P/EA + P/GA) = pi^2/4", "exponent of GA",
        stiffness.haringx, (2, 8, 12, 14), tuple(range(2, 15)),
    ),
    Case(
        POINTS, "bending ratio", "dozens of weak modes below the first one of the stiff plane", EXACT,
        "Euler, (2n - 1)^2 pi^2/4", "B2/B1", stiffness.ratio, (1.0, 100.0), (1.0, 10.0, 100.0, 1e3, 1e4),
    ),
    Case(
        LOAD, "number of linear elements", "a mesh that resolves nothing; round-off that grows with the square", EXACT,
        "Euler, pi^2/4", "elements", lambda number: stiffness.euler(Discretization("reduced", number, 1)),
        (1, 3, 100), (1, 2, 3, 10, 100, 1000, 10_000, 100_000),
    ),
    Case(
        LOAD, "degree", "one degree more is what bounds the error", EXACT,
        "Euler, pi^2/4", "degree of 4 elements", lambda p: stiffness.euler(Discretization("reduced", 4, p)),
        (1, 5, 12), tuple(range(1, 13)),
    ),
    Case(
        LOAD, "graded meshes", "round-off grows with the inverse square of the smallest element", SAID,
        "Euler, pi^2/4", "smallest of 12 elements of degree 6", stiffness.graded, (1e-3, 1e-5),
        (1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
    ),
    Case(
        POINTS, "rotations past 2 pi and 4 pi", "a double point at ends turned by several radian", EXACT,
        "Greenhill, C phi = 8.98681891582", "C, at the angle 8.99/C", stiffness.turned, (2.0, 0.6),
        (4.0, 2.0, 1.2, 0.8, 0.6),
    ),
    Case(
        ALONG, "a stiffness that varies along the rod", "layers, peaks, tails and ripple as wide as an element", EXACT,
        "Magnus' expansion of fourth order, on graded pieces", "number of a random draw", uneven.stiffness,
        (3, 4), tuple(range(10)),
    ),
    Case(
        ALONG, "a weight that varies along the rod", "the same, of a force along the rod", EXACT,
        "Magnus' expansion of fourth order, on graded pieces", "number of a random draw", uneven.weight,
        (7,), tuple(range(10)),
    ),
    Case(
        ALONG, "a foundation that varies along the rod", "the same, of springs along the rod", EXACT,
        "Magnus' expansion of fourth order, on graded pieces", "number of a random draw", uneven.bed,
        (5,), tuple(range(10)),
    ),
    Case(
        LOAD,
        "metres and newtons of a molecule, and of a pipeline", "entries of the matrix from 1e-30 to 1e9", f"{EXACT}; "
        "the loads are those in the problem's own units to 1e-9", "Euler, Haringx, Timoshenko, Greenhill, Michell, ...",
        "problem", classical.in_units, ("heavy", "greenhill"), classical.PROBLEMS,
    ),
    Case(
        INDEX, "an end nearly free to turn", "eigenvalues as small as the error of a state", "eigenvalues within "
        "their uncertainty; the index, or that their sign is undecided where that exceeds them", "the stiffness of a "
        "joint is the eigenvalue of three rotations", "stiffness", stiffness.soft, (1e-6, -1e-8, -1e-10),
        (1e-5, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12, -1e-12, -1e-10, -1e-8, -1e-6, -1e-5),
    ),
)  # fmt: skip
BIFURCATIONS = (
    Case(
        POINTS,
        "two branch points near each other", "one point, or two, within the tolerance of a zero eigenvalue", EXACT,
        "Euler, B pi^2/4", "relative distance", bifurcations.neighbours, (1e-4, 1e-8, 0.0), (*POWERS[::2], 0.0),
    ),
    Case(
        POINTS, "a fold pair", "two folds in one step, of a rod that stretches and does not turn", EXACT,
        "u^3 - a u = P", "distance in load", bifurcations.folds, (1e-2, 1e-6), POWERS[:5:2],
    ),
    Case(
        STEP, "a dent of a spring", "a bend that is sharper than a step, and a straight branch on both sides", EXACT,
        "1 - 2 exp(-t^2), t = (u - 0.5123)/d", "width d", bifurcations.dent, (3e-2,), (1e-1, 3e-2, 1e-2),
    ),
    Case(
        POINTS, "a cusp", "a tangent that is nearly vertical, and no fold", EXACT,
        "u^3 + a u = P", "a", bifurcations.cusp, (1e-5,), (1e-1, 1e-3, 1e-5, 0.0),
    ),
    Case(
        POINTS, "an eigenvalue that passes zero and comes back", "the index is the same at both ends of the step", SAID,
        "P^2 - d^2", "distance in load", bifurcations.crossings, (1e-3, 1e-4), POWERS[:3],
    ),
    Case(
        POINTS, "two eigenvalues that cross in opposite directions", "the index is 1 on either side, 0 between", SAID,
        "d - P and d + P", "distance in load", partial(bifurcations.opposite, 0), (1e-4, 1e-6, 1e-8), (*POWERS, 0.0),
    ),
    Case(
        POINTS, "the same, the index 2 between", "neither end of the step shows them", SAID,
        "-d - P and P - d", "distance in load", partial(bifurcations.opposite, 2), (1e-4, 1e-8), (*POWERS, 0.0),
    ),
    Case(
        POINTS, "a transcritical point", "the load changes along the null vector", EXACT,
        "u (u - a P)", "a", bifurcations.transcritical, (0.1, 1.0), (0.1, 1.0, 3.0),
    ),
    Case(
        POINTS, "a fold beside a branch point", "eigenvalues exchange their numbers next to zero", EXACT,
        "P = -u^2 and u = g", "g", bifurcations.fold_with_branch_point, (1e-3, 0.0, -1e-3),
        (1e-1, 1e-3, 1e-6, 0.0, -1e-6, -1e-3),
    ),
    Case(
        IMPERFECT, "an imperfection", "a broken pitchfork, sharper than a step", SAID,
        "elastica by elliptic integrals", "lateral load", bifurcations.imperfect, (1e-9,),
        (1e-3, 1e-6, 1e-9, 1e-12, 1e-13),
    ),
    Case(
        POINTS,
        "an isola", "a closed branch that no other one meets, and is the smaller the less the load exceeds its fold",
        SAID, "elastica by elliptic integrals", "greatest excess of the thrust", bifurcations.isola, (1e-2, 1e-6),
        (1e-1, 1e-2, 1e-4, 1e-6, 1e-7, 1e-8),
    ),
    Case(
        INDEX, "a range about a branch point", "every row has a zero eigenvalue to the tolerance", SAID,
        "Euler, pi^2/4", "half width", lambda half: ranges.within(EULER - half, EULER + half),
        (1e-6, 1e-9), (1e-12, 1e-9, 1e-6, 1e-3, 1.0),
    ),
    Case(
        INDEX, "the same, downwards", "the same", SAID,
        "Euler, pi^2/4", "half width", lambda half: ranges.within(EULER + half, EULER - half),
        (1e-6, 1e-9), (1e-9, 1e-6, 1e-3, 1.0),
    ),
    Case(
        INDEX, "a range between branch points", "it begins and ends beside one", SAID,
        "Euler, pi^2/4 and pi^2/2", "distance from both", lambda short: ranges.within(EULER + short, 2 * EULER - short),
        (1e-6,), (1e-6, 1e-3, 0.1),
    ),
    Case(
        STEP,
        "a range that ends just before a fold", "a step that leaves the range and comes back turns at the fold", EXACT,
        "u^3 - a u = P", "distance from it, over its load", ranges.turning, (1e-3, 0.5),
        (1e-3, 1e-2, 0.1, 0.5, 0.9, 1.5),
    ),
    Case(
        STEP, "a range that ends between two folds", "the last step leads past both, to the bound", EXACT,
        "u^3 - a u = P", "distance from the first, over its load", partial(ranges.turning, height=ranges.LOW), (0.5,),
        (0.3, 0.5, 0.9, 1.5),
    ),
    Case(
        ASKED, "a load asked for at a branch point", "its equations are singular, or nearly", EXACT,
        "Euler, pi^2/4", "distance from it", ranges.asked, (0.0, -1e-9), (0.0, 1e-12, -1e-12, 1e-9, -1e-9),
    ),
    Case(
        POINTS,
        "two to four branch points in two planes, at random", "several in a step, in either direction, at a row, or "
        "two at one load", SAID, "Euler, pi^2/4, times functions with given zeros", "number of a random draw",
        planes.crossings, (70072, 93209), tuple(range(60)),
    ),
    Case(
        POINTS,
        "two to five branch points in a cluster, at random", "up to five in a step, of which some hide others; pairs "
        "as shallow as 1e-6", SAID, "Euler, pi^2/4, times functions with given zeros", "number of a random draw",
        planes.cluster, (3,), tuple(range(100)),
    ),
)  # fmt: skip
ABOVE = (1e-2, 1e-4, -1e-4)
"""Greatest thrust of a sweep, less the critical one."""
SWEEPS = (
    Case(
        SWEEP, "flutter of two planes", "one flutters in the step in which the other one does, or both are one pair to "
        "round-off", EXACT, "Beck, by the characteristic equation", "B2/B1 - 1", thrusts.two_planes, (1e-6, 1e-10),
        (2e-2, 1e-2, 1e-3, 1e-6, 1e-9, 1e-10),
    ),
    Case(
        ASKED,
        "a flutter load that is asked for", "the pair is real at that row and complex, by round-off, from the next one "
        "on", EXACT, "Beck, by the characteristic equation", "distance, relative", thrusts.asked, (4e-13,),
        (0.0, 1e-14, -1e-14, 1e-13, -1e-13, 4e-13, -4e-13, 1e-11, -1e-11, 1e-9),
    ),
    Case(
        SWEEP,
        "flutter of a stiff rod on soft springs", "frequencies far below those of bending, in which round-off is "
        "measured", EXACT, "two degrees of freedom, P = k/3", "k in EI/L^3", thrusts.soft_springs, (1e-7,),
        (1e-5, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8),
    ),
    *(
        Case(
            SWEEP,
            f"{kind} that comes and goes{where}", "complex pairs, or negative eigenvalues, of a range within one "
            "step, about the greatest thrust", SAID, "Beck, thrusts that follow in part, by characteristic equations",
            "greatest thrust less the critical one", partial(thrusts.pair, kind, at), few, ABOVE,
        )
        for kind in ("flutter", "divergence")
        for at, where, few in ((thrusts.BETWEEN, "", (1e-4,)), (thrusts.AT_ROW, ", at a row", (1e-2,)))
    ),
    Case(
        STEP,
        "a fold of the path", "beyond it Newton's method finds the state that the rod snaps to, stable, too", "the "
        "sweep ends within 1e-5 of the fold, and says so", "extremes of an explicit angle by shooting", "tip load of a "
        "cantilever whose clamp turns, share that follows", lambda given: paths.snapping(*given), ((3.0, 0.02),),
        ((3.0, 0.02), (3.0, 0.05), (4.0, 0.1), (5.0, 0.02), (5.0, 0.2), (8.0, 0.1)),
    ),
    Case(
        STEP,
        "an imperfect column", "the other side of the gap has the unstable straight state", "it bends to one side and "
        "is stable; or a sentence that says where its path could not be followed", "symmetry", "lateral load",
        paths.bends, (1e-3, 1e-7), (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9),
    ),
    Case(
        ROW, "a floating ring under loads that follow", "nothing holds it, and Newton's method may turn it at random",
        "every state to 1e-6; or a sentence that says where its path could not be followed", "that under a pressure "
        "with a potential", "waves of natural curvature, elements", paths.floats, ((1e-3, 8), (1e-1, 6)),
        tuple((waves, elements) for waves in (1e-1, 1e-2, 1e-3) for elements in (6, 8, 11)),
    ),
)  # fmt: skip
TO_ITS_BAR = "every row within its uncertainty, and the curve ends, with a sentence, where its special point does"
LOCI = (
    *(
        Case(
            LOCUS,
            f"a gap between two loci of {kind}s", "a step leads across it to the other curve, which is a locus, too",
            "every row on one curve, to 1e-9, with its turning point; or a sentence that says what is not decided",
            "P^2 = b^2 + d^2", "d, in bounds of 0.3", partial(loci.gap, kind), few, widths,
        )
        for kind, few, widths in (
            ("branch point", (2e-2, 0.0), (0.1, 2e-2, 0.0)),
            ("fold", (2e-2,), (0.05, 2e-2)),
        )
    ),
    *(
        Case(
            LOCUS,
            f"a {kind} of both planes that becomes two", "their mean is a curve as well, as smooth", TO_ITS_BAR, source,
            "n, of stiffnesses 1 and 1 + e^n", partial(loci.split, kind), few, (2, 3, 4, 6),
        )
        for kind, source, few in (
            ("branch point", "Euler, pi^2/4", (4,)),
            ("divergence", "cos P^(1/2) = -1/4", (2,)),
            ("flutter", "Beck, by the characteristic equation", (4,)),
        )
    ),
    Case(
        LOCUS,
        "a parameter that is an imperfection", "beside it there is no branch point, however small it is", TO_ITS_BAR,
        "Euler, pi^2/4", "half width of the interval of a force across", loci.imperfect, (1e-2, 1e-8),
        tuple(10.0**-i for i in range(2, 12)),
    ),
    Case(
        LOCUS,
        "flutter on a foundation", "frequencies of a million whose difference is ten", TO_ITS_BAR, "Beck; no uniform "
        "foundation changes the load (Smith & Herrmann 1972)", "greatest stiffness", loci.founded, (1e5,),
        (1e2, 1e3, 1e4, 1e5, 1e6),
    ),
    Case(
        LOCUS, "a small closed locus", "hardly more than a step of the bounds", "followed once round, to 1e-9",
        "P^2 + b^2 = d^2", "d, in bounds of 0.3", loci.island, (2e-2,), (0.2, 0.1, 0.05, 2e-2),
    ),
    Case(
        LOCUS, "a cusp in wide bounds", "the normal of the curve turns by more than a right angle in a step",
        "one cusp, within its error, and the whole curve", "27 P^2 = 4 b^3", "half width of the interval of b",
        loci_codim2.cusp, (1e2,), (1.0, 1e1, 1e2, 1e3, 1e4),
    ),
    Case(
        LOCUS, "folds that pass a branch point", "coupling and curvature vanish, as at an end and at a cusp",
        "one curve, to 1e-9", "P - 3/2 d b = -(b + d P)^2/4", "d", loci_codim2.passes, (0.0, 0.2), (0.0, 0.1, 0.2),
    ),
    Case(
        LOCUS, "folds that end on two branch points at once", "no solution locates the end: two vectors vanish there",
        "an end within its error", "Michell's ring, C = 11/8 (Goriely 2006)", "bound of C", loci_codim2.end_on_ring,
        (1.6,), (1.6, 2.2, 2.5),
    ),
    Case(
        LOCUS, "a stiffness followed over decades", "a ten thousandth of its interval is more than its least value",
        "the whole curve, to 1e-9", "traced at the end", "greatest stretching stiffness of a ruler", loci_codim2.convex,
        (1e6,), (1e2, 1e3, 1e4, 1e5, 1e6),
    ),
    Case(
        LOCUS,
        "a ring whose stiffness varies", "a mesh of 8 elements breaks its symmetry of three waves", "double points "
        "within their errors; or a sentence that the mesh may be the cause", "Fourier series",
        "part that varies at the start", loci_codim2.modulated, (0.0,), (0.0, 0.05, 0.1, 0.2),
    ),
)  # fmt: skip

PUBLISHED = (
    Case(
        LOAD, "critical loads with closed forms", "three meshes, from a coarse one, and both formulations", EXACT,
        "Euler, Haringx, Timoshenko, Greenhill, Michell, ...: tests/literature/test_classics.py", "problem",
        classical.critical, ("heavy", "greenhill"), classical.PROBLEMS,
    ),
    Case(
        LOAD,
        "helical springs between hinges", "two critical loads that meet where the spring is 2.6202694 diameters long",
        EXACT, "Haringx 1948, E/G = 2.6", "part by which the length exceeds that", published.spring, (1e-3, -1e-3),
        (1e-1, 1e-3, 1e-5, -1e-5),
    ),
    Case(
        LOAD, "helical springs between clamps", "the same at 5.2405388 diameters", EXACT, "Haringx 1948, E/G = 2.6",
        "part by which the length exceeds that", partial(published.spring, supports="clamped-clamped"), (1e-3,),
        (1e-2, 1e-4, -1e-4),
    ),
    Case(
        POINTS,
        "pressed rings", "loads of equal first variation and different second ones; double points, motions that are "
        "free", EXACT, "n^2 - 1, n^2, (n^2 - 1)^2/(n^2 - 2) for n = 2 to 5 (Boresi 1955, Bodner 1958)", "load",
        published.ring, ("dead",), tuple(published.RINGS),
    ),
    Case(
        ROW, "rolled up by an end moment", "rotations of ten turns", "the end within 1e-7 of the circle; stable",
        "a circle passed by turn after turn", "turns", published.rolled, (2,), (1, 10),
    ),
    Case(
        ROW,
        "a shearable helix", "shear and stretch are the stiffer the more slender it is", "an error that is that of "
        "slenderness 10 within a factor 2 (no locking)", "uniform strains under a wrench", "slenderness",
        published.locking, (1e4,), (10.0, 100.0, 1e3, 1e4),
    ),
    Case(
        POINTS, "cords of many turns", "critical tensions 40 apart at a thousand times that", EXACT,
        "(2 pi N)^2 - w^2, w = 2 pi n or tan(w/2) = w/2", "turns N", published.cord, (2, 50), (2, 10, 50),
    ),
    Case(
        LOAD, "a deep arch of 215 degrees", "a fold far from the undeformed state", EXACT,
        "DaDeppo & Schmidt 1975, 8.973089969728", "degree of 8 elements", published.arch, (6,), (4, 6, 8),
    ),
    Case(
        INDEX,
        "the deep arch in space", "stable in its plane, and perhaps not across it", "the index of the rod in space",
        "the same arch as a rod in space", "C/B", published.arch_in_space, (1.0,), (2.0, 1.0, 0.5, 0.2),
    ),
    Case(
        POINTS, "snapping strips", "the state that is lost is far from any unbent one", EXACT,
        "Cazzolli & Dal Corso 2019; folds by shooting", "distance of the clamps, ratio of their angles",
        lambda given: snapping.snapping(*given), ((0.9, 0.0),),
        ((0.9, 0.0), (0.9, 0.5), (0.9, -0.5), (0.6, 0.0), (0.6, 0.5)),
    ),
    Case(
        POINTS, "snapping strips, clamps turned oppositely", "a pitchfork shortly before the fold", EXACT,
        "Cazzolli & Dal Corso 2019; shooting, conjugate points", "distance of the clamps", snapping.opposite, (0.9,),
        (0.95, 0.9, 0.8, 0.6),
    ),
    Case(
        POINTS,
        "strips, clamps turned alike", "the arch ends in its mirror image; stable on either side, and no fold", EXACT,
        "Cazzolli & Dal Corso 2019; shooting, conjugate points", "distance of the clamps", snapping.alike, (0.6, 0.8),
        (0.95, 0.9, 0.8, 0.6),
    ),
    Case(
        POINTS, "a hysteresis", "the load turns back twice; two stable states in between", EXACT,
        "Dhanakoti 2024; extremes of an explicit angle by shooting", "tip load of a cantilever whose clamp turns",
        snapping.hysteresis, (5.0,), (3.0, 5.0, 8.0),
    ),
    Case(
        POINTS,
        "pressed rings on springs that repeat n times", "multiple branch points by symmetry: pairs, single ones, and "
        "four modes at one load for n = 0 and 7", EXACT, "Fourier coefficients of the second variation", "n",
        springy_rings.ring, (7, 4), (0, 3, 4, 5, 6, 7),
    ),
    Case(
        STEP, "a ring deployed by 4 pi", "rotations of an end past 2 pi; the ends far from where they were",
        "a third of the ring after 2 pi, the ring after 4 pi, stable throughout",
        "Goto, Watanabe, Kasugai & Obata 1992", "B1/B2", published.deployed_ring, (9.0,), (100.0, 9.0, 4.0),
    ),
    Case(
        INDEX,
        "a planar elastica lost out of its plane", "a zero eigenvalue along the whole branch; ends up to 0.9 nearer",
        EXACT, "van der Heijden, Neukirch, Goss & Thompson 2003; shooting in space, conjugate points", "C/B",
        writhing.shortened, (1.0,), (1.25, 1.0, 0.75, 0.5),
    ),
    Case(
        POINTS,
        "writhing of a clamped rod", "the end turns by 4 pi, and back from one fold to the other; a zero eigenvalue "
        "throughout", EXACT, "van der Heijden, Neukirch, Goss & Thompson 2003; shooting in space, conjugate points",
        "end shortening, C/B", lambda given: writhing.turned(*given), ((0.5, 1.0),),
        ((0.4, 1.0), (0.45, 1.0), (0.5, 1.0), (0.6, 1.0), (0.5, 0.75), (0.5, 2.0)),
    ),
    Case(
        INDEX,
        "a heavy, curved rod lost out of its plane", "a natural curvature of which nothing is seen in the plane; ends "
        "up to 0.7 nearer", EXACT, "Lazarus, Miller, Metlitz & Reis 2013; shooting in space, conjugate points",
        "natural curvature, weight", lambda given: writhing.heavy_shortened(*given), ((1.0, 20.0),),
        ((1.0, 0.0), (1.0, 20.0), (1.0, 60.0), (3.0, 20.0), (3.0, 60.0), (5.0, 20.0)),
    ),
    Case(
        POINTS,
        "writhing of a heavy, curved rod", "the end turns by 4 pi, and back from one fold to the other; no symmetry at "
        "all", EXACT, "Lazarus, Miller & Reis 2013; shooting in space, conjugate points",
        "end shortening, natural curvature, weight", lambda given: writhing.heavy_turned(*given), ((0.4, 2.0, 50.0),),
        ((0.5, 0.5, 10.0), (0.4, 2.0, 50.0), (0.4, 3.0, 50.0), (0.25, 5.0, 100.0), (0.25, 10.0, 20.0)),
    ),
)  # fmt: skip
ENDURANCE = (
    Case(
        LONG, "long branches", "memory or time that grows with what has been done",
        "at most 8 kB a row, time of a row within a factor 2, no file or communicator left open", "measured in between",
        "rows", endurance.rows, (300,), (300, 3000, 10_000),
    ),
    Case(
        LONG, "many scenes in one process", "forms, factors and communicators of each have to go with it",
        "the heap stays within 4 MB and 0.5 kB a scene, time of a scene within a factor 2, no file or communicator "
        "left open; each with its buckling load", "Euler, B pi^2/4; measured in between", "scenes",
        endurance.scenes, (20,), (100, 1000),
    ),
)  # fmt: skip
CASES = {
    "stiffness": STIFFNESS,
    "bifurcations": BIFURCATIONS,
    "sweeps": SWEEPS,
    "loci": LOCI,
    "published": PUBLISHED,
    "endurance": ENDURANCE,
}
