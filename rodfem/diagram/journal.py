"""The journal of a run: its steps in order, those that are known and those that are new."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rodfem.diagram.record import Record
from rodfem.errors import InputError
from rodfem.fem.fields import Discretization


class Journal:
    """Steps that are ``known`` from an interrupted run, in order, and what ``keep`` does with each that is new.

    ``keep(record)`` is collective; None: nothing is recorded.  ``run`` names the run; empty: it has no name yet.
    """

    def __init__(
        self, known: Sequence[Record] = (), keep: Callable[[Record], None] | None = None, run: str = ""
    ) -> None:
        """Begin with the first step."""
        self.known, self.keep, self.run, self.done = known, keep, run, 0

    @property
    def first_mesh(self) -> Discretization | None:
        """Mesh that the interrupted run began with, if there was one."""
        return discretization_of(self.known[0].text["meshes"][0]) if self.known else None

    def next(self, name: str) -> Record | None:
        """Record of the next step if it is known; None for one that is new, or that has failed.

        Raises :class:`InputError` where the step of that ``name`` is a later one: this run is another one.
        """
        names = [record.text["name"] for record in self.known[self.done :]]
        if name not in names:
            return None
        if name != names[0]:
            raise InputError(self._mismatch(name))
        self.done += 1
        return self.known[self.done - 1]

    def add(self, record: Record) -> None:
        """Keep a new step; raises :class:`InputError` where one that is known was to come."""
        if self.done < len(self.known):
            raise InputError(self._mismatch(record.text["name"]))
        if self.keep is not None:
            self.keep(record)

    def _mismatch(self, name: str) -> str:
        there = self.known[self.done].text["name"]
        return (
            f"The run that was interrupted came to {there!r} where this one comes to {name!r}: give the scene that was "
            "run, or run it anew."
        )


def discretization_of(entries: dict[str, Any]) -> Discretization:
    """Discretisation of the entries of a file."""
    vertices = entries["vertices"]
    return Discretization(**entries | {"vertices": None if vertices is None else tuple(vertices)})
