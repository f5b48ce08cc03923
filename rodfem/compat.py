"""All differences between dolfinx releases, bridged by capability, not by version number.

Supported: 0.5.2 (Debian 12), 0.9.0 (Debian 13), 0.10.0 (Ubuntu 26.04) and 0.11.0 (Debian sid).  Nothing else in rodfem
asks for a version.
"""

from __future__ import annotations

import hashlib
import inspect
import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from rodfem import code_cache, libraries  # noqa: F401, the libraries before all that computes
from rodfem.errors import SetupError
from rodfem.forms.importing import without_pkg_resources

try:
    with without_pkg_resources():
        import basix
        import dolfinx
        import dolfinx.fem.petsc
        import dolfinx.mesh
        import ufl
        from dolfinx import fem
    from petsc4py import PETSc
except ModuleNotFoundError as missing:
    raise SetupError(
        f"This Python has no module {missing.name!r}: install what computes with 'pip install \"rodfem[pip]\"' (Python "
        "3.12 or newer), or use the Python of 'make setup' (.venv/bin/python), which sees Debian's python3-dolfinx."
    ) from missing

if np.issubdtype(PETSc.ScalarType, np.complexfloating):
    raise SetupError(
        "This PETSc was built for complex numbers, where MUMPS counts no inertia: unset PETSC_DIR and SLEPC_DIR, or "
        "point both at the build for real numbers."
    )

REAL: Any = np.float64  # numbers of states and forms, whatever those of PETSc
_FOR = hashlib.sha1(code_cache.processor().encode()).hexdigest()[:16]
C_COMPILER = {
    name: {"cffi_extra_compile_args": ["-O1", "-march=native", "-fvisibility=hidden", "-g0", f"-DPROCESSOR={_FOR}"]}
    for name in ("jit_options", "jit_params")  # dolfinx 0.5 calls them parameters
    if name in inspect.signature(fem.form).parameters
}
"""How the C code of forms is compiled: at -O1 in three quarters of the time of -O2, to kernels as fast, within 3 %.

With the instructions of this processor they take a fifth less time.  FFCx names a compiled module after these options:
that of another processor, in a cache that both share, is not loaded.
"""
_FFCX = dolfinx.jit.ffcx
_OPTION_FILES = [
    (module, name)
    for module in (dolfinx.jit, _FFCX.options if hasattr(_FFCX, "options") else _FFCX.parameters)
    for name in ("_load_options", "_load_parameters")  # dolfinx 0.5 calls them parameters
    if hasattr(module, name)
]
"""Functions that read options from files, each with its module."""
KINDS = CELL, BOUNDARY, INTERIOR = 1, 2, 4
"""Numbers that an entity of an integral has: cell; cell and facet; cell and facet on either side."""


def interval_mesh(comm: Any, elements: int, a: float, b: float) -> Any:
    """Uniform mesh of ``[a, b]`` with so many ``elements``, shared among the ranks of ``comm``."""
    mesh = dolfinx.mesh.create_interval(comm, elements, [a, b])
    if hasattr(ufl, "VectorElement"):
        # FFCx 0.5 gives the coordinate element this variant while it compiles, in place: a form signed before
        # would differ from one signed after, and every new run would compile again what is in the cache.
        spaced = ufl.FiniteElement("Lagrange", mesh.ufl_cell(), 1, variant="equispaced")
        mesh.ufl_domain()._ufl_coordinate_element = ufl.VectorElement(spaced)
    return mesh


def move_vertices(mesh: Any, old: np.ndarray, new: np.ndarray) -> None:
    """Move the vertices of an interval mesh from the arclengths ``old`` to ``new``, both ascending."""
    x = mesh.geometry.x
    x[:, 0] = new[np.clip(np.searchsorted((old[1:] + old[:-1]) / 2, x[:, 0]), 0, len(new) - 1)]


def mixed_space(mesh: Any, parts: Sequence[tuple[bool, int, int]]) -> Any:
    """Mixed space of Lagrange elements on Gauss-Lobatto-Legendre nodes: parts (continuous, degree, components)."""
    if hasattr(basix, "ufl") and hasattr(basix.ufl, "mixed_element"):
        lagrange, variant = ("Lagrange", mesh.basix_cell()), basix.LagrangeVariant.gll_warped
        more = {"dtype": mesh.geometry.x.dtype}
        elements = [
            basix.ufl.element(*lagrange, k, variant, shape=(n,) if n > 1 else None, discontinuous=not joined, **more)
            for joined, k, n in parts
        ]
        element = basix.ufl.mixed_element(elements)
    else:
        cell = mesh.ufl_cell()
        single = [(ufl.FiniteElement("Lagrange" if joined else "DG", cell, k), n) for joined, k, n in parts]
        element = ufl.MixedElement([ufl.VectorElement(e, dim=n) if n > 1 else e for e, n in single])
    with compilation():  # the element itself is compiled
        return fem.functionspace(mesh, element) if hasattr(fem, "functionspace") else fem.FunctionSpace(mesh, element)


def nodes(degree: int) -> np.ndarray:
    """Reference coordinates in [0, 1] of the nodes of a Lagrange element, in the order of its degrees of freedom."""
    return np.array([0.5]) if degree == 0 else np.array(_lagrange(degree).points)[:, 0]


def lagrange_basis(degree: int, x: np.ndarray) -> np.ndarray:
    """Values of the Lagrange basis on :func:`nodes` at reference points ``x`` of shape (m,): (m, degree + 1)."""
    if degree == 0 or len(x) == 0:
        return np.ones((len(x), degree + 1))
    values = _lagrange(degree).tabulate(0, np.asarray(x, dtype=float).reshape(-1, 1))
    return np.asarray(values)[0].reshape(len(x), degree + 1)


