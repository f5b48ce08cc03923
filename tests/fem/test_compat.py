"""What the bridge to dolfinx promises, whatever its release."""

import inspect
from importlib import reload
from math import pi
from pathlib import Path
from typing import Any

import classics
import numpy as np
import pytest
import ufl
from dolfinx import fem
from hemitropic_cases import follower, scene
from mpi4py import MPI
from numpy.polynomial import legendre
from petsc4py import PETSc

from rodfem import Discretization, Plan, Scene, SetupError, Solver, clamped, compat, free, trace
from rodfem.fem import form_compiler
from rodfem.fem.known import readable
from rodfem.fem.system import System

pytestmark = pytest.mark.versions

COMM = MPI.COMM_WORLD
KEYWORD = "jit_options" if "jit_options" in inspect.signature(fem.form).parameters else "jit_params"
DEGREES = pytest.mark.parametrize("degree", [1, 2, 3, 6, 8])


def lobatto(degree: int) -> np.ndarray:
    """Gauss-Lobatto-Legendre points in [0, 1]."""
    inner = np.real(legendre.legroots(legendre.legder(np.eye(degree + 1)[-1]))) if degree > 1 else []
    return (np.array([-1.0, *np.sort(inner), 1.0]) + 1) / 2


@DEGREES
def test_nodes_are_those_of_lobatto(degree: int) -> None:
    np.testing.assert_allclose(np.sort(compat.nodes(degree)), lobatto(degree), rtol=0, atol=1e-14)


@pytest.mark.ranks
@pytest.mark.short
def test_a_second_system_compiles_nothing() -> None:
    """Otherwise every run would compile again what is in the cache, and say so."""
    follower("reduced", 8, 6)
    said: list[str] = []
    with form_compiler.announce_compilation(lambda: said.append("compiling")):
        System(scene(), Discretization("reduced", 9, 6))
    assert COMM.allreduce(said, op=MPI.SUM) == []


@pytest.mark.long
def test_forms_are_compiled_beside_this_process(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All that the cache lacks, in two modules; begun ahead, they are found there; and what fails says why."""
    monkeypatch.setattr(compat, "C_COMPILER", {KEYWORD: {"cache_dir": str(folder)}})
    mesh = compat.interval_mesh(COMM, 4, 0.0, 1.0)
    x = ufl.SpatialCoordinate(mesh)[0]
    forms = [x**n * ufl.dx for n in (1, 2, 3)]
    said: list[str] = []
    with form_compiler.announce_compilation(lambda: said.append("compiling")) as compiled:
        assert form_compiler.compile_ahead(forms) == [None, None, None]
        assert said == ["compiling"]
        assert compiled
        found = [fem.assemble_scalar(form) for form in form_compiler.compile_forms(forms)]
    np.testing.assert_allclose(found, [1 / 2, 1 / 3, 1 / 4], rtol=1e-14)
    assert len(list(folder.glob("libffcx_forms_*.c"))) == 2
    assert None not in form_compiler.compile_ahead(forms)

    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("no compiler")

    monkeypatch.setattr("cffi.FFI.compile", broken)
    with pytest.raises(RuntimeError, match="no compiler"):
        form_compiler.compile_forms([x**4 * ufl.dx])


def test_options_in_the_current_folder_change_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files that FFCx and dolfinx read would change what is compiled, and one that is no JSON would end the run."""
    monkeypatch.chdir(folder)
    for module, reader in compat._OPTION_FILES:
        getattr(module, reader).cache_clear()
    (folder / "ffcx_parameters.json").write_text('{"epsilon": 0.05, "table_rtol": 0.05}')
    (folder / "ffcx_options.json").write_text('{"epsilon": 0.05, "table_rtol": 0.05}')
    for name in ("parameters", "options"):
        (folder / f"dolfinx_jit_{name}.json").write_text("no JSON")
    said: list[str] = []
    with form_compiler.announce_compilation(lambda: said.append("compiling")):
        System(scene(), Discretization("reduced", 9, 6))
    for module, reader in compat._OPTION_FILES:
        getattr(module, reader).cache_clear()
    assert (said, len(compat._OPTION_FILES)) == ([], 2)


def test_complex_petsc_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PETSc, "ScalarType", np.complex128)
    with pytest.raises(SetupError, match="complex"):
        reload(compat)


