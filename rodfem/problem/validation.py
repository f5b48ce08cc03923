"""Validation of a scene before any computation: each check raises one sentence."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from keyword import iskeyword
from math import isfinite
from numbers import Real
from reprlib import Repr
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.errors import InputError, SceneError
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.problem.attachment import Attachment
from rodfem.problem.constraint import Constraint
from rodfem.problem.end import SIDES, End
from rodfem.problem.kinds import check_scalar, number_of, real, reals
from rodfem.problem.local_state import (
    STATES,
    asked_for,
    asks_where,
    floats,
    functions_of_places,
    some_places,
)
from rodfem.problem.results import check_expression, check_results, check_same
from rodfem.problem.roles import Role, functions_of, is_object
from rodfem.problem.symbols import check_expressions
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

SHORT = Repr()
LARGEST, TINIEST = 1e60, 1e-60
"""Lengths, widths of ranges and stiffnesses whose powers are floats."""
EPS, FELT = float(np.finfo(float).eps), 1e-3
"""Round-off of a strain, and what of it is felt in bending, relative."""
FLEXIBLE = "choose a kind of rod without the stiff strains"
SOFTEST, STIFFEST = 1e-8, 1e-15
"""Least stiffness over the greatest one, of bending and twist, and of all strains with the rod's length as unit."""
GIVEN = re.compile(r"branch \d+(\.\d+)*|detached( \d+(\.\d+)*)?|found \d+ at .*")
"""Names that branches are given as they are found."""


def check_kinds(scene: Scene) -> None:
    """Check the kind of all that a scene is made of; raises :class:`SceneError`."""
    check_file_name("scene", scene.name)
    if scene.states is not None:
        check_file_name("first branch, states,", scene.states)
        if GIVEN.fullmatch(scene.states):
            raise SceneError(
                f"The first branch, states, has the name {scene.states!r}, which others are given: choose another, as "
                "'straight'."
            )
    if not isinstance(scene.title, str):
        raise SceneError(f"The title is {scene.title!r}: give a text.")
    if (
        not isinstance(scene.ends, Iterable)
        or isinstance(scene.ends, Iterator)
        or [isinstance(end, End) for end in scene.ends] != [True, True]
    ):
        raise SceneError("The ends are not two of the kind End: give them as in (clamped(), free()), or a Ring().")
    for what, given, kind, example in (
        ("attachments", scene.attachments, Attachment, "(Attachment(0.5, force=...),)"),
        ("constraints", scene.constraints, Constraint, "(at(1.0, lambda x, c: x.r[0]),)"),
        ("breaks", scene.breaks, Real, "(0.5,)"),
    ):
        if not (isinstance(given, (tuple, list)) and all(isinstance(x, kind) for x in given)):
            raise SceneError(f"The {what} are {given!r}: give a tuple of them, as in {what}={example}.")
    if not isinstance(scene.parameters, Mapping):
        raise SceneError(f"The parameters are {scene.parameters!r}: give a dictionary, as in {{'P': Parameter(0.0)}}.")
    for name, parameter in scene.parameters.items():
        check_parameter(name, parameter)
    if not (is_object(scene.inertia) and hasattr(scene.inertia, "rho_A") and hasattr(scene.inertia, "rho_I")):
        call = ", or call it if it is a method" if callable(scene.inertia) else ""
        raise SceneError(f"The inertia is {scene.inertia!r}: give one, as in Inertia(rho_A=lambda c: 1.0){call}.")
    if not (is_object(scene.ordinate) and hasattr(scene.ordinate, "places")):
        raise SceneError(f"The ordinate is {scene.ordinate!r}: give an Ordinate(name, s, of).")
    for what, words in (
        ("name", scene.ordinate.name), ("label", scene.ordinate.label), ("unit", scene.ordinate.unit),
    ):  # fmt: skip
        if not isinstance(words, str):
            raise SceneError(f"The {what} of the ordinate is {words!r}: give a text.")
    check_places_are_numbers(scene)
    for what, function, role in functions_of(scene):
        if not callable(function):
            raise SceneError(f"The {what} is {function!r}: give a function {role.call}{_as_function(function, role)}.")
        try:
            inspect.signature(function).bind(*range(role.arguments))
        except (TypeError, ValueError):  # ValueError for classes of Python's own, which have no signature
            meanings = f", where {role.meanings}" if role.meanings else ""
            raise SceneError(
                f"The {what} is no function of {role.arguments} argument(s): give {role.call}{meanings}."
            ) from None


