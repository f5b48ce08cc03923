r"""Detection of the continuous symmetries of a scene, by invariance of its equations.

A combination ``g = sum_j a_j g_j`` of the generators of :mod:`rodfem.fem.symmetries` is a symmetry where the equations
``F`` of equilibrium are equivariant, so that it carries equilibria into equilibria, for ``g(x) = A x + c`` ::

    dF(x)[g(x)] + A^t F(x) = 0

for all ``x``; and where it moves nothing that an end holds.  The space of such ``a`` is the null space of a matrix with
rows for each of a number of generic states.

What acts on the rod, with a potential, has to be invariant by itself: next to a rod 1e12 times as stiff as the spring
that holds it, the spring is round-off in ``F``.

The motion of a closed rod along itself is a symmetry where no equation has the arclength in it.  Where one has, it may
still be one together with a rotation (a ring under a dead radial load): ``g``, with the state's derivative in it, has
to leave the functional ``L`` invariant, ``dL(x)[g(x)] = 0``, on a fine mesh, which has such a symmetry up to its error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from rodfem.errors import SceneError
from rodfem.fem.assembly import Assembler
from rodfem.fem.state import LOAD, NodalValues
from rodfem.fem.symmetries import Symmetry, derivative, elementary_generators
from rodfem.problem.functions import derived
from rodfem.problem.quaternions import directors, of_vector, product
from rodfem.problem.unknowns import Block, Motion
from rodfem.tolerances import TINY

if TYPE_CHECKING:
    from rodfem.fem.equations import Equations
    from rodfem.fem.fields import Fields
    from rodfem.problem.scene import Scene

EXACT = 1e-10
"""Round-off of motions of what ends hold, relative to the greatest."""
INVARIANT = 1e-12
"""Round-off of the change of the functional, or of the equations, relative to the sum of magnitudes of its terms.

Up to 4e-13 were measured for symmetries of rods with elements of 1e-6.  A rod that bends less alike than this, next to
the stiffest of its strains, is taken for one that bends alike.
"""
SLIDING = 1e-8
"""The same for the motion of a closed rod along itself: the error of a fine mesh."""


def find_symmetries(equations: Equations) -> list[Symmetry]:
    """Find a basis of all exact symmetries; raises :class:`SceneError` where the equations are no numbers anywhere."""
    fields, parts = equations.fields, elementary_generators(equations.fields)
    single = [Symmetry(row, parts) for row in np.eye(len(parts))]
    moved, dofs_held = np.zeros((len(parts),) * 2), _clamped(fields)
    back = [s.linear(fields).T for s in single]
    rows, sizes, held = [], [], [np.zeros((1, len(parts)))]
    for seed in range(3):
        state = generic_state(equations, seed)
        changes = np.array([s.change(state) for s in single])
        row, size = _change_of_equations(state, back, changes)
        rows.append(row)
        sizes.append(size)
        # conditions on the weights a of a symmetry: invariance, and no motion of what an end holds
        changes /= fields.sizes  # conditions and motions stand next to others in other units
        held.append(changes[:, dofs_held].T)
        free = changes[:, fields.number >= 0]
        moved += free @ free.T
    free = _null_space(np.vstack(held))
    greatest = np.nan_to_num(np.max(sizes, axis=1), nan=np.inf)
    if not np.isfinite(greatest).any():
        raise SceneError(
            f"The equations of the rod are no numbers at any of the {len(greatest)} states that were tried: a function "
            "of the scene, or its derivative, overflows or is not defined there; write it such that it does not (that "
            "of tanh(x) overflows beyond x = 350; x/sqrt(1 + x^2) does not)."
        )
    # the round-off of wild states hides that of all others
    asked_at = np.flatnonzero(greatest <= 1e4 * greatest.min())
    conditions, magnitudes = np.vstack([rows[i] for i in asked_at]), np.max([sizes[i] for i in asked_at], axis=0)
    nearly = 1e-6  # of these motions those are chosen that do not change what acts on the rod
    moving = _moving(_kernel(free, conditions, magnitudes, nearly), moved)
    keeping = moving @ _keeping_loads(equations, [Symmetry(w, parts) for w in moving.T])
    basis = _moving(_kernel(keeping, conditions, magnitudes, INVARIANT), moved)
    return [Symmetry(w, parts) for w in simplest(basis).T]


def _moving(motions: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Combinations of ``motions`` (m, n) that change free unknowns, whose changes have products ``moved`` (m, m)."""
    if motions.shape[1] == 0:
        return motions
    motions = np.linalg.qr(motions)[0]
    scale = np.diag(moved).max(initial=TINY)
    squares, combinations = np.linalg.eigh(motions.T @ (moved / scale) @ motions)
    return np.asarray(motions @ combinations[:, squares > EXACT])


