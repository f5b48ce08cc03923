"""The rods of docs/real-rods.md in SI units: each number beside its hand calculation, as the page asserts it."""

import re
from pathlib import Path

import numpy as np
import pytest
from literature.test_free_rods import beal
from numpy.polynomial import Polynomial

from rodfem import Diagram

PAGE = Path(__file__).parents[2] / "docs" / "real-rods.md"


@pytest.mark.long
def test_every_number_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    """The blocks assert what they print, and the numbers in their comments are those printed."""
    text, names = PAGE.read_text(), {}
    for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL):
        assert len(block.splitlines()) < 30
        exec(block, names)
    said = capsys.readouterr().out
    numbers = re.findall(r'"\n?\)  # ([0-9.]+)', text)
    assert len(numbers) == 6
    for number in numbers:
        assert said.count(number) == 2, number  # computed, and by hand
    diagrams = [x for x in names.values() if isinstance(x, Diagram)]
    assert len(diagrams) == 6 and not any(diagram.warnings for diagram in diagrams)


def test_thrust_of_the_boom() -> None:
    """Where the square of an imaginary part, which is smooth, vanishes: the page's number, and Beal's (1965)."""
    beyond = np.linspace(109.7, 110.1, 10)
    lowest = [mu[abs(mu) < 1e4] for mu in map(beal, beyond)]
    roots = Polynomial.fit(beyond, [np.max(mu.imag) ** 2 for mu in lowest], 5).roots()
    thrust = roots[np.argmin(abs(roots - beyond[0]))].real
    assert thrust == pytest.approx(109.689191957, rel=2e-9) and thrust == pytest.approx(109.69, abs=5e-3)
    assert "109.689191957" in PAGE.read_text()
