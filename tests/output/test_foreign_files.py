"""Files that are corrupt, cut off, foreign or of another version: refused in one sentence by every reader."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import hemitropic_cases
import numpy as np
import pytest
from mpi4py import MPI

import rodfem
from rodfem import Discretization, InputError, Plan
from rodfem.app import console
from rodfem.output import render
from rodfem.whole_files import draft_of, locked

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


def refused(read: Callable[[], Any]) -> str:
    """Sentence with which a function refuses."""
    with pytest.raises(InputError) as trouble:
        read()
    return str(trouble.value)


def changed(*path: str | int, to: Any = ...) -> Callable[[dict[str, Any]], None]:
    def change(data: Any) -> None:
        for key in path[:-1]:
            data = data[key]
        if to is ...:
            del data[path[-1]]
        else:
            data[path[-1]] = to

    return change


TEXTS = ["", "[]", "3", "{}", "\0" * 99, "[" * 100_000, '{"branches": [']
ENTRIES: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (changed("format", "version", to=99), "reads versions up to 2"),
    (changed("format", "name", to="rodfem locus"), "its format is 'rodfem locus'"),
    *((changed(name), f"has no {name}") for name in ("scene", "range", "meshes")),
    (changed("branches", 0, "columns", "load", 1, to=0.0123), "another load in row 1"),
    (changed("branches", 0, "columns", "energy"), "'energy'"),
]


@pytest.mark.few(1)
@pytest.mark.parametrize("text", TEXTS, ids=range(len(TEXTS)))
def test_texts(text: str, bad: Path) -> None:
    path = bad / "diagram.json"
    path.write_text(text)
    readers = (lambda: rodfem.load_json(path), lambda: rodfem.load(bad, SCENE))
    for read in readers:
        sentence = refused(read)
        assert str(path) in sentence
        assert "\n" not in sentence
    assert not (bad / "a.png").exists()


@pytest.mark.parametrize(("change", "words"), ENTRIES)
def test_entries(change: Callable[[dict[str, Any]], None], words: str, good: Path, bad: Path) -> None:
    data = json.loads((good / "diagram.json").read_text())
    change(data)
    (bad / "diagram.json").write_text(json.dumps(data))
    sentence = refused(lambda: rodfem.load(bad, SCENE))
    assert words in sentence
    assert "\n" not in sentence


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
    (b"\x89HDF\r\n\x1a\n" + b"\0" * 4000, "states.h5"),
    (attribute("format", "rodfem modes"), "its format is 'rodfem modes'"),
    (attribute("format_version", 99), "reads versions up to 2"),
    (put(f"{HERE}/q", 3.0), "states.h5"),
    (put(f"{HERE}/s", np.full((50, 49), np.nan)), "states.h5"),
]


def spoil(path: Path, change: bytes | Callable[[h5py.File], None]) -> None:
    if isinstance(change, bytes):
        path.write_bytes(change)
        return
    with h5py.File(path, "a") as file:
        change(file)


@pytest.mark.few(5)
@pytest.mark.parametrize(("change", "words"), STATES)
def test_states(change: Any, words: str, bad: Path) -> None:
    path = bad / "states.h5"
    spoil(path, change)
    for read in (lambda: rodfem.load(bad, SCENE), lambda: render.draw_shape(path, "straight", 0, bad / "a.png")):
        sentence = refused(read)
        assert words in sentence
        assert "\n" not in sentence


@pytest.mark.parametrize("name", ["q", "motion"])
def test_modes(name: str, bad: Path) -> None:
    path = bad / "modes.h5"
    with h5py.File(path) as file:
        (row,) = file["branches/straight"]
    assert "has no modes of row 999 of a branch 'straight': it has " in refused(
        lambda: rodfem.load_modes(path, "straight", 999)
    )
    spoil(path, put(f"branches/straight/{row}/{name}", h5py.SoftLink("/branches")))
    sentence = refused(lambda: rodfem.load_modes(path, "straight", int(row)))
    assert "modes.h5" in sentence and "\n" not in sentence


def without(name: str) -> Callable[[h5py.File], None]:
    return lambda file: file.__delitem__(name)


def hollow(file: h5py.File) -> None:
    """45 GB of zeros, of which nothing is stored."""
    del file[f"{HERE}/r"]
    file.create_dataset(f"{HERE}/r", shape=(200_000, 20_000, 3), chunks=(1000, 100, 3), compression="gzip")


def pipe(path: Path) -> None:
    """What a reader waits for, for ever."""
    path.unlink()
    os.mkfifo(path)


def entries(folder: Path, *path: str | int, to: Any = ...) -> None:
    data = json.loads((folder / "diagram.json").read_text())
    changed(*path, to=to)(data)
    (folder / "diagram.json").write_text(json.dumps(data))


PROGRAMS: list[tuple[Callable[[Path], None], str, str]] = [
    (lambda bad: spoil(bad / "states.h5", without(f"{HERE}/r")), "view convert", "'r'"),
    (lambda bad: spoil(bad / "states.h5", put(f"{HERE}/s", np.zeros((50, 49)))), "view", "states.h5"),
    (lambda bad: entries(bad, "scene"), "info view", "has no scene"),
    (lambda bad: entries(bad, "branches", 0, "columns", "negative"), "info", "'negative'"),
    (lambda bad: entries(bad, "meshes", to=[3]), "info", "diagram.json"),
    (lambda bad: spoil(bad / "states.h5", hollow), "view convert load", "of the array branches/straight/r a part only"),
    (lambda bad: pipe(bad / "states.h5"), "view convert load", "regular file"),
    (lambda bad: pipe(bad / "diagram.json"), "info view convert load", "regular file"),
    (lambda bad: (bad / "states.h5").write_bytes(b"HDF"), "view convert load", "states.h5"),
]


@pytest.mark.parametrize(("change", "commands", "words"), PROGRAMS)
def test_programs(change: Callable[[Path], None], commands: str, words: str, bad: Path, capfd: Any) -> None:
    """A sentence without a wait: nothing is read that is larger than its file, or no file."""
    change(bad)
    for command in commands.split():
        if command == "load":
            with pytest.raises(InputError, match=words):
                rodfem.load(bad, SCENE)
            continue
        with pytest.raises(SystemExit):
            console.main([command, str(bad), *["--no-open"] * (command == "view")])
        said = capfd.readouterr().err
        assert said.count("\n") == 1 and words in said and said.startswith("error: ")


def test_links_out_of_a_folder(bad: Path, tmp_path: Path) -> None:
    """What is written takes the place of a link, whatever it points at."""
    mine = tmp_path / "mine"
    mine.write_text("mine")
    (bad / "csv").mkdir()
    for place in ("report.html", "csv/rows.csv"):
        with draft_of(bad / place) as draft:
            draft.write_text("")
        draft.symlink_to(mine)
        (bad / place).unlink()
        (bad / place).symlink_to(mine)
    console.main(["view", str(bad), "--no-open"])
    console.main(["convert", str(bad), "--to", "csv"])
    assert not any((bad / place).is_symlink() for place in ("report.html", "csv/rows.csv"))
    (bad / ".lock").symlink_to(mine)
    with pytest.raises(InputError, match="cannot be written"), locked(bad, MPI.COMM_SELF):
        pass
    assert mine.read_text() == "mine"


@pytest.mark.few(1)
def test_terminal_obeys_no_text_of_a_file(bad: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = json.loads((bad / "diagram.json").read_text())
    data["title"], data["scene"] = "\x1b]0;mine\x07 \\u001b \\", "\x1b[2J\x9b"
    (bad / "diagram.json").write_text(json.dumps(data))
    console.main(["info", str(bad)])
    console.main(["list", str(bad)])
    shown = capsys.readouterr().out
    assert "]0;mine" in shown and r"\u001b \: " in shown  # six characters and a backslash are what they are
    assert all(c.isprintable() or c == "\n" for c in shown)
