"""The programs of docs/trades assert the numbers of others that they print."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rodfem import Diagram

PAGES = sorted((Path(__file__).parents[2] / "docs" / "trades").glob("[a-z]*.md"))

pytestmark = pytest.mark.alone


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_trade(page: Path) -> None:
    blocks, names = re.findall(r"```python\n(.*?)```", page.read_text(), flags=re.DOTALL), dict[str, object]()
    assert blocks
    for block in blocks:
        assert "assert " in block and len(block.splitlines()) < 60
        exec(block, names)
    diagram = names.get("diagram")
    assert diagram is None or (isinstance(diagram, Diagram) and not diagram.warnings)
