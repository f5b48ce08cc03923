"""Answers of lesson 8: chiral rods."""

from math import pi

from lesson.answer import Answer

CORD, HEMITROPIC = 5 * pi**2, 0.11430421452003

ANSWERS = (
    Answer(
        "tension at which the straight cord of k0 = 3 pi loses stability",
        CORD,
        "exact 5 pi^2",
        1e-6,
        "Let the tension go down from 60, where the straight cord is stable.",
        ((HEMITROPIC, "That is the hemitropic rod."), (9 * pi**2, "That is k0^2: the mode has w = 2 pi.")),
    ),
    Answer(
        "compression at which the rod without coupling buckles",
        0.12538322397844363,
        "exact 10 lam (1 - lam) = pi^2/9",
        1e-6,
        "The thrust is 10 lam (1 - lam), the length 6.",
        ((HEMITROPIC, "That is A = 3."),),
    ),
    Answer(
        "tension at which a second direction of the straight cord becomes unstable",
        8.063525384097708,
        "exact 9 pi^2 - w^2 with tan(w/2) = w/2",
        1e-6,
        "Let the tension go down to 1: the index changes from 1 to 2.",
        ((CORD, "That is the first direction."),),
    ),
    Answer(
        "size of A for which the hemitropic rod buckles at lam = 0.12",
        1.9614199207686485,
        "exact sin(q-p) = (q-p) sin(p) sin(q)/(pq)",
        1e-6,
        "Solve the closed form of the lesson for A, or follow the branch point with diagram.locus.",
        ((-1.9614199207686485, "Give its size: both hands buckle alike."),),
    ),
    Answer(
        "compression at which the index of branch 2 of the hemitropic rod falls from 3 to 2",
        0.321650086556920,
        "shooting",
        1e-4,
        "Choose the fold of branch 2: there the compression turns back along the branch.",
        ((0.3320390797, "That is where the branch begins."),),
    ),
)
