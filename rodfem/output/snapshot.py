"""Picture of one state, which a notebook shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.output.files import save_states
from rodfem.output.folder import picture_at
from rodfem.problem.arguments import checked
from rodfem.problem.arguments import path as argument_path
from rodfem.whole_files import write_whole


@dataclass(frozen=True)
class Snapshot:
    """A picture as PNG; empty on all ranks but the first."""

    png: bytes

    def _repr_png_(self) -> bytes:
        return self.png

    def __repr__(self) -> str:
        """Size."""
        return f"<Snapshot: PNG of {len(self.png)} bytes>"

    @checked(path=argument_path("shape.png"))
    def save(self, path: Path | str) -> Path:
        """Write it; its folder is made.  Raises :class:`InputError` where it cannot be written."""
        path = Path(path)
        picture_at(path, (".png",))
        write_whole({path: self.png})
        return path


def snapshot(
    branches: Sequence[Branch],
    solvers: Sequence[BranchSolver],
    point: Point,
    path: Path | str | None,
    caption: str | None,
) -> Snapshot:
    """Draw a point of a diagram: pictures are made from files, so that its state is written to a temporary one.

    The first of the ``branches`` is drawn in grey, as the reference; ``solvers`` are those of the meshes.  ``point`` is
    one of theirs, or any other of these meshes; ``path`` is that of the picture (None: none is kept), and ``caption``
    its text.
    """
    from rodfem.output.render import draw_shape

    comm = solvers[0].system.comm
    with TemporaryDirectory() as folder:
        states, picture = Path(folder) / "states.h5", Path(folder) / "shape.png"
        homes = {id(p): (b.name, i) for b in reversed(branches) for i, p in enumerate(b.points)}
        (name, row), first, png = homes.get(id(point), ("state", 0)), branches[0], b""
        save_states(replace(first, special=[]), solvers, states, first=True)
        if name != first.name:
            save_states(Branch(name, None, 0, [point]), solvers, states, first=False)
            row = 0
        if comm.rank == 0:
            draw_shape(states, name, row, picture, caption=caption)
            png = picture.read_bytes()
    found = Snapshot(png)
    if path is not None and comm.rank == 0:
        found.save(path)
    return found