def _kernel(motions: np.ndarray, conditions: np.ndarray, magnitudes: np.ndarray, exact: float) -> np.ndarray:
    """Combinations of ``motions`` (m, n) that fulfil ``conditions`` (..., m), ``exact`` relative to their terms."""
    terms = abs(motions.T) @ magnitudes
    terms = np.where(terms > 0, terms, terms.max(initial=0.0) or 1.0)
    return np.asarray(motions @ (_null_space(conditions @ motions / terms, exact) / terms[:, None]))


def _keeping_loads(equations: Equations, found: list[Symmetry]) -> np.ndarray:
    """Combinations (found, number) of symmetries that were ``found`` by which what acts on the rod does not change.

    Multipliers are zero, as they are as large as the forces of the rod.
    """
    if not found or not equations.loads:
        return np.eye(len(found))
    states = [generic_state(equations, seed, no_multipliers=True) for seed in range(len(found) + 3)]
    changes = np.array([[symmetry.change(state) for symmetry in found] for state in states])
    lengths = abs(changes / equations.fields.sizes).max(axis=(0, 2))
    lengths = np.where(lengths > 0, lengths, 1.0)
    conditions = list[np.ndarray]()
    for form in equations.loads:
        along = [_derivatives(state, form, x / lengths[:, None]) for state, x in zip(states, changes, strict=True)]
        conditions += [row / max(TINY, *(largest for _, largest in along)) for row, _ in along]
    round_off = 1e-8  # of the differences, relative to the potential
    return np.asarray(_null_space(np.array(conditions), round_off) / lengths[:, None])


def _derivatives(state: NodalValues, form: Assembler, changes: np.ndarray) -> tuple[np.ndarray, float]:
    """Derivatives of a potential of what acts on the rod along ``changes`` (m, local size), and its largest value."""
    step = 1e-3  # in natural sizes

    def at(moved: np.ndarray) -> float:
        return NodalValues(state.equations, state.local + moved, state.line).integral(form)

    values = np.array([[at(side * step * change) for side in (-2, -1, 1, 2)] for change in changes])
    return values @ [1.0, -8.0, 8.0, -1.0] / (12 * step), float(abs(values).max())


def find_motion_along(equations: Equations) -> Symmetry | None:
    """Find the motion of a closed rod along itself, with what has to go with it, on a fine mesh; None if it is none."""
    fields, parts = equations.fields, elementary_generators(equations.fields)
    none = np.zeros(len(parts))
    if equations.uniform:
        return Symmetry(none, parts, along=1.0)
    if not fields.scene.conservative:
        return None
    single = [Symmetry(row, parts) for row in np.eye(len(parts))]
    rows, held = [], []
    for seed in range(len(parts) + 8):
        # a fine mesh resolves it to round-off, nearly
        state = generic_state(equations, seed, 0.35)
        changes = np.array([*(s.change(state) for s in single), derivative(state)])
        residual = state.covector()
        row, terms = changes @ residual, abs(changes) @ abs(residual)
        rows.append(row / terms.max())
        held.append((changes[:-1] / fields.sizes)[:, _clamped(fields)].T)
    free = _null_space(np.vstack(held))
    exact, along = np.array(rows)[:, :-1] @ free, np.array(rows)[:, -1]
    # dL[derivative] + sum_j a_j dL[g_j] = 0 at all states, for one a: least squares, and its residual decides
    weights = np.linalg.lstsq(exact, -along, rcond=SLIDING)[0]
    if abs(exact @ weights + along).max() > SLIDING:
        return None
    weights = free @ weights
    return Symmetry(np.where(abs(weights) > SLIDING, weights, 0.0), parts, along=1.0)


