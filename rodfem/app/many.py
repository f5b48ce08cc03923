"""Many rods: the same work on a list of scenes, shared among the ranks, each rod on one of them.

Results are files, one for each rod, written whole as they finish.  A rod whose file is whole and has its name, load,
range and constants is finished and skipped, on any number of ranks.  Functions of a scene, and the work, are not
compared: if one of them has changed, choose another folder.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from mpi4py import MPI

from rodfem.app.interrupts import held
from rodfem.diagram.solver import RANKS, SCENE
from rodfem.errors import ConvergenceError, InputError
from rodfem.file_format import RESULT
from rodfem.output.files import save_json
from rodfem.problem.arguments import checked, each, function, path
from rodfem.problem.scene import Scene
from rodfem.ranks import as_failure, end_together, on_first
from rodfem.whole_files import locked

Work = Callable[[Scene], dict[str, Any]]


def key_of(scene: Scene) -> dict[str, Any]:
    """Properties of a scene in which a saved result must agree to be used again."""
    constants = {name: p.value for name, p in scene.parameters.items()}
    return {"scene": scene.name, "load": scene.load, "span": list(scene.span), "constants": constants}


@checked(
    scenes=each(SCENE), work=function("work"), folder=path("results/map"), comm=RANKS, progress=function("print", 2)
)
def many(
    scenes: Sequence[Scene],
    work: Work,
    folder: Path | str,
    comm: MPI.Comm = MPI.COMM_WORLD,
    progress: Callable[[int, int], None] = lambda done, all_of_them: None,
) -> list[dict[str, Any]]:
    """Return ``work(scene)`` for all scenes, in order, on every rank; rods are dealt out to the ranks in turn.

    Scenes that :meth:`~rodfem.Scene.varying` has made from one another share their equations: they are set up faster.
    ``work`` gets no communicator but must use ``MPI.COMM_SELF``, and returns what JSON can hold.  Where it raises
    :class:`InputError` or :class:`ConvergenceError`, or a numerical library or memory gives up, the result is
    ``{"error": sentence}``, and the others go on.  ``progress(done, all)`` is called on rank 0 after each of its rods.
    ``scenes`` are shared among the ranks of ``comm``.  A rod is skipped if its file in ``folder`` is whole and has its
    name, load, range and constants: choose another folder if a function of a scene, or ``work``, has changed.  Raises
    :class:`InputError` where ``folder`` cannot be written, is in use by another process, or has a result in another
    format, and where ``work`` returns anything else.
    """
    return shared(
        [key_of(scene) for scene in scenes], [partial(work, scene) for scene in scenes], folder, comm, progress
    )


def shared(
    keys: Sequence[dict[str, Any]],
    works: Sequence[Callable[[], dict[str, Any]]],
    folder: Path | str,
    comm: MPI.Comm,
    progress: Callable[[int, int], None],
) -> list[dict[str, Any]]:
    """Results of ``works``, as :func:`many` has them; a saved one is used again if it has the same key."""
    folder = Path(folder)
    end_together()
    with locked(folder, comm):
        files = [folder / f"rod-{i:05d}.json" for i in range(len(keys))]
        on_first(comm, lambda: _check(files))
        trouble: InputError | None = None
        try:
            for done, i in enumerate(range(comm.rank, len(keys), comm.size), start=1):
                if _saved(files[i], keys[i]) is None:
                    result = _result(works[i])
                    with held():
                        save_json({"format": RESULT.mark(), "key": keys[i], "result": result}, files[i])
                if comm.rank == 0:
                    progress(min(done * comm.size, len(keys)), len(keys))
        except InputError as error:  # a result or a file cannot be written: the other ranks go on with theirs
            trouble = error
        for other in filter(None, comm.allgather(trouble)):
            raise other
        pairs = zip(files, keys, strict=True) if comm.rank == 0 else ()
        return comm.bcast([_saved(file, key) or {} for file, key in pairs])


def _check(files: Sequence[Path]) -> None:
    """Raise :class:`InputError` where a file has a format that is not to be written over."""
    for file in files:
        if data := _contents(file):
            RESULT.check(data, file)


def _result(work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What the work returns, or the sentence of its error; raises :class:`InputError` for what no file can hold."""
    try:
        with as_failure(MPI.COMM_SELF):
            result = work()
    except (InputError, ConvergenceError) as trouble:
        return {"error": str(trouble)}
    try:
        json.dumps(result, allow_nan=False)
    except (TypeError, ValueError) as trouble:
        what = f"The work returns what no file can hold ({trouble})"
        raise InputError(f"{what}: return numbers, texts and lists, None for nan.") from trouble
    if not isinstance(result, dict):
        raise InputError(f"The work returns {result!r}: return a dictionary.")
    return result


def _saved(file: Path, key: dict[str, Any]) -> dict[str, Any] | None:
    """Result in a file, None where there is none for this rod."""
    data = _contents(file)
    return data.get("result") if key.items() <= data.get("key", {}).items() else None


def _contents(file: Path) -> dict[str, Any]:
    """Entries of a file; none where it is missing or cut off."""
    try:
        data = json.loads(file.read_text()) if file.is_file() else {}
    except (OSError, ValueError):
        return {}
    return data if isinstance(data, dict) else {}
