r"""Trace the branches of the demos with AUTO-07p: speed against error of a collocation code.

Compiles the boundary value problems that stand beside this file, runs AUTO from the trivial branch through its
branch points and along what leaves there, over the load range of the demo, and compares with reference values
that neither AUTO nor rodfem computed.  The time is AUTO's user time without compilation and without the start of
the process, the median of several runs.  From Python::

    from trace import SCENES, trace
    for branch in trace(SCENES["cord"], ntst=20, ncol=4, tol=1e-9):
        print(branch.name, branch.points, branch.seconds, branch.values, branch.errors)
"""

from __future__ import annotations

import argparse
import atexit
import itertools
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
AUTO = Path(os.environ.get("AUTO_LIB", "/usr/lib/auto-07p/lib"))
FLAGS = ("-O3", "-fopenmp")
LIMIT = 20  # seconds for one run of AUTO
NAMES = {1: "BP", 2: "LP", 3: "HB", 4: "UZ", 5: "LP", 6: "BP", 9: "EP", -4: "UZ", -9: "MX"}


class AutoError(Exception):
    """AUTO is missing, or did not do what was asked; the message is one sentence."""


# --- what is traced


@dataclass(frozen=True)
class Target:
    """A number on a branch with an independent reference: where a special point lies, or an ordinate at a load."""

    name: str
    kind: str  # "BP" or "LP": the load of the nth one; "UZ": the ordinate at the nth crossing of the load `at`
    reference: float
    number: int = 0
    at: float | None = None


@dataclass(frozen=True)
class Branch:
    """One run of AUTO: the first starts from STPNT, the others from a branch point of the first."""

    name: str
    targets: tuple[Target, ...]
    ds: float
    dsmax: float
    stop: tuple[float, ...] = ()  # loads at which to stop
    until: str = ""  # AUTO's SP: special points at which to stop
    start: int | None = None  # the branch point, counted from 0


@dataclass(frozen=True)
class Scene:
    """A boundary value problem for AUTO, and the branches to trace."""

    name: str
    sources: tuple[str, ...]
    ndim: int
    nbc: int
    icp: tuple[int, ...]  # free parameters (the first is the load), then what PVLS computes
    free: int
    branches: tuple[Branch, ...]
    ordinate: int | Callable[[State], float] | None = None  # a parameter, or a function of the state
    note: str = ""


@dataclass(frozen=True)
class State:
    """A labelled solution: t in [0, 1], u by rows, parameters."""

    t: np.ndarray
    u: np.ndarray
    par: np.ndarray
    ncol: int


@dataclass
class Traced:
    """A branch as AUTO traced it."""

    scene: str
    name: str
    ntst: int
    ncol: int
    tol: float
    dsmax: float
    points: int
    seconds: float  # user time, the median of `runs`
    runs: int
    special: list[tuple[str, float]]  # kind and load of everything labelled
    values: dict[str, float]  # of the targets; nan where AUTO did not find one
    errors: dict[str, float]  # relative to the reference
    complete: bool  # to where the branch was to end
    loads: list[float] = field(repr=False)

    @property
    def error(self) -> float:
        """The largest relative error of the targets; infinite where one was not found."""
        return max((math.inf if math.isnan(e) else e for e in self.errors.values()), default=math.nan)

    @property
    def ms_per_point(self) -> float:
        """User time per accepted point, in milliseconds."""
        return 1e3 * self.seconds / self.points


def midpoint(state: State) -> float:
    """Transverse displacement of the middle of the hemitropic rod.

    AUTO is accurate to order 2 NCOL at mesh points, and to order NCOL + 1 only between them.  Hence the equations
    are integrated from the mesh point nearest to the middle: half an interval at most, by Runge-Kutta's method.
    """
    nodes = np.arange(0, len(state.t), state.ncol)
    start = nodes[np.argmin(abs(state.t[nodes] - 0.5))]
    u, steps = state.u[start], 32
    step = 6 * (0.5 - state.t[start]) / steps  # of arclength: the rod's length is 6
    for _ in range(steps if step else 0):
        k1 = slope(u, state.par)
        k2 = slope(u + step / 2 * k1, state.par)
        k3 = slope(u + step / 2 * k2, state.par)
        u = u + step / 6 * (k1 + 2 * k2 + 2 * k3 + slope(u + step * k3, state.par))
    return math.hypot(u[7], u[8])


