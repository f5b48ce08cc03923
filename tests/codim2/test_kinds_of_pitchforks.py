"""Where a pitchfork changes between super- and subcritical, along its locus: a column that may be compressed.

Its energy is ``EI t'^2/2 + P cos t - (P cos t)^2/(2 EA)``: the fourth power of t has the factor ``1 - 4 P/EA``, the
second one ``1 - P/EA``: a cantilever buckles at ``P (1 - P/EA) = pi^2/4``, and in neither way where ``EA = 4 P``.
"""

from math import pi

import numpy as np
import pytest
from classics import SUPPORTS, column

from rodfem import Discretization, Plan, trace


@pytest.mark.parametrize("planar", ["e2", None])
def test_a_column_that_may_be_compressed(planar: str | None) -> None:
    scene = column(
        "column", SUPPORTS["clamped-free"], (0.0, 4.0), rod="unshearable", constants={"EA": 20.0}, planar=planar,
        energy=lambda v, k, c: 0.5 * (c.EA * (v[2] - 1) ** 2 + 2.0 * k[0] ** 2 + k[1] ** 2 + k[2] ** 2),
    )  # fmt: skip
    diagram = trace(scene, Discretization("auto", 6, 6), Plan(depth=0, error_bars=False))
    locus = diagram.locus(diagram.special("branch point")[0], "EA", (11.0, 20.0))
    (mark,) = locus.marks
    assert mark.kind == "pitchfork changes its kind"
    exact = np.array([pi**2 / 3, 4 * pi**2 / 3])
    found, bars = locus.values[mark.row], locus.error[mark.row]
    assert (abs(found - exact) < np.maximum(bars, 1e-8)).all() and (bars < 1e-5).all()
    P, EA = locus.values.T
    np.testing.assert_allclose(P * (1 - P / EA), pi**2 / 4, rtol=1e-8)
