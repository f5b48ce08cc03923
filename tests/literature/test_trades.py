"""The programs of docs/trades, docs/how-to.md and docs/design.md assert the numbers of others that they print."""

import os
import re
from importlib import import_module
from pathlib import Path

import pytest

from rodfem import Diagram

DOCS = Path(__file__).parents[2] / "docs"
FILES = os.environ.get("RODFEM_ROBOTS", "")
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


@pytest.mark.long
@pytest.mark.skipif(not FILES, reason="RODFEM_ROBOTS names no clone of StructuresComp/Helix_Bifurcation_Types")
def test_150_experiments(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against the authors' files, where these are at hand."""
    monkeypatch.syspath_prepend(DOCS)
    two_grippers = import_module("two_grippers")
    found = two_grippers.compared(two_grippers.program(), two_grippers.measured(Path(FILES)))
    assert (found["right"], found["experiments"]) == (146, 150)
    page = (DOCS / "trades" / "two-grippers.md").read_text()
    for what in ("rms of the mean curvature", "rms of each", "mean"):
        assert f"{found[what]:.1f} %" in page
