"""Observers of a computation: the events that it reports while it runs.

The computation itself prints nothing and writes no file.  A terminal (:class:`rodfem.app.terminal.Report`), a writer of
files or a notebook derives from :class:`Observer` and overrides the events that it wants; events are the same on all
ranks.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partialmethod
from typing import TYPE_CHECKING, Any

from rodfem.continuation.branch import Branch, Point, SpecialPoint

if TYPE_CHECKING:
    from rodfem.fem.system import System


class Observer:
    """Hears every event, and does nothing.  Nothing that is handed over may be changed."""

    def compiling(self) -> None:
        """Forms are compiled, which takes some seconds."""

    def system(self, system: System, accuracy: float | None = None) -> None:
        """A scene has been discretised; an ``accuracy`` may be asked for."""

    def branch(self, branch: Branch) -> None:
        """A branch begins."""

    def progress(self, branch: Branch, point: Point) -> None:
        """A point has been added to a branch."""

    def special(self, branch: Branch, special: SpecialPoint) -> None:
        """A special point has been located; its error bars come with the end of its branch."""

    def law(self, special: SpecialPoint) -> None:
        """The local law of a branch point is known."""

    def mesh(self, system: System, load: float, why: str) -> None:
        """A branch goes on with another mesh from a load."""

    def accuracy(self, used: Sequence[System], worst: float, asked: float) -> None:
        """A branch was traced on meshes with a largest error, where one was ``asked`` for."""

    def finished(self, branch: Branch) -> None:
        """A branch has ended, and has its error bars."""

    def complete(self, diagram: Any) -> None:
        """One more branch of a :class:`~rodfem.Diagram` is complete, and can be saved."""

    def note(self, sentence: str) -> None:
        """Something worth knowing."""

    def warn(self, sentence: str) -> None:
        """Something went wrong, without stopping the computation."""


class Remark(str):
    """A sentence with the ``branch`` and the least and greatest of the ``loads`` that it is about; None: about all."""

    branch: str | None
    loads: list[float] | None

    def __new__(cls, sentence: str, *loads: float, branch: str | None = None) -> Remark:
        """Make a string that knows more than its letters."""
        made = super().__new__(cls, sentence)
        made.branch, made.loads = branch, [min(loads), max(loads)] if loads else None
        return made


class Recorder(Observer):
    """Keeps warnings and notes, and hands every event on to a listener.

    A remark between the first and the last event of a branch is about that branch; so is one about loads that comes
    before the first branch.
    """

    def __init__(self, listener: Observer) -> None:
        self.listener = listener
        self.warnings: list[Remark] = []
        self.notes: list[Remark] = []
        self._branch: str | None = None

    def _keep(self, remarks: list[Remark], sentence: str) -> None:
        loads, name = getattr(sentence, "loads", None) or (), getattr(sentence, "branch", None)
        remarks.append(Remark(sentence.strip(), *loads, branch=name or self._branch or None))

    def branch(self, branch: Branch) -> None:
        """Hand it on; what follows is about that branch."""
        if self._branch is None:
            for remark in (*self.warnings, *self.notes):
                remark.branch = branch.name if remark.loads else None
        self._branch = branch.name
        self.listener.branch(branch)

    def finished(self, branch: Branch) -> None:
        """Hand it on; what follows is about no branch."""
        self._branch = ""
        self.listener.finished(branch)

    def note(self, sentence: str) -> None:
        """Keep it and hand it on."""
        self._keep(self.notes, sentence)
        self.listener.note(sentence)

    def warn(self, sentence: str) -> None:
        """Keep it and hand it on."""
        self._keep(self.warnings, sentence)
        self.listener.warn(sentence)

    def _hand_on(self, event: str, *what: object) -> None:
        getattr(self.listener, event)(*what)


for _event in vars(Observer):
    if not _event.startswith("_") and _event not in vars(Recorder):
        setattr(Recorder, _event, partialmethod(Recorder._hand_on, _event))
