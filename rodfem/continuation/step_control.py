"""Control of the step of continuation: a class for each, of which a plan takes one."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from rodfem.continuation.branch import Point
from rodfem.errors import InputError
from rodfem.problem.arguments import finite, real, whole
from rodfem.tolerances import NEGLIGIBLE


@dataclass(frozen=True)
class StepControl:
    """Steps by the size of the correction, in the metric (root mean square rotation in radian, load over its span)."""

    first: float = 0.02  #: length of the first step
    largest: float = 0.1  #: bound of the step, which is also how coarse a branch is drawn
    smallest: float = 1e-5  #: length of a step at which a branch is given up
    aim: float = 1e-2  #: distance from prediction to correction that is aimed at
    most: int = 2000  #: number of points at which a branch is given up

    def __post_init__(self) -> None:
        """Check kinds and the largest step; raises :class:`InputError`."""
        for name in ("first", "largest", "smallest", "aim"):
            object.__setattr__(self, name, real(name, getattr(self, name), getattr(StepControl, name)))
        if whole("most", self.most, StepControl.most) < 1:
            raise InputError(f"most is {self.most}: a branch has at least one point; give most=1 or more.")
        if not self.smallest < self.largest <= 1:
            raise InputError(
                f"A step of {self.largest:g} is out of bounds: choose more than {self.smallest:g}, at most 1."
            )
        if 0 < self.first < self.smallest:
            raise InputError(f"A first step of {self.first:g} is out of bounds: choose {self.smallest:g} or more.")
        for name in ("first", "smallest", "aim"):
            if not 0 < getattr(self, name) < inf:
                raise InputError(f"StepControl with {name} = {getattr(self, name):g} lead nowhere: give more than 0.")

    def begin(self) -> float:
        """Length of the first step."""
        return min(self.first, self.largest)

    def after(self, step: float, moved: float, order: int) -> float:
        """Length of the next step; the correction ``moved`` the prediction, that of a predictor of an ``order``."""
        factor = (self.aim / max(moved, NEGLIGIBLE)) ** (1 / order)
        return min(step * min(max(factor, 0.4), 1.6), self.largest)

    def accepts(self, before: Point, after: Point) -> bool:
        """Whether a step that has converged is kept; else half of it is tried."""
        return True


@dataclass(frozen=True)
class IndexStepControl(StepControl):
    """Steps over which the index changes by no more than a bound: there is a row between nearly equal points."""

    change: int = 1  #: greatest change of the index from row to row
    resolved: float = 1e-4  #: length of a step that is kept nevertheless: eigenvalues may be multiple

    def __post_init__(self) -> None:
        """Check the bound, too; raises :class:`InputError`."""
        super().__post_init__()
        if whole("change", self.change, IndexStepControl.change) < 1:
            raise InputError(f"A change of the index of {self.change} leads nowhere: give change=1 or more.")
        if finite("resolved", self.resolved, IndexStepControl.resolved) < 0:
            raise InputError(f"resolved is {self.resolved:g}: give zero or more, as in resolved=1e-4.")

    def accepts(self, before: Point, after: Point) -> bool:
        """Whether the index has changed by no more than the bound, or the step is as short as it needs be."""
        small = after.arclength - before.arclength <= self.resolved
        return small or abs(after.negative - before.negative) <= self.change
