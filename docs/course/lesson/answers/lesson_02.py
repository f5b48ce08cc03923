"""Answers of lesson 2: critical loads and counts."""

from math import pi

from lesson.answer import Answer

ANSWERS = (
    Answer(
        "critical load of the clamped column",
        pi**2 / 4,
        "exact pi^2/4",
        1e-6,
        "Bisect between a load of index 0 and one of index 1.",
        ((pi**2, "Those are pinned ends."), (pi**2 / 2, "That is the stiff plane, of stiffness 2.")),
    ),
    Answer(
        "critical load of the column between pinned ends",
        pi**2,
        "exact pi^2",
        1e-6,
        "Bisect between a load of index 0 and one of index 1.",
        ((pi**2 / 4, "That is a free tip: hold its position across the axis."),),
    ),
    Answer(
        "critical weight per length of a heavy column",
        7.837347438943,
        "Greenhill 1881, exact 9/4 j^2 with the first zero j of the Bessel function of order -1/3",
        1e-6,
        "The section at s carries what is above it: the second variation has q (1 - s) in place of P.",
        ((3.476619007997635, "There the weight above s is taken as q s: measure it from the tip."),),
    ),
    Answer(
        "index in space of the straight column at P = 100, of bending stiffnesses 1 and 2",
        5,
        "exact: (2 n - 1)^2 pi^2/4 for n = 1, 2, 3, and twice that for n = 1, 2, are below 100",
        0.0,
        "Each plane of bending has critical loads of its own; leave out planar.",
        ((3, "That is the index in the plane."),),
    ),
)