def _as_function(value: Any, role: Role) -> str:
    """How a function of the constants that returns a ``value`` is written; how that of a cross-section is found."""
    if role.call == "f(c)" and (len(value) == role.size if isinstance(value, tuple | list) else role.size == 0):
        return f", as in lambda c: {value!r}"
    return ", as section.energy(rod) is" if callable(getattr(value, "energy", None)) else ""


def check_parameter(name: object, parameter: Any) -> None:
    """Raise :class:`SceneError` for a parameter whose name, value, label, words, unit or bounds make no sense."""
    if not isinstance(name, str) or not name.isidentifier() or iskeyword(name) or name == "s" or name.startswith("__"):
        raise SceneError(f"A parameter cannot have the name {name!r}: choose another (s is the arclength).")
    value = getattr(parameter, "value", parameter)
    texts = [getattr(parameter, text, "") for text in ("label", "words", "unit")]
    try:
        real(name, value, 0.0)
    except InputError:
        if value is not parameter:
            raise SceneError(
                f"The value of the parameter {name} is {value!r}: give a number first, as in Parameter(1.0, 'P')."
            ) from None
    try:
        real(name, value, 0.0)
        bounds = reals(name, getattr(parameter, "admissible", (0.0, 1.0)), (0.0, 1.0), 2)
    except InputError:
        bounds = ()
    if not bounds or not all(isinstance(text, str) for text in texts):
        raise SceneError(
            f"The parameter {name} is {SHORT.repr(parameter)}: give a number or a Parameter, as in Parameter(1.0, 'P')."
        )


def two_numbers(what: str, pair: Any) -> tuple[float, float]:
    """Return a pair as floats; raises :class:`SceneError` for anything but two numbers."""
    try:
        low, high = reals(what, pair, (0.0, 1.0), 2)
    except InputError:
        raise SceneError(f"{what} is {SHORT.repr(pair)}: give two numbers, as in (0.0, 1.0).") from None
    return low, high


def check_file_name(whose: str, name: object) -> None:
    """Raise :class:`SceneError` for a name that cannot be that of a folder, or of an entry of a file."""
    if not isinstance(name, str) or name in ("", ".", "..") or not writes(name):
        raise SceneError(
            f"The {whose} has the name {name!r}: give a text without slashes, as it names folders and entries of files."
        )


def writes(name: str) -> bool:
    """Whether a name can be written as that of a file."""
    return not any(c in name for c in "/\\\0\n") and not any("\ud800" <= c <= "\udfff" for c in name)


def check_places_are_numbers(scene: Scene) -> None:
    """Raise :class:`SceneError` for an arclength that is no finite number."""
    places = [("ordinate", s) for s in getattr(scene.ordinate, "places", ())]
    places += [("attachment", x.s) for x in scene.attachments] + [("break", s) for s in scene.breaks]
    for what, s in [*places, *(("constraint", x.s) for x in scene.constraints if x.s is not None)]:
        if not isinstance(s, Real) or isinstance(s, bool) or not isfinite(s):
            raise SceneError(f"The {what} is at s = {s!r}: give an arclength, one number.")


def check_load(scene: Scene) -> None:
    """Raise :class:`SceneError` where nothing in the scene depends on its load: there is nothing to trace."""
    if scene.load not in asked_for(scene):
        raise SceneError(
            f"Nothing in the scene depends on its load {scene.load!r}: use c.{scene.load} in an end, a load or the "
            "energy, or choose another load."
        )


