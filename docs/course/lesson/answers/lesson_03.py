"""Answers of lesson 3: columns under constraints."""

from math import pi, sqrt

from lesson.answer import Answer

ANSWERS = (
    Answer(
        "critical load between clamps, with the middle held",
        80.76291422570652,
        "exact 4 w^2 with tan(w) = w",
        1e-6,
        "Constrain the displacement of the middle as well as that of the end, and subtract two from the count.",
        ((4 * pi**2, "That is without the middle held."), (16 * pi**2, "The rod may still turn in the middle.")),
    ),
    Answer(
        "critical load, left end clamped, right end pinned on the axis",
        20.190728556426,
        "exact w^2 with tan(w) = w",
        1e-6,
        "Natural at the pinned end is theta' = 0: leave theta(1) free, and keep the constraint.",
        ((pi**2 / 4, "That is a free tip: hold it on the axis."), (4 * pi**2, "Those are two clamps.")),
    ),
    Answer(
        "critical load between pinned ends, with the middle held",
        4 * pi**2,
        "exact 4 pi^2: each half is a pinned column",
        1e-6,
        "Half the length, four times the load.",
        ((pi**2, "That is without the middle held."),),
    ),
    Answer(
        "distance d of the clamps at which a rod of stretching stiffness 1000 buckles",
        (1 + sqrt(1 - 16 * pi**2 / 1000)) / 2,
        "exact: 1000 (1 - d) d = 4 pi^2",
        1e-7,
        "The thrust is N = 1000 (1 - d), and the second variation is int eta'^2 - N d eta^2.",
        ((1 - 4 * pi**2 / 1000, "The rod has shortened before it buckles: its length is d, not 1."),),
    ),
)
