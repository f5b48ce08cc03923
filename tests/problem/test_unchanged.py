"""Functions that have changed between a scene and its trace: Python looks a variable up when a function is called."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import classics
import numpy as np
import pytest

from rodfem import Attachment, Discretization, Ordinate, Plan, at, clamped, free
from rodfem.diagram.trace import trace
from rodfem.errors import SceneError
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.scene import Scene

EULER = np.pi**2 / 4
COLUMN = classics.euler("clamped-free")
MESH = Discretization(elements=4, degree=4)
K = {"value": 1.0}
"""What the functions below use, as a variable of a module."""

CHANGES: dict[str, Callable[[], dict[str, Any]]] = {
    "stored energy": lambda: {"energy": lambda v, k, c: bending_and_twist(k, (K["value"], 1.0, 1.0))},
    "force on the right end": lambda: {"ends": (clamped(), free(lambda c: (0.0, 0.0, -K["value"] * c.P)))},
    "energy of an attachment": lambda: {
        "attachments": (Attachment(1.0, energy=lambda x, c: K["value"] * x.r[0] ** 2),)
    },
    "constraint": lambda: {"constraints": (at(1.0, lambda x, c: K["value"] * x.r[0]),)},
    "ordinate": lambda: {"ordinate": Ordinate("tip", s=1.0, of=lambda r, q: K["value"] * r[0])},
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_variable_that_changes_is_named(what: str) -> None:
    K["value"] = 1.0
    scene = replace(COLUMN, **CHANGES[what]())
    try:
        K["value"] = 2.0
        with pytest.raises(SceneError, match=f"The {what} was .* when the scene 'clamped-free' was made and is .* now"):
            trace(scene, MESH, Plan(error_bars=False))
    finally:
        K["value"] = 1.0


@pytest.mark.long
@pytest.mark.alone
def test_scenes_of_a_loop() -> None:
    """All but the last one would be the last one; with the value kept each is its own."""

    def of_a_loop(make: Callable[[], list[Scene]]) -> list[float | str]:
        out: list[float | str] = []
        for scene in make():
            try:
                out.append(trace(scene, MESH, Plan(error_bars=False, at=())).special()[0].point.load / EULER)
            except SceneError as trouble:
                out.append(str(trouble))
        return out

    def late() -> list[Scene]:
        return [
            replace(COLUMN, energy=lambda v, k, c: bending_and_twist(k, (B, B, 1.0)))  # noqa: B023
            for B in (1.0, 2.0)
        ]

    def kept() -> list[Scene]:
        return [replace(COLUMN, energy=lambda v, k, c, B=B: bending_and_twist(k, (B, B, 1.0))) for B in (1.0, 2.0)]

    first, second = of_a_loop(late)
    assert "keep its value" in str(first) and second == pytest.approx(2.0, abs=1e-6)
    assert of_a_loop(kept) == pytest.approx([1.0, 2.0], abs=1e-6)
