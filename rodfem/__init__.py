"""Stability of the equilibria of elastic rods: which are stable, and where they stop being so.

A person states a :class:`~rodfem.scene.Scene` (rod, ends, load, symmetry, what to record), chooses a
:class:`~rodfem.fields.Discretization` and a :class:`~rodfem.explore.Plan`, and calls :func:`~rodfem.runner.run`, which
traces the equilibria, decides the stability of each, finds and classifies the points where it is lost, and follows what
branches off.
``demos/hemitropic.py`` is a whole example.

Data flows, and imports go, one way: ``scene`` -> ``fields`` -> ``equations`` -> ``system`` (the bordered saddle
point) -> ``newton``, ``stability`` -> ``continuation`` -> ``locate``, ``bifurcation`` -> ``accuracy`` ->
``explore`` -> ``diagram``, ``runner`` -> ``cli``. ``plot`` and ``render`` draw from saved files alone. The
mathematics is in the package ``forms``.

This module loads nothing by itself, so that files can be drawn without MPI; its names are loaded when they are used.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOMES = {
    "locus": "loci.locus",
    "Locus": "loci.locus",
    **dict.fromkeys(
        ("End", "clamped", "pinned", "sliding", "hinged", "free", "Ring", "Attachment", "Constraint"), "ends"
    ),
    **dict.fromkeys(("integral", "at", "everywhere"), "ends"),
    "Scene": "scene",
    "Parameter": "scene",
    "Ordinate": "scene",
    "Inertia": "scene",
    "Discretization": "fields",
    "Plan": "explore",
    "Steps": "continuation",
    "run": "runner",
    "load_json": "diagram",
    "load_state": "diagram",
}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    """Load a public name from its module at first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'rodfem' has no attribute {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"rodfem.{_HOMES[name]}"), name)
