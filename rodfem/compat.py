"""All differences between dolfinx releases, bridged by capability, not by version number.

Supported: 0.5.2 (Debian 12), 0.9.0 (Debian 13), 0.10.0 (Ubuntu 26.04) and 0.11.0 (Debian sid).  Nothing else in rodfem
asks for a version.
"""

from __future__ import annotations

import inspect
import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI

from forms.importing import without_pkg_resources
from rodfem import code_cache
from rodfem.beside import Job
from rodfem.errors import SetupError

try:
    code_cache.have_home()
except RuntimeError as homeless:
    raise SetupError(code_cache.HOMELESS) from homeless
try:
    with without_pkg_resources():
        import basix
        import dolfinx
        import dolfinx.fem.petsc
        import dolfinx.mesh
        import ufl
        from dolfinx import fem
        from ffcx.codegeneration import jit
    from petsc4py import PETSc
except ModuleNotFoundError as missing:
    raise SetupError(
        f"This Python has no module {missing.name!r}: install Debian's python3-dolfinx and run with a virtual "
        "environment made by '/usr/bin/python3 -m venv --system-site-packages .venv' ('make setup' does both)."
    ) from missing


_COMPILE = jit._compile_objects
"""What FFCx calls for objects that its cache lacks, once it has locked their place in it."""
_SEARCH = jit.get_cached_module
"""How FFCx looks for a module in its cache: it lists that folder, which takes 10 ms where it has thousands of files."""
PATIENCE = 60.0
"""Seconds after which a module that is locked in the cache, and not written to, is taken for one of a killed run."""
_LISTENERS: list[Callable[[], None]] = []
"""Who is told of it."""
ALONE = MPI.COMM_WORLD.size == 1
"""Whether there is one process alone: only then does anything work beside it."""
_JOBS: list[Job] = []
"""What is compiled beside this process."""


def _by_name(module_name: str, object_names: Sequence[str], cache_dir: str | Path, timeout: int) -> Any:
    """Objects of a module of FFCx's cache, and the module: found by its name, or else as FFCx does it.

    ``module_name`` is that of the module, which has the ``object_names``; ``cache_dir`` is the folder, and ``timeout``
    says how many seconds a module is awaited that another process compiles.
    """
    place = Path(cache_dir)
    file = next((f for f in (place / f"{module_name}{end}" for end in EXTENSION_SUFFIXES) if f.is_file()), None)
    if file is None or not code_cache.is_whole(file) or not (place / f"{module_name}.c.cached").is_file():
        try:
            _remove_broken(place / f"{module_name}.c", file)
            return _awaited(module_name, object_names, place, timeout)
        except TimeoutError:
            raise
        except OSError as error:
            raise SetupError(code_cache.refused(error)) from error
    module = _loaded(module_name, file)
    return [getattr(module.lib, name) for name in object_names], module


def _remove_broken(lock: Path, file: Path | None) -> None:
    """Remove a module that is marked as ready, and is cut short or lost: the ``lock``, its code in C, before it."""
    mark = lock.with_suffix(".c.cached")
    if mark.is_file():
        for broken in (mark, lock, file):
            if broken is not None:
                broken.unlink(missing_ok=True)


def _awaited(module_name: str, object_names: Sequence[str], place: Path, timeout: int) -> Any:
    """What FFCx finds, which may be nothing; what another process compiles is awaited while it may be at work.

    Raises :class:`TimeoutError` where nobody has worked at the module for :data:`PATIENCE`.
    """
    lock = place / f"{module_name}.c"
    while True:
        try:
            return _SEARCH(module_name, object_names, place, timeout)
        except TimeoutError:
            with suppress(FileNotFoundError):
                if time.time() - lock.stat().st_mtime > PATIENCE:
                    raise


@cache
def _loaded(name: str, file: Path) -> Any:
    spec = spec_from_file_location(name, file)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


jit.get_cached_module = _by_name


class _Begun(BaseException):
    """A form is compiled elsewhere; no Exception, for which FFCx would unlock its place in the cache."""


REAL: Any = np.float64
"""Numbers of states and forms, whatever those of PETSc."""
_C_COMPILER = {
    name: {"cffi_extra_compile_args": ["-O1", "-g0"]}
    for name in ("jit_options", "jit_params")  # dolfinx 0.5 calls them parameters
    if name in inspect.signature(fem.form).parameters
}
"""How the C code of forms is compiled: at -O1 in three quarters of the time of -O2, to kernels as fast, within 3 %."""
COMPLEX = bool(np.issubdtype(PETSc.ScalarType, np.complexfloating))
"""Whether this PETSc was built for complex numbers: forms and states are real all the same."""
KINDS = CELL, BOUNDARY, INTERIOR = 1, 2, 4
"""Numbers that an entity of an integral has: cell; cell and facet; cell and facet on either side."""


