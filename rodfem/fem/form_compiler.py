"""Compilation of UFL forms by FFCx: together, beside this process, announced, into a cache that survives a kill."""

from __future__ import annotations

import errno
import fcntl
import inspect
import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import fem
from ffcx.codegeneration import jit
from mpi4py import MPI
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from rodfem import code_cache, compat
from rodfem.code_cache import Job
from rodfem.errors import SceneError, SetupError
from rodfem.linalg import compiler

_COMPILE = jit._compile_objects
"""What FFCx calls for objects that its cache lacks, once it has locked their place in it."""
_SEARCH = jit.get_cached_module
"""How FFCx looks for a module in its cache: it lists that folder, which takes 10 ms where it has thousands of files."""
PATIENCE = 60.0
"""Seconds after which a module that another program than rodfem has locked, and not written to, counts as abandoned."""
TOGETHER = re.compile("Failed (just-in-time|JIT) compilation|JIT compilation failed")
"""How the errors begin that dolfinx raises on all of several ranks, on the first and on the others."""
PAUSE = 0.05
"""Seconds between looks at what another process compiles."""
_CLAIMS: dict[str, int] = {}
"""Descriptors of the locked files that tell other processes which modules this one compiles."""
_LISTENERS: list[Callable[[], None]] = []
"""Who is told of it."""
ALONE = MPI.COMM_WORLD.size == 1
"""Whether there is one process alone: only then does anything work beside it."""
_JOBS: list[Job] = []
"""What is compiled beside this process."""


def _by_name(module_name: str, object_names: Sequence[str], cache_dir: str | Path, timeout: int) -> Any:
    """Objects of a module of FFCx's cache, and the module: found by its name, or else as FFCx does it.

    ``module_name`` is that of the module, which has the ``object_names``; ``cache_dir`` is the folder, and ``timeout``
    says how many seconds a module is awaited that another program compiles.  Two times None where the module is this
    process's to compile.
    """
    place = Path(cache_dir)
    try:
        while True:
            file = next((f for f in (place / f"{module_name}{end}" for end in EXTENSION_SUFFIXES) if f.is_file()), None)
            marked = (place / f"{module_name}.c.cached").is_file()
            if file is not None and marked:
                module = _loaded(module_name, file)
                return [getattr(module.lib, name) for name in object_names], module
            if _claim(place, module_name):
                if marked:
                    _remove(place, module_name)  # it is lost
                found = _awaited(module_name, object_names, place, timeout)
                if found[0] is not None:
                    _release(place, module_name)
                return found
            time.sleep(PAUSE)
    except TimeoutError:
        raise
    except OSError as error:
        raise SetupError(code_cache.refused(error)) from error


def _claim(place: Path, name: str) -> bool:
    """Lock a module for this process to compile; False where another process has it, or just had it.

    The system unlocks the file when a process dies, however: then what it left unfinished is removed.  On file systems
    without locks nothing is known of other processes.
    """
    place.mkdir(parents=True, exist_ok=True)
    path = place / f"{name}.compiling"
    abandoned = path.is_file()
    descriptor = os.open(path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o666)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        current = path.stat().st_ino == os.fstat(descriptor).st_ino
    except (BlockingIOError, FileNotFoundError):
        current = False
    except OSError as unsupported:
        if unsupported.errno not in (errno.ENOTSUP, errno.ENOLCK, errno.ENOSYS):
            os.close(descriptor)
            raise
        abandoned, current = False, True
    if not current:
        os.close(descriptor)
        return False
    _CLAIMS[name] = descriptor
    if abandoned and not (place / f"{name}.c.cached").is_file():
        _remove(place, name)
    return True


def _release(place: Path, name: str) -> None:
    """Unlock a module, compiled or not."""
    if name in _CLAIMS:
        (place / f"{name}.compiling").unlink(missing_ok=True)
        os.close(_CLAIMS.pop(name))


def _remove(place: Path, name: str) -> None:
    """Remove what is left of a module that is not there: its mark, and its code in C, for FFCx a lock."""
    for left in (place / f"{name}.c.cached", place / f"{name}.c"):
        left.unlink(missing_ok=True)


