"""Validation of a scene before any computation: each check raises one sentence."""

from __future__ import annotations

from itertools import pairwise
from math import isfinite
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from rodfem.errors import SceneError
from rodfem.problem.arguments import number_of
from rodfem.problem.functions import PLACES, SIDES, STATES
from rodfem.problem.trials import asked_for, check_functions, check_plane, expressions_of, floats, is_placed
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

FLEXIBLE = "choose a kind of rod without the stiff strains"
SOFTEST, STIFFEST = 1e-8, 1e-15
"""Least stiffness over the greatest one, of bending and twist, and of all strains with the rod's length as unit."""
NEXT = 1e-6  # least distance of two places, over the length: an element between them loses as many digits


def check_scene(scene: Scene) -> None:
    """Check places, functions, supports and the stored energy; raises :class:`~rodfem.errors.SceneError`."""
    if scene.planar not in (None, "e1", "e2"):
        raise SceneError(f"A rod cannot be planar across {scene.planar!r}: choose 'e1' or 'e2', or None for space.")
    check_places(scene)
    try:
        check_functions(scene)
        _ = scene.tables  # they cover what they are needed for
        check_convexity(scene)
    except RecursionError:
        deep = "A function of the scene has conditionals nested deeper than UFL can follow"
        raise SceneError(f"{deep}: give a table, as in rodfem.tabulated(s, values), or fewer of them.") from None
    check_start(scene)
    for side, end in zip(SIDES, scene.sides, strict=True):
        end.check(side, scene)
    for check in (check_drift, check_reach, check_inertia, check_plane):
        check(scene)
    if (values := ordinates(scene)) and not any(map(isfinite, values)):
        raise SceneError(f"The ordinate is {values[0]} whatever the state: return a finite number.")


def check_inertia(scene: Scene) -> None:
    """Raise :class:`SceneError` for masses that cannot be, at any load, and for one that is attached to drag."""
    heavy = [x.s for x in scene.attachments if x.mass or x.rotary_inertia]
    if heavy and scene.inertia.order == 1:
        raise SceneError(f"A mass is attached at s = {heavy[0]:g} to a rod with drag: leave it out or give an Inertia.")
    for load in (None, *scene.loads()) if scene.inertia_depends_on_load else (None,):
        if trouble := trouble_with_inertia(scene, load):
            raise SceneError(trouble)


def check_load(scene: Scene) -> None:
    """Raise :class:`SceneError` where nothing in the scene depends on its load: there is nothing to trace."""
    if scene.load not in asked_for(scene):
        use = f"use c.{scene.load} in an end, a load or the energy, or choose another load"
        raise SceneError(f"Nothing in the scene depends on its load {scene.load!r}: {use}.")


def _places(scene: Scene) -> list[tuple[str, float]]:
    """Places where elements meet, each with what is there."""
    found = [("break", s) for s in scene.breaks] + [("attachment", x.s) for x in scene.attachments]
    for x in scene.constraints:
        found += [("end of a tendon" if x.s is None else "constraint", s) for s in x.places]
    return found


def check_places(scene: Scene) -> None:
    """Raise :class:`SceneError` for a place that is not on the rod, or next to another one or an end, but not there."""
    (a, b), places = scene.interval, _places(scene)
    for what, s in [*places, *(("ordinate", s) for s in scene.ordinate.places)]:
        if not a <= s <= b:
            raise SceneError(f"The {what} at s = {s:g} is not on the rod: choose {a:g} <= s <= {b:g}.")
    for (one, here), (other, there) in pairwise(sorted([("end", a), *places, ("end", b)], key=itemgetter(1))):
        if NEGLIGIBLE < (there - here) / scene.length < NEXT:
            raise SceneError(
                f"The {one} at s = {here:.12g} and the {other} at s = {there:.12g} are {there - here:.1g} apart, with "
                f"an element between them: give one place, or two that are {NEXT * scene.length:g} apart."
            )


def ordinates(scene: Scene) -> list[float]:
    """Values of an ordinate at a point in the trial states in which it has one; raises :class:`SceneError`."""
    values = []
    for q, r, *_ in STATES if scene.ordinate.places else ():
        try:
            values.append(scene.ordinate.of(np.array(r) * scene.length, np.array(q, dtype=float)))
        except SceneError as trouble:
            if isinstance(trouble.__cause__, (TypeError, LookupError, AttributeError, NameError)):
                raise
    return values


