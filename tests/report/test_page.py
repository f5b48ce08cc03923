"""The page of a report: made from files alone, whole, without network, and harmless whatever its texts are."""

import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from output.test_formats import MESH, made
from problem.test_docs import scenes

from rodfem import InputError, Plan, run
from rodfem.app import console
from rodfem.report.page import STATIC, page_of, payload_of

KINDS = ("pinned", "locus", "planar", "follower", "ring", "foundation", "guided", "accurate")
HOSTILE = "</script><img src=x onerror=alert(1)>{{payload}}"


class Elements(HTMLParser):
    """Elements of a page with their attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def names(self) -> list[str]:
        return [tag for tag, _ in self.found]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders of small runs of different kinds."""
    folder = made(tmp_path_factory.mktemp("report"), *KINDS)
    plan = Plan((0.0, 1.0), depth=0, error_bars=False)
    run(scenes()["euler"], MESH, plan, folder / "short", figures=False, quiet=True)
    return folder


@pytest.mark.long
@pytest.mark.parametrize("name", KINDS)
def test_every_kind_of_run_has_a_page(results: Path, name: str) -> None:
    payload = payload_of(results / name)
    text = page_of(payload)
    data = json.loads(re.search(r'id="payload">(.*?)</script>', text, re.S)[1])  # type: ignore[index]
    saved = json.loads((results / name / "diagram.json").read_text())
    for shown, branch in zip(data["branches"], saved["branches"], strict=True):
        rows = len(branch["columns"]["load"])
        assert shown["load"] == branch["columns"]["load"] and len(shown["words"]) == rows
        assert shown["shape"]["shape"][0] == rows == len(shown["bodies"])
        assert shown["maps"]["shape"][0] == sum(map(len, shown["bodies"]))
        assert shown["pieces"][0]["rows"][0] == 0 and shown["pieces"][-1]["rows"][1] == rows - 1
        assert all(len(column) == rows for column in shown["ordinates"].values())
        rows = {0, len(branch["columns"]["load"]) - 1} | {special["row"] for special in branch["special"]}
        assert rows <= {int(row) for row in shown["modes"]} and not shown["missed"]
        for modes in shown["modes"].values():
            assert all(values["shape"] == [data["s"]["shape"][0], 6] for mode in modes for values in mode["parts"])
    assert bool(data["loci"]) == (name == "locus")
    exact = [mode["words"] for branch in data["branches"] for modes in branch["modes"].values() for mode in modes]
    assert any(re.search(r"\(\de-", words) for words in exact) == (name == "pinned")
    assert dict(data["origin"])["command"] and "dolfinx" in dict(data["origin"])["versions"]


def test_reactions_are_ordinates_with_bars(results: Path) -> None:
    """A column under the thrust P: its foot pushes with P along the axis, the load at its head is no support's."""
    branches = payload_of(results / "pinned")["branches"]
    for branch in branches:
        found = branch["ordinates"]["reaction force e₃, left end"]
        assert found == pytest.approx(branch["load"], rel=1e-6, abs=1e-9)
        assert "reaction force e₃, right end" not in branch["ordinates"]
        for special in branch["special"]:
            bar = branch["readings"][special["row"]]["reaction force e₃, left end"]
            assert re.fullmatch(r"[\d.]+ \(\de-\d+\)", bar)


def test_of_too_many_states_the_nearest_is_drawn(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A page of 3,218 states has 8.7 MB for 13.9: special ones, the ends and every n-th have shapes and profiles."""
    everything = payload_of(results / "pinned")["branches"]
    states = sum(len(branch["load"]) for branch in everything)
    monkeypatch.setattr("rodfem.report.rods.BUDGET", 49 * (states // 3))
    for few, branch in zip(payload_of(results / "pinned")["branches"], everything, strict=True):
        (shapes, *_), rows = few["shape"]["shape"], len(branch["load"])
        own = [row for row in range(rows) if row in (0, rows - 1) or row in (s["row"] for s in branch["special"])]
        assert shapes == few["profile"]["shape"][0] == len(few["element"]) < rows == len(few["drawn"])
        assert sorted(set(few["drawn"])) == list(range(shapes)) and few["drawn"] == sorted(few["drawn"])
        assert len({few["drawn"][row] for row in own}) == len(own)
        assert branch["drawn"] == list(range(rows)) and few["bodies"] == branch["bodies"]


def test_the_page_needs_no_network_and_runs_no_text(results: Path) -> None:
    clean = payload_of(results / "short")
    plain = Elements(page_of(clean))
    hostile: dict[str, Any] = clean | dict.fromkeys(("title", "scene", "folder"), HOSTILE)
    hostile["constants"] = {HOSTILE: 1.0}
    hostile["branches"] = [branch | {"name": HOSTILE, "ended": HOSTILE} for branch in clean["branches"]]
    text = page_of(hostile)
    found = Elements(text)
    assert found.names() == plain.names() and found.names().count("script") == 4 and "img" not in found.names()
    assert "<img src=x" not in text
    links = [value for _, attributes in found.found for key, value in attributes.items() if key in ("src", "href")]
    assert links == ["data:,"]
    policy = next(a["content"] for tag, a in found.found if "http-equiv" in a)
    assert (
        policy is not None and "default-src 'none'" in policy and "'unsafe-inline'" not in policy.split("style-src")[0]
    )


def test_libraries_have_their_licences() -> None:
    vendor = {file.name for file in (STATIC / "vendor").iterdir()}
    assert {"LICENSE-plotly", "LICENSE-three"} <= vendor
    assert sum(len(file.read_bytes()) for file in (STATIC / "vendor").iterdir()) < 2_500_000


def test_unfit_folders_are_refused_in_a_sentence(results: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"There is no .*diagram.json: give the diagram.json"):
        payload_of(tmp_path)
    (tmp_path / "diagram.json").write_bytes((results / "short" / "diagram.json").read_bytes())
    with pytest.raises(InputError, match=r"states\.h5"):
        payload_of(tmp_path)
    (tmp_path / "states.h5").write_bytes((results / "pinned" / "states.h5").read_bytes())
    with pytest.raises(InputError, match="different runs"):
        payload_of(tmp_path)
    for file in ("diagram.json", "states.h5"):
        (tmp_path / file).write_bytes((results / "short" / file).read_bytes())
    (tmp_path / "modes.h5").write_bytes(b"none")
    with pytest.raises(InputError, match=r"modes\.h5"):
        payload_of(tmp_path)
    (tmp_path / "modes.h5").unlink()
    (tmp_path / "locus-1.json").write_text("{}")
    with pytest.raises(InputError, match="locus"):
        payload_of(tmp_path)


def test_commands(results: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(console.webbrowser, "open", opened.append)
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    console.main(["view", str(results / "short")])
    monkeypatch.setenv("DISPLAY", ":0")
    console.main(["view", str(results / "short"), "--no-open"])
    assert not opened and (results / "short" / "report.html").exists()
    console.main(["view", str(results / "short"), "--output", str(results / "a.html")])
    assert opened == [(results / "a.html").as_uri()]
    assert capsys.readouterr().out.splitlines()[-1] == str(results / "a.html")


@pytest.mark.long
def test_it_needs_neither_dolfinx_nor_mpi() -> None:
    program = "import sys, rodfem.report.page; print(*{'dolfinx', 'mpi4py'} & set(sys.modules))"
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert not out.strip()
