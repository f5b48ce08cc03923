"""Answers of lesson 7: rings."""

from math import sqrt

from lesson.answer import Answer

FLUID, WEIGHTS, STRINGS = 3.0, 4.0, 4.5

ANSWERS = (
    Answer(
        "torque C t0 at which the twisted ring leaves its plane",
        sqrt(3),
        "exact sqrt(3), Michell 1889",
        1e-6,
        "Give the torque C t0, not the natural twist t0.",
        ((sqrt(3) / 1.5, "That is t0: multiply it by C."), (sqrt(8), "That is the mode n = 3.")),
    ),
    Answer(
        "critical pressure of a ring under a fluid",
        FLUID,
        "exact n^2 - 1, Levy 1884",
        1e-6,
        "The natural curvature is 1, and the mode has n = 2 waves.",
        ((WEIGHTS, "That is a force of constant direction."), (STRINGS, "That is a force to the centre.")),
    ),
    Answer(
        "critical pressure of a ring under forces of constant direction",
        WEIGHTS,
        "exact n^2",
        1e-6,
        "Give the force per length in fixed components, as a function of c.s.",
        (
            (FLUID, "That is a fluid."),
            (STRINGS, "That is a force to the centre."),
            (1.0, "That is the rotation, n = 1."),
        ),
    ),
    Answer(
        "critical pressure of a ring under forces to its centre",
        STRINGS,
        "exact (n^2 - 1)^2/(n^2 - 2), Boresi 1955",
        1e-6,
        "The potential per length is p times the distance from (1, 0, 0).",
        ((FLUID, "That is a fluid."), (WEIGHTS, "That is a force of constant direction.")),
    ),
)
