"""Lines in the space of a scene's parameters: what the scalar unknown ``load`` stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rodfem.problem.ends import Constants
from rodfem.problem.scene import Scene


@dataclass(frozen=True, eq=False)
class Line:
    """Parameters ``origin + t direction``, (number of parameters,) each, where ``t`` is the unknown ``load``."""

    scene: Scene
    origin: np.ndarray
    direction: np.ndarray

    def constants(self, t: float) -> Constants:
        """All parameters as numbers, at the middle of the rod."""
        values = (self.origin + t * self.direction).tolist()
        return Constants(s=sum(self.scene.interval) / 2, **dict(zip(self.scene.parameters, values, strict=True)))


def line(scene: Scene, origin: Mapping[str, float], direction: Mapping[str, float]) -> Line:
    """Line through ``origin``, with the scene's values where it has none, along the named parameters."""
    start = [origin.get(name, p.value) for name, p in scene.parameters.items()]
    return Line(scene, np.array(start), np.array([direction.get(name, 0.0) for name in scene.parameters]))


def load_line(scene: Scene) -> Line:
    """Line along which the scene's load varies and all else has the scene's values."""
    return line(scene, {scene.load: 0.0}, {scene.load: 1.0})