def check_ordinate(scene: Scene) -> None:
    """Raise :class:`SceneError` where the ordinate is no number, at states where it need not be defined."""
    if not scene.ordinate.places:
        along = some_places(scene, wrap=ufl.variable)[True]
        check_expression("ordinate along the rod", scene.ordinate.of(along, scene.constants()))
        return
    values = []
    for q, r, *_ in STATES:
        try:
            values.append([scene.ordinate.of(np.array(r) * scene.length, np.array(q, dtype=float)) for _ in range(2)])
        except SceneError as trouble:
            if isinstance(trouble.__cause__, (TypeError, LookupError, AttributeError, NameError)):
                raise
    for first, second in values:
        check_same("ordinate", first, second)
    if values and not any(isfinite(first) for first, _ in values):
        raise SceneError(f"The ordinate is {values[0][0]} whatever the state: return a finite number.")


def check_start(scene: Scene) -> None:
    """Check that the start returns quaternions, of rotations in the plane; raises :class:`SceneError`."""
    if scene.start is None:
        return
    s = np.linspace(*scene.interval, 5)
    q = scene.start(s)
    check_same("start", q, scene.start(s))
    if q.shape != (5, 4):
        raise SceneError(f"The start has the shape {q.shape} at 5 arclengths: return a quaternion for each, (5, 4).")
    if not (np.isfinite(q).all() and (np.linalg.norm(q, axis=1) > 0).all()):
        raise SceneError("The start is no rotation everywhere: return quaternions of unit norm.")
    if scene.normal is not None and abs(np.delete(q[:, 1:], scene.normal, axis=1)).max() > NEGLIGIBLE:
        raise SceneError(f"The start leaves the plane across {scene.planar}: turn about that axis only.")


def check_energy(scene: Scene) -> None:
    """Check that the stored energy is a scalar."""
    v, k = ufl.as_vector(UNDEFORMED), ufl.as_vector([0.0, 0.0, 0.0])
    check_scalar("stored energy", scene.energy(v, k, scene.constants()))


def check_inertia(scene: Scene) -> None:
    """Raise :class:`SceneError` for a negative inertia, or none where stability is a matter of motion.

    One that depends on the load is checked at several loads of the range.
    """
    for load in (None, *scene.loads()) if scene.inertia_depends_on_load else (None,):
        if trouble := trouble_with_inertia(scene, load):
            raise SceneError(trouble)


def trouble_with_inertia(scene: Scene, load: float | None) -> str:
    """Sentence on a mass or a rotary inertia at a ``load``, None for the scene's own, that cannot be; empty for none.

    A rod under loads without a potential has an inertia.
    """
    masses, rotary = _inertia_at(scene, load)
    there = "" if load is None else f" at {scene.load} = {load:g}"
    if min(masses + rotary) < 0:
        remedy = (
            "give zero or more" if load is None else f"give zero or more, or a range of {scene.load} in which it is"
        )
        return f"A mass or rotary inertia of {min(masses + rotary):g}{there} is negative: {remedy}."
    largest = max(masses + rotary)  # what is much less is none
    if largest and not TINIEST < largest < LARGEST:
        return f"A mass or rotary inertia of {largest:g}{there} has powers that are no floats: use other units."
    given = max(masses + rotary) > 0 and scene.inertia != type(scene.inertia)()
    if scene.conservative or max(masses) > 0 or given:
        return ""
    return (
        f"The scene has a load without potential ({scene.without_potential()[0]}): its stability is a matter "
        f"of motion, so give it an inertia{there}, as in inertia=Inertia(rho_A=lambda c: 1.0)."
    )


def _inertia_at(scene: Scene, load: float | None) -> tuple[list[float], list[float]]:
    """Masses and rotary inertias of a scene at a ``load``, by default its own: of the rod at its samples."""
    c, along = scene.constants(load), [scene.constants(load, s) for s in scene.samples()]
    carried = [float(x.mass(c)) for x in scene.attachments if x.mass]
    turned = [float(y) for x in scene.attachments if x.rotary_inertia for y in x.rotary_inertia(c)]
    carried += [number_of(scene.inertia.rho_A(there)) for there in along]
    turned += [number_of(x) for there in along for x in scene.inertia.rho_I(there)]
    return carried, turned