def _null_space(rows: np.ndarray, exact: float = EXACT) -> np.ndarray:
    """Orthonormal null vectors of conditions (..., m) of size one, (m, number)."""
    if rows.shape[1] == 0:
        return np.zeros((0, 0))
    # the small factor R has the null space of all rows; zero rows below it make the decomposition a full one
    _, singular, vectors = np.linalg.svd(np.linalg.qr(np.vstack([rows, np.zeros((rows.shape[1],) * 2)]), mode="r"))
    return np.asarray(vectors[singular < exact * max(singular[0], 1.0)].T)


def _change_of_equations(state: NodalValues, back: list[Any], changes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``dF(x)[g] + A^t F(x)`` of each generator, (conditions, m), by its ``A^t``, and sums of magnitudes, (m,).

    Across the columns of the multipliers that close a ring: what these have to change by follows from the rest.
    """
    fields, residual = state.fields, state.covector()
    whole = residual.copy()  # a scalar has a copy in each cell: all of its equation
    whole[fields.copies] = residual[fields.copies].sum(axis=0)
    tangent = state.tangent()
    table = _summed(fields, np.array([tangent @ g for g in changes]), copies=True)
    table += _summed(fields, np.array([A @ whole for A in back]))
    sizes = _summed(fields, np.array([abs(tangent) @ abs(g) for g in changes]), copies=True)
    sizes += _summed(fields, np.array([abs(A) @ abs(whole) for A in back]))
    # each equation relative to its own terms: that of a place has none as large as the stiffest strain's
    largest = sizes.max(axis=1, keepdims=True)
    table, sizes, closing = (x / np.where(largest > 0, largest, 1.0) for x in (table, sizes, _closing(fields, tangent)))
    across = np.linalg.qr(closing)[0]
    table -= across @ (across.T @ table)
    return np.asarray(np.linalg.qr(table, mode="r")), np.linalg.norm(sizes, axis=0)


def _closing(fields: Fields, tangent: Any) -> np.ndarray:
    """Columns of the ``tangent`` of the multipliers that close a ring, (unknowns, number)."""
    numbers = [i for i, x in enumerate(fields.unknown_scalars) if x.group.motion is Motion.CLOSING]
    changes = np.zeros((len(numbers), len(fields.number)))
    for change, i in zip(changes, numbers, strict=True):
        change[fields.copies[:, i]] = 1.0
    return _summed(fields, np.array([tangent @ change for change in changes]).reshape(changes.shape), copies=True)


def _summed(fields: Fields, table: np.ndarray, *, copies: bool = False) -> np.ndarray:
    """Components of covectors (m, local size) along the free unknowns, (unknowns, m): without that along the load.

    A scalar has a copy in each cell; with ``copies`` each has a share of its component, else each has all of it.
    """
    free = np.flatnonzero(fields.number >= 0)
    out = np.zeros((fields.unknowns, len(table)))
    if copies:
        np.add.at(out, fields.number[free], table[:, free].T)
    else:
        out[fields.number[free]] = table[:, free].T
        out[fields.number[fields.copies[0]]] = table[:, fields.copies[0]].T
    return np.delete(out, fields.scalars[LOAD], axis=0)


def simplest(basis: np.ndarray) -> np.ndarray:
    """Basis of the same space, columns with a one where all others have a zero: plain rotations and translations."""
    rows = basis.T.copy()
    for i in range(len(rows)):
        column = int(np.argmax(abs(rows[i:]).max(axis=0) > 0.5 * abs(rows[i:]).max()))
        pivot = i + int(np.argmax(abs(rows[i:, column])))
        rows[[i, pivot]] = rows[[pivot, i]]
        rows[i] /= rows[i, column]
        others = np.arange(len(rows)) != i
        rows[others] -= np.outer(rows[others, column], rows[i])
    return np.where(abs(rows) > 1e-9, rows, 0.0).T  # the rest is round-off of the elimination


def _clamped(fields: Fields) -> np.ndarray:
    """Local degrees of freedom that an end holds, or that a planar rod does without."""
    dofs = [d.ravel() for d in fields.dofs.values()]
    used = np.unique(np.concatenate(dofs))
    return used[fields.number[used] < 0]


def generic_state(equations: Equations, seed: int, decay: float = 0.6, *, no_multipliers: bool = False) -> NodalValues:
    """Generic state with a random load: the same on any number of ranks, ends held.

    Values are functions of the place along the rod, not of the numbering, with all Fourier coefficients, of which each
    is smaller than the one before by the ratio ``decay``: whatever function of the arclength a load is, it does work.
    Those of a ring are closed: whether a pressure is felt by a translation, say, only shows there.
    """
    fields, scene = equations.fields, equations.fields.scene
    values, part = derived(equations, ("generic values", seed, decay), lambda: _generic_values(fields, seed, decay))
    low, high = sorted(scene.span)
    local = fields.sizes * fields.filled(values)
    local[fields.copies[:, -1]] = low + (high - low) * part
    local[fields.multipliers & no_multipliers] = 0.0
    for size in (1.0, 0.1, 0.01, 1e-3):  # of displacements: a barrier admits no large ones
        moved = local.copy()
        moved[fields.dofs.get("r", [])] *= size
        state = NodalValues(equations, moved, equations.line)
        loads = sum(state.integral(form) for form in equations.loads)
        if fields.comm.allreduce(bool(np.isfinite(loads) and np.isfinite(state.covector()).all()), op=MPI.LAND):
            break
    return state


def _generic_values(fields: Fields, seed: int, decay: float) -> tuple[dict[str, Any], float]:
    """Values of a generic state by name, without units, and where in its range the load is: whatever the constants."""
    rng, scene, named = np.random.default_rng(seed), fields.scene, dict[str, Any]()
    for block in fields.blocks:
        x = (fields.coordinates(block.degree) - scene.interval[0]) / scene.length
        named[block.name] = _generic(fields, block, x[..., None], rng, decay)
    named |= {unknown.name: rng.normal() for unknown in fields.unknown_scalars}
    return named, float(rng.uniform(0.1, 0.9))


def _generic(fields: Fields, block: Block, x: np.ndarray, rng: np.random.Generator, decay: float) -> np.ndarray:
    """Values of a field at places ``x`` (..., 1) in [0, 1]: periodic for a ring, but for what its closure asks for."""
    scene, closed = fields.scene, fields.scene.closed

    def wave() -> np.ndarray:
        a, b, w, p = rng.normal(size=(4, block.size))
        turn = (2 * np.pi if closed else 2.1) * (x - p)
        kernel = (np.cos(turn) - decay) / (1 - 2 * decay * np.cos(turn) + decay**2)
        return np.asarray(0.5 * (a + b * kernel + w * np.sin(turn)) + (0.0 if closed else 0.3 * p * x**2))

    values, ahead = wave(), of_vector(scene.sides[1].turn * x * np.array([0.0, 0.0, 1.0]))
    if block.name == "q":
        values = product(fields.turning.normalised(_rotated(scene, values, wave, x, rng)), ahead)
    if block.name == fields.turning.name:
        return _turned(fields, values, x)
    if block.name == "v":
        values = 0.1 * values + [1.0 if i == 2 else 0.0 for i in scene.free_strains]
        return (values[..., None, :] @ directors(ahead))[..., 0, :] if block.size == 3 else np.asarray(values)
    return values


def _rotated(
    scene: Scene, values: np.ndarray, wave: Callable[[], np.ndarray], x: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Quaternions at ``x``, not of length one, that are far from zero: ``values`` about one direction."""
    u, v = np.linalg.qr(rng.normal(size=(4, 2)))[0].T
    clamps = [end.fixed_rotation for end in scene.sides if end.fixed_rotation is not None]
    u = np.array(clamps[0]) if clamps else u  # far from a clamp a rotation would come to it in a jump
    if scene.sides[1].sign >= 0:
        return np.asarray(u + 0.3 * values)
    return np.asarray((u + 0.3 * values) * np.cos(np.pi * x) + (v + 0.3 * wave()) * np.sin(np.pi * x))


def _turned(fields: Fields, values: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Rotations (..., size) that are those of clamps at the ends: a jump there would be a curvature without bound."""
    scene, turning = fields.scene, fields.turning
    if scene.closed:
        if turning.name == "q":
            return values
        first, last = turning.start(scene.start, np.array(scene.interval), scene.interval)
        return np.asarray(values + (last - first) * x)
    for end, s, at_end in zip(scene.sides, scene.interval, ((1 - x) ** 3, x**3), strict=True):
        if end.fixed_rotation is not None:
            clamp = turning.clamp(end.fixed_rotation, scene.start, s, scene.interval)
            values = (1 - at_end) * values + at_end * clamp
    return turning.normalised(values)
