"""Files that are corrupt, cut off, foreign or of another version: refused in one sentence by every reader."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import hemitropic_cases
import numpy as np
import pytest

import rodfem
from rodfem import Discretization, Plan
from rodfem.app import console
from rodfem.errors import InputError
from rodfem.output import plot_diagram, plot_modes, render

pytestmark = pytest.mark.alone
SCENE = hemitropic_cases.scene(span=(0.0, 0.1))


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run, with modes."""
    folder = tmp_path_factory.mktemp("good")
    plan = Plan((0.0, 0.1), at=(0.05,), depth=0, modes=2, error_bars=False)
    rodfem.run(SCENE, Discretization("reduced", 8, 6), plan, folder, figures=False, quiet=True)
    assert rodfem.load(folder, SCENE)["straight"].points[-1].load == 0.1
    return folder


@pytest.fixture
def bad(good: Path, tmp_path: Path) -> Path:
    """Copy of it, to be spoiled."""
    return Path(shutil.copytree(good, tmp_path / "bad"))


def refused(read: Callable[[], Any], capfd: pytest.CaptureFixture[str]) -> str:
    """Sentence with which a function, or a program, refuses."""
    try:
        status = read()
    except InputError as trouble:
        return str(trouble)
    out, err = capfd.readouterr()
    assert (status, out) == (2, ""), f"read without a word: {status!r}"
    return err.rstrip("\n")


def changed(*path: str | int, to: Any = ...) -> Callable[[dict[str, Any]], None]:
    def change(data: Any) -> None:
        for key in path[:-1]:
            data = data[key]
        if to is ...:
            del data[path[-1]]
        else:
            data[path[-1]] = to

    return change


TEXTS = ["", " ", "[]", '[{"branches": []}]', "3", "null", '"a"', "{}", "\0" * 99, "[" * 100_000, '{"branches": [']
TEXTS += ['{"format": {"name": "rodfem diagram", "version": 1}, "branches": NaN}']
B, C, S = ("branches", 0), ("branches", 0, "columns"), ("branches", 0, "special", 0)
ENTRIES: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (changed("format", "version", to=99), "reads versions up to 1"),
    (changed("format", "version", to="1"), "version '1'"),
    (changed("format", "version", to=True), "version True"),
    (changed("format", "name", to="rodfem locus"), "has the format 'rodfem locus'"),
    (changed("format", to=[1]), "has the format"),
    *((changed(name), f"has no {name}") for name in ("scene", "parameter", "range", "meshes", "constants", "branches")),
    (changed("range", to=[0, 1, 2]), "two finite numbers"),
    (changed("range", to=[0, 10**400]), "two finite numbers"),
    (changed("constants", to={"A": "3"}), "numbers by name"),
    (changed("branches", to=3), "a list of objects"),
    (changed("branches", to=[3]), "a list of objects"),
    (changed("branches", to=[]), "in the place of a list of objects, one or more"),
    (changed("meshes", to=[]), "in the place of a list of objects, one or more"),
    (changed("meshes", 0, "elements", to=-7), "a whole number"),
    (changed("meshes", 0, "elements", to=10**9), "too large"),
    (changed("meshes", 0, "vertices", to=["a"]), "a list of numbers"),
    (changed(*B, "name", to="../../etc"), "a name without slashes"),
    (changed(*B, "parent", to=["a"]), "a name and a number"),
    (changed(*B, "columns", to=[]), "lists by name"),
    (changed(*B, "columns"), "has no columns"),
    (changed(*C, "load", to=[]), "one length"),
    (changed(*C, "load", to=3), "lists by name"),
    (changed(*C, "load", 0, to=None), "a finite number"),
    (changed(*C, "load", 0, to="a"), "a finite number"),
    (changed(*C, "load", 1, to=0.0123), "another load in row 1"),
    (changed(*C, "mesh", 0, to=5), "row of mesh 5, of 1"),
    (changed(*C, "negative", 0, to=0.5), "a whole number"),
    (changed(*C, "energy"), "has no energy"),
    (changed(*C, "load"), "has no load"),
    (changed(*S, "ordinate"), "special point 0, has no ordinate"),
    (changed(*S, "row", to=99999), "in row 99999"),
    (changed(*S, "row", to=-7), "a whole number"),
    (changed(*S, "kind", to="foo"), "one of branch point"),
    (changed(*S, "law", to={"kind": 3}), "a text"),
    (changed(*B, "unexplained", to=[{"row": 9999}]), "in row 9999"),
]