def check_scene(scene: Scene) -> None:
    """Check supports, places and the stored energy; raises :class:`~rodfem.errors.SceneError`."""
    if scene.planar not in (None, "e1", "e2"):
        raise SceneError(f"A rod cannot be planar across {scene.planar!r}: choose 'e1' or 'e2', or None for space.")
    check_energy(scene)
    _ = scene.tables
    check_places(scene)
    check_results(scene)
    check_expressions(scene)
    check_start(scene)
    check_supports(scene)
    check_convexity(scene)
    check_inertia(scene)
    check_ordinate(scene)


def check_convexity(scene: Scene) -> None:
    """Raise :class:`SceneError` where the stored energy is not strictly convex at the undeformed state."""
    for s in scene.samples() if scene.depends_on_s() else [None]:
        where = "" if s is None else f" at s = {s:g}"
        try:
            stiffness = scene.stiffness(s)
        except (ArithmeticError, ValueError):  # of a root or a logarithm whose derivative has a pole there
            stiffness = np.full((3, 3), np.nan)
        except TypeError as trouble:  # of float(), for a complex number
            raise SceneError(f"The stored energy is no real number{where}: leave complex numbers out.") from trouble
        if not np.isfinite(stiffness).all():
            raise SceneError(
                f"The second derivative of the stored energy at the undeformed state is not finite{where}: choose "
                "constants for which it is."
            )
        if not stiffness.any():
            raise SceneError(
                f"The stored energy is flat at the undeformed state{where}: write it as a function of the strains v "
                "and k whose second derivative there is not zero, with UFL (ufl.cosh), without math and numpy."
            )
        if not TINIEST / scene.length**2 < abs(stiffness).max() < LARGEST / scene.length**2:
            raise SceneError(
                f"The stiffness of {abs(stiffness).max():.3g}{where} is so far from one that its powers are no floats: "
                "choose other units."
            )
        balanced = in_lengths(stiffness, scene)
        if not is_definite(balanced):
            raise SceneError(
                f"The stored energy is not convex{where}: its second derivative at the undeformed state has the "
                f"eigenvalue {np.linalg.eigvalsh(stiffness)[0]:.3g}; choose constants for which all are positive."
            )
        strains, coupling = balanced[:-3, :-3], balanced[:-3, -3:]
        # stiff strains hide no bending, but bending and twist, with the strains that go with them, must be comparable
        relaxed: np.ndarray = balanced[-3:, -3:] - coupling.T @ np.linalg.solve(strains, coupling)
        for values, least in ((np.linalg.eigvalsh(relaxed), SOFTEST), (np.linalg.eigvalsh(balanced), STIFFEST)):
            if values[0] <= least * values[-1]:
                raise SceneError(
                    f"The stored energy is convex, but for round-off{where}: with the rod's length as unit its second "
                    f"derivative at the undeformed state has eigenvalues from {values[0]:.3g} to {values[-1]:.3g}; "
                    f"{FLEXIBLE}, or constants that are nearer to each other."
                )


def in_lengths(stiffness: np.ndarray, scene: Scene) -> np.ndarray:
    """Stiffness with the rod's length as unit: that of bending is beside that of strains, which have no unit."""
    units = np.where(np.arange(len(stiffness)) < len(stiffness) - 3, 1.0, 1.0 / scene.length)
    return np.asarray(units[:, None] * stiffness * units)


def round_off_of_strains(scene: Scene) -> str:
    """How stiff the strains of a rod are whose round-off is felt in bending; empty for any other rod."""
    values = np.linalg.eigvalsh(in_lengths(scene.stiffness(), scene))
    ratio = values[-1] / values[0]
    if ratio * EPS < FELT:
        return ""
    return f"Shear or stretch is {ratio:.0e} times as stiff as bending, and its round-off {ratio * EPS:.0e} of bending"


