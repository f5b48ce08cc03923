"""Glossary: every word and code of tables, files and pictures, in a sentence or two.

A key has all names of one entry, between bars.
"""

from __future__ import annotations

from difflib import get_close_matches

from rodfem.continuation.kinds import KINDS
from rodfem.errors import InputError
from rodfem.output.table import COLUMNS, SPECIAL

ENTRIES = {
    # special points
    "branch point": (
        "An equilibrium in which branches cross: the second variation is singular, and the load does no work on "
        "the null vectors. What leaves it is followed, to the depth that was asked for."
    ),
    "fold": (
        "A limit point: the load turns back along the branch, and one eigenvalue changes its sign. Beyond its "
        "load no state of this branch is near, so that a rod that was stable jumps."
    ),
    "imperfect bifurcation": (
        "A branch point that an imperfection takes apart, by less than steps along the branch resolve; its "
        "unfolding is the size of the imperfection."
    ),
    "flutter": (
        "Under a load without a potential: two real frequencies coincide and become a complex pair, so that "
        "oscillations grow. AUTO's word is Hopf bifurcation."
    ),
    "divergence": (
        "Under a load without a potential: a frequency passes through zero and becomes imaginary, so that the rod "
        "leaves the state without oscillating."
    ),
    "event": "A load at which a number of the state that the plan names passes through zero.",
    "user | requested load": "A load that was asked for; every branch is computed at exactly this load.",
    "end": "The first or the last state of a branch; `ended` says why no more follow.",
    # stability
    "index | negative | negative eigenvalues": (
        "Number of negative eigenvalues of the second variation of the energy, on perturbations that keep the "
        "constraints: the number of directions in which the energy falls. 0 is stable."
    ),
    "negative_before | negative_after": "Index right before and right after a special point along its branch.",
    "zero": (
        "Number of eigenvalues that vanish, those of symmetries included: directions in which the energy does not "
        "change to second order."
    ),
    "stable": (
        "The index is zero: every small perturbation that keeps the constraints and is no symmetry costs energy. "
        "Drawn as a solid line."
    ),
    "unstable": (
        "The index is not zero. Without a potential: number of eigenvalues, of those found, that are negative or "
        "complex. Drawn dotted."
    ),
    "stable in the plane, unstable in space | negative_in_space | in space": (
        "Of a planar rod: the index in its plane is zero, that among all perturbations in space is not. Drawn "
        "dashed; the index in space is in parentheses."
    ),
    "mu | omega^2 | omega2": (
        "Eigenvalue of the second variation with the rod's inertia (unit rotary inertia where it has none): the "
        "square of a frequency. A negative one is a growing motion."
    ),
    "spectrum | left-most eigenvalues": (
        "The smallest eigenvalues mu of a state: of typical ones in states.h5, of all on request."
    ),
    "band | inside": (
        "Eigenvalues nearer to zero than the band have a sign that round-off of the factors hides; their Rayleigh "
        "quotients, each with an uncertainty, decide."
    ),
    "counts prove that none is missing | certified": (
        "The number of eigenvalues found below a shift is that of the inertia of the shifted matrix."
    ),
    "undecided | stability undecided | 0 or 1": (
        "Eigenvalues so near to zero that the error of the mesh, or round-off, leaves their sign open: the index lies "
        "between its first value and that plus their number."
    ),
    "on one side of a kink | kink": (
        "The state is where the second derivative of an energy jumps: the second variation, and its index, depend on "
        "the side, and stability is undecided. The functions are named."
    ),
    "soft mode | soft | soft_value | soft_uncertainty": (
        "An eigenvalue near zero with the name of what moves, its value in the metric, and a bound of its error: "
        "sliding along the rod, turning of an end, slipping of a ring along itself."
    ),
    "residual": "Size of (S - mu M) x for the eigenpair found, relative to S x.",
    "index change unexplained | unexplained": (
        "Between two rows the index changes, and no special point was found that says why: smaller steps or more "
        "elements are needed."
    ),
    "singular first state, not located | singular first state | singular_start": (
        "The range begins in a state of which eigenvalues vanish that do not vanish along the branch; what leaves "
        "it is not followed."
    ),
    "hysteresis": "At one load two stable states coexist: which one the rod takes depends on the loads before.",
    "circle of states": (
        "States that a symmetry turns into each other, all at one load and of one energy; one eigenvalue is zero "
        "along the circle."
    ),
    "symmetry | drift": (
        "A rigid motion, or another continuous family of perturbations, that leaves the equations as they are. It "
        "is a zero eigenvalue, never part of the index; the drift scalar that fixes it vanishes but for round- "
        "off."
    ),
    "mode": "An eigenvector of the second variation with the rod's inertia: how the rod moves.",
    # the local law
    "normal form | law": (
        "load = load_b + c x^p + ...: the load along the branch that leaves a branch point, in the change x of "
        "the ordinate, or in the distance a from there where the ordinate does not change."
    ),
    "pitchfork": "A branch and its mirror image leave on one side of the critical load.",
    "supercritical pitchfork | supercritical": (
        "The new branch exists on the side of the load on which the old one has the higher index: the rod moves "
        "away gradually."
    ),
    "subcritical pitchfork | subcritical": (
        "The new branch exists on the side on which the old one has the lower index: at the critical load the rod "
        "jumps, and imperfections lower that load."
    ),
    "transcritical": "The new branch passes through the critical load, with a slope.",
    "vertical branch": "The new branch consists of states at one and the same load.",
    "multiplicity | directions at once": "Number of eigenvalues that vanish at a special point and not beside it.",
    "null vector": "Perturbation whose eigenvalue vanishes at a special point.",
    # numbers and their errors
    "load | parameter": "The number that varies along a diagram, as the scene declares it.",
    "ordinate": "The scene's number of a state on the vertical axis of the diagram.",
    "energy | int W ds": "Stored energy of the rod alone, without the potential of loads, springs and foundations.",
    "potential | total potential energy": (
        "Energy V of the rod, its loads, springs and foundations, up to a constant: stationary at an equilibrium. "
        "Where two stable states at one load have the same, that is Maxwell's load."
    ),
    "conjugate": (
        "What the load does work on, -dV/dload: the displacement of a force's point, the angle of a moment. Along a "
        "branch dV = -conjugate dload. Against the load it makes the distinguished diagram of Maddocks (1987): where a "
        "fold opens to smaller loads, the index is greater on its side of greater conjugate."
    ),
    "error bar | error_estimate | ordinate_error_estimate | estimate": (
        "In parentheses after a number: a bound of the error of the discretisation, by a second computation on a "
        "richer mesh. The error of the model is not in it."
    ),
    "at least | resolved | not resolved": (
        "The mesh does not resolve the state: the number in parentheses is no bound, and whether the rod has such "
        "a state is open."
    ),
    "no estimate": "The second computation that bounds the error failed, or was not asked for.",
    "accuracy": "Error that every load and ordinate keeps below, by meshes chosen on the way.",
    "metric": "Measure of a change of state: root mean square of the rotation in radian, with centreline and load.",
    "row | point": "One equilibrium of a branch.",
    "reduced | pointwise | formulation": (
        "Reduced: the contact force and the centreline follow from the rotation by integration. Pointwise: they "
        "are unknown fields."
    ),
    "eta": "Multiplier of the unit norm of the quaternions, a field of unknowns.",
    # branches
    "branch": (
        "A curve of equilibria, row by row along its arclength. What leaves the first branch, or one that a search "
        "found, is branch 1, branch 2, ...; what leaves branch 1 is branch 1.1, branch 1.2, ...."
    ),
    "first branch | straight | ring": (
        "The branch of the state from which a run starts. It is called straight where its states are, ring if the rod "
        "is closed, or as the scene says (states=...), and first branch otherwise."
    ),
    "detached": "A branch on the other side of a gap that an imperfection leaves: no step from the others reaches it.",
    "directors": (
        "Unit vectors of the cross-section: d1 and d2 in its plane, d3 across it. Pictures have a stripe along d1, and "
        "arrows along d1 and d2."
    ),
    "twist": "Turns of the directors about the centreline: the integral of the twist rate k3 over 2 pi.",
    "writhe": "Turns of the centreline about itself: Gauss's integral; of a closed rod, its link less its twist.",
    "found": "A branch through an equilibrium that a search by deflation found.",
    "depth | branch_points_not_followed": (
        "Number of switches from the first branch; the plan says how many are followed."
    ),
    "ended": "Why a branch has no more rows.",
    "end of range": "The branch reaches a bound of the load's range.",
    "closed loop": "The branch has come back to its beginning.",
    "meets another branch": "The branch ends on another one, in a branch point.",
    "stretch reaches zero": "The rod is squeezed to nothing somewhere: no rod beyond.",
    "no convergence": "Newton's method failed with the smallest step: there may be more of this branch.",
    "points reached": "The largest number of rows of a branch was reached: there is more of it.",
    "not convex": "The stored energy loses convexity: an index means nothing beyond.",
    # pictures of frequencies, loci
    "motion | bending about d1 | bending about d2 | bending | torsion | mixed | without rotation | rigid motion": (
        "The rotation that a mode mostly consists of: about a director of the cross-section, about the axis, several, "
        "or none, as in vibrations along the rod. A rod that nothing holds has rigid motions of frequency zero."
    ),
    "complex pair, real part | complex pair, imaginary part": (
        "Two frequencies a +- ib: the rod oscillates with a, and the oscillation grows as exp(b t)."
    ),
    "diverged, growth rate": "An imaginary frequency: the motion grows as exp(b t) without oscillating.",
    "locus": "Curve of the loads of one special point as a second parameter varies: a boundary of stability.",
    "range of flutter | range of divergence | range of instability": (
        "Loads at which a complex pair, or an imaginary frequency, is among those found: shaded."
    ),
    "stable side": (
        "Side of a locus of branch points on which the branch has the index 0; shaded next to the curve only, as far "
        "as the index was counted."
    ),
    "stable, as far as these curves tell": (
        "Between the stable side of a locus and the next one, or the bound of the load: stable unless a special point "
        "that no locus follows lies between."
    ),
    "image, not traced": (
        "Branch that a symmetry of the scene makes of a traced one, with the opposite ordinate: as stable as that."
    ),
    "start": "Where a locus was started: the special point of the diagram.",
    "turning point | turns": "Where a locus turns back in the second parameter.",
    "cusp": "Where two folds meet and vanish: beyond it there is no hysteresis.",
    "fold meets branch point": "Where a locus of folds ends on one of branch points.",
}
KNOWN = {name for key in ENTRIES for name in key.split(" | ")}
ENTRIES |= {
    x.name: f"{x.words[0].upper()}{x.words[1:]}." for x in (*COLUMNS, *SPECIAL) if x.name not in {*KNOWN, "kind"}
}
"""What is not explained above has the words of the table."""
NAMES = {name: key for key in ENTRIES for name in key.split(" | ")}
"""Entry of each name."""
NEAR = 3
"""Names that are suggested for one that there is not."""


