"""A diagram as tables, states that coexist with their copies, and the page from Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from demo_cases import scene

import rodfem
from rodfem import Diagram, Plan
from rodfem.app import console

pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def ruler() -> Diagram:
    return rodfem.trace(scene("ruler"), plan=Plan(depth=1, error_bars=False))


def test_columns_are_those_of_the_points(ruler: Diagram) -> None:
    branch = ruler["branch 1"]
    assert branch["load"].tolist() == [p.load for p in branch.points]
    assert branch["stable"].tolist() == [float("nan") if p.stable is None else p.stable for p in branch.points]
    with pytest.raises(KeyError, match="points have no number 'soft'"):
        branch["soft"]
    assert {point.branch for point in branch.points} == {"branch 1"}


def test_tables_of_other_libraries(ruler: Diagram) -> None:
    pytest.importorskip("xarray")
    frame, data = ruler.to_dataframe(), ruler.to_xarray()
    branch = ruler["branch 1"]
    own = frame[frame.branch == "branch 1"]
    assert len(frame) == sum(len(b.points) for b in ruler) == data.sizes["point"]
    assert np.array_equal(own.load, branch["load"]) and np.array_equal(own.energy, branch["energy"])
    last = data.isel(point=(data.branch == "branch 1").values).isel(point=-1)
    for name in ("s", "r", "directors", "strain", "curvature", "force", "moment"):
        assert np.array_equal(last[name].dropna("node", how="all"), getattr(branch.points[-1], name))
    assert data["r"].dims == ("point", "node", "component") and data["ordinate"].attrs["units"] == ""


def test_states_that_coexist_with_their_copies(ruler: Diagram) -> None:
    """A buckled ruler has its mirror image; the straight one is its own."""
    load = ruler["branch 1"].points[-1].load
    found = {state.point.branch: (state.images, state.freedoms) for state in ruler.states(load)}
    assert found == {ruler[0].name: (1, 0), "branch 1": (2, 0), "branch 2": (2, 0)}


def test_the_page_from_python(ruler: Diagram, tmp_path: object) -> None:
    page = ruler.view()
    assert "ruler" in page.html and page._repr_html_().startswith("<iframe srcdoc=")
    assert len(repr(page)) < 100


def test_netcdf_of_files_is_the_table_of_the_diagram(ruler: Diagram, tmp_path: Path) -> None:
    """Coordinates, units and all; profiles in files are at other points, from which nodes are interpolated."""
    xarray = pytest.importorskip("xarray")
    console.main(["convert", str(ruler.save(tmp_path)), "--to", "netcdf"])
    read, own = xarray.open_dataset(tmp_path / "netcdf" / "diagram.nc"), ruler.to_xarray()
    assert {*read.coords} == {*own.coords} and {*read.data_vars} == {*own.data_vars} and read.sizes == own.sizes
    assert read.attrs == own.attrs and read.branch.values.tolist() == own.branch.values.tolist()
    for name in own.variables.keys() - {"branch"}:
        assert read[name].attrs == own[name].attrs and read[name].dims == own[name].dims
        bound = 2e-4 if name in ("strain", "curvature", "force", "moment") else 1e-14
        np.testing.assert_allclose(read[name].astype(float), own[name].astype(float), rtol=bound, atol=bound)
