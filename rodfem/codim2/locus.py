"""Rows of the locus of a special point, what is said of them, their file; :mod:`rodfem.codim2.follow` follows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.criteria import Interval
from rodfem.continuation.branch import SpecialPoint
from rodfem.errors import InputError
from rodfem.fem.system import System
from rodfem.file_format import LOCUS
from rodfem.output.files import mesh_of, save_json
from rodfem.output.table import plain
from rodfem.output.words import number
from rodfem.problem.arguments import finite
from rodfem.problem.units import Units
from rodfem.tolerances import NEGLIGIBLE, same_special

COARSE = "This mesh does not resolve all states: errors of `at least` that may be larger; use more elements."
"""Under the rows of a locus of which some are not resolved."""
AS_THEY_ARE = "kind", "start", "lower", "unresolved", "note", "bounds", "crossings", "ended"
COLUMNS = "ordinate", "index", "located_to", "error", "omega2"
"""Entries of a file that are attributes of a locus: as they are, and tables."""


@dataclass
class Mark:
    """A row of a locus where something happens: ``kind`` says what."""

    kind: str
    row: int


@dataclass(frozen=True)
class Row:
    """A point of a locus."""

    load: float
    parameter: float  #: the second one
    ordinate: float
    omega2: float  #: the double eigenvalue of flutter, nan for others
    index: tuple[int, int]  #: on the two sides of the curve
    located_to: tuple[float, float]  #: uncertainties of both parameters on the mesh


@dataclass(repr=False)
class Locus:
    """A curve of special points in the plane of two parameters, one row a point, in order along the curve.

    The ``index`` is that of the equilibria on its two sides: the eigenvalues that vanish on it positive, and negative;
    under loads without a potential the number of unstable ones.  The ``error`` says how far, across the curve, that of
    a richer mesh is away in either parameter; of turning points, cusps and ends how far those of that curve are.  It is
    nan where it was not asked for, inf where the richer mesh does not find the point; ``unresolved`` rows may exceed
    it.  ``marks`` are rows at which the curve turns in a parameter, cusps, and rows (away from the ``start``) before
    which another eigenvalue has passed through zero, not located.
    """

    system: System
    kind: str
    names: tuple[str, str]  #: the two parameters, the scene's load first
    bounds: tuple[Interval, Interval]  #: their intervals
    values: np.ndarray  #: both at each row, (n, 2)
    ordinate: np.ndarray
    index: np.ndarray  #: on the two sides, (n, 2)
    lower: int  #: side of the load on which the index is the lower one at the start: -1 below, 1 above, 0 not known
    omega2: np.ndarray  #: the double eigenvalue of flutter, nan for others
    located_to: np.ndarray  #: uncertainties on the mesh, (n, 2): of turning points, cusps and ends also along the curve
    error: np.ndarray  #: that of the mesh, (n, 2)
    marks: list[Mark]
    start: int
    ended: tuple[str, str]  #: why it ends, at its first and last row
    solve: Callable[[int, float], list[Row]]  # rows where a parameter, 0 or 1, has a value
    states: list[PETSc.Vec] = field(default_factory=list)  # not saved
    crossings: list[tuple[float, float]] = field(default_factory=list)  # load, ordinate at the start's parameter
    note: str = ""  # why errors that were asked for are not estimated
    unresolved: list[int] = field(default_factory=list)

    def __repr__(self) -> str:
        each = zip(self.names, self.values.min(axis=0), self.values.max(axis=0), strict=True)
        ranges = ", ".join(f"{name} from {low:.6g} to {high:.6g}" for name, low, high in each)
        return f"<Locus of the {self.kind}: {len(self.values)} points, {ranges}>"

    def at(self, **value: float) -> list[Row]:
        """Rows at which one of its two parameters has a value, as ``locus.at(A=-2.0)``, each solved for; collective.

        Raises :class:`InputError` for anything but one of :attr:`names`.
        """
        names = [name for name in self.names if name in value]
        if len(names) != 1 or len(value) != 1:
            one = f"give {' or '.join(self.names)}, as in at({self.names[1]}=1.0)"
            raise InputError(f"{value} is not one parameter of the locus: {one}.")
        return self.solve(self.names.index(names[0]), finite(1.0)(names[0], value[names[0]]))

    def passes(self, special: SpecialPoint, units: Units) -> bool:
        """Whether the curve passes the line of its start at a special point of a scene with these natural sizes."""
        point, one = special.point, (units.load, units.ordinate)
        same = (same_special((point.load, point.ordinate), special.located_to, at, one) for at in self.crossings)
        return self.kind == special.kind and any(same)

    def data(self) -> dict[str, Any]:
        """Plain lists, numbers and strings for a file; what was not computed is None."""
        columns = {name: self.values[:, i].tolist() for i, name in enumerate(self.names)}
        columns |= {name: plain(getattr(self, name)) for name in COLUMNS}
        return {
            "format": LOCUS.mark(),
            **self._of_scene(),
            **{name: getattr(self, name) for name in AS_THEY_ARE},
            "parameters": list(self.names),
            "columns": columns,
            "without_estimate": np.flatnonzero(np.isinf(self.error[:, 0])).tolist(),
            "marks": [{"kind": m.kind, "row": m.row} for m in self.marks],
        }

    def _of_scene(self) -> dict[str, Any]:
        scene = self.system.scene
        own = [scene.parameters[name] for name in self.names]
        return {
            "scene": scene.name,
            "title": scene.title or scene.name,
            "ordinate_name": scene.ordinate.name,
            "natural": scene.units.ordinate,
            "planar": bool(scene.planar),
            "constants": {name: p.value for name, p in scene.parameters.items() if name not in self.names},
            "discretization": mesh_of(self.system),
            "labels": [p.label or name for name, p in zip(self.names, own, strict=True)],
            "words": [p.words for p in own],
            "units": [p.unit for p in own],
        }

    def save(self, path: Path) -> None:
        """Write :meth:`data` as JSON, whole or not at all; call it on one rank."""
        save_json(self.data(), path)

    def text(self, rows: int = 12) -> str:
        """Rows of the curve for the terminal: some of them, its ends, and all that are marked."""
        n, marks, scene = len(self.values), {m.row: m.kind for m in self.marks}, self.system.scene
        shown = sorted({0, n - 1, self.start, *marks, *np.linspace(0, n - 1, min(rows, n)).astype(int).tolist()})
        lines = [
            f"\nLocus of the {self.kind} in {self.names[0]} and {self.names[1]} (in parentheses the estimated error "
            "of the discretisation across the curve, where it was asked for; of the ordinate it was not)",
            f"  {self.names[0]:<24} {self.names[1]:<24} {'ordinate':<14} index{' in its plane' * bool(scene.planar)}",
        ]
        for i in shown:
            each, resolved = zip(self.values[i], self.error[i], strict=True), i not in self.unresolved
            pair = [f"{v:.10g}" if np.isnan(e) else number(v, e, resolved) for v, e in each]
            ordinate = self.ordinate[i] if abs(self.ordinate[i]) > NEGLIGIBLE * scene.units.ordinate else 0.0
            index = f"{self.index[i, 0]}|{self.index[i, 1]}" if self.index[i, 0] >= 0 else ""
            note = "start" if i == self.start else marks.get(i, "")
            lines.append(f"  {pair[0]:<24} {pair[1]:<24} {ordinate:<14.8g} {index:<6} {note}".rstrip())
        lines.append(f"  {n} points; ends: {self.ended[0]}; {self.ended[1]}")
        return "\n".join([*lines, *filter(None, [self.note, COARSE * bool(self.unresolved)])])
