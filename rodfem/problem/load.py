"""Kinds of loads: each says where it has a potential, and its term there, or else its virtual work.

A term is made of the state where the load acts, a :class:`~rodfem.problem.contribution.Site`, and of its value there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rodfem.forms import loads

if TYPE_CHECKING:
    from rodfem.problem.contribution import Site

Term = Callable[["Site", Any], Any]


@dataclass(frozen=True)
class Load:
    """A kind of load.

    Attributes
    ----------
    potential
        Its potential, None where it has none in space.
    in_plane
        Its potential where the rod is planar, None where that is the same.
    work
        Its virtual work where it has no potential.
    moment
        Whether it is a moment, about the normal of a planar rod; a force is in its plane.
    """

    potential: Term | None = None
    in_plane: Term | None = None
    work: Term = lambda at, value: 0
    moment: bool = False

    def potential_in(self, *, planar: bool) -> Term | None:
        """Potential of a planar rod, or of one in space, None where there is none."""
        return (planar and self.in_plane) or self.potential


def _felt(at: Site, force: Any) -> Any:
    """Potential of a dead force in the free directions; None where it is the contact force of the reduced rod."""
    return -sum(force[i] * at.x.r[i] for i in at.free) if "r" in vars(at.x) and at.free else None


def _about_normal(at: Site, moment: Any) -> Any:
    """Minus moment times angle: in a plane all moments are about its normal."""
    return -moment[at.normal] * at.turned


POTENTIAL = Load(lambda at, value: value)
DEAD = Load(lambda at, force: loads.dead(at.x.r, force))
DEAD_AT_END = Load(_felt)
FOLLOWER = Load(work=lambda at, force: loads.follower_work(at.x.R, force, at.first.r))
MOMENT = Load(
    in_plane=_about_normal, work=lambda at, moment: loads.moment_work(at.x.q, moment, at.first.q), moment=True
)
FOLLOWER_MOMENT = Load(
    in_plane=_about_normal, work=lambda at, moment: loads.follower_moment_work(at.x.q, moment, at.first.q), moment=True
)
