"""Pictures of a rod in space: from where it is seen, and how it is drawn, off screen, from ``states.h5`` alone.

It is seen along the axis across the plane in which it moves, a little from above.  What is upwards is decided here, for
pictures and the page alike.  Gravity is downwards.  Without it an axis of space points upwards, e1 before
e2 before e3, never the opposite way, so that a weight that hangs along -e1 pulls downwards.  The exception is an arch,
a rod that is bent before a load presses on its crown: it stands.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from rodfem.errors import InputError
from rodfem.file_format import STATES
from rodfem.output.glyphs import POINT, Glyph, Look, Solid, between, glyphs_of, sign_of, striped
from rodfem.output.states import curve_at
from rodfem.output.style import DARK, FIRST, LOAD, ROD, SECOND, STRIPE
from rodfem.problem.arguments import checked
from rodfem.problem.arguments import path as argument_path
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import HELD, TURNS, Setting
from rodfem.problem.setting import read as read_setting
from rodfem.ranks import on_first
from rodfem.whole_files import draft_of, write_whole

if TYPE_CHECKING:
    from rodfem.continuation.branch import Branch, Point
    from rodfem.continuation.branch_solver import BranchSolver

Floats = NDArray[np.float64]
SIZE, ROOM = (1600, 1000), 0.84  # pixels, and the share of the height above the caption
FORMATS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
SHINE = {"smooth_shading": True, "ambient": 0.25, "specular": 0.3, "specular_power": 25.0}
LIBRARIES = "try to install the Debian packages libegl1 libgl1-mesa-dri libxrender1 libxcursor1"
TILT = np.radians(20.0)  # by which a picture is seen from above
NEAR, LEVEL = 0.9, 0.1
"""Cosines: from which on a direction is that of the nearest axis of space, or a load that of the motion; below which an
axis of space is across."""
UNSEEN = 1e-3  # displacement, or distance of the ends, that a picture does not show, relative to the rod's size


def draw_shape(
    states: Path, branch: str, row: int, path: Path,
    *, caption: str | None = None, radius: float | None = None, size: tuple[int, int] = SIZE,
    view: Floats | None = None,
) -> Path:  # fmt: skip
    """Draw one equilibrium: the rod with a stripe along d1, arrows along d1 and d2, what holds it and what loads it.

    Cross-sections lie in the plane of d1 and d2, so that shear shows (:func:`rodfem.output.glyphs.profile_of`).  The
    state is in a ``row`` of a ``branch`` of the file ``states``; the suffix of ``path`` decides the format.  By default
    ``caption`` says scene, branch and load, ``radius`` is :func:`thickness`, and ``view``, the axes of the picture (3,
    3), that of this state; ``size`` is in pixels.  Raises :class:`ValueError` where there is no such state,
    :class:`ImportError` without PyVista, and :class:`RuntimeError` where the picture comes out blank.
    """
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise ValueError(f"picture {path} has an unknown format: expected one of {FORMATS}, try shape.png")
    state = read_state(Path(states), branch, row)
    look = Look(radius or thickness(state.centres), state.view() if view is None else view)
    pyvista = _import_pyvista()
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
    plotter.set_background("white")
    solids = state.solids(look)
    for color, surface in _surfaces(pyvista.PolyData, [*solids, *state.arrows(look.radius)]):
        plotter.add_mesh(surface, color=color, split_sharp_edges=True, feature_angle=40.0, **SHINE)
    _look_at(plotter, np.concatenate([solid.points for solid in solids]), look, size[0] / size[1])
    plotter.add_axes(xlabel="e1", ylabel="e2", zlabel="e3", color=DARK, x_color=DARK, y_color=DARK, z_color=DARK)
    _write(plotter, state.caption if caption is None else caption, state.setting.notes, solids)
    plotter.enable_anti_aliasing("ssaa")
    with draft_of(path) as draft:
        picture = plotter.screenshot(str(draft), return_img=True)
    plotter.close()
    if np.ptp(picture) == 0:
        raise RuntimeError(f"the picture {path} came out blank: {LIBRARIES}")
    return path


def _surfaces(kind: Any, bodies: Sequence[Solid | Glyph]) -> Iterator[tuple[str, Any]]:
    """Each colour with all its ``bodies`` as one surface: VTK takes as long to set up an arrow as a rod."""
    for color in dict.fromkeys(body.color for body in bodies):
        first, *others = (kind.from_regular_faces(x.points, x.triangles) for x in bodies if x.color == color)
        yield color, first.append_polydata(*others)


@dataclass(frozen=True)
class State:
    """A state at n places of the rod, with the ``reference`` (n, 3) from which it has moved; directors are columns."""

    s: Floats
    centres: Floats
    directors: Floats
    reference: Floats
    setting: Setting
    caption: str = ""

    def view(self) -> Floats:
        """Axes of the picture, (3, 3)."""
        setting, reference = self.setting, self.reference
        feet = sum(bool(x.held.any()) for x in setting.supports) > 1
        along = {"axis": axis_of(setting, reference), "down": setting.gravity, "load": setting.force}
        side = setting.widest(self.directors[0])
        return view_of(reference, self.centres - reference, side=side, feet=feet, **along)

    def solids(self, look: Look) -> list[Solid | Glyph]:
        """The rod, its stripe, what holds it and what loads it."""
        pose = self.centres, self.directors
        rods = striped((self.s, *pose), self.setting.section, look.radius, (ROD, STRIPE))
        return [*rods, *glyphs_of(self.setting, self.s, pose, look)]

    def arrows(self, radius: float) -> list[Glyph]:
        """The directors d1 and d2 at 25 places of a rod of this ``radius``."""
        places = np.linspace(0, len(self.s) - 1, 27).round().astype(int)[1:-1]
        ways = [(self.centres[i], self.directors[i, :, k], c) for i in places for k, c in ((0, FIRST), (1, SECOND))]
        return [between("arrow", at, at + 4.5 * radius * way, 0.12 * radius, color) for at, way, color in ways]


def read_state(states: Path, branch: str, row: int) -> State:
    """Read a state of a file; raises ValueError where there is none."""
    unfit = f"cannot read {states} ({{}}): try the states.h5 of a scene"
    with STATES.opened(states, ("branches", "parameter", "scene"), unfit) as file:
        branches = file["branches"]
        if branch not in branches:
            raise InputError(f"{states} has no branch {branch!r}: try one of {sorted(branches)}")
        if not 0 <= row <= (last := len(branches[branch]["r"]) - 1):
            raise InputError(f"row {row} of branch {branch!r} does not exist: try one of 0 to {last}")
        symbol, load = file.attrs["parameter"], branches[branch]["load"][row]
        caption = f"{file.attrs['scene']}, {branch}, {'λ' if symbol == 'lam' else symbol} = {load:.4g}"
        return replace(state_in(branches, file.attrs["first"], branch, row), caption=caption)


def state_in(branches: Any, first: str, branch: str, row: int, count: int = 800) -> State:
    """State at ``count`` places, by groups of ``branches``; the ``first`` one has the shape that the load has left."""
    group, origin = branches[branch], branches[first]
    left = 0 if branch == first else int(np.argmin(abs(origin["load"][:] - group["load"][row])))
    s, centres, turned = curve_at(group, row, count)
    return State(s, centres, directors(turned), curve_at(origin, left, count)[1], read_setting(group, row))


def _import_pyvista() -> Any:
    """Return the module pyvista, prepared for a machine without display."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    try:
        import pyvista
    except ImportError as error:
        advice = 'try pip install "rodfem[viz]"' if isinstance(error, ModuleNotFoundError) else LIBRARIES
        raise ImportError(f"pyvista cannot be loaded ({error}): {advice}") from error
    return pyvista