def require_real_petsc() -> None:
    """Raise :class:`SetupError` on a PETSc with complex numbers, where a saddle matrix has no inertia."""
    if COMPLEX:
        raise SetupError(
            "This PETSc was built for complex numbers, where MUMPS counts no inertia: under a load with a potential "
            "rodfem needs the real one; unset PETSC_DIR and SLEPC_DIR, or point both at the real build."
        )


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
    """Mixed space of Lagrange elements on Gauss-Lobatto-Legendre nodes.

    Each part is ``(continuous, degree, components)``; a part with one component is scalar.
    """
    if hasattr(basix, "ufl") and hasattr(basix.ufl, "mixed_element"):
        elements = [
            basix.ufl.element(
                "Lagrange",
                mesh.basix_cell(),
                degree,
                basix.LagrangeVariant.gll_warped,
                discontinuous=not continuous,
                shape=(size,) if size > 1 else None,
                dtype=mesh.geometry.x.dtype,
            )
            for continuous, degree, size in parts
        ]
        element = basix.ufl.mixed_element(elements)
    else:
        cell = mesh.ufl_cell()
        single = [
            ufl.FiniteElement("Lagrange" if continuous else "DG", cell, degree) for continuous, degree, _ in parts
        ]
        element = ufl.MixedElement(
            [ufl.VectorElement(e, dim=p[2]) if p[2] > 1 else e for e, p in zip(single, parts, strict=True)]
        )
    with _quiet():  # the element itself is compiled
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
    x = np.asarray(mesh.geometry.x)[:, 0]
    return x[_vertices(mesh, cells)]


def cell_coordinates(mesh: Any, cells: int) -> np.ndarray:
    """Coordinates of the vertices of each local cell, in reference order: (cells, 2, 3)."""
    return np.asarray(mesh.geometry.x)[_vertices(mesh, cells)]


@contextmanager
def _from_cache() -> Iterator[None]:
    """Raise :class:`SetupError` where the folder of compiled code is locked, or cannot be written."""
    try:
        yield
    except TimeoutError as locked:
        raise SetupError(
            "A compiled form never became ready, most likely because an earlier run was killed while compiling: "
            f"delete the folder {code_cache.folder()} and run again."
        ) from locked
    except OSError as error:
        raise SetupError(code_cache.refused(error)) from error


def compile_forms(forms: Sequence[Any]) -> list[Any]:
    """Compile UFL forms: the first, which takes the longest, and all others together, at once.

    Raises :class:`SetupError` where the cache is locked by a killed run, or cannot be written.
    """
    with _from_cache():
        compiled = compile_ahead(forms)
        _wait()
        with _quiet():
            return [f for g in _groups(forms) for f in _compiled(g)] if None in compiled else compiled


def expression(form: Any, points: np.ndarray, mesh: Any, cells: int) -> Callable[[], np.ndarray]:
    """Compile a UFL vector to be evaluated at reference ``points`` (m, 1) of the first cells: (cells, m * size).

    ``form`` is the vector, on cells of ``mesh``, of which the first ``cells`` are evaluated.  Raises as
    :func:`compile_forms` does.
    """
    with _from_cache(), _quiet():
        compiled = fem.Expression(form, points, dtype=REAL)
    chosen = np.arange(cells, dtype=np.int32)
    takes_mesh = "mesh" in inspect.signature(compiled.eval).parameters
    takes_entities = "entities" in inspect.signature(compiled.eval).parameters

    def evaluate() -> np.ndarray:
        values = compiled.eval(mesh, chosen) if takes_mesh or takes_entities else compiled.eval(chosen)
        return np.asarray(values).reshape(cells, -1)

    return evaluate


def assemble_matrix(matrix: PETSc.Mat, form: Any, rows: np.ndarray, columns: np.ndarray) -> None:
    """Add a real form to a PETSc matrix, without the final exchange between ranks.

    ``rows`` and ``columns`` are the global numbers of the local degrees of freedom, -1 for what is left out; the matrix
    has them as its maps too.  Where PETSc's numbers are complex the form is assembled by dolfinx alone first.  ``form``
    is a compiled bilinear form, and ``matrix`` has a pattern that holds all its entries.
    """
    if not COMPLEX:
        fem.petsc.assemble_matrix(matrix, form)
        return
    shape = (len(rows), len(columns))
    table = local_table(form)
    entries = table[: shape[0], : shape[1]].tocoo()
    row, column = rows[entries.row], columns[entries.col]
    kept = (row >= 0) & (column >= 0)
    used, row = np.unique(row[kept], return_inverse=True)
    summed = sp.csr_matrix((entries.data[kept], (row, column[kept])), shape=(len(used), matrix.getSize()[1]))
    matrix.setValuesIJV(
        summed.indptr.astype(PETSc.IntType),
        summed.indices.astype(PETSc.IntType),
        summed.data.astype(PETSc.ScalarType),
        addv=True,
        rowmap=used.astype(PETSc.IntType),
    )