def slope(u: np.ndarray, par: np.ndarray) -> np.ndarray:
    """The right-hand side of hemitropic.f90, without eps and delta, which are zero."""
    a, w, m = u[0], u[1:4], u[4:7]
    force = np.array([0.0, par[1], par[2]])
    n = (a * a - w @ w) * force + 2 * (w @ force) * w - 2 * a * np.cross(w, force)
    k = np.array([m[0], m[1], 10 * m[2] + 3 * n[2]])
    v = np.array([0.0, 0.0, 1 + n[2] + 3 * m[2]])
    dr = (a * a - w @ w) * v + 2 * (w @ v) * w + 2 * a * np.cross(w, v)
    return np.concatenate([[-w @ k / 2], (a * k + np.cross(w, k)) / 2, -np.cross(k, m) - np.cross(v, n), dr])


CORD = Scene(
    name="cord",
    sources=("rod", "cord"),
    ndim=10,
    nbc=13,
    icp=(1, 2, 3, 4, 5),
    free=4,
    ordinate=5,
    branches=(
        Branch(
            "straight",
            (
                Target("first branch point", "BP", 49.34802200544679),
                Target("second branch point", "BP", 8.063525384097708, 1),
            ),
            ds=-0.5,
            dsmax=5.0,
            stop=(0.0,),
        ),
        Branch(
            "branch 1",
            (Target("1 - r3(1) at lam = 40", "UZ", 0.5793314271, at=40.0),),
            ds=0.1,
            dsmax=5.0,
            stop=(49.5,),
            until="BP1",
            start=0,
        ),
        Branch(
            "branch 2",
            (
                Target("fold", "LP", 7.8065554232),
                Target("1 - r3(1) at lam = 40", "UZ", 0.4471009289603, at=40.0),
            ),
            ds=0.1,
            dsmax=5.0,
            stop=(60.0,),
            start=1,
        ),
    ),
    note="branch 1 ends where it meets another branch, at lam = 35.80",
)

HEMITROPIC = Scene(
    name="hemitropic",
    sources=("rod", "hemitropic_law", "hemitropic"),
    ndim=10,
    nbc=14,
    icp=(1, 2, 3, 4, 5),
    free=5,
    ordinate=midpoint,
    branches=(
        Branch(
            "straight",
            (
                Target("first branch point", "BP", 0.114304214520030),
                Target("second branch point", "BP", 0.332039079723330, 1),
            ),
            ds=0.01,
            dsmax=0.2,
            stop=(0.95,),
        ),
        Branch(
            "branch 1",
            (Target("mid-point displacement at lam = 0.5", "UZ", 1.7290345503, at=0.5),),
            ds=0.01,
            dsmax=0.2,
            stop=(0.95,),
            start=0,
        ),
        Branch(
            "branch 2",
            (
                Target("fold", "LP", 0.321650086557),
                Target("mid-point displacement at lam = 0.5", "UZ", 0.6290085085226, at=0.5),
            ),
            ds=0.01,
            dsmax=0.2,
            stop=(0.6,),
            start=1,
        ),
    ),
    note="branch 2 stops at lam = 0.6: at 0.6124 the stretch reaches zero, which AUTO does not notice",
)

RULER = Scene(
    name="ruler",
    sources=("rod", "ruler"),
    ndim=8,
    nbc=8,
    icp=(1, 2),
    free=1,
    ordinate=2,
    branches=(
        Branch("plane", (Target("first branch point", "BP", 4.42594840243),), ds=0.1, dsmax=0.5, stop=(12.0,)),
        Branch(
            "branch 1",
            (Target("tip displacement at lam = 8", "UZ", 0.4647694690790, at=8.0),),
            ds=0.1,
            dsmax=0.5,
            stop=(12.0,),
            start=0,
        ),
    ),
)

