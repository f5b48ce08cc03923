"""The steps of a run, so that one that was interrupted goes on: a branch that is known is not traced again.

A run that goes on does all that it did before, in the same order; only what takes long, the tracing of a branch and a
search by deflation, is recalled from the journal of the run that was interrupted.  With the result of a step comes all
that it leaves behind for those that follow: new meshes, gaps, branch points that it met, warnings, and the vectors
from which the next inverse iterations start.  So the diagram is that of a run which was not interrupted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from rodfem.adaptivity.error_estimate import Enriched
from rodfem.adaptivity.gaps import Gap, Gaps
from rodfem.continuation.branch import Branch
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.observer import Observer, Recorder
from rodfem.diagram.journal import Journal, discretization_of
from rodfem.diagram.record import Reader, Record, Writer
from rodfem.fem.natural_order import NaturalOrder
from rodfem.problem.events import Event

if TYPE_CHECKING:
    from rodfem.adaptivity.mesh_sequence import Meshes


@dataclass(frozen=True)
class Recalled:
    """What a step has ``found``, what else it has ``left``, and the ``warnings`` and ``notes`` that were given."""

    found: Any
    left: dict[str, Any]
    warnings: list[str]
    notes: list[str]


class Bookkeeper:
    """Records the steps of one tracer in a journal, and recalls those that it knows; collective."""

    def __init__(
        self,
        journal: Journal,
        meshes: Meshes,
        gaps: Gaps,
        branches: list[Branch],
        events: Sequence[Event],
        said: Recorder | None,
    ) -> None:
        """Begin with the first step.

        Parameters
        ----------
        journal
            What is known.
        meshes, gaps, branches
            Those of the tracer, which steps add to.
        events
            Those of the plan.
        said
            What keeps warnings and notes, if anything does.
        """
        self.journal, self.meshes, self.gaps, self.branches, self.events = journal, meshes, gaps, branches, events
        self.said = said or Recorder(Observer())
        self._orders: dict[int, NaturalOrder] = {}
        self.begin()

    def begin(self) -> None:
        """Begin a step: what is said from now on belongs to it."""
        self._heard = len(self.said.warnings), len(self.said.notes)

    def order(self, solver: BranchSolver) -> NaturalOrder:
        """Natural order of a solver's unknowns."""
        if id(solver) not in self._orders:
            self._orders[id(solver)] = NaturalOrder(solver.system)
        return self._orders[id(solver)]

    # --- recording -------------------------------------------------------------------------------------------------

    def keep(self, name: str, found: Any, left: dict[str, Any]) -> None:
        """Record a step: what it has ``found``, and what else it has ``left``, as JSON can hold it."""
        self._settle()
        if self.journal.keep is None:
            return
        with self.meshes.solvers[0].system.clock.scope("files"):
            self.journal.add(self._record(name, found, left))

    def _record(self, name: str, found: Any, left: dict[str, Any]) -> Record:
        writer = Writer(lambda mesh: self.order(self.meshes.solvers[mesh]))
        text = {"name": name, "found": writer(found), "left": left}
        text["meshes"] = [asdict(solver.system.fields.discretization) for solver in self.meshes.solvers]
        text["memory"] = [self._memory(writer, solver) for solver in self.meshes.solvers]
        text["gaps"] = [[writer(gap.special), writer(gap.unfolded, self._at(gap))] for gap in self.gaps.known]
        text["switched"] = [[special.switched for special in branch.special] for branch in self.branches]
        text["said"] = [self.said.warnings[self._heard[0] :], self.said.notes[self._heard[1] :]]
        text["richer"] = {
            str(mesh): [self._memory(writer, richer.solver), self._origins(writer, richer, found)]
            for mesh, richer in self.meshes.companions.items()
        }
        return Record(text, writer.vectors)

    def _settle(self) -> None:
        """Forget what Newton's method carries along a branch, so that it does not matter whether it was traced."""
        for solver in [*self.meshes.solvers, *(richer.solver for richer in self.meshes.companions.values())]:
            solver.forget()

    def _at(self, gap: Gap) -> NaturalOrder:
        return self.order(self.meshes.solvers[gap.special.point.mesh])

    def _memory(self, writer: Writer, solver: BranchSolver) -> dict[str, Any]:
        inertia, verification = solver.inertia, solver.system.verification
        return {
            "vectors": writer(inertia.vectors, self.order(solver)),
            "band": [inertia.resolution, inertia.tolerance],
            "damping": solver.system.damping,
            "dropped": sorted(verification.dropped),
            "norm": verification.norm,
        }

    def _origins(self, writer: Writer, richer: Enriched, found: Any) -> list[Any]:
        """Special points of a branch as they are on a richer mesh, by their numbers."""
        special = found.special if isinstance(found, Branch) else []
        number = {id(s): i for i, s in enumerate(special)}
        order = self.order(richer.solver)
        return [[number[id(s)], writer(o, order), rho] for s, o, rho in richer.origins if id(s) in number]

    # --- recalling -------------------------------------------------------------------------------------------------

    def recall(self, name: str) -> Recalled | None:
        """Result of a known step of that name, with all that it has changed; None for a new step."""
        record = self.journal.next(name)
        if record is None:
            return None
        text = record.text
        for mesh in text["meshes"][len(self.meshes.solvers) :]:
            self.meshes.add(discretization_of(mesh))
        reader = Reader(lambda mesh: self.order(self.meshes.solvers[mesh]), record.vectors, self.events)
        found = reader(text["found"])
        for solver, memory in zip(self.meshes.solvers, text["memory"], strict=False):
            self._remember(reader, solver, memory)
        self.gaps.known = [Gap(special := reader(s), reader(u, self._of(special.point.mesh))) for s, u in text["gaps"]]
        traced = [*self.branches, found] if isinstance(found, Branch) else self.branches
        for branch, flags in zip(traced, text["switched"], strict=True):
            for special, flag in zip(branch.special, flags, strict=True):
                special.switched = flag
        for mesh, (memory, origins) in text["richer"].items():
            self._remember_richer(int(mesh), reader, memory, origins, found)
        self._settle()
        return Recalled(found, text["left"], *text["said"])

    def _of(self, mesh: int) -> NaturalOrder:
        return self.order(self.meshes.solvers[mesh])

    def _remember(self, reader: Reader, solver: BranchSolver, memory: dict[str, Any]) -> None:
        inertia, verification = solver.inertia, solver.system.verification
        inertia.vectors = reader(memory["vectors"], self.order(solver))
        inertia.resolution, inertia.tolerance = memory["band"]
        solver.system.damping = memory["damping"]
        verification.dropped, verification.norm = set(memory["dropped"]), memory["norm"]

    def _remember_richer(
        self, mesh: int, reader: Reader, memory: dict[str, Any], origins: list[Any], found: Any
    ) -> None:
        """Do the same for a richer companion, when it is made."""

        def remember(richer: Enriched) -> None:
            self._remember(reader, richer.solver, memory)
            order = self.order(richer.solver)
            richer.origins += [(found.special[i], reader(origin, order), rho) for i, origin, rho in origins]

        self.meshes.when_made(mesh, remember)
