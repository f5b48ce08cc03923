"""Formats of files: versions are checked, and docs/files.md has the entries that runs write, no more and no fewer."""

import json
import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from problem.test_docs import page, scenes

import rodfem
from rodfem import Discretization, InputError, Parameter, Plan, Scene, Solver, many, run
from rodfem.continuation.branch import Unexplained
from rodfem.file_format import DIAGRAM, FORMATS, LOCUS, MODES, PROGRAM, RESULT, STATES
from rodfem.forms.energy import bending_and_twist
from rodfem.output import render
from rodfem.output.files import load_state
from rodfem.output.plot_locus import draw_locus

HOME = Path(__file__).parents[2]
PAGE = (HOME / "docs" / "files.md").read_text()
MESH, POINTWISE = Discretization("auto", 4, 6), Discretization("pointwise", 4, 6)
pytestmark = pytest.mark.versions


def column() -> Scene:
    """Euler's, whose buckling load is least at e = 0."""
    return replace(
        scenes()["euler"],
        energy=lambda v, k, c: bending_and_twist(k, (1.0 + c.e**2, 2.0, c.C)),
        parameters={"P": Parameter(0.0), "e": Parameter(0.1), "C": Parameter(1.0)},
    )


def held() -> Scene:
    """A hinge on the left, a clamp that turns on the right."""
    known = scenes()
    return replace(known["twisted"], ends=(known["hinge"].ends[0], known["twisted"].ends[1]), name="held")


def sprung() -> Scene:
    """Springs at both ends, and no twist."""
    known = scenes()
    spring = rodfem.elastic(lambda c: (10.0, 10.0, 10.0), lambda c: 5.0, force=page()["push"])
    return replace(known["untwistable"], ends=(spring, spring), name="sprung")


def guided() -> Scene:
    """A guide at either end, the left one with a spring that keeps the rod from turning."""
    left = rodfem.sliding_hinge((0.0, 1.0, 0.0), (0.6, 0.0, -0.8))
    spring = replace(left, energy=lambda x, c: page()["loads"].rotational_spring(x.q, 5.0))
    return replace(scenes()["euler"], ends=(spring, page()["guided"]), name="guided")


def on_a_plane() -> Scene:
    """On a plane across e2, along which both ends slide."""
    kept, push = rodfem.everywhere(lambda x, c: x.r[1], strain=False), page()["push"]
    ends = rodfem.sliding((0.0, None, 0.0)), rodfem.sliding((0.0, None, None), force=push)
    return replace(scenes()["euler"], ends=ends, constraints=(kept,), name="plane")


def viscous() -> Scene:
    """A rod without inertia in a fluid."""
    return replace(scenes()["leipholz"], inertia=rodfem.Drag(), name="viscous")


def loose() -> Scene:
    """Free to turn about its left end, but for a spring of stiffness 1e-10."""
    joint = replace(rodfem.pinned(), energy=lambda x, c: page()["loads"].rotational_spring(x.q, 1e-10))
    return replace(scenes()["euler"], ends=(joint, rodfem.free(page()["push"])), name="loose")


FAR = rodfem.Event("far", of=lambda state: state.r[-1, 2] - 9.0)
QUICK = {"error_bars": False, "depth": 0}
RUNS: dict[str, tuple[Callable[[], Scene], Discretization, Plan]] = {
    "pinned": (lambda: scenes()["euler"], MESH, Plan((0.0, 12.0), at=(11.0,), depth=1, spectrum=2, modes=2)),
    "accurate": (lambda: scenes()["euler"], MESH, Plan((0.0, 1.0), accuracy=1e-4)),
    "locus": (column, MESH, Plan((0.0, 12.0), locus=("e", -0.2, 0.2), **QUICK)),
    "planar": (lambda: scenes()["in_plane"], MESH, Plan((0.0, 1.0), **QUICK)),
    "follower": (lambda: scenes()["leipholz"], MESH, Plan((0.0, 42.0), at=(5.0,), modes=1, **QUICK)),
    "drag": (viscous, MESH, Plan((0.0, 1.0), at=(0.5,), modes=1, **QUICK)),
    "ring": (lambda: scenes()["ring"], POINTWISE, Plan((0.0, 0.2), **QUICK)),
    "foundation": (lambda: scenes()["winkler"], MESH, Plan((0.0, 1.0), at=(0.5,), modes=1, **QUICK)),
    "stretched": (lambda: scenes()["pressed"], MESH, Plan((1.0, 0.99), at=(0.995,), modes=1, **QUICK)),
    "held": (held, MESH, Plan((0.0, 0.2), events=(FAR,), **QUICK)),
    "guided": (guided, MESH, Plan((0.0, 0.2), **QUICK)),
    "sprung": (sprung, MESH, Plan((0.0, 0.2), **QUICK)),
    "plane": (on_a_plane, MESH, Plan((0.0, 0.2), **QUICK)),
    "loose": (loose, MESH, Plan((0.0, 0.2), **QUICK)),
}