def is_definite(matrix: np.ndarray) -> bool:
    """Whether a symmetric matrix is positive definite, by its eigenvalues after scaling to a unit diagonal.

    So stiffnesses may differ by any factor: a stretch 1e14 times as stiff as bending hides no eigenvalue of bending.
    """
    diagonal = matrix.diagonal()
    if not (diagonal > 0.0).all():
        return False
    roots = np.sqrt(diagonal)
    return bool(matrix.size == 0 or np.linalg.eigvalsh(matrix / roots[:, None] / roots)[0] > NEGLIGIBLE)


def check_supports(scene: Scene) -> None:
    """Check shapes, whether anything holds the rod, and whether the ends can be where they are asked to be."""
    for side, end in zip(SIDES, scene.sides, strict=True):
        end.check(side, scene)
    check_drift(scene)
    check_reach(scene)


def check_drift(scene: Scene) -> None:
    """Raise :class:`SceneError` where the rod is held, but not in all directions in which it can be moved.

    One that nothing holds may float if the forces on its ends balance.  Whether loads along it do, the equations tell.
    """
    c = scene.constants()
    if floats(scene):
        check_balance(scene)
    if scene.closed or any(asks_where(f, c) for _, f, _ in functions_of_places(scene)):
        return
    held = np.vstack([np.zeros(3), *(end.fixed(c) for end in scene.sides)])
    if not held.any():
        return
    for i, direction in enumerate(np.eye(3)):
        if np.linalg.matrix_rank(np.vstack([held, direction])) > np.linalg.matrix_rank(held):
            raise SceneError(
                f"The rod can drift away along e{i + 1}: hold that component of the position at one end at least, "
                "or attach a spring."
            )


def check_balance(scene: Scene) -> None:
    """Raise :class:`SceneError` where dead forces on the ends of a rod that nothing holds do not add up to zero."""
    along = [x for x in scene.attachments if x.force]
    if along or scene.distributed is not None or not scene.conservative:
        return
    for load in scene.loads():
        c = scene.constants(load)
        forces = np.array([[float(x) for x in end.force(c)] for end in scene.sides if end.force] or np.zeros((1, 3)))
        total = forces.sum(axis=0)
        if abs(total).max() > NEGLIGIBLE * abs(forces).max():
            raise SceneError(
                f"At {scene.load} = {load:g} the forces on the ends add up to {(total + 0.0).tolist()}, and nothing "
                "holds the rod against that: hold an end, attach a spring, or let the forces balance."
            )


def check_reach(scene: Scene) -> None:
    """Raise :class:`SceneError` where the ends of an inextensible rod are farther apart than it is long."""
    if 2 in scene.free_strains or 0 in scene.free_strains:
        return
    for load in scene.loads():
        left, right = (end.held(scene.constants(load)) for end in scene.sides)
        if None not in left and None not in right:
            distance = sum((float(b) - float(a)) ** 2 for a, b in zip(left, right, strict=True)) ** 0.5
            if distance > scene.length * (1 + NEGLIGIBLE):
                raise SceneError(
                    f"At {scene.load} = {load:g} the ends are {distance:.6g} apart, but the rod is inextensible "
                    f"and only {scene.length:.6g} long: let it stretch, or move the ends together."
                )


def check_places(scene: Scene) -> None:
    """Raise :class:`SceneError` for attachments, constraints and breaks that are not on the rod, or for empty ones."""
    a, b = scene.interval
    for x in scene.attachments:
        if all(getattr(x, field.name) is None for field in fields(x) if field.name != "s"):
            raise SceneError(
                f"Nothing is attached at s = {x.s:g}: give the attachment a force, a follower force, an energy, a mass "
                f"or a rotary inertia; a joint of two elements is breaks=({x.s:g},)."
            )
    places = [("attachment", x.s) for x in scene.attachments] + [("break", s) for s in scene.breaks]
    places += [("constraint", x.s) for x in scene.constraints if x.s is not None]
    for what, s in places:
        if not a <= s <= b:
            raise SceneError(f"The {what} at s = {s:g} is not on the rod: choose {a:g} <= s <= {b:g}.")
