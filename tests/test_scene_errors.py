"""Bad input ends with one sentence and status 2, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI
from rods import run_demo

from rodfem.ends import clamped, free
from rodfem.errors import SceneError
from rodfem.fields import Discretization
from rodfem.scene import Ordinate, Parameter, Scene
from rodfem.system import System

pytestmark = pytest.mark.short

BAD = [
    "--elements 0",
    "--elements -3",
    "--elements 2.5",
    "--degree 0",
    "--degree 13",
    "--degree six",
    "--formulation foo",
    "--range 0 1.5",
    "--range 1 0.5",
    "--range 0.5 0.5",
    "--range 0",
    "--range nan 0.5",
    "--range 0 inf",
    "--range=-inf 0.5",
    "--at 2",
    "--at -0.1",
    "--at nan",
    "--at inf",
    "--twisting 0.5",  # 10 B < A^2: the energy is not convex
    "--twisting nan",
    "--coupling inf",
    "--coupling -3.2",
    "--bending -1",
    "--bending 0",
    "--bending inf",
    "--half-length 0",
    "--half-length -1",
    "--half-length nan",
    "--half-length inf",
    "--spectrum -1",
    "--spectrum 1.5",
    "--colour blue",
    "blue",
    "--output /proc/nowhere",
    "--output",
]


@pytest.mark.parametrize("arguments", BAD)
def test_bad_input(
    arguments: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def compute(*_: object, **__: object) -> None:
        raise AssertionError("set up a system for bad input")

    monkeypatch.setattr(System, "__init__", compute)
    output = folder / "out"
    with pytest.raises(SystemExit) as ended:
        run_demo(*(["--output", str(output)] if "--output" not in arguments else []), *arguments.split())
    out, err = capfd.readouterr()
    assert ended.value.code == 2
    assert not output.exists()
    if MPI.COMM_WORLD.rank == 0:
        assert err.startswith("error: ")
        assert err.endswith(".\n")
        assert err.count("\n") == 1
        assert out == ""
    else:
        assert out == err == ""


def ordinate(s: float = 0.0) -> Ordinate:
    return Ordinate("nothing", s=s, of=lambda r, q: 0.0)


GOOD: dict[str, Any] = {
    "name": "cantilever",
    "interval": (0.0, 1.0),
    "rod": "flexible",
    "energy": lambda v, k, c: 0.5 * (v[0] ** 2 + v[1] ** 2 + (v[2] - 1) ** 2 + k[0] ** 2 + k[1] ** 2 + c.B * k[2] ** 2),
    "parameters": {"F": Parameter(0.0), "B": Parameter(2.0)},
    "load": "F",
    "ends": (clamped(), free(lambda c: (0, 0, c.F))),
    "ordinate": ordinate(),
    "span": (0.0, 1.0),
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"interval": (1.0, 0.0)}, "interval"),
        ({"interval": (0.0, float("nan"))}, "interval"),
        ({"rod": "stiff"}, "kind of rod"),
        ({"load": "G"}, "not a parameter"),
        ({"parameters": {"F": Parameter(0.0), "B": Parameter(2.0, admissible=(3.0, 4.0))}}, "admissible"),
        ({"parameters": {"F": Parameter(0.0), "B": Parameter(-2.0)}}, "not convex"),
        ({"ordinate": ordinate(2.0)}, "not on the rod"),
        ({"span": (0.3, 0.3)}, "empty"),
        ({"ends": (free(), free())}, "drift away"),
        ({"ends": (clamped(lambda c: (0, None, 0)), free())}, "drift away"),
    ],
)
def test_bad_scene(change: dict, words: str) -> None:
    Scene(**GOOD)
    with pytest.raises(SceneError, match=words):
        Scene(**(GOOD | change))


@pytest.mark.parametrize(
    "make", [lambda: Discretization("mixed"), lambda: Discretization(elements=0), lambda: Discretization(degree=0)]
)
def test_bad_discretization(make: Callable[[], Discretization]) -> None:
    with pytest.raises(SceneError, match=r"choose|give"):
        make()