def statement(scene: Scene) -> str:
    """Numbers, expressions and trial ordinates of a scene, in which two that state one rod agree."""
    numbers = (scene.name, scene.interval, scene.rod, scene.parameters, scene.load, scene.span, scene.breaks)
    places = [part.s for part in scene.parts]
    return repr((numbers, scene.planar, places, ordinates(scene), list(map(str, expressions_of(scene)))))


def check_start(scene: Scene) -> None:
    """Check that the start has rotations, in the plane."""
    if scene.start is None:
        return
    q = scene.start(np.linspace(*scene.interval, PLACES))
    if q.shape != (PLACES, 4):
        raise SceneError(f"The start has the shape {q.shape}: return a quaternion for each arclength, ({PLACES}, 4).")
    if not (np.isfinite(q).all() and (np.linalg.norm(q, axis=1) > 0).all()):
        raise SceneError("The start is no rotation everywhere: return quaternions of unit norm.")
    if scene.normal is not None and abs(np.delete(q[:, 1:], scene.normal, axis=1)).max() > NEGLIGIBLE:
        raise SceneError(f"The start leaves the plane across {scene.planar}: turn about that axis only.")


def trouble_with_inertia(scene: Scene, load: float | None) -> str:
    """Sentence on a mass or a rotary inertia that cannot be, at a ``load`` or the scene's own; empty for none."""
    masses, rotary = _inertia_at(scene, load)
    least, largest = min(masses + rotary), max(masses + rotary)
    there = "" if load is None else f" at {scene.load} = {load:g}"
    if least < 0:
        remedy = "" if load is None else f", or a range of {scene.load} in which it is"
        return f"A mass or rotary inertia of {least:g}{there} is negative: give zero or more{remedy}."
    given = largest > 0 and scene.inertia != type(scene.inertia)()
    if scene.conservative or max(masses) > 0 or given:
        return ""
    return (
        f"The scene has a load without potential ({scene.without_potential()[0]}): its stability is a matter "
        f"of motion, so give it an inertia{there}, as in inertia=Inertia(rho_A=lambda c: 1.0)."
    )


def _inertia_at(scene: Scene, load: float | None) -> tuple[list[float], list[float]]:
    """Masses and rotary inertias of a scene at a ``load``, by default its own: of the rod at its samples."""
    c, along = scene.constants(load), [scene.constants(load, s) for s in scene.samples()]
    masses = [float(x.mass(c)) for x in scene.attachments if x.mass]
    masses += [number_of(scene.inertia.rho_A(there)) for there in along]
    rotary = [float(y) for x in scene.attachments if x.rotary_inertia for y in x.rotary_inertia(c)]
    rotary += [number_of(x) for there in along for x in scene.inertia.others(there)]
    return masses, rotary


def check_convexity(scene: Scene) -> None:
    """Raise :class:`SceneError` if the stored energy is not strictly convex at the undeformed state."""
    for s in scene.samples() if scene.energy_depends_on("s") else [None]:
        where = "" if s is None else f" at s = {s:g}"
        try:
            stiffness = scene.stiffness(s)
        except (ArithmeticError, ValueError):  # of a root or a logarithm whose derivative has a pole there
            stiffness = np.full((3, 3), np.nan)
        if trouble := _trouble_with_stiffness(scene, stiffness):
            raise SceneError(trouble.format(where))


