"""The picture of docs/trades/horizontal-tube.md: the rod from above, and the force of the wall along it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import h5py
import numpy as np
from matplotlib.figure import Figure

import rodfem
from rodfem import Discretization, Plan

PAGE = Path(__file__).parent / "trades" / "horizontal-tube.md"
LOADS = (65.0, 75.0, 87.0, 99.14)


def main() -> None:
    """Trace the rod of the page, and draw it."""
    names: dict[str, Any] = {}
    exec(re.findall(r"```python\n(.*?)```", PAGE.read_text(), flags=re.DOTALL)[0], names)
    tube = replace(names["tube"], span=(60.0, 99.2))
    diagram = rodfem.trace(tube, Discretization(elements=16), Plan(depth=1, at=LOADS))
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    above, below = figure.subplots(2, sharex=True)
    with TemporaryDirectory() as folder:
        diagram.save(folder)
        with h5py.File(Path(folder) / "states.h5") as file:
            rows = file["branches"][diagram[1].name]
            for load in LOADS:
                i = int(np.argmin(abs(rows["load"][:] - load)))
                s, sign = rows["s"][i], np.sign(rows["r"][i][len(rows["s"][i]) // 4, 1])
                above.plot(s, sign * rows["r"][i][:, 1] / names["radius"], label=f"F = {load:g}")
                below.plot(s, rows["p1"][i][:, 0] / names["weight"])
    above.set_ylabel("across / clearance")
    above.legend(ncols=len(LOADS), loc="upper center", frameon=False, bbox_to_anchor=(0.5, 1.25))
    below.axhline(0.0, color="0.6", linewidth=0.8)
    below.set_ylabel("wall force / weight")
    below.set_xlabel("s")
    figure.savefig(PAGE.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