FOLLOWER = Scene(
    name="follower",
    sources=("rod", "follower"),
    ndim=7,
    nbc=10,
    icp=(1, 2, 3, 4),
    free=4,
    branches=(Branch("straight", (), ds=0.5, dsmax=2.0, stop=(25.0,)),),
    note="no branch point up to P = 25: nothing for statics to find",
)

FLUTTER = Scene(
    name="flutter",
    sources=("flutter",),
    ndim=4,
    nbc=5,
    icp=(1, 2),
    free=2,
    ordinate=2,
    branches=(
        Branch(
            "mu1, mu2",
            (
                Target("flutter load", "LP", 20.0509536189738),
                Target("mu1 at P = 10", "UZ", 26.7885149853, 0, at=10.0),
                Target("mu2 at P = 10", "UZ", 345.468944394, 1, at=10.0),
            ),
            ds=0.5,
            dsmax=20.0,
            stop=(-1.0,),
        ),
    ),
    note="vibrations about the straight rod, linearised by hand: AUTO does not do that",
)

HALF = replace(
    HEMITROPIC,
    name="hemitropic-half",
    sources=("rod", "hemitropic_law", "hemitropic_half"),
    nbc=12,
    icp=(1, 2, 3, 4),
    free=3,
    ordinate=4,
    note="half the rod, using the flip symmetry",
)

SCENES = {scene.name: scene for scene in (CORD, HEMITROPIC, HALF, RULER, FOLLOWER, FLUTTER)}


# --- AUTO