def local_table(form: Any) -> sp.csr_matrix:
    """A bilinear form between all local degrees of freedom; of this rank's cells only."""
    local = fem.assemble_matrix(form)  # PETSc brings the parts of other ranks' rows there
    size = int(np.asarray(local.indptr)[-1])
    return sp.csr_matrix((local.data[:size], local.indices[:size], local.indptr), shape=(len(local.indptr) - 1,) * 2)


def compile_ahead(forms: Sequence[Any]) -> list[Any]:
    """Compiled forms; None for those that the cache lacks, which are now compiled into it beside this process.

    One of several ranks begins nothing: there dolfinx compiles on the first rank, while the others wait.
    """
    if not ALONE:
        return [None] * len(forms)
    _wait()
    with _quiet():
        return [form for group in _groups(forms) for form in _compiled_or_begun(group)]


def _groups(forms: Sequence[Any]) -> list[Sequence[Any]]:
    """Forms that share a module of C, one half of the compiler's work in each module."""
    return [group for group in (forms[:1], forms[1:]) if group]


def _compiled_or_begun(group: Sequence[Any]) -> list[Any]:
    def begin(*arguments: Any, **options: Any) -> None:
        given = inspect.signature(_COMPILE).bind(*arguments, **options).arguments
        lock = Path(given["cache_dir"]) / f"{given['module_name']}.c"

        def work() -> None:
            try:
                _COMPILE(*arguments, **options)
            except BaseException:
                lock.unlink()  # this process compiles it then, and says what is wrong
                raise

        _say()
        _JOBS.append(Job(work))
        raise _Begun

    try:
        with _instead("_compile_objects", begin):
            return _compiled(group)
    except _Begun:
        return [None] * len(group)


def _compiled(group: Sequence[Any]) -> list[Any]:
    """Forms of dolfinx for UFL forms that share one module of C."""
    compile_all = jit.compile_forms
    made: list[Any] = []

    def compile_one(forms: Any, *arguments: Any, **options: Any) -> Any:
        if not made:
            made.extend(compile_all(list(group), *arguments, **options))
        objects, *rest = made
        return [next(found for form, found in zip(group, objects, strict=True) if form is forms[0])], *rest

    with _instead("compile_forms", compile_one):
        return [fem.form(form, dtype=REAL, **_C_COMPILER) for form in group]


def _wait() -> None:
    """Await all that is compiled beside this process."""
    while _JOBS:
        _JOBS.pop().wait()


@contextmanager
def _instead(name: str, function: Callable[..., Any]) -> Iterator[None]:
    """Have ``function`` in the place of one of FFCx's."""
    usual = getattr(jit, name)
    setattr(jit, name, function)
    try:
        yield
    finally:
        setattr(jit, name, usual)


class Integral(NamedTuple):
    """An integral of a compiled form.

    ``kernel`` is the C function that computes the tensor of one entity, a function pointer of cffi; ``entities``
    (count, ``kind``) are a cell each, with a facet on the boundary, of both sides inside.
    """

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


def pack_constants(form: Any) -> np.ndarray:
    """Values of the constants of a compiled form, one after the other."""
    return np.asarray(dolfinx.cpp.fem.pack_constants(getattr(form, "_cpp_object", form)))


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the compilers' own chatter off the terminal: FFCx's, and that of setuptools, which runs the C compiler."""
    root = logging.getLogger()
    level, disabled = root.level, root.manager.disable
    logging.disable(max(disabled, logging.INFO))
    try:
        yield
    finally:
        logging.disable(disabled)
        root.setLevel(level)


@contextmanager
def slepc_errors() -> Iterator[None]:
    """Have the errors of SLEPc's functions raised as :class:`PETSc.Error`, whatever slepc4py makes of them.

    Its functions set the exception and return a value all the same where petsc4py's check is compiled to another
    convention (3.25.1 on Debian sid).  Python makes a SystemError of that, with the exception as its cause.
    """
    try:
        yield
    except SystemError as trouble:
        if isinstance(trouble.__cause__, PETSc.Error):
            raise trouble.__cause__ from None
        raise


def destroy_garbage(comm: Any) -> None:
    """Destroy the PETSc objects that Python has collected; collective over ``comm``.

    Since PETSc 3.18 their memory is kept until then, as ranks may collect them in another order.
    """
    if hasattr(PETSc, "garbage_cleanup"):
        for communicator in (comm, PETSc.COMM_SELF):
            PETSc.garbage_cleanup(communicator)


@contextmanager
def announce_compilation(say: Callable[[], None]) -> Iterator[list[bool]]:
    """Call ``say`` once if forms are compiled inside the block; yields a list that is empty until then."""
    said: list[bool] = []

    def once() -> None:
        if not said:
            said.append(True)
            say()

    def compile_aloud(*arguments: Any, **options: Any) -> Any:
        _say()
        return _COMPILE(*arguments, **options)

    _LISTENERS.append(once)
    try:
        with _instead("_compile_objects", compile_aloud):
            yield said
    finally:
        _LISTENERS.remove(once)


def _say() -> None:
    """Say that something is compiled."""
    for listener in _LISTENERS:
        listener()
