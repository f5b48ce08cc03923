"""Identification: constants and fields of a rod from what was measured of it.

Least squares by Gauss and Newton's method within a trust region (scipy), with the derivatives of critical loads and of
states; these are found again near by as the unknowns ``p`` change.  With the Jacobian ``J`` of the residuals ``f``,
each over the standard deviation of its datum, the covariance of ``p`` is ``(J^t J)^-1``, times ``f . f / (m - n)`` if
the deviations are not known (m data, n unknowns).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem.codim2.adjoint import restoration, state_derivative
from rodfem.codim2.neighbours import Neighbours, Values, in_parts, losses
from rodfem.continuation.branch import Point
from rodfem.diagram.diagram import MESH, trace
from rodfem.diagram.plan import Plan
from rodfem.diagram.solver import SCENE, Solver
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.fields import Discretization
from rodfem.fem.state import load_line
from rodfem.output.words import number
from rodfem.problem.arguments import Check, checked, each
from rodfem.problem.field import Field, names, with_fields
from rodfem.problem.functions import derived
from rodfem.problem.scene import Scene

if TYPE_CHECKING:
    from petsc4py import PETSc

CRITICAL, ORDINATE, SHAPE = "critical loads", "ordinate", "shape"
"""What may be measured: see :func:`identify`."""
WIDTHS = {CRITICAL: 1, ORDINATE: 2, SHAPE: 5}
"""Numbers in a row of each."""
BLIND = 1e-9
"""Least singular value of the Jacobian in sizes of the first guess, over the largest: less is not determined."""
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
Rows = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, repr=False)
class Identified:
    """Constants of a rod by what was measured, with standard ``errors`` and their ``covariance``, in the same order.

    ``scene`` has them, ``residuals`` (m,) are model minus data, and ``points`` the equilibria at the loads of the data,
    with their index.
    """

    scene: Scene
    values: dict[str, float]
    errors: dict[str, float]
    covariance: np.ndarray
    residuals: np.ndarray
    points: list[Point]

    def __repr__(self) -> str:
        each = ", ".join(f"{name} = {number(value, self.errors[name])}" for name, value in self.values.items())
        return f"<Identified: {each}>"


def _one_or_more(check: Check) -> Check:
    """Check of what is given by itself, or in a list."""
    several = each(check)
    return lambda name, given: [*several(name, given)] if isinstance(given, (list, tuple)) else check(name, given)


@checked(scene=_one_or_more(SCENE), discretization=MESH)
def identify(
    scene: Scene | Sequence[Scene],
    data: Mapping[str, Any] | Sequence[Mapping[str, Any]],
    unknown: Sequence[str] | Mapping[str, Field],
    deviations: Mapping[str, float] | None = None,
    discretization: Discretization | None = None,
) -> Identified:
    """Constants of a ``scene``, or fields in their place, for which it fits what was measured best.

    ``data`` has at least one of ``"critical loads"``: those at which the index of the first branch grows, in their
    order; ``"ordinate"``: rows of load and ordinate; ``"shape"``: rows of load, arclength and position; each as rows,
    or as the path of a text file with a row in each line.  Of several experiments with one rod ``scene`` and ``data``
    are lists.  States are followed from the first load of the data on, without jumps, on the mesh of the
    ``discretization``.  ``unknown`` are names of constants, whose values are the first guess, or
    :class:`~rodfem.Field` by name.  ``deviations`` are standard deviations of the data by kind; if they are not given
    those of one kind are alike, and of several relative to their largest datum.  Raises
    :class:`~rodfem.errors.InputError` for data and names that make no sense, and
    :class:`~rodfem.errors.ConvergenceError` for what the data do not determine.
    """
    scenes, every = [scene] if isinstance(scene, Scene) else [*scene], [data] if isinstance(data, Mapping) else [*data]
    if not len(scenes) == len(every) > 0:
        raise InputError(f"There are {len(scenes)} scenes and {len(every)} sets of data: give one for each.")
    fields, tables = dict(unknown) if isinstance(unknown, Mapping) else {}, [_tables(one, deviations) for one in every]
    given = _chosen(fields) or list(unknown), discretization or Discretization()
    models = [_Model(with_fields(rod, fields), own, *given) for rod, own in zip(scenes, tables, strict=True)]
    return _fitted(models, _weights(models, deviations), known=bool(deviations))


def _chosen(fields: Mapping[str, Field]) -> list[str]:
    return [n for name, field in fields.items() for n in names(name, field)]


def _weights(models: Sequence[_Model], deviations: Mapping[str, float] | None) -> np.ndarray:
    """Deviations (m,) of the residuals, as given, or all one, of several kinds of data the largest of each kind."""
    sizes = dict[str, float]()
    for model in models:
        for kind, table in model.tables.items():
            sizes[kind] = max(sizes.get(kind, 0.0), float(abs(table[:, -1]).max()))
    sizes = dict(deviations or (sizes if len(sizes) > 1 else dict.fromkeys(sizes, 1.0)))
    return np.concatenate([np.full(model.count(kind), sizes[kind]) for model in models for kind in model.tables])


def _fitted(models: Sequence[_Model], weights: np.ndarray, *, known: bool) -> Identified:
    """Least squares of the residuals over their ``weights`` (m,), which are their deviations if these are ``known``."""
    from scipy.optimize import least_squares

    rod, chosen, exact = models[0].scene, models[0].chosen, float(np.finfo(float).eps) ** 0.8

    def residuals(p: np.ndarray) -> np.ndarray:
        return np.concatenate([model.at(p)[0] for model in models]) / weights

    def slopes(p: np.ndarray) -> np.ndarray:
        return np.concatenate([model.at(p)[1] for model in models]) / weights[:, None]

    guess = np.array([rod.parameters[n].value for n in chosen])
    size = np.where(guess, abs(guess), 1.0)
    answer = least_squares(
        residuals,
        guess,
        slopes,
        bounds=tuple(np.transpose([rod.parameters[n].admissible for n in chosen])),
        x_scale=size,
        **dict.fromkeys(("xtol", "ftol", "gtol"), exact),
    )
    covariance, free = _covariance(answer.jac, size, chosen), len(weights) - len(chosen)
    if not known:
        covariance = covariance * (2 * answer.cost / free if free else np.nan)
    found = dict(zip(chosen, answer.x.tolist(), strict=True))
    errors = dict(zip(chosen, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    points = [point for model in models for point in model.points(found)]
    return Identified(rod.varying(**found), found, errors, covariance, answer.fun * weights, points)


def _read(rows: Any) -> Any:
    """Rows of a file, whose numbers are between blanks, commas or semicolons; other lines, as its head, are left out.

    Raises :class:`InputError` for one that cannot be read.
    """
    if not isinstance(rows, (str, Path)):
        return rows
    try:
        lines = [re.split(r"[\s,;]+", line.strip(" \t\r,;")) for line in Path(rows).read_text().splitlines()]
    except (OSError, UnicodeDecodeError) as trouble:
        raise InputError(f"The data in {rows} cannot be read ({trouble}): give the path of a text file.") from trouble
    return [[float(x) for x in line] for line in lines if all(NUMBER.fullmatch(x) for x in line)]


def _tables(data: Mapping[str, Any], deviations: Mapping[str, float] | None) -> dict[str, np.ndarray]:
    """Data as tables of rows; raises :class:`InputError`."""
    out = {}
    for kind, rows in data.items():
        if kind not in WIDTHS:
            raise InputError(f"Data of the kind {kind!r} are not known: choose one of {', '.join(WIDTHS)}.")
        rows = _read(rows)
        try:
            out[kind] = np.array(rows, dtype=float).reshape(-1, WIDTHS[kind])
        except (TypeError, ValueError):
            out[kind] = np.zeros((0, 0))
        if not (out[kind].size and np.isfinite(out[kind]).all()):
            raise InputError(f"Data of the {kind} are no table: give rows of {WIDTHS[kind]} finite numbers each.")
        if deviations is not None and not deviations.get(kind, 0.0) > 0.0:
            raise InputError(f"deviations has none for the {kind}: give a positive one for each kind of data, or none.")
    if not out:
        raise InputError("There are no data: give some, as in {'critical loads': [9.87]}.")
    return out


def _covariance(J: np.ndarray, size: np.ndarray, chosen: Sequence[str]) -> np.ndarray:
    """``(J^t J)^-1``; raises :class:`ConvergenceError` for unknowns that the data do not determine."""
    _, s, rows = np.linalg.svd(J * size, full_matrices=True)
    if len(s) < len(chosen) or s[-1] <= BLIND * s[0]:
        name = chosen[int(abs(rows[-1]).argmax())]
        raise ConvergenceError(f"The data do not determine {name}: give more of them, or fewer unknowns.")
    return np.asarray((rows.T / s**2) @ rows * np.outer(size, size))


class _Model:
    """Residuals of the data of a scene, and their derivatives in the ``chosen`` constants."""

    def __init__(self, scene: Scene, tables: dict[str, np.ndarray], chosen: list[str], mesh: Discretization) -> None:
        for name in chosen:
            scene.check_constant(name)
        self.scene, self.tables, self.chosen = scene, tables, chosen
        self.solver, self._values = Solver(scene, mesh), {name: p.value for name, p in scene.parameters.items()}
        loads = {float(row[0]) for kind in (ORDINATE, SHAPE) for row in tables.get(kind, ())}
        self._states = dict[float, "PETSc.Vec"]()
        point = None
        for load in sorted(loads, reverse=scene.span[0] > scene.span[1]):
            point = self.solver.equilibrium(load, point)
            self._states[load] = point.x
        self._critical = None
        if wanted := len(tables.get(CRITICAL, ())):
            found = losses(trace(scene, mesh, Plan(depth=0, error_bars=False))[0], wanted)
            if len(found) < wanted:
                raise InputError(f"The first branch has {len(found)} critical loads, not {wanted}: give a wider range.")
            self._critical = Neighbours(found)

    def count(self, kind: str) -> int:
        """Number of residuals of a kind."""
        return len(self.tables[kind]) * (3 if kind == SHAPE else 1)

    def at(self, p: np.ndarray) -> Rows:
        """Residuals (m,) and their derivatives (m, n); not finite where the rod is lost."""
        key = np.asarray(p).tobytes()
        try:
            return derived(self, key, lambda: self._rows(dict(zip(self.chosen, p.tolist(), strict=True))))
        except ConvergenceError:
            m = sum(map(self.count, self.tables))
            return np.full(m, np.inf), np.zeros((m, len(p)))

    def _rows(self, values: Values) -> Rows:
        own, equilibria = {**self._values, **values}, self.solver.equilibria
        with restoration(equilibria.system):
            self._states = in_parts(self._moved, self._states, (self._values, own))
            self._values = own
            parts = [self._of(kind, table) for kind, table in self.tables.items()]
        return np.concatenate([f for f, _ in parts]), np.concatenate([J for _, J in parts])

    def _moved(self, states: Mapping[float, PETSc.Vec], values: Values) -> dict[float, PETSc.Vec]:
        """States at their loads with other constants."""
        equilibria, out = self.solver.equilibria, {}
        equilibria.system.line = load_line(self.scene, **values)
        for load, x in states.items():
            out[load], outcome = equilibria.at_load(x, load)
            if not outcome.converged:
                raise ConvergenceError(f"No equilibrium was found at {self.scene.load} = {load:g}.")
        return out

    def _of(self, kind: str, table: np.ndarray) -> Rows:
        if self._critical is not None and kind == CRITICAL:
            loads, slopes = self._critical.loads(self.chosen, np.array([self._values[n] for n in self.chosen]))
            return loads - table[:, 0], slopes
        data, solver = table[:, 1 if kind == ORDINATE else 2 :], self.solver.equilibria
        f, J = np.empty(data.shape), np.empty((*data.shape, len(self.chosen)))
        for load, x in self._states.items():
            here = np.flatnonzero(table[:, 0] == load)
            of = partial(self._measured, kind, table[here, 1])
            f[here] = of(x) - data[here]
            for i, name in enumerate(self.chosen if len(here) else ()):
                J[here, :, i] = state_derivative(solver, x, name, of)
        return f.ravel(), J.reshape(f.size, -1)

    def _measured(self, kind: str, s: np.ndarray, x: PETSc.Vec) -> np.ndarray:
        """What is measured of a state: its ordinate, or places at arclengths ``s`` (m,), as rows."""
        shape, system = self.solver.equilibria.shape, self.solver.equilibria.system
        if kind == ORDINATE:
            return np.full((len(s), 1), shape.ordinate(x))
        return np.array([shape.place(system.at(x), each, shape.weights(each))[0] for each in s.tolist()]).reshape(-1, 3)

    def points(self, found: Values) -> list[Point]:
        """Equilibria of the rod that was found, with their index."""
        solver = self.solver.rebind(**found)
        return [solver.equilibrium(load, x) for load, x in self._states.items()]
