"""Answers of lesson 4: folds."""

from math import sqrt

from lesson.answer import Answer

ANSWERS = (
    Answer(
        "load of the fold of the deep arch",
        8.973089969728,
        "DaDeppo & Schmidt 1975; digits by shooting",
        1e-6,
        "Follow the curve past the largest load, and locate that by ever shorter steps.",
    ),
    Answer(
        "load p at which the truss of the picture snaps",
        2 / sqrt(27),
        "exact 2/sqrt(27)",
        1e-6,
        "First and second derivative of the energy vanish: x^3 - x = p and 3 x^2 = 1.",
        ((1 / sqrt(3), "That is the place of the apex, not the load."),),
    ),
    Answer(
        "displacement of the crown at which the arch jumps in the machine",
        1.20389143,
        "computed by two programs: rodfem, and shooting with a Runge-Kutta method",
        1e-5,
        "Trace the scene of the machine up to w = 1.5: its first fold.",
        (
            (1.18479570, "That is the other fold, where the arch jumps on the way back."),
            (1.1373206, "That is where the dead load is largest: a constraint removes that direction."),
        ),
    ),
)
