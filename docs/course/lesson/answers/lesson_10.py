"""Answers of lesson 10: errors."""

from math import pi

from lesson.answer import Answer

ANSWERS = (
    Answer(
        "tension of the localised helix at an end shortening of 0.03",
        2900.993205792131,
        "exact on an infinite rod, van der Heijden & Thompson 2000",
        1e-7,
        "Use at least 32 elements of degree 6, and an Event at the shortening 0.03.",
    ),
    Answer(
        "Euler's load pi^2/4, extrapolated from 2, 4 and 8 elements of degree 1",
        pi**2 / 4,
        "exact pi^2/4",
        1e-5,
        "Take (4 x(h/2) - x(h))/3 first, then (16 y(h/2) - y(h))/15.",
    ),
    Answer(
        "critical load of the stepped column",
        3.3842519560084767,
        "exact tan(0.3 w/sqrt(2)) tan(0.7 w) = sqrt(2), P = w^2",
        1e-6,
        "The lower part has EI = 2, the upper part EI = 1.",
        ((3.38618, "The step is inside an element: give breaks=(0.3,)."), (pi**2 / 4, "That is EI = 1 throughout.")),
    ),
)
