"""Results of a run in plain numbers and texts, from which they are made again to the last bit.

Objects of the classes that :data:`CLASSES` names become dictionaries, and vectors become arrays in natural order, on
any number of ranks (:mod:`rodfem.fem.natural_order`).  An object that is met twice stays one object.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Branch, NormalForm, Point, SpecialPoint, Unexplained
from rodfem.continuation.kinds import KINDS, Kind
from rodfem.continuation.normal_form import Origin
from rodfem.continuation.singular import SingularState
from rodfem.fem.natural_order import NaturalOrder
from rodfem.problem.events import Event
from rodfem.stability.soft_mode import SoftMode

CLASSES = {c.__name__: c for c in (Branch, Point, SpecialPoint, NormalForm, SoftMode, Unexplained, SingularState, Origin)}
"""Classes whose objects are recorded, field by field."""
TAG = "is"
"""Entry of a dictionary that stands for something else: for what."""


@dataclass(frozen=True)
class Record:
    """Recorded objects: a ``text`` that JSON can hold, and the ``vectors`` that it names by their numbers."""

    text: Any
    vectors: list[np.ndarray]


class Writer:
    """Records objects.  ``orders(mesh)`` is the natural order of a mesh; collective, as vectors are gathered."""

    def __init__(self, orders: Callable[[int], NaturalOrder]) -> None:
        """Nothing is recorded yet."""
        self.orders, self.vectors = orders, list[np.ndarray]()
        self._met: dict[int, int] = {}

    def __call__(self, value: Any, order: NaturalOrder | None = None) -> Any:
        """What stands for a value; ``order`` is that of vectors outside of a point."""
        if isinstance(value, PETSc.Vec):
            assert order is not None
            self.vectors.append(order.values(value))
            return {TAG: "vector", "number": len(self.vectors) - 1}
        if isinstance(value, (Kind, Event)):
            return {TAG: type(value).__name__, "name": str(value) if isinstance(value, Kind) else value.name}
        if isinstance(value, np.ndarray):
            return {TAG: "array", "values": value.tolist()}
        if isinstance(value, (list, tuple)):
            items = [self(item, order) for item in value]
            return {TAG: "tuple", "items": items} if isinstance(value, tuple) else items
        if is_dataclass(value):
            return self._object(value, order)
        return value.item() if isinstance(value, np.generic) else value

    def _object(self, value: Any, order: NaturalOrder | None) -> Any:
        if id(value) in self._met:
            return {TAG: "again", "number": self._met[id(value)]}
        self._met[id(value)] = len(self._met)
        if isinstance(value, (Point, SpecialPoint)):
            order = self.orders(value.mesh if isinstance(value, Point) else value.point.mesh)
        return {TAG: type(value).__name__, **{f.name: self(getattr(value, f.name), order) for f in fields(value)}}


class Reader:
    """Makes recorded objects again.

    ``orders(mesh)`` is the natural order of a mesh, ``vectors`` are those of the record, and ``events`` those of the
    plan.
    """

    def __init__(
        self, orders: Callable[[int], NaturalOrder], vectors: Sequence[np.ndarray], events: Sequence[Event]
    ) -> None:
        """Nothing is read yet."""
        self.orders, self.vectors, self.events = orders, vectors, {event.name: event for event in events}
        self._met: list[Any] = []

    def __call__(self, text: Any, order: NaturalOrder | None = None) -> Any:
        """Value that a text stands for; ``order`` is that of vectors outside of a point."""
        if isinstance(text, list):
            return [self(item, order) for item in text]
        if not isinstance(text, dict):
            return text
        name = text[TAG]
        if name == "vector":
            assert order is not None
            return order.vector(self.vectors[text["number"]])
        if name == "array":
            return np.array(text["values"])
        if name == "tuple":
            return tuple(self(text["items"], order))
        if name == "again":
            return self._met[text["number"]]
        if name in (Kind.__name__, Event.__name__):
            return (KINDS if name == Kind.__name__ else self.events)[text["name"]]
        return self._object(CLASSES[name], text, order)

    def _object(self, kind: type, text: dict[str, Any], order: NaturalOrder | None) -> Any:
        place = len(self._met)
        self._met.append(None)
        if kind is Point:
            order = self.orders(text["mesh"])
        elif kind is SpecialPoint:  # its point has been met, or is the first of its entries that has vectors
            order = self.orders(self._mesh_of(text["point"]))
        self._met[place] = kind(**{name: self(entry, order) for name, entry in text.items() if name != TAG})
        return self._met[place]

    def _mesh_of(self, point: dict[str, Any]) -> int:
        mesh: int = self._met[point["number"]].mesh if point[TAG] == "again" else point["mesh"]
        return mesh
