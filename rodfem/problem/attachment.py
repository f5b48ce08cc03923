"""Attachments along the rod: springs, masses, loads at a point."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rodfem.forms import inertia
from rodfem.problem.contribution import Contribution, Site
from rodfem.problem.load import DEAD, FOLLOWER, POTENTIAL
from rodfem.problem.roles import Role, role_field

if TYPE_CHECKING:
    from rodfem.problem.local_state import Constants, OfConstants, OfPlace


@dataclass(frozen=True)
class Attachment(Contribution):
    """Something attached at arclength ``s``.

    A dead ``force(c)``, a ``follower(c)`` force by its components along the directors, a potential ``energy(x, c)`` (a
    spring), a ``mass(c)``, a ``rotary_inertia(c)`` (3,) about the directors.
    """

    s: float
    force: OfConstants | None = role_field(Role("force of an attachment", "f(c)", 3, load=DEAD))
    follower: OfConstants | None = role_field(
        lambda x: Role(f"follower force at s = {x.s:g}", "f(c)", 3, load=FOLLOWER)
    )
    energy: OfPlace | None = role_field(Role("energy of an attachment", "f(x, c)", 0, load=POTENTIAL))
    mass: Callable[[Constants], Any] | None = role_field(Role("mass of an attachment", "f(c)", 0))
    rotary_inertia: OfConstants | None = role_field(Role("rotary inertia of an attachment", "f(c)", 3))

    def kinetic(self, at: Site) -> Iterator[Any]:
        """Mass, where there is a centreline, and rotary inertia."""
        if self.mass is not None and at.first.r is not None:
            yield inertia.translational(at.first.r, at.second.r, self.mass(at.c))
        if self.rotary_inertia is not None:
            yield inertia.rotary(at.x.q, at.first.q, at.second.q, tuple(self.rotary_inertia(at.c)))
