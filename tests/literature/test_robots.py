"""Numbers of docs/trades/two-grippers.md on experiments, against the authors' files where these are at hand."""

import os
from importlib import import_module
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
FILES = os.environ.get("RODFEM_ROBOTS", "")


@pytest.mark.long
@pytest.mark.skipif(not FILES, reason="RODFEM_ROBOTS names no clone of StructuresComp/Helix_Bifurcation_Types")
def test_150_experiments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    two_grippers = import_module("two_grippers")
    found = two_grippers.compared(two_grippers.program(), two_grippers.measured(Path(FILES)))
    assert (found["right"], found["experiments"]) == (146, 150)
    page = (DOCS / "trades" / "two-grippers.md").read_text()
    for what in ("rms of the mean curvature", "rms of each", "mean"):
        assert f"{found[what]:.1f} %" in page