@cache
def folder() -> Path:
    """Where programs and AUTO's files go; removed in the end."""
    path = Path(tempfile.mkdtemp(prefix="rodfem-auto-"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


def require_auto() -> None:
    """Say what to install if something is missing."""
    if not (AUTO / "main.o").exists():
        raise AutoError(f"AUTO-07p was not found in {AUTO}: install Debian's package auto-07p, or set AUTO_LIB.")
    if shutil.which("gfortran") is None:
        raise AutoError("gfortran was not found: install Debian's package gfortran.")


def compiled(scene: Scene, *more: str, link: Iterable[Path]) -> Path:
    """A program from the scene's Fortran, and the objects given."""
    work = folder() / "-".join((scene.name, *more))
    work.mkdir(exist_ok=True)
    sources = [str(HERE / f"{name}.f90") for name in (*scene.sources, *more)]
    done = subprocess.run(
        ["gfortran", *FLAGS, "-w", *sources, *map(str, link), "-o", "program"], cwd=work, capture_output=True, text=True
    )
    if done.returncode:
        raise AutoError(f"gfortran could not compile {scene.name}: {done.stderr.strip()}")
    return work / "program"


@cache
def program(name: str) -> Path:
    """The scene linked with AUTO."""
    require_auto()
    return compiled(SCENES[name], link=sorted(AUTO.glob("*.o")))


def check(scene: Scene) -> list[float]:
    """Largest deviations of df/du, df/dp, db/du, db/dp from central differences, relative to the matrix."""
    executable = compiled(scene, "check", link=())
    arguments = [str(executable), str(scene.ndim), str(scene.nbc), str(scene.free)]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True)
    return [float(word) for word in done.stdout.split()]


def user_time(executable: Path, cwd: Path) -> float:
    """Run on one core; user time in seconds. A run that loses its way on a coarse mesh is stopped by the system."""
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    with open(cwd / "log", "w") as log:
        command = ["sh", "-c", f"ulimit -t {LIMIT}; exec {executable}"]
        process = subprocess.Popen(command, cwd=cwd, stdout=log, stderr=log, env=environment)
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode < 0:
        raise AutoError(f"AUTO was stopped by signal {-process.returncode} in {cwd.name}.")
    return usage.ru_utime


@cache
def start_time(executable: Path) -> float:
    """User time of starting the process: AUTO without its constants stops at once."""
    cwd = folder() / "start"
    cwd.mkdir(exist_ok=True)
    return statistics.median(user_time(executable, cwd) for _ in range(9))


def constants(scene: Scene, branch: Branch, label: int, ntst: int, ncol: int, tol: float, dsmax: float) -> str:
    """AUTO's constants file."""
    crossings = {target.at for target in branch.targets if target.at is not None}
    lines = [
        f"NDIM={scene.ndim}, IPS=4, IRS={label}, ILP=1, NPAR=12",
        f"ICP={list(scene.icp)}",
        f"NTST={ntst}, NCOL={ncol}, IAD=3, ISP=2, ISW={-1 if label else 1}, IPLT=0, NBC={scene.nbc}, NINT=0",
        "NMX=400, NPR=500, MXBF=0, IID=0, ITMX=9, ITNW=7, NWTN=3, JAC=1",
        f"EPSL={tol}, EPSU={tol}, EPSS={10 * tol}",
        f"DS={math.copysign(min(abs(branch.ds), dsmax), branch.ds)}, DSMIN=1e-6, DSMAX={dsmax}, IADS=1",
    ]
    lines += [f"UZR={{{scene.icp[0]}: {sorted(crossings)}}}"] if crossings else []
    lines += [f"UZSTOP={{{scene.icp[0]}: {list(branch.stop)}}}"] if branch.stop else []
    lines += [f"SP=['{branch.until}']"] if branch.until else []
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class Row:
    """A line of fort.7."""

    kind: str
    label: int
    par: dict[int | None, float]


def rows(path: Path, scene: Scene) -> list[Row]:
    """The accepted points. Columns: branch, point, type, label, first parameter, norm, maxima, other parameters."""
    result = []
    for line in path.read_text().splitlines():
        words = line.split()
        if len(words) < 5 or words[0] == "0":
            continue
        type_, label = int(words[2]) % 10, int(words[3])
        type_ = int(words[2]) if int(words[2]) < 0 else type_
        numbers = [float(word) for word in words[4:]]
        maxima = len(numbers) - 1 - len(scene.icp)
        others = numbers[2 + maxima :]
        result.append(Row(NAMES.get(type_, ""), label, dict(zip(scene.icp, [numbers[0], *others], strict=True))))
    return result


def state(path: Path, label: int) -> State:
    """A labelled solution of fort.8: a header, rows (t, u), free parameters, directions, all parameters."""
    lines = path.read_text().splitlines()
    position = 0
    while position < len(lines):
        header = [int(word) for word in lines[position].split()]
        (found, points, width, length, _, ncol), npar = (header[i] for i in (3, 6, 7, 8, 9, 10)), header[11]
        if found == label:
            body = np.array(" ".join(lines[position + 1 : position + 1 + length]).split(), dtype=float)
            values, par = body[: points * width].reshape(points, width), body[-npar:]
            return State(values[:, 0], values[:, 1:], par, ncol)
        position += 1 + length
    raise AutoError(f"AUTO did not write the solution with label {label}.")


def trace(
    scene: Scene, ntst: int, ncol: int, tol: float, dsmax: float | None = None, runs: int = 5, only: str | None = None
) -> list[Traced]:
    """All branches of the scene, or only one; `dsmax` is the largest step on what leaves the trivial branch.

    With `only`, the trivial branch is traced once, for what leaves it to start from.
    """
    executable = program(scene.name)
    work = folder() / f"{scene.name}-run"
    work.mkdir(exist_ok=True)
    for name in ("fort.3", "fort.7", "fort.8"):
        (work / name).unlink(missing_ok=True)
    labels: list[int] = []
    result = []
    for branch in scene.branches:
        if branch.start is not None and only not in (None, branch.name):
            continue
        label = 0
        if branch.start is not None:
            if branch.start >= len(labels):
                break  # the mesh is too coarse to see the branch point
            label = labels[branch.start]
            shutil.copy(work / "trunk.8", work / "fort.3")
        step = branch.dsmax if dsmax is None or (branch.start is None and len(scene.branches) > 1) else dsmax
        (work / "fort.2").write_text(constants(scene, branch, label, ntst, ncol, tol, step))
        times = [user_time(executable, work) for _ in range(runs if only in (None, branch.name) else 1)]
        points = rows(work / "fort.7", scene) if (work / "fort.7").exists() else []
        if not points:
            raise AutoError(f"AUTO found no point of {scene.name}, {branch.name}: {(work / 'log').read_text()[-300:]}")
        if branch.start is None:
            labels = [row.label for row in points if row.kind == "BP"]
            shutil.copy(work / "fort.8", work / "trunk.8")
            if only not in (None, branch.name):
                continue
        values = {target.name: value(scene, target, points, work) for target in branch.targets}
        result.append(
            Traced(
                scene=scene.name,
                name=branch.name,
                ntst=ntst,
                ncol=ncol,
                tol=tol,
                dsmax=step,
                points=len(points),
                seconds=max(statistics.median(times) - start_time(executable), 0.0),
                runs=runs,
                special=[(row.kind, row.par[scene.icp[0]]) for row in points if row.label],
                values=values,
                errors={t.name: abs(values[t.name] / t.reference - 1) for t in branch.targets},
                complete=points[-1].kind == ("BP" if branch.until else "UZ"),
                loads=[row.par[scene.icp[0]] for row in points],
            )
        )
    return result


def value(scene: Scene, target: Target, points: list[Row], work: Path) -> float:
    """What AUTO found for a target; nan if nothing."""
    load = scene.icp[0]
    if target.at is None:
        found = [row for row in points if row.kind == target.kind]
        return found[target.number].par[load] if target.number < len(found) else math.nan
    found = [row for row in points if row.kind == "UZ" and abs(row.par[load] - target.at) < 1e-5 * abs(target.at)]
    if target.number >= len(found):
        return math.nan
    row = found[target.number]
    return scene.ordinate(state(work / "fort.8", row.label)) if callable(scene.ordinate) else row.par[scene.ordinate]


# --- which discretisation for which error

ACCURACIES = (1e-4, 1e-6, 1e-8)
SETTINGS = HERE / "settings.json"  # scene -> branch -> accuracy -> [NTST, NCOL, tol]; written by --sweep


def sweep(scene: Scene, accuracies: Iterable[float] = ACCURACIES) -> dict[str, dict[str, list[float]]]:
    """The fastest NTST, NCOL and tolerance for each branch and error, the better of two runs each.

    One counts only if the mesh a step finer is as accurate: an error can be small by chance.
    """
    meshes = (5, 6, 8, 10, 12, 14, 16, 20, 24, 30, 40, 60)
    best: dict[str, dict[str, list[float]]] = {branch.name: {} for branch in scene.branches if branch.targets}
    for accuracy, ncol, factor in itertools.product(accuracies, (3, 4, 5, 6, 7), (1e-1, 1e-2)):
        tol, key = float(f"{accuracy * factor:.0e}"), f"{accuracy:g}"
        before: dict[str, Traced] = {}
        done: set[str] = set()  # the branches for which a finer mesh, which is slower, need not be tried
        for ntst in meshes:
            now: dict[str, Traced] = {}
            for name in sorted(best.keys() - done):
                try:
                    now[name] = trace(scene, ntst, ncol, tol, runs=2, only=name)[-1]
                except (AutoError, IndexError):
                    continue
                old, new, entry = before.get(name), now[name], best[name].get(key)
                if old and all(b.name == name and b.complete and b.error <= accuracy for b in (old, new)):
                    done.add(name)
                    if entry is None or old.seconds < entry[3]:
                        best[name][key] = [old.ntst, ncol, tol, old.seconds]
                elif entry and new.complete and new.seconds > 2 * entry[3]:
                    done.add(name)
            before = now
    return {name: {key: entry[:3] for key, entry in found.items()} for name, found in best.items()}


def at_accuracy(scene: Scene, accuracy: float, dsmax: float | None, runs: int) -> list[Traced]:
    """Every branch, each with the discretisation that `settings.json` has for this error."""
    chosen = json.loads(SETTINGS.read_text())[scene.name]
    result = []
    for branch in scene.branches:
        entry = chosen.get(branch.name, {}).get(f"{accuracy:g}")
        if entry:
            result += trace(scene, int(entry[0]), int(entry[1]), entry[2], dsmax, runs, only=branch.name)
    return result


# --- the command line

HEADER = f"{'scene':16}{'branch':10}{'NTST':>5}{'NCOL':>5}{'tol':>8}{'error':>9}{'points':>8}{'ms/point':>10}{'s':>9}"


def line(traced: Traced) -> str:
    """A row of the table."""
    error = f"{traced.error:9.1e}" if traced.errors else f"{'-':>9}"
    return (
        f"{traced.scene:16}{traced.name:10}{traced.ntst:5}{traced.ncol:5}{traced.tol:8.0e}{error}"
        f"{traced.points:8}{traced.ms_per_point:10.3f}{traced.seconds:9.4f}"
    )


def arguments() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__.split("\n\n")[0].replace('r"""', ""), epilog="Scenes: " + ", ".join(SCENES) + "."
    )
    add = parser.add_argument
    add("scenes", nargs="*", metavar="scene", help="which (default: all)")
    add(
        "--accuracy",
        type=float,
        nargs="+",
        choices=ACCURACIES,
        default=list(ACCURACIES),
        help="as found by --sweep (default 1e-4 1e-6 1e-8)",
    )
    add("--ntst", type=int, help="mesh intervals, instead of --accuracy (default 20 with --ncol or --tol)")
    add("--ncol", type=int, help="collocation points in each, 2 to 7 (default 4)")
    add("--tol", type=float, help="AUTO's EPSL and EPSU; EPSS is ten times that (default 1e-9)")
    add("--dsmax", type=float, help="largest step on the branches (default: the scene's)")
    add("--runs", type=int, default=5, help="of which the median time counts (default 5)")
    add("--json", type=Path, metavar="FILE", help="write everything there")
    add("--sweep", action="store_true", help="find the fastest discretisation for each error; writes settings.json")
    add("--check", action="store_true", help="compare the derivatives with finite differences, and stop")
    options = parser.parse_args()
    unknown = [name for name in options.scenes if name not in SCENES]
    if unknown:
        parser.error(f"unknown scene {unknown[0]!r}: choose from {', '.join(SCENES)}")
    if options.ncol is not None and not 2 <= options.ncol <= 7:
        parser.error("AUTO takes 2 to 7 collocation points")
    if options.runs < 1:
        parser.error("at least one run is needed")
    return options