def _look_at(plotter: Any, points: Floats, look: Look, aspect: float) -> None:
    """Set a camera without perspective that sees all points (n, 3), above the caption."""
    seen = points @ look.axes.T
    low, high = seen.min(axis=0) - 5.0 * look.radius, seen.max(axis=0) + 5.0 * look.radius
    half = (high - low) / 2
    scale = max(half[1] / ROOM, half[0] / aspect)
    focus = ((low + high) / 2 - (0.0, (1.0 - ROOM) / 2 * scale, 0.0)) @ look.axes  # the caption's line is below
    camera = focus + 4 * (half[2] + scale) * look.axes[2]
    plotter.camera_position = [tuple(camera), tuple(focus), tuple(look.axes[1])]
    plotter.camera.enable_parallel_projection()
    plotter.camera.parallel_scale = scale
    plotter.renderer.ResetCameraClippingRange()


def _write(plotter: Any, caption: str, notes: Sequence[str], solids: Sequence[Solid | Glyph]) -> None:
    """Write the line at the foot, what is not drawn above it, and the names of what has its colour."""
    font = str(Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf"))
    width, height = plotter.window_size
    labels = [(caption, 0.5, 0.03, "black"), (f"not drawn: {', '.join(notes)}" if notes else "", 0.5, 0.095, DARK)]
    loaded = any(solid.color == LOAD for solid in solids)
    names = [("load" * loaded, 184, LOAD), ("d₁", 104, FIRST), ("d₂", 48, SECOND)]
    labels += [(name, 1.0 - right / width, 1.0 - 70.0 / height, colour) for name, right, colour in names]
    for label, x, y, colour in (label for label in labels if label[0]):
        style = {"font_size": min(20, int(0.875 * width) // len(label)), "color": colour, "font_file": font}
        actor = plotter.add_text(label, position=(x, y), viewport=True, **style)
        actor.GetTextProperty().SetJustificationToCentered()


# --- from where a rod is seen


def axis_of(setting: Setting, reference: Floats) -> Floats:
    """Direction (3,) of the axis of a rod in the state ``reference`` (n, 3): from one end to the other.

    Of a rod that is held at one end alone it is that of its support, from which load bends the chord away, unless the
    rod leaves it sideways, as a coil does.
    """
    chord, holding = reference[-1] - reference[0], [x for x in setting.supports if x.held.any() or x.turning != TURNS]
    stem = directors(holding[0].frame)[:, 2] if len(holding) == 1 and holding[0].turning == HELD else chord
    return np.asarray(stem if stem @ chord > 0.3 * np.linalg.norm(chord) else chord)


def thickness(centres: Floats) -> float:
    """Mean radius with which a rod of this centreline (n, 3) is drawn: by its length, and by its extent if it coils."""
    length = np.linalg.norm(np.diff(centres, axis=0), axis=1).sum()
    return float(min(length / 90.0, np.linalg.norm(np.ptp(centres, axis=0)) / 40.0))


def view_of(
    reference: Floats,
    moved: Floats,
    *,
    axis: Floats | None = None,
    down: Floats | None = None,
    load: Floats | None = None,
    side: Floats | None = None,
    feet: bool = False,
) -> Floats:
    """Axes of a picture as rows (3, 3): to the right, upwards, and to the viewer.

    The rod has ``moved`` (n, 3) from the centreline ``reference`` (n, 3).  Directions (3,) are the ``axis`` of the rod
    (None: its chord), gravity, ``down``, the ``load`` across the rod, and ``side``, upwards where a straight rod has
    not moved.  With ``feet`` the rod is held in two places or more, and may be an arch.

    Without gravity the axis goes to the right, so that nothing that holds the rod looks tilted, and vertical is the
    principal direction of the displacement across it, or a load that is not nearly along that; then the rod is seen
    from aside.  A closed rod is shown in the plane nearest to it.
    """
    size = float(np.linalg.norm(np.ptp(reference, axis=0)))
    chord = reference[-1] - reference[0] if axis is None else axis
    shape, tilt = moved.T @ moved / len(moved), TILT
    if np.linalg.norm(chord) < UNSEEN * size and down is None:
        spread = np.cov((reference + moved).T)
        scale = float(np.linalg.norm(np.ptp(reference + moved, axis=0)))
        vectors = np.linalg.eigh(spread + np.diag(scale * np.array([3e-3, 2e-3, 1e-3])) ** 2)[1]
        right, up = upwards(vectors[:, 2]), upwards(vectors[:, 1])
        tilt = np.radians(55.0)  # what is across the plane is seen
    elif down is not None:
        up = -down / np.linalg.norm(down)
        spread = (reference - reference.mean(axis=0)).T @ (reference - reference.mean(axis=0)) / len(reference)
        right = _principal(shape + spread, up, UNSEEN * size, side)
        level = abs(right @ chord) < UNSEEN * size  # an upright rod has no way of its own to go
        right = right * sign_of(right @ (moved[np.argmax(np.linalg.norm(moved, axis=1))] if level else chord))
    else:
        right = _snapped(chord / np.linalg.norm(chord))
        up = upwards(_principal(shape, right, UNSEEN * size, side))
        if load is not None:
            right, up, tilt = _loaded(right, up, load, reference if feet else None)
    back = np.cross(right, up)
    return np.array([right, np.cos(tilt) * up - np.sin(tilt) * back, np.cos(tilt) * back + np.sin(tilt) * up])


def _loaded(right: Floats, up: Floats, load: Floats, arch: Floats | None) -> tuple[Floats, Floats, float]:
    """Directions and tilt of a picture in which a ``load`` is seen; ``arch`` (n, 3) is a rod that may be one."""
    aside = load - (load @ right) * right
    standing = up * _standing(up, arch, load)
    if abs(up @ aside) >= NEAR * np.linalg.norm(aside):
        towards = (standing @ aside) * (np.cross(right, standing) @ aside) > POINT * (aside @ aside)
        return right, standing, -TILT if towards else TILT
    up = _snapped(aside / np.linalg.norm(aside))
    up = up - (up @ right) * right
    up = upwards(up / np.linalg.norm(up))
    up = up * _standing(up, arch, load)
    turned = np.cos(np.radians(40.0)) * right + np.sin(np.radians(40.0)) * np.cross(right, up)
    return turned, up, np.radians(35.0)  # the rod goes away, so upwards


def _standing(up: Floats, rod: Floats | None, load: Floats) -> float:
    """-1 where an arch, the ``rod`` (n, 3), would hang from ``up`` though the ``load`` presses on its crown; else 1."""
    if rod is None:
        return 1.0
    bow, size = (rod - np.linspace(rod[0], rod[-1], len(rod))).mean(axis=0), np.linalg.norm(np.ptp(rod, axis=0))
    arch = np.linalg.norm(bow) > 0.05 * size and abs(up @ bow) > LEVEL * np.linalg.norm(bow)
    return sign_of(up @ bow) if arch and load @ bow < 0 else 1.0


def _principal(moments: Floats, axis: Floats, least: float, other: Floats | None) -> Floats:
    """Direction across ``axis`` of the greatest second moment; ``other``, if given, where that is below ``least^2``."""
    out = np.eye(3) - np.outer(axis, axis)
    values, vectors = np.linalg.eigh(out @ moments @ out)
    found = vectors[:, -1]
    if values[-1] < least**2:
        found = np.eye(3)[0] if other is None else other
        if np.linalg.norm(out @ found) < 0.1:
            found = np.eye(3)[int(np.argmin(abs(axis)))]
    found = out @ _snapped(found / np.linalg.norm(found))
    return np.asarray(found / np.linalg.norm(found))


def upwards(direction: Floats) -> Floats:
    """The direction (3,) or its opposite, so that the first of e1, e2, e3 that is not nearly across it points along."""
    components = direction[abs(direction) > LEVEL * np.linalg.norm(direction)]
    return direction * sign_of(components[0])


def _snapped(direction: Floats) -> Floats:
    """Axis of space near which a unit vector is, or the vector itself."""
    i = int(np.argmax(abs(direction)))
    return np.sign(direction[i]) * np.eye(3)[i] if abs(direction[i]) > NEAR else direction


# --- in notebooks


@dataclass(frozen=True)
class Snapshot:
    """A picture as PNG; empty on all ranks but the first."""

    png: bytes

    def _repr_png_(self) -> bytes:
        return self.png

    def __repr__(self) -> str:
        return f"<Snapshot: PNG of {len(self.png)} bytes>"

    @checked(path=argument_path("shape.png"))
    def save(self, path: Path | str) -> Path:
        """Write it; its folder is made.  Raises :class:`InputError` where it cannot be written."""
        path = Path(path)
        if path.suffix.lower() != ".png":
            raise InputError(f"The picture {path} is PNG: give a name that says so, as in shape.png.")
        write_whole({path: self.png})
        return path


def snapshot(
    branches: Sequence[Branch],
    solvers: Sequence[BranchSolver],
    point: Point,
    path: Path | str | None,
    caption: str | None,
) -> Snapshot:
    """Draw a point of a diagram: pictures are made from files, so that its state is written to a temporary one."""
    from rodfem.continuation.branch import Branch
    from rodfem.output.files import states_of

    homes = {id(p): (b.name, i) for b in reversed(branches) for i, p in enumerate(b.points)}
    (name, row), comm = homes.get(id(point), ("state", 0)), solvers[0].system.comm
    saved = [replace(branches[0], special=[])]
    if name != saved[0].name:
        saved.append(Branch(name, None, 0, [point]))
        row = 0
    with TemporaryDirectory() as folder:
        states, png = Path(folder) / "states.h5", b""
        image = states_of(saved, solvers, states, first=True)
        if comm.rank == 0:
            states.write_bytes(image)
            png = draw_shape(states, name, row, Path(folder) / "shape.png", caption=caption).read_bytes()
    found = Snapshot(png)
    if path is not None:
        on_first(comm, lambda: found.save(path))
    return found


# --- in processes

PROGRAM = """
import os, sys
from rodfem.output.render import drawn
words = drawn(*sys.argv[1:])
print(words or "", file=sys.stderr, flush=True)
os._exit(bool(words))  # to take VTK down takes a tenth of a process
"""


def drawn(states: str, branch: str, row: str, path: str, caption: str) -> str | None:
    """Draw as :func:`draw_shape` does; a sentence on what failed, else None."""
    try:
        draw_shape(Path(states), branch, int(row), Path(path), caption=caption)
    except (ImportError, RuntimeError, ValueError, OSError) as error:
        return str(error).split("\n", 1)[0]
    return None


def draw_shape_safely(states: Path, branch: str, row: int, path: Path, caption: str) -> str:
    """Draw as :func:`draw_shape` does, in a process of its own, which may crash; a sentence on what failed."""
    mpi = ("OMPI_", "PMI", "MPI_LOCAL")  # beginnings of names, PMI_ and PMIX_ alike
    environment = {key: value for key, value in os.environ.items() if not key.startswith(mpi)}
    home = str(Path(__file__).resolve().parents[2])
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, [home, os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-P", "-c", PROGRAM, str(states), branch, str(row), str(path), caption]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120.0)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"drawing {path} did not end within 120 s ({type(error).__name__}): {LIBRARIES}"
    if done.returncode < 0:
        return f"drawing {path} crashed with signal {-done.returncode}: {LIBRARIES}"
    reason = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
    return f"drawing {path} failed: {reason}" * bool(done.returncode)