# --- numbers in the functions of a scene are values of its compiled forms, not part of their text


def column(stiffness: float, weight: float) -> Scene:
    """Euler's column of that bending stiffness, whose dead load is ``weight`` times the parameter."""
    return classics.column(
        "column", (clamped(), free(lambda c: (0.0, 0.0, -weight * c.P))), (0.0, 1.2 * stiffness / weight * pi**2 / 4),
        energy=lambda v, k, c: 0.5 * stiffness * (k[0] ** 2 + 2.6 * k[1] ** 2 + k[2] ** 2),
    )  # fmt: skip


@pytest.mark.long
def test_another_number_compiles_nothing() -> None:
    """And each column buckles at Euler's load of its own numbers."""
    said: list[str] = []
    for stiffness, weight in ((1.234, 0.7), (2.345, 1.7)):
        with form_compiler.announce_compilation(lambda: said.append("compiling")):
            diagram = trace(column(stiffness, weight), Discretization("reduced", 4, 4), Plan(depth=0, error_bars=False))
        (buckling,) = [s for s in diagram["straight"].special if s.kind == "branch point"]
        assert buckling.point.load == pytest.approx(pi**2 / 4 * stiffness / weight, rel=1e-9)
        if stiffness == 1.234:
            said.clear()
    assert COMM.allreduce(said, op=MPI.SUM) == []


@pytest.mark.long
def test_values_are_those_of_the_numbers() -> None:
    """Also in conditions and in the base of a power; exponents, integers and the numbers of formulas stay."""
    mesh = compat.interval_mesh(MPI.COMM_SELF, 8, 0.0, 1.0)
    x = ufl.SpatialCoordinate(mesh)[0]
    dx = ufl.dx(domain=mesh, metadata={"quadrature_degree": 8})
    form = (0.5 * (x + 1.7) ** 2.5 + ufl.conditional(ufl.lt(x, 0.375), 3.3 * x, 7 * x) + ufl.bessel_J(1, 2.9 * x)) * dx
    mapped = readable(form, mesh)
    assert sorted(float(c.value) for c in mapped.constants()) == [0.375, 1.7, 2.9, 3.3]
    values = [fem.assemble_scalar(f) for f in form_compiler.compile_forms([form, mapped])]
    assert values[1] == pytest.approx(values[0], rel=1e-14)
    for nothing in (0, 0.5 * x * dx, 7 * x**1.5 * dx):
        assert not getattr(readable(nothing, mesh), "constants", list)()


def by_number(v: Any, k: Any, c: Any) -> Any:
    return (k[0] ** 2 + 1.3 * (k[1] - 0.3) ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def by_parameter(v: Any, k: Any, c: Any) -> Any:
    return (k[0] ** 2 + 1.3 * (k[1] - c.n) ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def linear(v: Any, k: Any, c: Any) -> Any:
    return 5.1 * k[2] + (k[0] ** 2 + 1.3 * k[1] ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def rod(energy: Any) -> Scene:
    ends = clamped(), free(lambda c: (c.P, 0.0, 0.0))
    return classics.column("rod", ends, (0.0, 12.0), energy=energy, constants={"n": 0.3})


@pytest.mark.long
@pytest.mark.parametrize("energy", [by_number, by_parameter, linear])
def test_a_number_that_vanishes_shifts_no_other(energy: Any) -> None:
    """diag(1, -0.3, 1.5) was computed for diag(1, 1.3, 1.5)."""
    solver = Solver(rod(energy), Discretization(elements=2, degree=3)).equilibria
    convexity = solver.convexity
    matrices = convexity._matrices(solver.start(0.0))  # the straight rod
    np.testing.assert_allclose(matrices, np.broadcast_to(np.diag([1.0, 1.3, 1.5]), matrices.shape), atol=1e-12)
