"""Answers of lesson 5: branch points and imperfections."""

from math import pi

from lesson.answer import Answer

ANSWERS = (
    Answer(
        "curvature c of the pitchfork of the column, P = P1 (1 + c a^2) with a the angle of the tip",
        1 / 8,
        "exact 1/8",
        1e-6,
        "c = -Pi''''/(6 Pi''_P P1): derivatives of the energy in the direction of the null vector.",
        ((1 / 4, "Divide the fourth derivative by 4!, and the second by 2!."),),
    ),
    Answer(
        "critical load of the column, by the stiffness of one amplitude at P = 2 and 3",
        pi**2 / 4,
        "exact pi^2/4",
        1e-6,
        "h' = (y . S' y) / (b . y)^2 with y = S^-1 b, at both loads: scipy's CubicHermiteSpline has roots.",
        ((2.4670751, "That is no cubic: use the slopes, too."),),
    ),
    Answer(
        "largest load of the rigid column, eps = 0.01",
        0.9311904418870033,
        "exact (1 - eps^(2/3))^(3/2)",
        1e-6,
        "p = cos(theta) - eps cot(theta) along the curve of equilibria: where is it largest?",
        ((1.0, "That is the perfect column."),),
    ),
    Answer(
        "curvature c of the pitchfork of the heavy column, q = q1 (1 + c a^2) with a the angle of the tip",
        0.1137215639,
        "computed by two programs: the reduced energy, and shooting at small angles",
        1e-6,
        "Take the null vector of exercise 2.2, one at the tip, and the derivatives of lesson 5 with the weight 1 - s.",
        ((1 / 8, "That is the load at the tip: the upper part of a heavy column carries less."),),
    ),
    Answer(
        "curvature at which the rod between two robots leaves the helix C11 = 0.65, C22 = 0",
        6.551450266,
        "by another computation of the rod of Tong, Borum & Jawed (2022)",
        1e-8,
        "grippers(0.65, 0.0) of the page: its first branch point.",
        ((7.068037605, "That is the path of C11 = 0.23."),),
    ),
)
