"""Answers of lesson 11: design."""

from math import pi

from lesson.answer import Answer

UNIFORM = pi**2 / 4

ANSWERS = (
    Answer(
        "critical load of the strongest column, clamped and free, of length and volume one",
        pi**2 / 3,
        "exact pi^2/3, Keller 1960",
        1e-3,
        "The area is the moment to the power 2/3, with the volume one.",
        ((UNIFORM, "That is the uniform column."), (4 * pi**2 / 3, "That is the column between pins.")),
    ),
    Answer(
        "largest dP/dA of the uniform column along it, per length",
        pi**2,
        "exact pi^2 cos(pi s/2)^2 at the foot",
        1e-4,
        "It is 2 A phi'^2 over the integral of phi^2, at the foot.",
        ((pi**2 / 2, "That is the mean along the rod, or the derivative in EI."),),
    ),
    Answer(
        "critical load of the best straight taper",
        3.12074754619,
        "exact by elementary functions, the best t = 0.5586",
        1e-6,
        "Let the area be linear, and vary its slope.",
        ((UNIFORM, "That is the uniform column."),),
    ),
)
