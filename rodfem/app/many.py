"""Many rods: the same work on a list of scenes, shared among the ranks, each rod on one of them.

Results are files, one for each rod, written whole as they finish.  A rod whose file is whole and has its name, load,
range and constants is finished and skipped, on any number of ranks.  Functions of a scene, and the work, are not
compared: if one of them has changed, choose another folder.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import product, zip_longest
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from rodfem.codim2.neighbours import NUMBERS, Rods, continued
from rodfem.diagram.diagram import MESH, PLAN, trace
from rodfem.diagram.plan import Plan
from rodfem.diagram.solver import RANKS, SCENE
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.fields import Discretization
from rodfem.file_format import RESULT
from rodfem.libraries import optional
from rodfem.output.files import save_json
from rodfem.output.table import special_data
from rodfem.problem.arguments import checked, each, function, path, reals
from rodfem.problem.scene import Scene
from rodfem.ranks import as_failure, end_together, on_first
from rodfem.whole_files import locked

Work = Callable[[Scene], dict[str, Any]]
OF_POINT = dict(zip(NUMBERS, ("load", "error_estimate", "ordinate", "negative_before", "negative_after"), strict=True))
"""What a family has of a special point, and the entries of files."""
MODELS, TRIED = 8, 2  # traced rods that others may be continued from; the nearest ones, before a rod is traced


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
    return shared([*map(key_of, scenes)], [partial(work, scene) for scene in scenes], folder, comm, progress)


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


# --- a family


@checked(scene=SCENE, folder=path("results/family"), plan=PLAN, discretization=MESH)
def family(
    scene: Scene,
    over: Mapping[str, Sequence[float]],
    folder: Path | str,
    plan: Plan | None = None,
    discretization: Discretization | None = None,
    **sharing: Any,
) -> Any:
    """Critical loads of a ``scene`` for every combination of values of constants, an ``xarray.Dataset``.

    ``over`` has the values by name, as in ``{"A": np.linspace(-2, 0, 41)}``: the dimensions of the dataset.  Of each
    rod the special points of its first branch, or of all that the ``plan`` asks for, are along the dimension ``point``,
    by their loads: ``kind``, ``critical_load``, its ``error``, ``ordinate``, ``index_before`` and ``index_after``, nan
    beyond their number.  ``first_loss`` is the load at which the first branch loses its stability, nan if it does not
    or begins unstable.  Where a rod fails, ``trouble`` is the sentence.  Rods are continued from their neighbours where
    these have the same special points (:mod:`rodfem.codim2.neighbours`), else traced.

    ``folder``, and ``comm`` and ``progress`` of ``sharing``, by default a bar on a terminal, are as for :func:`many`,
    which keeps each rod in a file: an interrupted family goes on, and ranks share it; another plan or
    ``discretization`` wants another folder.  Raises
    :class:`~rodfem.errors.InputError` for what is no constant of the scene, and
    :class:`~rodfem.errors.SetupError` without xarray.
    """
    xarray = optional("xarray", "tables")
    values = _columns_of(scene, over)
    each = [*product(*(column.tolist() for column in values.values()))]
    rods = _Rods(scene, [*values], np.array([np.ptp(x) or 1.0 for x in values.values()]), (plan, discretization))
    common, how = key_of(scene), dict[str, Any](comm=MPI.COMM_WORLD, progress=bar) | sharing
    keys = [common | {"constants": common["constants"] | dict(zip(values, x, strict=True))} for x in each]
    found = shared(keys, [partial(rods, x) for x in each], folder, **how)
    of_rods, of_points = _columns(found)
    shape = tuple(map(len, values.values()))
    data = {name: ([*values], column.reshape(shape)) for name, column in of_rods.items()}
    data |= {name: ([*values, "point"], table.reshape(*shape, -1)) for name, table in of_points.items()}
    return xarray.Dataset(data, values, {"scene": scene.name, "load": scene.load})


def _columns_of(scene: Scene, over: Mapping[str, Sequence[float]]) -> dict[str, np.ndarray]:
    """Values of each constant; raises :class:`InputError` for what is none, and for a value that is not admissible."""
    values = {name: np.array(reals(f"over[{name!r}]", column, (0.5, 1.0))) for name, column in over.items()}
    if not values or scene.load in values or not all(map(len, values.values())):
        raise InputError(f"over is {over!r}: give values of constants other than the load, as in {{'A': (-2, -1)}}.")
    for name, column in values.items():
        scene.check_constant(name)
        for value in column.tolist():
            scene.parameters[name].check(name, value)
    return values


def bar(done: int, count: int) -> None:
    """Draw a bar of what is done of all rods, if the errors of the program go to a terminal."""
    if sys.stderr.isatty():
        drawn = f"{'#' * (40 * done // count):<40}"
        sys.stderr.write(f"\r[{drawn}] {done} of {count} rods" + "\n" * (done == count))
        sys.stderr.flush()


def _columns(found: Sequence[dict[str, Any]]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Columns (rods,) of what rods have, and tables (rods, points) of their special points."""
    of_rods = {
        "first_loss": np.array([rod.get("first_loss") for rod in found], dtype=float),
        "trouble": np.array([rod.get("error", "") for rod in found]),
    }
    points = [rod.get("points", []) for rod in found]  # filled up where a rod has fewer
    rows = list(zip(*zip_longest(*points, fillvalue={}), strict=True)) or [()] * len(points)
    of_points = {name: np.array([[x.get(name) for x in row] for row in rows], dtype=float) for name in NUMBERS}
    of_points["kind"] = np.array([[x.get("kind", "") for x in row] for row in rows])
    return of_rods, of_points


class _Rods:
    """Rods of a family, by the values of the constants ``names``: each continued from rods near by, or traced."""

    def __init__(
        self, scene: Scene, names: list[str], sizes: np.ndarray, how: tuple[Plan | None, Discretization | None]
    ) -> None:
        self.scene, self.names, self.sizes = scene, names, sizes
        self.plan, self.mesh = how[0] or Plan(depth=0), how[1] or Discretization()
        self.models: list[Rods] = []

    def __call__(self, values: tuple[float, ...]) -> dict[str, Any]:
        """Special points of a rod, by their loads, and where its first branch loses its stability."""
        for model in sorted(self.models, key=lambda model: model.distance(values, self.sizes))[:TRIED]:
            with suppress(ConvergenceError):
                return _result_of(model.at(values, self.sizes), model.indices[0])
        return self._traced(values)

    def _traced(self, values: tuple[float, ...]) -> dict[str, Any]:
        """The same by a diagram, from which others may be continued."""
        rod = self.scene.varying(**dict(zip(self.names, values, strict=True)))
        diagram = trace(rod, self.mesh, self.plan, comm=MPI.COMM_SELF)
        first, every = diagram[0], [*map(special_data, diagram.special())]
        if len(diagram) == 1 and rod.conservative and continued(first, self.plan.load_range(rod)):
            bars = self.plan.error_bars
            self.models = [*self.models[1 - MODELS :], Rods(first, self.names, error_bars=bars)]
        points = [{"kind": x["kind"]} | {name: x[entry] for name, entry in OF_POINT.items()} for x in every]
        return _result_of(points, first.points[0].negative)


def _result_of(points: list[dict[str, Any]], index: int) -> dict[str, Any]:
    """Special points in the order of their loads, and the first loss of a branch that begins with an ``index``."""
    lost = [x["critical_load"] for x in points if not index and x["index_after"] > x["index_before"] == 0]
    return {"points": sorted(points, key=itemgetter("critical_load")), "first_loss": next(iter(lost), None)}
