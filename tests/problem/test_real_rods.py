"""The rods of docs/real-rods.md in SI units: each number beside its hand calculation, as the page asserts it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rodfem import Diagram

PAGE = Path(__file__).parents[2] / "docs" / "real-rods.md"

pytestmark = pytest.mark.alone


def test_every_number_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    """The blocks assert what they print, and the numbers in their comments are those printed."""
    text, names = PAGE.read_text(), {}
    for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL):
        assert len(block.splitlines()) < 30
        exec(block, names)
    said = capsys.readouterr().out
    numbers = re.findall(r'"\)  # ([0-9.]+)', text)
    assert len(numbers) == 5
    for number in numbers:
        assert said.count(number) == 2, number  # computed, and by hand
    diagrams = [x for x in names.values() if isinstance(x, Diagram)]
    assert len(diagrams) == 5 and not any(diagram.warnings for diagram in diagrams)
