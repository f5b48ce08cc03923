"""Equations that overflow wherever they are asked are refused in a sentence."""

from __future__ import annotations

from typing import Any

import pytest
import ufl
from classics import SUPPORTS, column

from rodfem import Discretization, Solver
from rodfem.errors import SceneError
from rodfem.forms.energy import bending_and_twist


@pytest.mark.long
def test_the_derivative_of_tanh_of_large_numbers() -> None:
    """UFL has it as 2 cosh(x) / (cosh(2 x) + 1), which overflows, where tanh(x) is one."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        return (1.5 - 0.5 * ufl.tanh((c.s - c.k) / c.w)) * bending_and_twist(k, (c.B1, c.B2, c.C))

    scene = column("sharp", SUPPORTS["clamped-free"], (0.0, 6.0), energy=energy, constants={"k": 1e-7, "w": 1e-8})
    with pytest.raises(SceneError, match=r"are no numbers at any of the 3 states .* overflows"):
        Solver(scene, Discretization("auto", 2, 3))
