"""Compilation of UFL forms by FFCx: together, in the background, announced, into a cache that survives a kill.

A module is compiled in a folder of its own, and moved to the cache when it is whole: nobody awaits a process that died,
and two processes that compile the same module at once make the same file.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from dolfinx import fem
from ffcx.codegeneration import jit
from mpi4py import MPI

from rodfem import code_cache, compat
from rodfem.code_cache import Job
from rodfem.errors import SceneError, SetupError
from rodfem.expressions import differentiated
from rodfem.linalg.compiled import missing_compiler, require_compiler

_COMPILE = jit._compile_objects
"""What FFCx calls for objects that its cache lacks."""
_SIGNATURE = inspect.signature(_COMPILE)
TOGETHER = re.compile("Failed (just-in-time|JIT) compilation|JIT compilation failed")
"""How the errors begin that dolfinx raises on all of several ranks, on the first and on the others."""
_LISTENERS: list[Callable[[], None]] = []
"""Who is told that something is compiled."""
ALONE = MPI.COMM_WORLD.size == 1
"""Whether there is one process alone: only then does anything work in the background."""
_JOBS: list[Job] = []
"""What is compiled in the background."""


def _cached(module_name: str, object_names: Sequence[str], cache_dir: str | Path, timeout: int) -> Any:
    """Objects of a module of FFCx's cache, and the module; without listing its folder, which takes 10 ms."""
    files = (Path(cache_dir) / f"{module_name}{end}" for end in EXTENSION_SUFFIXES)
    file = next((f for f in files if f.is_file()), None)
    whole = file is not None and (Path(cache_dir) / f"{module_name}.c.cached").is_file()
    module = code_cache.load(module_name, file) if file and whole else None
    if module is None:
        try:
            Path(cache_dir).mkdir(parents=True, exist_ok=True)
            (Path(cache_dir) / f"{module_name}.c").touch()  # FFCx renames it if it fails
        except OSError as error:
            raise SetupError(code_cache.refused(error)) from error
        return None, None
    return [getattr(module.lib, name) for name in object_names], module


def _compile(*arguments: Any, **options: Any) -> Any:
    """Compile as FFCx does, in a folder of its own; raises :class:`SetupError` if there is no compiler."""
    require_compiler()
    given = _SIGNATURE.bind(*arguments, **options)
    with TemporaryDirectory(dir=(folder := Path(given.arguments["cache_dir"]))) as room:
        flags = [*(given.arguments["cffi_extra_compile_args"] or ()), "-w"]  # nobody mends code that FFCx writes
        given.arguments.update(cache_dir=Path(room), cffi_extra_compile_args=flags)
        made = _COMPILE(*given.args, **given.kwargs)
        files = (file for file in Path(room).iterdir() if file.is_file())
        for file in sorted(files, key=lambda file: file.suffix == ".cached"):  # last, as it says that all are there
            file.replace(folder / file.name)
    return made


def _compile_aloud(*arguments: Any, **options: Any) -> Any:
    _say()
    return _compile(*arguments, **options)


def _say() -> None:
    for listener in _LISTENERS:
        listener()


jit.get_cached_module = _cached
jit._compile_objects = _compile_aloud


class _Begun(BaseException):
    """A form is compiled elsewhere; no Exception, which FFCx would take for a failure."""


@contextmanager
def _from_cache(comm: MPI.Comm) -> Iterator[None]:
    """Raise :class:`SetupError` if the cache cannot be written, :class:`SceneError` for what cannot be compiled."""
    try:
        yield
    except OSError as error:
        raise SetupError(code_cache.refused(error)) from error
    except ImportError as error:
        raise SetupError(code_cache.UNLOADABLE.format(code_cache.folder())) from error
    except (AttributeError, RuntimeError) as trouble:
        together = comm.size > 1 and isinstance(trouble, RuntimeError) and TOGETHER.match(str(trouble))
        why = comm.bcast(str(trouble)) if together else str(trouble)
        if together and (missing := comm.bcast(missing_compiler())):
            raise SetupError(missing) from trouble
        if "LiteralFloat" not in why:  # FFCx takes a product of nothing but numbers for one with arguments
            raise
        raise SceneError(
            "The equations cannot be compiled: in a function of the scene terms cancel each other, as in x**2 - x**2; "
            "leave them out."
        ) from trouble


def compile_forms(forms: Sequence[Any], comm: MPI.Comm = MPI.COMM_SELF) -> list[Any]:
    """Compile UFL ``forms`` on meshes of ``comm``: the first, which takes the longest, and all others, at once."""
    with _from_cache(comm):
        compiled = compile_ahead(forms)
        _wait()
        with compat.compilation():
            return [f for g in _groups(forms) for f in _compiled(g)] if None in compiled else compiled


def expression(form: Any, points: np.ndarray, mesh: Any, cells: int) -> Callable[[], np.ndarray]:
    """Compile a UFL vector to be evaluated at reference ``points`` (m, 1) of the first cells: (cells, m * size)."""
    # dolfinx packs the constants of what it is given; FFCx numbers those that differentiation leaves
    derived = differentiated(form)
    with _from_cache(mesh.comm), compat.compilation():
        compiled = fem.Expression(derived, points, dtype=compat.REAL)
    chosen = np.arange(cells, dtype=np.int32)
    takes_mesh = not {"mesh", "entities"}.isdisjoint(inspect.signature(compiled.eval).parameters)

    def evaluate() -> np.ndarray:
        return np.asarray(compiled.eval(mesh, chosen) if takes_mesh else compiled.eval(chosen)).reshape(cells, -1)

    return evaluate


def compile_ahead(forms: Sequence[Any]) -> list[Any]:
    """Compiled forms; None for those that the cache lacks: one process alone now compiles them in the background."""
    if not ALONE:
        return [None] * len(forms)
    _wait()
    with compat.compilation():
        return [form for group in _groups(forms) for form in _compiled_or_begun(group)]


def _groups(forms: Sequence[Any]) -> list[Sequence[Any]]:
    """Forms that share a module of C, one half of the compiler's work in each module."""
    return [group for group in (forms[:1], forms[1:]) if group]


def _compiled_or_begun(group: Sequence[Any]) -> list[Any]:
    def begin(*arguments: Any, **options: Any) -> None:
        _say()
        _JOBS.append(Job(lambda: _compile(*arguments, **options)))  # where that fails, this process says what is wrong
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
        return [fem.form(form, dtype=compat.REAL, **compat.C_COMPILER) for form in group]


def _wait() -> None:
    while _JOBS:
        _JOBS.pop().wait()


@contextmanager
def _instead(name: str, function: Callable[..., Any]) -> Iterator[None]:
    usual = getattr(jit, name)
    setattr(jit, name, function)
    try:
        yield
    finally:
        setattr(jit, name, usual)


@contextmanager
def announce_compilation(say: Callable[[], None]) -> Iterator[list[bool]]:
    """Call ``say`` once if forms are compiled inside the block; yields a list that is empty until then."""
    said: list[bool] = []

    def once() -> None:
        if not said:
            said.append(True)
            say()

    _LISTENERS.append(once)
    try:
        yield said
    finally:
        _LISTENERS.remove(once)
