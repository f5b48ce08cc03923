"""Formulations of a rod: a class each, in a file of its own, registered here by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodfem.errors import Argument, InputError, Remedy
from rodfem.fem.formulations.pointwise import Pointwise
from rodfem.fem.formulations.reduced import Reduced

if TYPE_CHECKING:
    from rodfem.fem.formulation import Formulation
    from rodfem.problem.scene import Scene

AUTO = "auto"
"""Not a formulation: the first that applies is chosen."""
FORMULATIONS: dict[str, Formulation] = {made.name: made for made in (Reduced(), Pointwise())}


def names() -> tuple[str, ...]:
    """Return what a discretisation may ask for."""
    return AUTO, *FORMULATIONS


def chosen(name: str, scene: Scene) -> Formulation:
    """Formulation of that name, or the first that applies; raises :class:`InputError` where it does not apply."""
    refusals = {other: made.refusal(scene) for other, made in FORMULATIONS.items()}
    first = next(other for other, refusal in refusals.items() if not refusal)
    if refusals.get(name):
        remedy = Remedy("use {}", Argument("Discretization", "formulation", first))
        raise InputError(f"The {name} formulation {refusals[name]}", remedy)
    return FORMULATIONS[first if name == AUTO else name]
