"""Every demo, classical problem and scene of the documentation, as they are recorded in ``tests/golden``."""

import json
from collections.abc import Callable
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import classics
import demo_cases as demos
import hemitropic_cases
import pytest
from literature import test_classics
from problem import test_docs

import rodfem
from rodfem import Discretization, Plan, Scene, SpecialPoint
from rodfem.continuation.kinds import FLUTTER

DEMOS: dict[str, Callable[[], Scene]] = {
    "hemitropic": hemitropic_cases.scene,
    "cord": lambda: demos.scene("cord", span=(60.0, 8.0)),
    "ruler": lambda: demos.scene("ruler"),
    "follower": lambda: demos.scene("follower"),
    "ring": lambda: demos.scene("ring"),
}
OTHERS: dict[str, Callable[[], Scene]] = {
    "bow": classics.bow,
    "helical spring": lambda: classics.spring(3.0, 2.0),
    "loop": classics.loop,
    "lateral in the plane": lambda: classics.lateral("e2"),
    "planar column": classics.planar_column,
    "Bathe and Bolourchi": classics.bathe,
    "Beck": classics.beck,
}

FAMILIES = {"michell"}
"""Scenes whose side branches are families of equilibria at one load: which of them is followed is up to round-off."""
NOT_CONSERVATIVE = ("demo follower", "classic Beck", "docs pflueger", "docs leipholz")
"""Cases without a potential, named, so that nobody has to state all scenes to tell them apart."""


def cases() -> dict[str, Callable[[], Scene]]:
    """Scenes by name, of which the first word says where they are from."""
    found = {f"demo {name}": scene for name, scene in DEMOS.items()}
    found |= {f"classic {name}": entry[0] for name, entry in test_classics.CRITICAL.items()}
    found |= {f"classic {name}": scene for name, scene in OTHERS.items()}
    return found | {f"docs {name}": (lambda s=scene: s) for name, scene in test_docs.scenes().items()}


VARIED = (
    "demo hemitropic",
    "demo cord",
    "demo ruler",
    "demo follower",
    "demo ring",
    "classic stepped",
    "classic michell",
    "classic semi-tangential",
    "classic arch under dead load",
    "classic tip on a plane",
    "classic no mean deflection",
    "classic in a plane",
    "docs hinge",
    "classic tip spring",
    "classic point load",
)
"""Cases that have all that a rod may have: closed, planar, curved ones, joints, springs, constraints of all kinds."""


REPEATED = (
    "shearable",
    "stepped",
    "twisted",
    "ring",
    "sprung",
    "heavy",
    "winkler",
    "midway",
    "bow",
    "in_plane",
    "on_a_plane",
)
"""Scenes of the documentation that state a classical problem once more, with other numbers at most."""


def distinct() -> list[str]:
    """Names of the cases with forms of their own: a comparison of two codes learns nothing from the others."""
    return [name for name in cases() if name.removeprefix("docs ") not in REPEATED]


def single_branches() -> list[Any]:
    """Names of the conservative ones of these without families, for tests; those beside ``VARIED`` are long."""
    names = [
        name for name in distinct() if name not in NOT_CONSERVATIVE and name.removeprefix("classic ") not in FAMILIES
    ]
    return [pytest.param(name, marks=[] if name in VARIED else [pytest.mark.long]) for name in names]


def trace(scene: Scene, *, error_bars: bool = True) -> rodfem.Diagram:
    """Diagram of a scene to the depth 1.

    By the default discretisation, or twice as many elements where the rod is bent from the start: of a closed rod the
    numbers of a coarse mesh depend on where it is along itself.
    """
    mesh = Discretization("auto", 8 if scene.start is None else 16, 6)
    return rodfem.trace(scene, mesh, Plan(depth=0 if scene.name in FAMILIES else 1, error_bars=error_bars))


@cache
def numbers() -> dict[str, Any]:
    """What is recorded, by the names of the cases."""
    read: dict[str, Any] = json.loads((Path(__file__).parent / "golden" / "numbers.json").read_text())
    return read


def record(scene: Scene, *, error_bars: bool = True) -> list[dict[str, Any]]:
    """What is recorded of a scene: its branches, with their special points and the sequence of their indices.

    Without ``error_bars`` the bars are round-off, and no forms of a higher degree are compiled.
    """
    return recorded(trace(scene, error_bars=error_bars))


def recorded(diagram: rodfem.Diagram) -> list[dict[str, Any]]:
    """What is recorded of a diagram."""
    return [
        {
            "name": branch.name,
            "ended": branch.ended.split(" at ")[0].split(":")[0],
            "indices": [index for index, _ in groupby(p.negative for p in branch.points)],
            "special": [_point(s) for s in branch.special],
        }
        for branch in diagram.branches
    ]


def _point(s: SpecialPoint) -> dict[str, Any]:
    out = {
        "kind": s.kind,
        "load": s.point.load,
        "bar": max(s.error_estimate, s.located_to),
        "index": [s.negative_before, s.negative_after],
        "zero": s.point.zero,
    }
    return out | ({"omega2": s.omega2} if s.kind == FLUTTER else {})
