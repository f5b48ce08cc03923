"""What a locus says of itself, and what it leaves as it was."""

from dataclasses import replace
from math import pi

import classics
import numpy as np
import pytest

from rodfem import Diagram, Discretization, InputError, Plan, clamped, free, trace
from rodfem.codim2.locus import COARSE
from rodfem.forms import loads
from rodfem.output.plot_locus import in_words, stable_region
from rodfem.report.branches import _readings

MESH = Discretization("auto", 4, 6)


def column(B1: float, planar: str | None = None) -> Diagram:
    """A column of bending stiffnesses ``B1`` and 1 under a thrust at its free end."""
    constants = {"B1": B1, "B2": 1.0}
    scene = classics.column("column", classics.SUPPORTS["clamped-free"], (0.0, 3.0), constants=constants, planar=planar)
    return trace(scene, MESH, Plan(depth=0))


@pytest.mark.long
def test_a_rod_that_is_kept_in_its_plane_is_stable_in_that() -> None:
    """Out of its plane it buckles at half the load: the region beside its locus is not that of stability in space."""
    diagram = column(0.5, "e2")
    found = diagram.locus(diagram.special("branch point")[0], "B2", (0.4, 1.2))
    data = found.data()
    assert stable_region(data, [data]) and in_words(data).startswith("stable in its plane")
    assert data["planar"] and "index in its plane" in found.text()
    assert "in its plane" not in in_words(data | {"planar": False})


@pytest.mark.long
def test_special_points_that_are_close_have_loci_of_their_own() -> None:
    """Of two planes whose stiffnesses differ by a millionth: one load is proportional to B2, the other is not."""
    diagram = column(1 + 1e-6)
    first, second = diagram.special("branch point")
    of_first, of_second = (diagram.locus(special, "B2", (0.5, 1.2)) for special in (first, second))
    units = diagram.scene.units
    assert of_first.passes(first, units) and not of_first.passes(second, units)
    assert of_second.values[:, 0] == pytest.approx((1 + 1e-6) * pi**2 / 4, abs=1e-9)
    assert of_first.values[:, 0] == pytest.approx(pi**2 / 4 * of_first.values[:, 1], abs=1e-9)


@pytest.mark.long
def test_a_locus_leaves_the_symmetries_of_its_diagram() -> None:
    """A ring that bends unlike in its planes does not turn about its tangent freely; one that bends alike does."""
    diagram = trace(classics.ring(), Discretization("auto", 8, 6), Plan(depth=0, error_bars=False))
    special, end = diagram.special("branch point")[0], diagram[0].points[-1]
    before = diagram.assess(end)
    diagram.locus(special, "B2", (0.5, 2.0))
    after = diagram.assess(end)
    assert (after.negative, after.zero) == (before.negative, before.zero) and not diagram.warnings
    assert len(diagram.locus(special, "C", (0.5, 2.0)).values) > 5


@pytest.mark.long
def test_a_special_point_of_another_diagram_is_refused() -> None:
    diagram = column(0.5)
    with pytest.raises(InputError, match=r"P = 1\.2337006 is not one of this diagram"):
        column(1.5).locus(diagram.special("branch point")[0], "B2", (0.5, 1.2))


@pytest.mark.long
def test_rows_have_their_bars_on_the_page() -> None:
    """Without one a row has none; ``at least`` where the mesh does not resolve its state."""
    diagram = column(0.5)
    curve = diagram.locus(diagram.special("branch point")[0], "B2", (0.5, 1.2))
    data = replace(curve, unresolved=[0]).data()
    shown = _readings(data, zip(data["columns"]["B2"], data["columns"]["P"], strict=True))
    assert [bool(pair) for pair in shown] == np.isfinite(curve.error[:, 0]).tolist()
    assert "at least" in shown[0][1] and "at least" not in shown[-1][1] and shown[-1][1].startswith("1.23370055")


@pytest.mark.long
def test_rows_that_the_mesh_does_not_resolve_are_said() -> None:
    """A column on a foundation: the stiffer that is, the shorter the waves by which its free end buckles."""
    rod = classics.column(
        "founded", (clamped(), free(classics.push)), (0.0, 10.0), planar="e2", constants={"P": 0.0, "w": 0.0},
        potential=lambda x, c: loads.spring(x.r, (c.w, 0.0, 0.0)),
    )  # fmt: skip
    diagram = trace(rod, Discretization("auto", 2, 4), Plan(depth=0))
    found = diagram.locus(diagram.special("branch point")[0], "w", (0.0, 1e6), (0.0, 1e4))
    assert found.start == 0 and 0 not in found.unresolved and len(found.values) - 1 in found.unresolved
    assert "at least" in found.text() and COARSE in found.text()
