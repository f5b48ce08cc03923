"""Supports and loads of a rod in one state, as a file records them: plain arrays, for pictures.

:mod:`rodfem.problem.supports` makes and writes it from a scene.

Cross-sections are not part of a scene.  A picture gives them the proportion of the bending stiffnesses: with ``B`` (2,
2) that of the curvatures ``k1, k2`` the second moments of area about the centre are proportional to ::

    J = (B22, -B12; -B12, B11),        J_ab = int x_a x_b dA,   x_1 along d1, x_2 along d2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.problem.quaternions import directors

Floats = NDArray[np.float64]

SUPPORTS, CONSTRAINTS, SECTION = "supports", "constraints", "section"
DISTRIBUTED, FOUNDATION = "distributed", "foundation"
"""Groups below that of a branch or a state, and of the file."""
HELD, AXIS, TURNS = "held", "axis", "free"  # freedom of directors: held, rotating about one axis, rotating freely


@dataclass(frozen=True)
class Support:
    """Support and loads of a rod at the arclength ``s``, in one state; vectors are (3,), zero if there is none.

    ``guide`` is the only direction in which the position moves if that need not be e1, e2 or e3; ``frame`` is the
    quaternion of what holds the directors, ``axis`` is along them.  Stiffnesses (3, 3), ``force`` and ``moment``, felt
    in the free directions, are in the frame of space.
    """

    s: float
    kind: str
    held: NDArray[np.bool_]
    turning: str
    axis: Floats
    frame: Floats
    translation_stiffness: Floats
    rotation_stiffness: Floats
    mass: float
    force: Floats
    moment: Floats
    follower: Floats
    follower_moment: Floats
    guide: Floats = field(default_factory=lambda: np.zeros(3))

    @property
    def slides(self) -> list[Floats]:
        """Unit vectors along which the position moves freely, (3,) each."""
        if self.guide.any():
            return [self.guide / np.linalg.norm(self.guide)]
        return [e for e, held in zip(np.eye(3), self.held, strict=True) if not held]

    def loads(self, R: Floats) -> tuple[Floats, Floats]:
        """Force and moment (3,) in the frame of space where the directors are the columns of ``R`` (3, 3)."""
        return self.force + R @ self.follower, self.moment + R @ self.follower_moment


def kind_of(held: int, turning: str, sprung: bool) -> str:
    """Name of a support that holds ``held`` components of the position and leaves the directors ``turning``."""
    if turning == HELD:
        return "clamp" if held == 3 else "slide"
    if turning == AXIS:
        return "hinge"
    return "pin" if held else "spring" if sprung else "free"


@dataclass(frozen=True)
class Setting:
    """Supports and loads of a rod in one state, as a file records them.

    ``section`` has arclengths (n,) and second moments of area (n, 2, 2); ``distributed`` arclengths and forces per
    length (n, 3) in space and along the directors; ``foundation`` arclengths and stiffnesses per length (n, 3, 3).
    ``notes`` names in words what acts and has no place in a picture.
    """

    supports: tuple[Support, ...] = ()
    section: tuple[Floats, Floats] | None = None
    distributed: tuple[Floats, Floats, Floats] | None = None
    foundation: tuple[Floats, Floats] | None = None
    notes: tuple[str, ...] = ()

    @property
    def axis(self) -> Floats | None:
        """Direction d3 of the first support that holds it (3,); None without one."""
        return next((directors(x.frame)[:, 2] for x in self.supports if x.turning != TURNS), None)

    @property
    def force(self) -> Floats | None:
        """Sum of the dead forces at the supports (3,), None where there is none."""
        total = np.sum([np.zeros(3), *(x.force for x in self.supports)], axis=0)
        return total if total.any() else None

    @property
    def gravity(self) -> Floats | None:
        """Direction of the dead force along the rod (3,), of gravity, say; None where there is none."""
        total = np.zeros(3) if self.distributed is None else self.distributed[1].sum(axis=0)
        return total if total.any() else None

    def widest(self, R: Floats) -> Floats | None:
        """Direction (3,) in which the cross-sections are wide, where the directors are the columns of ``R`` (3, 3)."""
        return None if self.section is None else R[:, :2] @ np.linalg.eigh(self.section[1].mean(axis=0))[1][:, -1]


def read(group: Any, row: int = 0) -> Setting:
    """Read the state of a row of what was written below a group of a file, with the section of the file."""
    supports = [
        Support(**{name: value[row] for name, value in here.items()}, **dict(here.attrs))
        for here in group[SUPPORTS].values()
    ]
    s, B = (group.file[SECTION][name][:] for name in ("s", "stiffness"))
    section = s, B[:, ::-1, ::-1] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    notes, distributed, foundation = [x.attrs["note"] for x in group.get(CONSTRAINTS, {}).values()], None, None
    if along := group.get(DISTRIBUTED):
        distributed = along["s"][:], along["force"][row], along["follower"][row]
    if along := group.get(FOUNDATION):
        if "stiffness" in along:
            foundation = along["s"][:], along["stiffness"][:]
        else:
            notes.append(along.attrs["note"])
    return Setting(tuple(supports), section, distributed, foundation, tuple(notes))