def main() -> None:
    """Print the table."""
    options = arguments()
    scenes = [SCENES[name] for name in options.scenes or SCENES]
    require_auto()
    if options.check:
        print(f"{'scene':16}    df/du      df/dp      db/du      db/dp   (deviation from central differences)")
        for scene in scenes:
            print(f"{scene.name:16}" + "".join(f"{number:11.1e}" for number in check(scene)))
        return
    if options.sweep:
        settings = json.loads(SETTINGS.read_text()) if SETTINGS.exists() else {}
        for scene in scenes:
            settings[scene.name] = sweep(scene)
        SETTINGS.write_text(json.dumps(settings, indent=1) + "\n")
        print(f"Settings for each error are in {SETTINGS}.")
        return
    print(HEADER)
    everything = []
    for scene in scenes:
        fixed = any(item is not None for item in (options.ntst, options.ncol, options.tol))
        if fixed or not any(branch.targets for branch in scene.branches):
            runs = [
                trace(scene, options.ntst or 20, options.ncol or 4, options.tol or 1e-9, options.dsmax, options.runs)
            ]
        else:
            runs = [at_accuracy(scene, accuracy, options.dsmax, options.runs) for accuracy in options.accuracy]
        for traced in itertools.chain(*runs):
            print(line(traced), flush=True)
            everything.append(traced)
        if scene.note:
            print(f"{'':16}({scene.note})")
    if options.json:
        rows = [asdict(t) | {"error": t.error, "ms_per_point": t.ms_per_point} for t in everything]
        options.json.write_text(json.dumps(finite(rows), indent=1) + "\n")


def finite(data):
    """The same without nan and infinity, which JSON does not know."""
    if isinstance(data, dict):
        return {key: finite(item) for key, item in data.items()}
    if isinstance(data, list | tuple):
        return [finite(item) for item in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


if __name__ == "__main__":
    try:
        main()
    except AutoError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        sys.exit(1)
