"""Pictures of a rod in space, drawn off screen from ``states.h5`` alone."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

__all__ = ["draw_shape", "draw_shape_safely", "main"]

Floats = NDArray[np.float64]
SIZE, VIEW_ANGLE, ELEVATION = (1600, 1000), 18.0, 20.0  # pixels, degrees, degrees
ROD, STRIPE, FIRST, SECOND, CLAMP = "#9CC4E6", "#1F3A5F", "#D55E00", "#009E73", "#9A9A9A"
FORMATS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
CLAMPED = {"both": (True, True), "start": (True, False), "end": (False, True), "none": (False, False)}
MPI_VARIABLES = ("OMPI_", "PMI", "MPI_LOCAL")  # the beginnings of their names, PMI_ and PMIX_ alike
LIBRARIES = "try to install the Debian packages libegl1 libgl1-mesa-dri libxrender1 libxcursor1"


def draw_shape(
    states: Path, branch: str, row: int, path: Path,
    *, caption: str | None = None, radius: float | None = None, clamped: str = "both",
) -> Path:  # fmt: skip
    """Draw one equilibrium as a tube with a stripe along d1, arrows along d1 and d2, and clamped ends.

    Cross-sections lie in the plane of d1 and d2, so that shear shows.

    Parameters
    ----------
    states
        The file ``states.h5``; lengths in it are nondimensional.
    branch, row
        Name of the branch, and row of the state in it, counted from 0.
    path
        Picture to write, 1600 by 1000 pixels; the suffix decides the format (.png, .jpg, .bmp, .tif).
    caption
        Line at the foot of the picture: scene, branch and load when None, nothing when empty.
    radius
        Radius of the tube, nondimensional; about 1/90 of the rod's length when None.
    clamped
        Which ends get the block of a clamp: "both", "start", "end" or "none".

    Returns
    -------
    path
        The picture written; its folder is created where it is missing.

    Raises
    ------
    ValueError
        If the file, the branch or the row does not exist, or an argument has no meaning.
    ImportError
        If PyVista or one of the libraries it needs is missing.
    RuntimeError
        If the picture comes out blank.
    """
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise ValueError(f"picture {path} has an unknown format: expected one of {FORMATS}, try shape.png")
    if clamped not in CLAMPED:
        raise ValueError(f"clamped={clamped!r} is unknown: expected one of {tuple(CLAMPED)}, try 'both'")
    if radius is not None and not radius > 0.0:
        raise ValueError(f"radius={radius} is not positive: expected a length, try 0.01 or leave it out")
    centres, directors, text = _read(Path(states), branch, row)
    length = np.linalg.norm(np.diff(centres, axis=0), axis=1).sum()
    thickness = float(radius or min(length / 90.0, np.linalg.norm(np.ptp(centres, axis=0)) / 40.0))
    text = text if caption is None else caption
    pyvista = _import_pyvista()
    font = str(Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf"))
    plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE), lighting="light kit")
    plotter.set_background("white")
    _add_rod(pyvista, plotter, centres, directors, thickness, CLAMPED[clamped])
    plotter.camera_position = _camera_position(centres, 6.0 * thickness)
    plotter.camera.view_angle = VIEW_ANGLE
    plotter.renderer.ResetCameraClippingRange()
    plotter.add_axes(xlabel="e1", ylabel="e2", zlabel="e3", line_width=4, viewport=(0.0, 0.76, 0.15, 1.0))
    labels = [(text, 0.5, 0.03, "black"), ("d₁", 0.935, 0.93, FIRST), ("d₂", 0.97, 0.93, SECOND)]
    for label, x, y, colour in filter(lambda item: item[0], labels):
        style = {"font_size": min(20, 1400 // len(label)), "color": colour, "font_file": font}
        actor = plotter.add_text(label, position=(x, y), viewport=True, **style)
        actor.GetTextProperty().SetJustificationToCentered()
    plotter.enable_anti_aliasing("ssaa")
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = plotter.screenshot(str(path), return_img=True)
    plotter.close()
    if np.ptp(picture) == 0:
        raise RuntimeError(f"the picture {path} came out blank: {LIBRARIES}")
    return path


def _read(states: Path, branch: str, row: int, count: int = 800) -> tuple[Floats, Floats, str]:
    """Return centres (count, 3), directors (count, 3, 3) with columns d1, d2, d3, and the usual caption."""
    import h5py
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation

    try:
        with h5py.File(states, "r") as file:
            branches = file["branches"]
            if branch not in branches:
                raise ValueError(f"{states} has no branch {branch!r}: try one of {sorted(branches)}")
            if not 0 <= row <= (last := len(branches[branch]["r"]) - 1):
                raise ValueError(f"row {row} of branch {branch!r} does not exist: try one of 0 to {last}")
            load, s, r, q = (branches[branch][key][row] for key in ("load", "s", "r", "q"))
            s, r, q = (values[np.isfinite(s)] for values in (s, r, q))
            symbol = {"lam": "λ"}.get(file.attrs["parameter"], file.attrs["parameter"])
            caption = f"{file.attrs['scene']} rod, {branch}, {symbol} = {load:.4g}"
    except (KeyError, OSError) as error:
        reason = "expected HDF5 with s and branches" if states.exists() else "no such file"
        raise ValueError(f"cannot read {states}, {reason}: try the states.h5 of a scene") from error
    opposite = np.sum(q[1:] * q[:-1], axis=1, keepdims=True) < 0.0  # q and -q are the same rotation
    q[1:] *= np.cumprod(np.where(opposite, -1.0, 1.0), axis=0)
    at = np.linspace(s[0], s[-1], count)
    directors = Rotation.from_quat(CubicSpline(s, q)(at)[:, [1, 2, 3, 0]]).as_matrix()
    return CubicSpline(s, r)(at), directors, caption


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


def _add_rod(
    pyvista: Any, plotter: Any, centres: Floats, directors: Floats, radius: float, clamped: tuple[bool, bool]
) -> None:
    """Add tube, stripe, arrows along d1 and d2, and the ends."""

    def patch(distance: float, angles: Floats) -> Any:
        """Return the part of a tube between two angles from d1, with its normals."""
        normals = np.einsum("nik,ka->nai", directors[:, :, :2], np.array([np.cos(angles), np.sin(angles)]))
        n, k = normals.shape[:2]
        corner = (np.arange(n - 1)[:, None] * k + np.arange(k - 1)).ravel()
        quads = np.column_stack([np.full_like(corner, 4), corner, corner + 1, corner + k + 1, corner + k])
        surface = pyvista.PolyData((centres[:, None] + distance * normals).reshape(-1, 3), quads.ravel())
        surface.point_data.active_normals = normals.reshape(-1, 3)
        return surface

    style = {"smooth_shading": True, "ambient": 0.25, "specular": 0.3, "specular_power": 25.0}
    plotter.add_mesh(patch(radius, np.linspace(0.0, 2.0 * np.pi, 49)), color=ROD, **style)
    plotter.add_mesh(patch(1.02 * radius, np.linspace(-0.3, 0.3, 9)), color=STRIPE, **style)
    stations = np.linspace(0, len(centres) - 1, 27).round().astype(int)[1:-1]
    arrow = pyvista.Arrow(tip_length=0.22, tip_radius=0.075, shaft_radius=0.026, tip_resolution=24)
    for index, colour in ((0, FIRST), (1, SECOND)):
        points = pyvista.PolyData(centres[stations])
        points["director"] = directors[stations, :, index]
        arrows = points.glyph(orient="director", scale=False, factor=4.5 * radius, geom=arrow)
        plotter.add_mesh(arrows, color=colour, **style)
    block = pyvista.Cube(x_length=4.8, y_length=4.8, z_length=2.4)
    disc = pyvista.Disc(inner=0.0, outer=1.0, c_res=48)
    for end, outward, clamp in ((0, -1.2, clamped[0]), (-1, 1.2, clamped[1])):
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = radius * directors[end], centres[end]
        body = block.translate((0.0, 0.0, outward), inplace=False) if clamp else disc
        plotter.add_mesh(body.transform(frame, inplace=False), color=CLAMP if clamp else ROD, ambient=0.25)


def _camera_position(centres: Floats, margin: float) -> list[tuple[float, ...]]:
    """Return place, focus and upward direction of a camera at the rod's side, slightly above."""
    bias = np.linalg.norm(np.ptp(centres, axis=0)) * np.array([3e-3, 2e-3, 1e-3])  # for symmetric shapes
    _, up, right = np.linalg.eigh(np.cov(centres.T) + np.diag(bias**2))[1].T
    right = right * np.sign(right @ (centres[-1] - centres[0] + 1e-3 * bias))
    up = up * np.sign(up @ (centres.mean(axis=0) - (centres[0] + centres[-1]) / 2.0 + bias))
    back, tilt = np.cross(right, up), np.radians(ELEVATION)
    axes = np.array([right, np.cos(tilt) * up - np.sin(tilt) * back, np.cos(tilt) * back + np.sin(tilt) * up])
    seen = centres @ axes.T
    half = np.ptp(seen, axis=0) / 2.0 + margin
    distance = half[2] + max(1.2 * half[1], half[0] * SIZE[1] / SIZE[0]) / np.tan(np.radians(VIEW_ANGLE / 2))
    focus = (seen.min(axis=0) + seen.max(axis=0)) / 2.0 @ axes
    return [tuple(focus + distance * axes[2]), tuple(focus), tuple(axes[1])]