def _trouble_with_stiffness(scene: Scene, stiffness: np.ndarray) -> str:
    """Sentence on a second derivative of the energy that no rod has, with ``{}`` for the place; else empty."""
    if not np.isfinite(stiffness).all():
        return "The second derivative of the stored energy is not finite at the undeformed state{}: change constants."
    largest = abs(stiffness).max()
    if not largest:
        return "The stored energy is flat at the undeformed state{}: write it with UFL (ufl.cosh), in v and k."
    balanced = in_lengths(stiffness, scene)
    roots = np.sqrt(abs(balanced.diagonal()))
    roots[roots == 0.0] = 1.0
    # scaled to a unit diagonal: stiff strains hide no bending
    if not np.linalg.eigvalsh(balanced / roots[:, None] / roots)[0] > NEGLIGIBLE:
        least = np.linalg.eigvalsh(stiffness)[0]
        return f"The stored energy is not convex{{}}: its eigenvalue {least:.3g} is not positive; change constants."
    strains, coupling = balanced[:-3, :-3], balanced[:-3, -3:]
    # stiff strains hide no bending, but bending and twist, with the strains that go with them, must be comparable
    relaxed: np.ndarray = balanced[-3:, -3:] - coupling.T @ np.linalg.solve(strains, coupling)
    for values, least in ((np.linalg.eigvalsh(relaxed), SOFTEST), (np.linalg.eigvalsh(balanced), STIFFEST)):
        if values[0] <= least * values[-1]:
            ratio = f"eigenvalues from {values[0]:.3g} to {values[-1]:.3g} of its second derivative, the length as unit"
            return f"The stored energy is convex, but for round-off{{}}: {ratio}; {FLEXIBLE}, or change constants."
    return ""


def in_lengths(stiffness: np.ndarray, scene: Scene) -> np.ndarray:
    """Stiffness with the rod's length as unit: that of bending stands next to that of strains, which have no unit."""
    units = np.where(np.arange(len(stiffness)) < len(stiffness) - 3, 1.0, 1.0 / scene.length)
    return np.asarray(units[:, None] * stiffness * units)


def round_off_of_strains(scene: Scene) -> str:
    """How stiff the strains of a rod are whose round-off is felt in bending; empty for any other rod."""
    values = np.linalg.eigvalsh(in_lengths(scene.stiffness(), scene))
    ratio = values[-1] / values[0]
    felt = ratio * float(np.finfo(float).eps)
    if felt < 1e-3:  # of bending
        return ""
    return f"Shear or stretch is {ratio:.0e} times as stiff as bending, and its round-off {felt:.0e} of bending"


def check_drift(scene: Scene) -> None:
    """Raise :class:`SceneError` where the rod is held, but not in all directions; one that nothing holds may float."""
    c = scene.constants()
    if floats(scene):
        check_balance(scene)
    if scene.closed or is_placed(scene):
        return
    held = np.vstack([np.zeros(3), *(end.fixed(c) for end in scene.sides)])
    for i, direction in enumerate(np.eye(3) if held.any() else ()):
        if np.linalg.matrix_rank(np.vstack([held, direction])) > np.linalg.matrix_rank(held):
            raise SceneError(f"The rod can drift away along e{i + 1}: hold that component, or attach a spring.")


def check_balance(scene: Scene) -> None:
    """Raise :class:`SceneError` where dead forces on the ends of a rod that nothing holds do not add up to zero."""
    if any(x.force for x in scene.attachments) or scene.distributed is not None or not scene.conservative:
        return
    for load in scene.loads():
        c = scene.constants(load)
        forces = np.array([end.force(c) if end.force else (0.0, 0.0, 0.0) for end in scene.sides], dtype=float)
        total = forces.sum(axis=0)
        if abs(total).max() > NEGLIGIBLE * abs(forces).max():
            what = f"At {scene.load} = {load:g} the forces on the ends add up to {(total + 0.0).tolist()}"
            raise SceneError(f"{what}, and nothing holds the rod against that: hold an end, or let the forces balance.")


def check_reach(scene: Scene) -> None:
    """Raise :class:`SceneError` where the ends of an inextensible rod are farther apart than it is long."""
    if 2 in scene.free_strains or 0 in scene.free_strains:
        return
    for load in scene.loads():
        left, right = (end.support(scene.constants(load)) for end in scene.sides)
        if None not in left and None not in right:
            distance = sum((float(b) - float(a)) ** 2 for a, b in zip(left, right, strict=True)) ** 0.5
            if distance > scene.length * (1 + NEGLIGIBLE):
                what = f"At {scene.load} = {load:g} the ends are {distance:.6g} apart, but the rod is inextensible"
                raise SceneError(f"{what} and only {scene.length:.6g} long: let it stretch, or move the ends together.")
