"""Bound of the steps of a branch about a piece that is to be looked at again."""

from __future__ import annotations

from math import inf
from types import SimpleNamespace
from typing import Any

import pytest

from rodfem.diagram.shorter_steps import PARTS, SHORTER, ShorterSteps, Unresolved


def row(arclength: float) -> Any:
    return SimpleNamespace(arclength=arclength)


def test_steps_are_long_up_to_the_piece_short_in_it_and_long_again() -> None:
    """A branch that goes back far before the piece does not creep towards it."""
    steps = ShorterSteps()
    assert steps.reach(row(0.0)) == inf
    with pytest.raises(Unresolved):
        steps.ask(row(3.0), row(3.2))
    assert steps.reach(row(0.5)) == pytest.approx(2.5)
    assert steps.reach(row(2.99)) == steps.reach(row(3.1)) == pytest.approx(0.2 / PARTS)
    assert steps.reach(row(3.5)) == inf


def test_what_is_short_already_is_not_asked_for_for_ever() -> None:
    """A piece within the last one counts, another one begins anew."""
    steps, length = ShorterSteps(), 1.0
    for _ in range(SHORTER):
        with pytest.raises(Unresolved):
            steps.ask(row(1.0), row(1.0 + length))
        length /= PARTS
        assert steps.reach(row(1.0)) == pytest.approx(length)
    steps.ask(row(1.0), row(1.0 + length))
    with pytest.raises(Unresolved):
        steps.ask(row(9.0), row(9.5))


def test_a_branch_does_not_go_to_and_fro_between_two_pieces() -> None:
    """It goes back beyond both of them each time: each is known when the other one is asked for."""
    steps, asked = ShorterSteps(), 0
    for _ in range(10):
        for first in (3.0, 5.0):
            try:
                steps.ask(row(first), row(first + 0.2))
            except Unresolved:
                asked += 1
    assert asked == 2 * SHORTER
    assert steps.reach(row(3.1)) == steps.reach(row(5.1)) == pytest.approx(0.2 / PARTS)
    assert steps.reach(row(3.5)) == pytest.approx(1.5)