def _awaited(module_name: str, object_names: Sequence[str], place: Path, timeout: int) -> Any:
    """What FFCx finds, which may be nothing; what another program compiles is awaited while it may be at work.

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


def _compile(*arguments: Any, **options: Any) -> Any:
    """Compile as FFCx does, and unlock the module; raises :class:`SetupError` where there is no compiler."""
    given = inspect.signature(_COMPILE).bind(*arguments, **options).arguments
    try:
        compiler.require()
        return _COMPILE(*arguments, **options)
    finally:
        _release(Path(given["cache_dir"]), given["module_name"])


@cache
def _loaded(name: str, file: Path) -> Any:
    spec = spec_from_file_location(name, file)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


jit.get_cached_module = _by_name
jit._compile_objects = _compile


class _Begun(BaseException):
    """A form is compiled elsewhere; no Exception, for which FFCx would unlock its place in the cache."""


@contextmanager
def _from_cache(comm: MPI.Comm) -> Iterator[None]:
    """Raise :class:`SetupError` where the folder of compiled code is locked, or cannot be written.

    Raises :class:`SceneError` for a function that the compiler cannot take.  Of several ranks the first of ``comm``
    compiles; all fail together, and the first alone knows why.
    """
    try:
        yield
    except TimeoutError as locked:
        raise SetupError(
            "A compiled form never became ready, most likely because an earlier run was killed while compiling: "
            f"delete the folder {code_cache.folder()} and run again."
        ) from locked
    except OSError as error:
        raise SetupError(code_cache.refused(error)) from error
    except (AttributeError, RuntimeError) as trouble:
        together = comm.size > 1 and isinstance(trouble, RuntimeError) and TOGETHER.match(str(trouble))
        why = comm.bcast(str(trouble)) if together else str(trouble)
        if together and (missing := comm.bcast(compiler.missing())):
            raise SetupError(missing) from trouble
        if "LiteralFloat" not in why:  # FFCx takes a product of nothing but numbers for one with arguments
            raise
        raise SceneError(
            "The equations cannot be compiled: in a function of the scene terms cancel each other, as in x**2 - x**2; "
            "leave them out."
        ) from trouble


def compile_forms(forms: Sequence[Any], comm: MPI.Comm = MPI.COMM_SELF) -> list[Any]:
    """Compile UFL ``forms`` on meshes of ``comm``: the first, which takes the longest, and all others, at once.

    Raises :class:`SetupError` where the cache is locked by a killed run, or cannot be written.
    """
    with _from_cache(comm):
        compiled = compile_ahead(forms)
        _wait()
        with compat.quiet():
            return [f for g in _groups(forms) for f in _compiled(g)] if None in compiled else compiled


def expression(form: Any, points: np.ndarray, mesh: Any, cells: int) -> Callable[[], np.ndarray]:
    """Compile a UFL vector to be evaluated at reference ``points`` (m, 1) of the first cells: (cells, m * size).

    ``form`` is the vector, on cells of ``mesh``, of which the first ``cells`` are evaluated.  Raises as
    :func:`compile_forms` does.
    """
    # dolfinx packs the constants of what it is given; FFCx numbers those that differentiation leaves
    derived = apply_derivatives(apply_algebra_lowering(form))
    with _from_cache(mesh.comm), compat.quiet():
        compiled = fem.Expression(derived, points, dtype=compat.REAL)
    chosen = np.arange(cells, dtype=np.int32)
    takes_mesh = "mesh" in inspect.signature(compiled.eval).parameters
    takes_entities = "entities" in inspect.signature(compiled.eval).parameters

    def evaluate() -> np.ndarray:
        values = compiled.eval(mesh, chosen) if takes_mesh or takes_entities else compiled.eval(chosen)
        return np.asarray(values).reshape(cells, -1)

    return evaluate


def compile_ahead(forms: Sequence[Any]) -> list[Any]:
    """Compiled forms; None for those that the cache lacks, which are now compiled into it beside this process.

    One of several ranks begins nothing: there dolfinx compiles on the first rank, while the others wait.
    """
    if not ALONE:
        return [None] * len(forms)
    _wait()
    with compat.quiet():
        return [form for group in _groups(forms) for form in _compiled_or_begun(group)]


def _groups(forms: Sequence[Any]) -> list[Sequence[Any]]:
    """Forms that share a module of C, one half of the compiler's work in each module."""
    return [group for group in (forms[:1], forms[1:]) if group]


def _compiled_or_begun(group: Sequence[Any]) -> list[Any]:
    def begin(*arguments: Any, **options: Any) -> None:
        given = inspect.signature(_COMPILE).bind(*arguments, **options).arguments
        name = given["module_name"]
        lock = Path(given["cache_dir"]) / f"{name}.c"

        def work() -> None:
            try:
                _compile(*arguments, **options)
            except BaseException:
                lock.unlink()  # this process compiles it then, and says what is wrong
                raise

        _say()
        _JOBS.append(Job(work))
        os.close(_CLAIMS.pop(name))  # the copy holds the lock, as long as it lives
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
        return _compile(*arguments, **options)

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
