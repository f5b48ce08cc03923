r"""Modes: the motion of the rod in its left-most eigenvectors, and their amplitudes in a measured motion.

A mode is a motion ``(u, w)`` of the rod: displacement and infinitesimal rotation along it, in the space frame, with its
eigenvalue ``mu``.  It has unit kinetic energy, ``int rhoA u.u + w.(rhoI) w ds = 1`` (a symmetry that moves nothing with
inertia: unit size in the metric of rotations), so that its amplitude ``a(t)`` in a small motion of the rod obeys ::

    a'' + mu a = f(t),        f = sum (force . u + moment . w),

whatever the scene's inertia is.  For feedback one needs ``a`` and the gain ``f``: the *weights* of a mode are the
mass times its left eigenvector, one vector for displacements and one for rotations at each node, such that ::

    a = sum over nodes of (weight_displacement . displacement + weight_rotation . rotation)

for every small motion, and nothing of the other modes.  Without potential (follower loads) the pencil has left
eigenvectors of its own: ``f`` is taken with ``left_displacement``, ``left_rotation``; else these are ``u, w``.  A
complex pair of eigenvalues is one complex mode, of the one with positive imaginary part; the other is its conjugate.

Symmetry modes, whose eigenvalue is zero for a reason, come after the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from rodfem.errors import InputError
from rodfem.file_format import MODES
from rodfem.problem.arguments import checked, text, whole
from rodfem.problem.arguments import path as argument_path
from rodfem.problem.quaternions import directors
from rodfem.whole_files import with_added, write_whole

SYMMETRY, RIGID = "symmetry", "rigid motion"
"""Names of the motion in a symmetry mode, and in one of a rod that nothing holds, under loads without a potential."""
TYPICAL = "modes"
"""Group of a branch in ``states.h5`` that has modes at a few of its states, one state a row of each array."""
FIELDS = ("value", "residual", "error", "displacement", "rotation", "rotation_body")
LEFT = ("left_displacement", "left_rotation", "weight_displacement", "weight_rotation")


def exponent(mu: complex, rates: bool) -> complex:
    """Exponent ``a`` of motions ``exp(a t)`` of an eigenvalue ``mu = omega^2``, or of ``rates`` of decay."""
    return -mu if rates else complex(np.sqrt(-mu))


@dataclass(frozen=True, repr=False)
class Modes:
    """Modes of one state, K of them, at the m nodes of the mesh; nondimensional, or in the units of the scene.

    Motions are in the space frame, (K, m, 3).
    """

    load: float
    s: np.ndarray  #: arclength (m,)
    r: np.ndarray  #: centreline (m, 3)
    q: np.ndarray  #: unit quaternions (m, 4)
    value: np.ndarray  #: eigenvalues mu = omega^2, or rates (K,), complex without a potential; zeros of symmetries last
    residual: np.ndarray  #: backward errors of the eigenpairs (K,); nan for symmetries
    error: np.ndarray  #: estimated errors of the discretisation (K,); nan where not estimated, and for symmetries
    motion: tuple[str, ...]  #: what each does: SYMMETRY, bending about a director, torsion, or a mixture
    displacement: np.ndarray
    rotation: np.ndarray
    left_displacement: np.ndarray  #: with the next, what takes forces to the mode's amplitude
    left_rotation: np.ndarray
    weight_displacement: np.ndarray  #: with the next, what takes motions to the mode's amplitude
    weight_rotation: np.ndarray
    rates: bool = False  #: whether the eigenvalues are rates of decay
    note: str = ""  #: why errors that were asked for are not estimated; empty where they are

    def __repr__(self) -> str:
        each = ", ".join(f"{v:.6g} ({m})" for v, m in zip(self.value, self.motion, strict=True))
        return f"<Modes at load {self.load:.10g}: mu = {each}>"

    @property
    def rotation_body(self) -> np.ndarray:
        """Rotations by their components along the directors, (K, m, 3)."""
        return np.einsum("mji,kmj->kmi", directors(self.q), self.rotation)

    def amplitude(self, displacement: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """Amplitudes (K,) of the modes in a small motion (m, 3), (m, 3) of the rod; :class:`InputError` without one."""
        for name, given in (("displacement", displacement), ("rotation", rotation)):
            if np.shape(given) != self.r.shape:
                raise InputError(f"The {name} has the shape {np.shape(given)}: give one of the shape {self.r.shape}.")
        return np.asarray(
            np.tensordot(self.weight_displacement, displacement) + np.tensordot(self.weight_rotation, rotation)
        )


def save_modes(modes: Modes, path: Path, branch: str, row: int, about: Mapping[str, Any], *, first: bool) -> None:
    """Append the ``modes`` of a ``row`` of a ``branch`` to a file (``first``: a new one), on one rank."""

    def add(file: h5py.File) -> None:
        if first:
            file.attrs.update(MODES.mark_attributes())
        MODES.check_hdf5(file)
        file.attrs.update(about, normalisation="kinetic energy: mode . M mode = 1")
        group = file.create_group(f"branches/{branch}/{row}")
        for name in ("load", "s", "r", "q", *FIELDS, *LEFT):
            group[name] = getattr(modes, name)
        group.attrs["note"] = modes.note
        group.attrs["rates"] = modes.rates
        group["motion"] = np.array(modes.motion, dtype=h5py.string_dtype())

    write_whole({path: with_added(path, add, first=first)})


@checked(path=argument_path("results/column/modes.h5"), branch=text("straight"), row=whole(0, 0))
def load_modes(path: Path | str, branch: str, row: int) -> Modes:
    """Modes of a saved state; raises :class:`InputError` where the file has none, or has another or a newer format."""
    unfit = f"{path} has no modes of row {row} of a branch {branch!r}"
    if (known := rows_with_modes(Path(path))) and (branch, row) not in known:
        raise InputError(f"{unfit}: it has {', '.join(f'{name}, row {at}' for name, at in known)}.")
    with MODES.opened(path, ("branches",), f"{unfit} ({{}}): give {MODES.file}.") as file:
        group = file[f"branches/{branch}/{row}"]
        own: dict[str, Any] = {"load": float(group["load"][()]), "motion": tuple(group["motion"].asstr()[()])}
        own |= {"note": str(group.attrs.get("note", "")), "rates": bool(group.attrs.get("rates", False))}
        arrays = {name: group[name][()] for name in Modes.__dataclass_fields__ if name not in own}
    return Modes(**own, **arrays)


def rows_with_modes(path: Path) -> list[tuple[str, int]]:
    """Branches and rows that a file has modes of, none without a file; raises :class:`InputError` if it is unfit."""
    if not path.exists():
        return []
    with MODES.opened(path, ("branches",)) as file:
        return [(name, int(row)) for name, rows in file["branches"].items() for row in rows]


class Few(NamedTuple):
    """Some modes of a state, of unit kinetic energy, symmetries last; complex under loads without a potential.

    Displacements and rotations (K, m, 3) are in space, backward errors ``residual`` (K,) nan for symmetries.
    """

    value: np.ndarray
    residual: np.ndarray
    motion: tuple[str, ...]
    displacement: np.ndarray
    rotation: np.ndarray


@dataclass(frozen=True)
class Typical:
    """Modes ``found`` at the ``row`` of a branch; None where they were not, and why so is the ``trouble``."""

    row: int
    found: Few | None
    trouble: str = ""


def write_typical(group: h5py.Group, typical: Sequence[Typical]) -> None:
    """Write modes into the ``group`` of a branch; nothing without any state."""
    if not typical:
        return
    own, words = group.create_group(TYPICAL), {"dtype": h5py.string_dtype()}
    own["row"] = [each.row for each in typical]
    own.create_dataset("trouble", data=[each.trouble for each in typical], **words)
    for name in Few._fields:
        rows = [None if each.found is None else np.asarray(getattr(each.found, name)) for each in typical]
        named = name == "motion"
        own.create_dataset(name, data=stacked(rows, "" if named else np.nan), **(words if named else {}))


def stacked(rows: Sequence[np.ndarray | None], nothing: Any = np.nan) -> np.ndarray:
    """Arrays, some of them None, as the rows of one, filled up with ``nothing``."""
    given: Any = list(filter(lambda row: row is not None, rows)) or [np.empty(0)]
    shape = tuple(np.max([row.shape for row in given], axis=0).astype(int))
    ragged = len(given) < len(rows) or any(row.shape != shape for row in given)
    dtype = object if nothing == "" else np.result_type(*given, *[float] * ragged)
    out = np.full((len(rows), *shape), nothing if ragged else 0, dtype)
    for i, row in enumerate(rows):
        if row is not None:
            out[(i, *map(slice, row.shape))] = row
    return out


def typical_of(group: Mapping[str, Any]) -> Iterator[Typical]:
    """Modes in the group of a branch, open or in memory: in order of their rows; none where the file has none."""
    if TYPICAL not in group:
        return
    own = group[TYPICAL]
    arrays = {name: own[name][()] for name in ("row", "trouble", *Few._fields)}
    for i, row in enumerate(arrays["row"]):
        if trouble := _text(arrays["trouble"][i]):
            yield Typical(int(row), None, trouble)
            continue
        value, rotation = arrays["value"][i], arrays["rotation"][i]
        count, nodes = (int(np.isfinite(each).sum()) for each in (value, rotation[0, :, 0]))
        moved = (arrays[name][i][:count, :nodes] for name in ("displacement", "rotation"))
        names = tuple(_text(name) for name in arrays["motion"][i][:count])
        yield Typical(int(row), Few(value[:count], arrays["residual"][i][:count], names, *moved))


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
