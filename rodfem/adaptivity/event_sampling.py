"""How much the location of an event depends on the places along the rod at which its function receives the state.

A function of the state sees it at nodes: the highest node is lower than the highest place, and a sum over nodes is
no integral.  Two meshes miss alike of it, and what they agree in is no bound.  The same states, whose polynomials are
known at any place, are given to the function at more places: at so many pieces of each element, its ends among them.
Close to these are more, since an extreme that is nearer to an end than other places are would show in none of them.

Of samples of which one has four times as many places, an error that falls with the distance of places, or its square,
is by a quarter at most in the last: all of them together bound it by what they differ by.  Ends of elements are in
every sample, and a function that looks at them alone, or at the whole in a way that places do not matter for, has the
same values and costs no solve.  A function that jumps from node to node, as the place of the highest one, tells no
distance to where it would vanish: it has no bar.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem import compat
from rodfem.errors import ConvergenceError, SceneError
from rodfem.fem.shape import Shape, unique
from rodfem.problem.events import Event

FINER = 4
"""Pieces of an element in the finest sample, for each degree."""
LEFT = 1 / (2 * FINER)
"""Part of an error that falls with the distance of places that is left there of that at nodes of elements twice as
long."""
CLOSE = np.array([1 / 64, 1 / 16, 1 / 4])
"""More places there beside an end of an element, relative to a piece."""
BESIDE = 1e-7, 1e-4
"""Distances along the branch, in the metric, at which a function that jumps is told from one that is steep."""


def where_places_matter(shape: Shape, event: Event, x: PETSc.Vec, noise: float) -> list[Event]:
    """The event with more and more places, or none where these make no difference at a state.

    Raises :class:`ConvergenceError` where its function fails with more places.

    Parameters
    ----------
    shape
        That of the mesh.
    event
        The event.
    x
        The state.
    noise
        Round-off of the event's values near it.
    """
    other = [finer_event(shape, event, t) for t in _samples(shape.system.fields.discretization.degree)]
    here = event(shape.sample(x))
    try:
        return other if any(abs(more(shape.sample(x)) - here) > noise for more in other) else []
    except SceneError as trouble:
        words = str(trouble)
        raise ConvergenceError(f"with more places along the rod {words[0].lower()}{words[1:]}") from trouble


def refuse_jump(shape: Shape, event: Event, x: PETSc.Vec, tangent: PETSc.Vec, noise: float) -> None:
    """Raise :class:`ConvergenceError` where an event happens in a jump from node to node.

    Parameters
    ----------
    shape
        That of the mesh.
    event
        The event.
    x, tangent
        The state at which it happens, and the tangent of the branch.
    noise
        Round-off of the event's values near it.
    """
    near, far = (abs(event(shape.sample(x + tangent * d)) - event(shape.sample(x - tangent * d))) for d in BESIDE)
    if near > max(far / 2, noise) and where_places_matter(shape, event, x, noise):
        raise ConvergenceError(
            f"the event {event.name!r} jumps there from node to node: interpolate between them in its function"
        )


def finer_event(shape: Shape, event: Event, t: np.ndarray) -> Event:
    """Return the ``event`` whose function receives states of a ``shape`` at places ``t`` of each element."""
    return replace(event, of=lambda state: event.of(SimpleNamespace(**finer(shape, vars(state), t))))


def finer(shape: Shape, sample: dict[str, Any], t: np.ndarray) -> dict[str, Any]:
    """A sample of a state of a ``shape`` at places ``t``, from 0 to 1, of each element instead of the nodes.

    Fields that jump at ends of elements have one place less on each, equally far apart.
    """
    f, out = shape.system.fields, dict(sample)
    elements, degree = f.discretization.elements, f.discretization.degree
    inside = np.linspace(0.0, 1.0, len(t) - 1)
    blocks = {block.name: block for block in f.blocks}
    out["s"] = _between(sample["s"][:, None], elements, degree, t)[:, 0]
    for name, block in blocks.items():
        if block.continuous:
            out[name] = _between(sample[name], elements, degree, t)
        else:
            out[name] = np.einsum("tn,eni->eti", _basis(block.degree, inside), sample[name])
    out["r"] = _between(sample["r"], elements, degree, t)
    q = f.turning.quaternion(out[f.turning.name])
    out["q"] = q / np.linalg.norm(q, axis=1, keepdims=True)
    out["q"][:: len(t) - 1] = sample["q"][::degree]
    return out


def _samples(degree: int) -> list[np.ndarray]:
    """Places of two samples on an element: even numbers of pieces, so that the middle of the rod stays the middle."""
    fine = FINER * degree
    close = CLOSE / fine
    finest = np.concatenate([np.linspace(0.0, 1.0, fine + 1), close, 1.0 - close])
    return [np.linspace(0.0, 1.0, 2 * ((3 * degree + 1) // 2) + 1), np.sort(finest)]


def _between(values: np.ndarray, elements: int, degree: int, t: np.ndarray) -> np.ndarray:
    """Values (m, ...) of a continuous field at the places of all elements, of those at their nodes."""
    cells = values[np.arange(elements)[:, None] * degree + np.arange(degree + 1)]
    return unique(np.einsum("tn,eni->eti", _basis(degree, t), cells))


def _basis(degree: int, t: np.ndarray) -> np.ndarray:
    """Lagrange basis on the nodes from left to right, (places, nodes): at the ends exactly that of the end."""
    basis = compat.lagrange_basis(degree, t)[:, np.argsort(compat.nodes(degree))]
    if degree:
        basis[[0, -1]] = 0.0
        basis[0, 0] = basis[-1, -1] = 1.0
    return basis
