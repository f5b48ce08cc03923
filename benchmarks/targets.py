"""Numbers with independent references by which every program is judged, scene by scene and branch by branch.

No finite element and no collocation code had a part in them: straight states solve transcendental equations, bent
ones were shot with Runge-Kutta methods of order 8 (residuals below 1e-12).  :mod:`benchmarks.references` computes them
again.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """Where a special point lies, or a number at a given load.

    ``kind`` in AUTO's letters: the load of the ``number``-th branch point (BP) or fold (LP) or flutter point (HB) of
    the branch, or the ordinate where the branch passes the load ``at`` (UZ; ``number`` counts its crossings).
    """

    name: str
    kind: str
    reference: float
    number: int = 0
    at: float | None = None
    source: str = "shooting"


CLOSED = "transcendental equation"

TARGETS: dict[str, dict[str, tuple[Target, ...]]] = {
    "cord": {
        "straight": (
            Target("first branch point", "BP", 49.34802200544679, source=CLOSED),
            Target("second branch point", "BP", 8.063525384097708, 1, source=CLOSED),
        ),
        "branch 1": (Target("1 - r3(1) at lam = 40", "UZ", 0.57933142705311, at=40.0),),
        "branch 2": (
            Target("fold", "LP", 7.806555423174),
            Target("1 - r3(1) at lam = 40", "UZ", 0.44710092896044, at=40.0),
        ),
    },
    "hemitropic": {
        "straight": (
            Target("first branch point", "BP", 0.114304214520030, source=CLOSED),
            Target("second branch point", "BP", 0.332039079723330, 1, source=CLOSED),
        ),
        "branch 1": (Target("mid-point displacement at lam = 0.5", "UZ", 1.729034550256, at=0.5),),
        "branch 2": (
            Target("fold", "LP", 0.3216500865569),
            Target("mid-point displacement at lam = 0.5", "UZ", 0.629008508523, at=0.5),
        ),
    },
    "ruler": {
        "plane": (Target("first branch point", "BP", 4.425948402435),),
        "branch 1": (Target("tip displacement at lam = 8", "UZ", 0.4647694690790, at=8.0),),
    },
    "follower": {
        "straight": (
            Target("flutter load", "HB", 20.0509536189738, source=CLOSED),
            Target("mu1 at P = 10", "UZ", 26.7885149852693, 0, 10.0, CLOSED),
            Target("mu2 at P = 10", "UZ", 345.468944393927, 1, 10.0, CLOSED),
        ),
    },
}
