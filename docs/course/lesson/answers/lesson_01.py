"""Answers of lesson 1: the elastica."""

from math import pi

from lesson.answer import Answer

ANSWERS = (
    Answer(
        "displacement of the tip across the axis, at P = 1.5 pi^2/4",
        0.7885758056925356,
        "exact 2 sqrt(m)/K(m) where K(m)^2 = P",
        1e-6,
        "Solve at P = 1.5 pi^2/4 = 3.7011, from a start that is bent.",
        (
            (0.3635882249217906, "That is the distance of the tip along the axis."),
            (-0.7885758056925356, "That is the mirror image: start on the other side."),
        ),
    ),
    Answer(
        "displacement of the tip across the axis, under a moment pi/2 at the tip",
        2 / pi,
        "exact 2/pi: a quarter of a circle",
        1e-6,
        "Natural is theta'(1) = M, so that the curvature is constant.",
        ((-2 / pi, "The moment turns the other way."),),
    ),
    Answer(
        "displacement of the tip across the axis, under a transverse force 1",
        0.3017207737998134,
        "Bisshopp & Drucker 1945",
        1e-6,
        "The potential of the force is -F int sin(theta) ds.",
        ((1 / 3, "That is linear theory: the tip also moves along the axis."),),
    ),
    Answer(
        "smallest load with a bent equilibrium, spring of stiffness 4 at the foot",
        1.5991918421721507,
        "exact solution of sqrt(P) tan(sqrt(P)) = 4",
        1e-6,
        "Linearise: theta = cos(w (1 - s)) with w^2 = P, and theta'(0) = 4 theta(0) at the foot.",
        ((pi**2 / 4, "That is a clamped foot."),),
    ),
)
