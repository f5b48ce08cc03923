"""Files for other programs, read again by these programs' own readers."""

import csv
import json
from math import pi
from pathlib import Path

import classics
import h5py
import numpy as np
import pytest

import rodfem
from rodfem import Discretization, Plan, run
from rodfem.output.states import to_csv, to_vtkhdf


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cantilever of bending stiffness 2 rolled up by an end moment, with modes of one state."""
    folder = tmp_path_factory.mktemp("rolled")
    plan = Plan((0.0, pi), at=(2.0,), modes=2, depth=0, error_bars=False)
    run(classics.rolled("moment"), Discretization("pointwise", 4, 5), plan, folder, figures=False, quiet=True)
    return folder


@pytest.mark.long
@pytest.mark.versions
def test_vtk_reads_the_steps(saved: Path, tmp_path: Path) -> None:
    io = pytest.importorskip("vtkmodules.vtkIOHDF")  # without the other modules, whose import takes seconds
    from vtkmodules.util.numpy_support import vtk_to_numpy

    path, modes = to_vtkhdf(saved, tmp_path)
    data = json.loads((saved / "diagram.json").read_text())["branches"][0]["columns"]
    with h5py.File(saved / "states.h5") as file:
        r = file["branches/first branch/r"][()]
    reader = io.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == len(data["load"])
    for step in (0, 3, len(r) - 1):
        reader.SetStep(step)
        reader.Update()
        shape = reader.GetOutputDataObject(0)
        assert vtk_to_numpy(shape.GetPoints().GetData()) == pytest.approx(r[step], abs=1e-15)
        assert shape.GetNumberOfLines() == 1 and shape.GetCell(0).GetNumberOfPoints() == len(r[step])
        k = vtk_to_numpy(shape.GetPointData().GetArray("k"))
        assert k == pytest.approx(np.tile([0.0, data["load"][step] / 2, 0.0], (len(k), 1)), abs=1e-6)
        v = vtk_to_numpy(shape.GetPointData().GetArray("v"))
        assert v == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(v), 1)), abs=1e-6)
        for name in ("load", "energy", "negative"):
            assert shape.GetFieldData().GetArray(name).GetValue(0) == data[name][step]
    reader = io.vtkHDFReader()
    reader.SetFileName(str(modes))
    reader.Update()
    found = reader.GetOutputDataObject(0).GetPointData()
    (place,) = rodfem.modes.modes.rows_with_modes(saved / "modes.h5")
    expected = rodfem.load_modes(saved / "modes.h5", *place)
    for i in (0, 1):
        assert vtk_to_numpy(found.GetArray(f"displacement {i + 1}")) == pytest.approx(expected.displacement[i])


@pytest.mark.versions
def test_tables(saved: Path, tmp_path: Path) -> None:
    """Numbers are those of the diagram, to the last bit."""
    rows, special = to_csv(saved, tmp_path)
    branch = json.loads((saved / "diagram.json").read_text())["branches"][0]
    lines = list(csv.DictReader(rows.open()))
    assert [float(line["load"]) for line in lines] == branch["columns"]["load"]
    assert [float(line["energy"]) for line in lines] == branch["columns"]["energy"]
    assert [line["kind"] for line in csv.DictReader(special.open())] == [s["kind"] for s in branch["special"]]