@cache
def basis_on_pieces(degree: int, pieces: int) -> np.ndarray:
    """Values of the same basis at the nodes of equal pieces of an element, (pieces, nodes, nodes)."""
    places = (np.arange(pieces)[:, None] + nodes(degree)) / pieces
    return lagrange_basis(degree, places.ravel()).reshape(pieces, degree + 1, degree + 1)


@cache
def _lagrange(degree: int) -> Any:
    return basix.create_element(
        basix.ElementFamily.P, basix.CellType.interval, degree, basix.LagrangeVariant.gll_warped
    )


def _table(adjacency: Any, cells: int) -> np.ndarray:
    """Connectivity of one entity type as an array of shape (cells, entries per cell)."""
    values = adjacency.array if hasattr(adjacency, "array") else adjacency
    return np.asarray(values).reshape(cells, -1)


def cell_dofs(space: Any, cells: int) -> np.ndarray:
    """Local degrees of freedom of a scalar (sub-)space, numbered in its parent: (cells, per cell)."""
    return _table(space.dofmap.list, cells)


def _vertices(mesh: Any, cells: int) -> np.ndarray:
    """Rows in the coordinates of the mesh of the two vertices of each local cell: (cells, 2)."""
    geometry = mesh.geometry
    tables = getattr(geometry, "dofmaps", None)  # one for each type of cells
    if tables is None:
        return _table(geometry.dofmap, cells)
    return _table(tables(0) if callable(tables) else tables[0], cells)


def cell_vertices(mesh: Any, cells: int) -> np.ndarray:
    """Arclengths of the two vertices of each local cell, in reference order: (cells, 2)."""
    return cell_coordinates(mesh, cells)[:, :, 0]


def cell_coordinates(mesh: Any, cells: int) -> np.ndarray:
    """Coordinates of the vertices of each local cell, in reference order: (cells, 2, 3)."""
    return np.asarray(mesh.geometry.x)[_vertices(mesh, cells)]


def local_table(form: Any) -> sp.csr_matrix:
    """A bilinear form between all local degrees of freedom; of this rank's cells only."""
    local = fem.assemble_matrix(form)  # PETSc brings the parts of other ranks' rows there
    size = int(np.asarray(local.indptr)[-1])
    return sp.csr_matrix((local.data[:size], local.indices[:size], local.indptr), shape=(len(local.indptr) - 1,) * 2)


class Integral(NamedTuple):
    """An integral of a compiled form: its kernel of cffi, and ``entities`` (count, kind), cells with facets."""

    kernel: Any
    kind: int
    entities: np.ndarray


def integrals(form: Any) -> list[Integral]:
    """Integrals of a compiled form, over the cells and facets of this rank."""
    found, compiled, cpp = [], form.ufcx_form, getattr(form, "_cpp_object", form)
    kinds = fem.IntegralType if hasattr(fem, "IntegralType") else dolfinx.cpp.fem.IntegralType
    types = (kinds.cell, kinds.exterior_facet, kinds.interior_facet)  # in the order of ufcx.h
    for place, (of_kind, kind) in enumerate(zip(types, KINDS, strict=True)):
        if hasattr(compiled, "form_integral_offsets"):
            kernels = [compiled.form_integrals[i] for i in range(*compiled.form_integral_offsets[place : place + 2])]
        else:
            kernels = [compiled.integrals(place)[i] for i in range(compiled.num_integrals(place))]
        if not kernels:
            continue
        # Entities are found by the number of the subdomain, in newer releases by the place among the integrals.
        names = cpp.integral_ids(of_kind) if hasattr(cpp, "integral_ids") else range(len(kernels))
        for kernel, name in zip(kernels, names, strict=True):
            entities = np.ascontiguousarray(cpp.domains(of_kind, name), dtype=np.int32).reshape(-1, kind)
            found.append(Integral(kernel.tabulate_tensor_float64, kind, entities))
    return found


def coefficients(form: Any) -> list[str]:
    """Names of the functions that the kernels of a compiled form read, in their order."""
    return [function.name for function in getattr(form, "_cpp_object", form).coefficients]


def pack_constants(form: Any) -> np.ndarray:
    """Values of the constants of a compiled form, one after the other."""
    return np.asarray(dolfinx.cpp.fem.pack_constants(getattr(form, "_cpp_object", form)))


@contextmanager
def compilation() -> Iterator[None]:
    """Compile with rodfem's options alone, and without the chatter of FFCx and of setuptools."""
    root, readers = logging.getLogger(), {place: getattr(*place) for place in _OPTION_FILES}
    level, disabled = root.level, root.manager.disable
    logging.disable(max(disabled, logging.INFO))
    for place in readers:
        setattr(*place, lambda: ({}, {}))
    try:
        yield
    finally:
        for place, reader in readers.items():
            setattr(*place, reader)
        logging.disable(disabled)
        root.setLevel(level)


@contextmanager
def slepc_errors() -> Iterator[None]:
    """Have the errors of SLEPc's functions raised as :class:`PETSc.Error`.

    Where petsc4py's check is compiled to another convention (3.25.1 on Debian sid) slepc4py sets the exception and
    returns a value all the same: Python makes a SystemError of that, with the exception as its cause.
    """
    try:
        yield
    except SystemError as trouble:
        if isinstance(trouble.__cause__, PETSc.Error):
            raise trouble.__cause__ from None
        raise


def destroy_garbage(comm: Any) -> None:
    """Destroy the PETSc objects that Python has collected, as PETSc does not since 3.18; collective over ``comm``."""
    if hasattr(PETSc, "garbage_cleanup"):
        for communicator in (comm, PETSc.COMM_SELF):
            PETSc.garbage_cleanup(communicator)
