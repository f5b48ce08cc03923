"""Functions of a scene that take another branch for expressions than for numbers are refused."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import pytest
import ufl
from classics import column

from rodfem import Attachment, Inertia, Ordinate, Scene, SceneError, clamped, free
from rodfem.forms.energy import bending_and_twist

OTHER = "as a function of numbers and .* as an expression of its constants"
SOFT, STIFF = (1.0, 1.0, 1.0), (9.0, 9.0, 9.0)


def scene(factor: Callable[[Any], Any] = lambda c: 1.0, on: float = 1.0, end: Any = None, **changes: Any) -> Scene:
    """Column under a thrust with a ``factor`` that depends on a constant ``on``."""
    ends = clamped(), free(lambda c: (0.0, 0.0, -c.P * factor(c)), energy=end)
    return column("flag", ends, (0.0, 6.0), constants={"on": on}, **changes)


@pytest.mark.parametrize(
    ("factor", "on", "words"),
    [
        (lambda c: 1 if c.on == 1 else 2, 1.0, rf"^The force on the right end is -6 {OTHER}.*ufl\.conditional"),
        (lambda c: 2 if c.on != 1 else 1, 1.0, OTHER),
        (lambda c: 1 if c.on in (1, 2) else 2, 1.0, OTHER),
        (lambda c: 1 if c.on else 2, 0.0, OTHER),
        (lambda c: 1 if ufl.eq(c.on, 1) else 2, 1.0, "takes ufl.eq or ufl.ne for true or false"),
        (lambda c: ufl.sin(c.on) / c.on if c.on != 0 else 1.0, 0.0, OTHER),
        (lambda c: {1.0: 1.0}.get(c.on, 3.0), 1.0, OTHER),
        (lambda c: {1.0: 1.0}[c.on], 1.0, "KeyError, 'c.on'"),
        (lambda c: 1 if 2 * c.on == 2 else 2, 1.0, rf"is -6 {OTHER.replace('.*', '-12')}, at P = 6"),
        (lambda c: 1 if c.on - 1 else 2, 1.0, OTHER),
        (lambda c: 1 if isinstance(c.on, float) else 2, 1.0, OTHER),
        (lambda c: {6.0: 2.0}.get(c.P, 1.0), 1.0, OTHER),
    ],
)
def test_a_branch_by_the_value_of_a_constant(factor: Callable[[Any], Any], on: float, words: str) -> None:
    """The first gave half of Euler's load with the bar 9e-12, the one by a dictionary a third of it."""
    with pytest.raises(SceneError, match=words):
        scene(factor, on)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"energy": lambda v, k, c: bending_and_twist(k, {1.0: SOFT}.get(c.on, STIFF))}, f"stored energy .* {OTHER}"),
        ({"end": lambda x, c: {1.0: 2.0}.get(c.on, 1.0) * x.r[0] ** 2}, f"energy of the right end .* {OTHER}"),
        ({"potential": lambda x, c: {1.0: 2.0}.get(c.on, 1.0) * x.r[0] ** 2}, f"potential along the rod .* {OTHER}"),
        ({"distributed": lambda c: (0.0, 0.0, c.P if c.s == 0.5 else 1.0 + c.on if c.on == 1 else 0.0)}, OTHER),
        ({"inertia": Inertia(lambda c: {1.0: 2.0}.get(c.on, 1.0))}, f"mass per length .* {OTHER}"),
        (
            {"attachments": (Attachment(0.5, force=lambda c: (0.0, 0.0, -c.P * {1.0: 1.0}.get(c.on, 3.0))),)},
            f"force of an attachment .* {OTHER}",
        ),
        (
            {"ordinate": Ordinate("bent", s=None, of=lambda x, c: x.k[0] ** 2 * {1.0: 2.0}.get(c.on, 1.0))},
            f"ordinate along the rod .* {OTHER}",
        ),
    ],
)
def test_every_function_is_asked(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        scene(**changes)


@pytest.mark.few(7)
@pytest.mark.parametrize(
    "changes",
    [
        {"factor": lambda c: ufl.conditional(ufl.eq(c.on, 1), 1.0, 2.0)},
        {"factor": lambda c: ufl.conditional(ufl.lt(c.P, 1), 1.0, 2.0)},
        {"factor": lambda c: ufl.max_value(c.on, 0.5)},
        {"factor": (lambda twice: lambda c: twice(c.on))(lru_cache(lambda x: 2 * x))},
        {"factor": lambda c: (lambda x: ufl.diff(x**2 / 2, x))(ufl.variable(c.on))},
        {"end": lambda x, c: ufl.erf(x.r[0]) ** 2 + ufl.bessel_J(1, x.r[0])},
        {"end": lambda x, c: ufl.ln(x.r[2])},
        {"attachments": (Attachment(0.5, force=lambda c: (0.0, 0.0, -c.P if c.s == 0.5 else 0.0)),)},
    ],
)
def test_what_is_the_same_as_an_expression(changes: dict[str, Any]) -> None:
    """Conditions of UFL, caches, derivatives, functions that UFL does not evaluate, the place of an attachment."""
    assert scene(**changes).name == "flag"