COPIED = ("pinned", "locus")
"""Runs that have files of all formats but one."""


def made(folder: Path, *names: str) -> Path:
    """The folder, with a folder of each run of these names."""
    for name in names:
        scene, mesh, plan = RUNS[name]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("rodfem.diagram.sweep.LOADS", 26)
            diagram = run(scene(), mesh, plan, folder / name, figures=False, quiet=True)
        if name == "pinned":  # a run that leaves something unexplained, and is on a kink, as no small one does
            diagram[0].points[0].kink = "stored energy"
            diagram[0].unexplained = [Unexplained(*diagram[0].points[:2], 0, 1)]
            diagram.save(folder / "unexplained")
    return folder


@pytest.fixture(scope="module")
def some(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a file of each format."""
    folder = made(Path(MPI.COMM_WORLD.bcast(str(tmp_path_factory.mktemp("files")))) / "results", *COPIED)
    WORKED.clear()
    many([scenes()["euler"]], counted, folder / "many")
    return folder


@pytest.fixture(scope="module")
def results(some: Path) -> Path:
    """Folder with a folder of each run."""
    return made(some, *(name for name in RUNS if name not in COPIED))


# --- the page and the files ------------------------------------------------------------------------------------------

Entries = dict[str, list[str]]
"""Types of all that has a name, with <...> in it for what the scene or the run names."""
BELOW = {"states.h5": "branches/<branch>"}
"""Where a file has supports, loads and cross-sections."""
SORTS = {"energy": "energy potential conjugate", "profile": "r strain curvature force moment"}
"""Bounds of errors by what they are of."""


def rows(text: str) -> list[list[str]]:
    """Name, type, unit, meaning and condition of all entries in tables."""
    cells = [[cell.strip(" `") for cell in line.split("|")[1:-1]] for line in re.findall(r"^\| `.*$", text, re.M)]
    return [row for row in cells if len(row) == 5]


def described() -> dict[str, dict[str, tuple[str, str]]]:
    """Type and condition of each entry of each file, as the page has them."""
    out: dict[str, dict[str, tuple[str, str]]] = {name: {} for name in FILES}
    for title, text in re.findall(r"^## ([^\n]*)\n(.*?)(?=^## |\Z)", PAGE, flags=re.MULTILINE | re.DOTALL):
        files = [title.strip("`")] if title.startswith("`") else list(BELOW) if title.startswith("Supports") else []
        for part in re.split(r"^### ", text, flags=re.MULTILINE):
            heading = re.match(r"`(.*)`\n", part)
            for name, kind, _, _, where in rows(part):
                for file in files:
                    above = heading[1] if heading else BELOW[file] if title.startswith("Supports") else ""
                    path = f"{above}{'.' if file.endswith('json') else '/'}{name}".lstrip("./")
                    assert path not in out[file], path
                    out[file][path] = kind, where
    return out


def type_of(value: Any) -> str:
    """Type of a value of a JSON file, as ``number (2, 3)``; a dimension in which its rows differ is k."""
    kinds: set[str] = set()

    def shape(x: Any) -> list[str]:
        if not isinstance(x, list):
            kinds.add({bool: "boolean", int: "integer", float: "number", str: "text", type(None): "null"}[type(x)])
            return []
        inner = [shape(y) for y in x]
        alike = [len(set(sizes)) == 1 for sizes in zip(*inner, strict=False)]
        return [str(len(x)), *(n if same else "k" for n, same in zip(inner[0] if inner else [], alike, strict=True))]

    size = shape(value)
    return ", ".join(sorted(kinds)) + (f" ({', '.join(size)})" if size else "")


def of_json(path: Path) -> Iterator[tuple[str, str, set[str]]]:
    """Path, type, and names below it of each entry."""
    whole = json.loads(path.read_text())
    chosen = whole.get("parameters", [])

    def entries(data: dict[str, Any], above: str) -> Iterator[tuple[str, str, set[str]]]:
        names: set[str] = set()
        for name, value in data.items():
            last = above.split(".")[-1]
            own = {"constants": "<parameter>", "meaning": "<column>"}.get(last, name)
            own = (
                "<parameter>" if (last == "columns" and name in chosen) or last in ("derivatives", "densities") else own
            )
            if last == "errors":
                own = next((f"<{sort}>" for sort, those in SORTS.items() if name in those.split()), name)
            names.add(own)
            here = f"{above}.{own}".lstrip(".")
            if here == "result":
                yield here, "any", set()
            elif isinstance(value, dict):
                yield from entries(value, here)
            elif isinstance(value, list) and value and isinstance(value[0], dict):
                yield here, "objects", set()
                for x in value:
                    yield from entries(x, f"{here}[]")
            else:
                yield here, type_of(value), set()
        yield above, "object", names

    return entries(whole, "")


def of_hdf5(path: Path) -> Iterator[tuple[str, str, set[str]]]:
    """Path, type, and names below it of each entry."""
    kinds = {"f": "number", "i": "integer", "b": "boolean", "c": "complex", "O": "text", "U": "text"}

    def typed(value: np.ndarray) -> str:
        size = ", ".join(map(str, value.shape))
        return kinds[value.dtype.kind] + (f" ({size})" if size else "")

    def entries(group: h5py.Group, above: str) -> Iterator[tuple[str, str, set[str]]]:
        names = {f"@{name}" for name in group.attrs}
        for name, value in group.attrs.items():
            yield f"{above}/@{name}".lstrip("/"), typed(np.asarray(value)), set()
        for name, value in group.items():
            last = above.split("/")[-1]
            own = {"branches": "<branch>", "supports": "<place>", "constraints": "<constraint>"}.get(last)
            own = own or ("<row>" if last == "<branch>" and name.isdigit() else re.sub(r"\d+$", "<i>", name))
            own = own.replace("vector_<i>", "vector_<j>")
            names.add(own)
            here = f"{above}/{own}".lstrip("/")
            if isinstance(value, h5py.Group):
                yield from entries(value, here)
            else:
                yield here, typed(value[()]), set()
        yield above, "group", names

    with h5py.File(path) as file:
        yield from entries(file, "")


FILES = {
    "diagram.json": of_json,
    "states.h5": of_hdf5,
    "modes.h5": of_hdf5,
    "locus-1.json": of_json,
    "rod-00000.json": of_json,
}


def fits(found: str, told: str) -> bool:
    """Whether a type that a file has is the one that the page tells."""
    if told == "objects":
        return found in (told, " (0)")
    kinds, size = re.fullmatch(r"(.*?)(?: ?\((.*)\))?", found).groups()
    allowed = set(re.findall(r"[a-z]+", re.sub(r"\(.*?\)", "", told))) - {"or"}
    if not set(re.findall(r"[a-z]+", kinds)) <= allowed | ({"integer"} if "number" in allowed else set()):
        return False
    if kinds == "null" and not size:
        return True
    dims = size.split(", ") if size else []
    return any(_alike(dims, one.split(", ") if one else []) for one in re.findall(r"\((.*?)\)", told) or [""])


def _alike(dims: list[str], told: list[str]) -> bool:
    if dims[:1] == ["0"]:
        return bool(told)
    return len(dims) == len(told) and all(a == b or not b.isdigit() for a, b in zip(dims, told, strict=True))


@pytest.mark.long
@pytest.mark.parametrize("file", FILES)
def test_page_has_what_files_have(results: Path, file: str) -> None:
    told, missing = described()[file], []
    found: dict[str, set[str]] = defaultdict(set)
    for path in sorted(results.glob(f"*/{file}")):
        for name, kind, below in FILES[file](path):
            found[name].add(kind)
            start = f"{name}{'.' if file.endswith('json') else '/'}" if name else ""
            if kind in ("object", "group"):
                always = {x[len(start) :] for x, (_, where) in told.items() if x.startswith(start) and not where}
                missing += [f"{path}: {start}{x}" for x in always - below if not re.search(r"[./<]|\[\]", x)]
    names = {name for name in found if name and not name.endswith("[]")}
    absent = {name for name in set(told) - names if told[name][1] != "of `rodfem many"}
    assert (names - set(told), absent) == (set(), set())
    assert missing == []
    assert [(name, k, told[name][0]) for name in names for k in found[name] if not fits(k, told[name][0])] == []


# --- versions --------------------------------------------------------------------------------------------------------


def marked(path: Path, version: int) -> None:
    """Give a file of a run another version, and program."""
    if path.suffix == ".json":
        data = json.loads(path.read_text())
        data["format"] |= {"version": version, "program": "rodfem 9.1"}
        path.write_text(json.dumps(data))
        return
    with h5py.File(path, "a") as file:
        file.attrs.update(format_version=version, program="rodfem 9.1")


WORKED: list[Scene] = []
"""Scenes that were worked on, since the last time that anybody looked."""


def counted(scene: Scene) -> dict[str, Any]:
    """Work that says how often it was done."""
    WORKED.append(scene)
    return {"any": len(WORKED)}


@pytest.fixture
def copied(some: Path, folder: Path) -> Path:
    """Copy of files of all formats."""
    for name in ("pinned/diagram.json", "pinned/states.h5", "pinned/modes.h5", "locus/locus-1.json"):
        (folder / Path(name).name).write_bytes((some / name).read_bytes())
    (folder / "rod-00000.json").write_bytes((some / "many" / "rod-00000.json").read_bytes())
    return folder


def read(folder: Path) -> list[Callable[[], Any]]:
    """All readers of a diagram, of states, of modes, of a locus and of a result of work."""
    euler, at = scenes()["euler"], ("branch 1", 0)
    with h5py.File(folder / "modes.h5") as file:
        modes = "straight", int(next(iter(file["branches/straight"])))
    locus = folder / "locus-1.json"
    return [
        lambda: rodfem.load_json(folder / "diagram.json"),
        lambda: rodfem.load(folder, euler),
        lambda: load_state(folder / "states.h5", *at, Solver(euler, MESH).equilibria),
        lambda: render.read_state(folder / "states.h5", *at),
        lambda: rodfem.load_modes(folder / "modes.h5", *modes),
        lambda: draw_locus([json.loads(locus.read_text())], folder / "locus.png"),
        lambda: many([euler], counted, folder),
    ]


NAMES = {
    DIAGRAM: "diagram.json",
    STATES: "states.h5",
    MODES: "modes.h5",
    LOCUS: "locus-1.json",
    RESULT: "rod-00000.json",
}


@pytest.mark.long
def test_files_say_what_they_are(copied: Path) -> None:
    """A saved result is used again."""
    assert f"version: {rodfem.__version__}\n" in (HOME / "CITATION.cff").read_text()
    assert json.loads((copied / "diagram.json").read_text())["format"] == {
        "name": "rodfem diagram", "version": 2, "program": f"rodfem {rodfem.__version__}"
    }  # fmt: skip
    with h5py.File(copied / "states.h5") as file:
        names = ("format", "format_version", "program")
        assert [file.attrs[name] for name in names] == ["rodfem states", 2, PROGRAM]
    assert [reader() for reader in read(copied)][-1] == [{"any": 1}]


def test_files_of_a_newer_version_are_refused(copied: Path) -> None:
    for form in FORMATS:
        marked(copied / NAMES[form], form.version + 1)
    sentence = (
        rf"was written by rodfem 9\.1, in version [23] of the format 'rodfem \w+', and {PROGRAM} reads versions up to"
    )
    for reader in read(copied):
        with pytest.raises(InputError, match=sentence):
            reader()
    assert json.loads((copied / "rod-00000.json").read_text())["result"] == {"any": 1}
