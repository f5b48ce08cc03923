"""Answers of lesson 9: loads that follow the rod."""

from math import acos, pi, sqrt

from lesson.answer import Answer

BECK, ZIEGLER = 20.0509536189738, 3.5 - sqrt(2)

ANSWERS = (
    Answer(
        "flutter load of Beck's column",
        BECK,
        "exact double zero of the frequency equation, Beck 1952",
        1e-6,
        "The force is a follower at the tip, and the rod has mass but no rotary inertia.",
        ((pi**2 / 4, "That is a dead load, Euler's."), (2 * pi**2, "That is an old approximation, 2 pi^2.")),
    ),
    Answer(
        "critical thrust of Ziegler's pendulum with vanishing damping",
        41 / 28,
        "exact 41/28, Ziegler 1952",
        1e-5,
        "Look for the load at which an eigenvalue of the system of first order gets a positive real part, b = 0.001.",
        ((ZIEGLER, "That is without damping."),),
    ),
    Answer(
        "critical load if 0.3 of the thrust follows the tip",
        acos(-3 / 7) ** 2,
        "exact cos(sqrt(P)) = -3/7",
        1e-6,
        "The tip has two loads, force and follower; look for a divergence.",
        ((BECK, "That is a thrust that follows entirely."), (pi**2 / 4, "That is a thrust that does not follow.")),
    ),
    Answer(
        "flutter load of a column under a uniform tangential thrust",
        40.0537365149,
        "Leipholz 1962: 40.05",
        1e-6,
        "The scene has a follower force per length, and the tip none.",
        ((BECK, "That is a thrust at the tip."),),
    ),
)