def title(entry: str) -> str:
    """Names of an entry in words, the codes of the terminal among them: ``branch point, BP``."""
    codes = dict.fromkeys(kind.code for name, kind in KINDS.items() if name in entry.split(" | "))
    return ", ".join([*entry.split(" | "), *codes])


def explanation(word: str) -> list[tuple[str, str]]:
    """Titles and texts of a word, several for a code of several kinds.

    Raises :class:`~rodfem.errors.InputError` for a word that no entry has.
    """
    found = _found(word)
    if not found:
        inside = [name for name in NAMES if word.lower() in name.lower().replace(",", "").split()]
        near = inside[:NEAR] or get_close_matches(word.lower(), NAMES, n=NEAR)
        best = f"{' or '.join(near)}, or rodfem explain" if near else "rodfem explain"
        raise InputError(f"There is no entry {word!r}: try {best}, which lists all.")
    return [(title(NAMES[name]), ENTRIES[NAMES[name]]) for name in dict.fromkeys(found)]


def is_entry(word: str) -> bool:
    """Whether a word has an entry."""
    return bool(_found(word))


def _found(word: str) -> list[str]:
    """Names of the entries of a word: those of a code, or its own."""
    found = [name for name, kind in KINDS.items() if kind.code == word.upper()]
    wanted = " ".join(word.lower().split())
    return found or [name for name in NAMES if name.lower() in (wanted, wanted.replace(" ", "_"))]
