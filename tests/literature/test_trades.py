"""The programs of docs/trades, docs/how-to.md and docs/design.md assert the numbers of others that they print."""

import re
from pathlib import Path

import pytest

from rodfem import Diagram

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [DOCS / "how-to.md", DOCS / "design.md", *sorted((DOCS / "trades").glob("[a-z]*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page(page: Path) -> None:
    blocks, names = re.findall(r"```python\n(.*?)```", page.read_text(), flags=re.DOTALL), dict[str, object]()
    assert blocks
    assert all("assert " in block or block is blocks[0] for block in blocks)
    for block in blocks:
        assert len(block.splitlines()) < 60
        exec(block, names)
    diagram = names.get("diagram")
    assert diagram is None or (isinstance(diagram, Diagram) and not diagram.warnings)
