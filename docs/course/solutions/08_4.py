"""What the page shows: branch 2 turns back in a fold, and loses one of its three negative eigenvalues there."""

import runpy
from pathlib import Path

import rodfem

demo = runpy.run_path(str(Path(rodfem.__file__).parents[1] / "demos" / "hemitropic.py"))
(fold,) = rodfem.trace(demo["hemitropic_rod"](), depth=1).special("fold", "branch 2")
answer = fold.point.load
assert (fold.negative_before, fold.negative_after) == (3, 2)