def draw_shape_safely(
    states: Path, branch: str, row: int, path: Path, *, limit: float = 120.0, **options: str | float | None
) -> str | None:
    """Draw as `draw_shape` does, but in a process of its own, which may crash without harm.

    Parameters
    ----------
    states, branch, row, path, **options
        As for `draw_shape`; the options are caption, radius and clamped.
    limit
        Time that drawing may take, in seconds.

    Returns
    -------
    trouble
        None where the picture was written, else a sentence that says what failed and what to do.
    """
    command = [sys.executable, "-m", "rodfem.render", str(states), f"--branch={branch}", f"--row={row}"]
    command += [f"--{key}={value}" for key, value in {"output": path, **options}.items() if value is not None]
    home = str(Path(__file__).resolve().parents[1])
    environment = {key: value for key, value in os.environ.items() if not key.startswith(MPI_VARIABLES)}
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, [home, os.environ.get("PYTHONPATH")]))
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=limit)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"drawing {path} did not end within {limit:g} s ({type(error).__name__}): {LIBRARIES}"
    if done.returncode < 0:
        return f"drawing {path} crashed with signal {-done.returncode}: {LIBRARIES}"
    reason = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
    return f"drawing {path} failed: {reason}" if done.returncode else None


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the shape named on the command line.

    Parameters
    ----------
    arguments
        Command line without the program's name; that of the process when omitted.

    Returns
    -------
    status
        0, or 2 after one sentence on standard error.
    """
    parser = argparse.ArgumentParser(prog="python -m rodfem.render", description="Draw a rod in space.")
    parser.add_argument("states", type=Path, help="states.h5 of a scene")
    parser.add_argument("--branch", required=True, help="name of the branch")
    parser.add_argument("--row", required=True, type=int, help="row of the state, counted from 0")
    parser.add_argument("--output", type=Path, default=Path("shape.png"), help="picture to write")
    parser.add_argument("--caption", help="line at the foot of the picture")
    parser.add_argument("--radius", type=float, help="radius of the tube, nondimensional")
    parser.add_argument("--clamped", default="both", help="both, start, end or none")
    options = vars(parser.parse_args(arguments))
    try:
        print(draw_shape(path=options.pop("output"), **options))
    except (ImportError, OSError, RuntimeError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