@pytest.mark.few(1)
@pytest.mark.parametrize("text", TEXTS, ids=range(len(TEXTS)))
def test_texts(text: str, bad: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = bad / "diagram.json"
    path.write_text(text)
    readers = (
        lambda: rodfem.load_json(path),
        lambda: rodfem.load(bad, SCENE),
        lambda: plot_diagram.main([str(path), "--output", str(bad / "a.png")]),
    )
    for read in readers:
        sentence = refused(read, capfd)
        assert str(path) in sentence
        assert "\n" not in sentence
    assert not (bad / "a.png").exists()


@pytest.mark.parametrize(("change", "words"), ENTRIES)
def test_entries(change: Callable[[dict[str, Any]], None], words: str, good: Path, bad: Path, capfd: Any) -> None:
    data = json.loads((good / "diagram.json").read_text())
    change(data)
    (bad / "diagram.json").write_text(json.dumps(data))
    sentence = refused(lambda: rodfem.load(bad, SCENE), capfd)
    assert words in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize("entry", [(*C, "ordinate"), (*S, "load"), (*S, "zero"), (*S, "negative_before")])
def test_a_table_of_what_is_not_there(entry: tuple[str | int, ...], good: Path, bad: Path) -> None:
    """``rodfem info`` ended with KeyError: 'load'."""
    data = json.loads((good / "diagram.json").read_text())
    changed(*entry)(data)
    (bad / "diagram.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match=f"has no {entry[-1]}: run the scene again"):
        console.info([str(bad)])


def put(name: str, value: Any) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        if name in file:
            del file[name]
        file[name] = value

    return change


def attribute(name: str, value: Any) -> Callable[[h5py.File], None]:
    return lambda file: file.attrs.__setitem__(name, value)


HERE = "branches/straight"
STATES: list[tuple[bytes | Callable[[h5py.File], None], str]] = [
    (b"", "states.h5"),
    (b"text", "states.h5"),
    (b"\x89HDF\r\n\x1a\n" + b"\0" * 4000, "states.h5"),
    (attribute("format", "rodfem modes"), "has the format 'rodfem modes'"),
    (attribute("format_version", 99), "reads versions up to 1"),
    (attribute("format_version", "x"), "version 'x'"),
    (put("branches", 3.0), "states.h5"),
    (put(f"{HERE}/q", 3.0), "states.h5"),
    (put(f"{HERE}/q", "abc"), "states.h5"),
    (put(f"{HERE}/s", np.full((50, 49), np.nan)), "states.h5"),
]
LOADED: list[tuple[bytes | Callable[[h5py.File], None], str]] = [
    (attribute("formulation", "foo"), "of the foo formulation"),
    (put(f"{HERE}/elements", np.zeros(500)), "no elements"),
    (put(f"{HERE}/q", np.zeros((500, 49, 4))), "no rotation somewhere"),
    (put(f"{HERE}/q", np.ones((500, 7, 4))), "is no state of the scene"),
    (put(f"{HERE}/n1", np.ones(500) * 1j), "not real and finite"),
]


def spoil(path: Path, change: bytes | Callable[[h5py.File], None]) -> None:
    if isinstance(change, bytes):
        path.write_bytes(change)
        return
    with h5py.File(path, "a") as file:
        change(file)


@pytest.mark.few(9)
@pytest.mark.parametrize(("change", "words"), STATES)
def test_states(change: Any, words: str, bad: Path, capfd: Any) -> None:
    path = bad / "states.h5"
    spoil(path, change)
    for read in (
        lambda: rodfem.load(bad, SCENE),
        lambda: render.main([str(path), "--branch", "straight", "--row", "0", "--output", str(bad / "a.png")]),
    ):
        sentence = refused(read, capfd)
        assert words in sentence
        assert "\n" not in sentence


@pytest.mark.few(3)
@pytest.mark.parametrize(("change", "words"), LOADED)
def test_states_of_no_rod(change: Any, words: str, bad: Path, capfd: Any) -> None:
    spoil(bad / "states.h5", change)
    assert words in refused(lambda: rodfem.load(bad, SCENE), capfd)


@pytest.mark.few(17)
@pytest.mark.parametrize("name", ["load", "s", "r", "q", "value", "motion", "displacement"])
@pytest.mark.parametrize("value", [3.5, "abc", np.zeros((1, 1)), h5py.SoftLink("/branches")], ids=range(4))
def test_modes(name: str, value: Any, bad: Path, capfd: Any) -> None:
    path = bad / "modes.h5"
    with h5py.File(path) as file:
        (row,) = file["branches/straight"]
    if name == "load" and value == 3.5:
        value = np.nan
    spoil(path, put(f"branches/straight/{row}/{name}", value))
    for read in (
        lambda: rodfem.load_modes(path, "straight", int(row)),
        lambda: plot_modes.main([str(path), "--branch", "straight", "--row", row, "--output", str(bad / "a.png")]),
    ):
        sentence = refused(read, capfd)
        assert "modes.h5" in sentence
        assert "\n" not in sentence


def test_results_of_many(tmp_path: Path) -> None:
    """A result that cannot be read is computed anew; one of another format is not written over."""
    path = tmp_path / "rod-00000.json"
    for text in ("", "[]", '{"key": 3', "\0"):
        path.write_text(text)
        assert rodfem.many([SCENE], lambda rod: {"a": 1}, tmp_path) == [{"a": 1}]
    path.write_text('{"format": {"name": "rodfem diagram", "version": 1}}')
    with pytest.raises(InputError, match="has the format 'rodfem diagram'"):
        rodfem.many([SCENE], lambda rod: {"a": 1}, tmp_path)
