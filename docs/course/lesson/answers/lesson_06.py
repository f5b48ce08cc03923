"""Answers of lesson 6: big rotations."""

from lesson.answer import Answer

GREENHILL = 8.986818915818128

ANSWERS = (
    Answer(
        "critical moment of a shaft twisted between clamps, B = 1",
        GREENHILL,
        "exact tan(M/2) = M/2, Greenhill 1883",
        1e-6,
        "Turn one clamp about the axis, and follow the straight shaft past a whole turn.",
        ((GREENHILL / 2, "That is M/2: the zero of tan(x) - x."),),
    ),
    Answer(
        "critical angle of the shaft with C = 2",
        GREENHILL / 2,
        "exact M/C with tan(M/2) = M/2",
        1e-6,
        "The moment decides, and it is C times the angle.",
        ((GREENHILL, "That is the moment: the angle is M/C."), (2 * GREENHILL, "A stiffer shaft turns less.")),
    ),
    Answer(
        "critical angle of the shaft under a tension 10, C = 1",
        10.428856439276949,
        "exact sin(q-p) = (q-p) sin(p) sin(q)/(pq), p, q = (M/2 -+ W)/2, W^2 = M^2/4 - 10",
        1e-6,
        "The sliding end has a force (0, 0, 10) along the axis.",
        ((GREENHILL, "That is the shaft without tension."),),
    ),
    Answer(
        "displacement of the tip of the bend of 45 degrees, along the force",
        53.47485879,
        "Bathe & Bolourchi 1979: 53.4",
        1e-6,
        "Start from the arc, a turn by s/100 about e2, and raise the force along e2 in steps.",
    ),
)
