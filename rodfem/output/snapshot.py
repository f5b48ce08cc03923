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
        home = next((b.name for b in branches if any(p is point for p in b.points)), "state")
        first = branches[0]
        save_states(replace(first, special=[]), solvers, states, first=True)
        row = next((i for i, p in enumerate(first.points) if p is point), -1)
        if row < 0:
            save_states(Branch(home, None, 0, [point]), solvers, states, first=False)
        png = b""
        if comm.rank == 0:
            draw_shape(states, first.name if row >= 0 else home, max(row, 0), picture, caption=caption)
            png = picture.read_bytes()
    found = Snapshot(png)
    if path is not None and comm.rank == 0:
        found.save(path)
    return found
