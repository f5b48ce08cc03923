"""A run on a terminal: colours, the live line, and a session as text."""

from __future__ import annotations

import io
import re
from pathlib import Path

import hemitropic_cases
import pytest
from hemitropic_cases import run_demo

from rodfem import Discretization, Plan, trace
from rodfem.app.colour import painted, wanted
from rodfem.app.terminal import Report
from rodfem.launcher import RANK

pytestmark = pytest.mark.alone
MESH = Discretization("reduced", 6, 3)


class Terminal(io.StringIO):
    """Text that takes itself for a terminal."""

    def isatty(self) -> bool:
        return True


def test_colour_is_for_terminals_and_can_be_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    for name in ("NO_COLOR", *RANK):
        monkeypatch.delenv(name, raising=False)
    assert wanted(Terminal()) and not wanted(io.StringIO())
    # ranks write into a terminal of mpirun's, wherever that writes
    for name, value in (("TERM", "dumb"), ("NO_COLOR", "1"), ("OMPI_COMM_WORLD_RANK", "0")):
        with monkeypatch.context() as changed:
            changed.setenv(name, value)
            assert not wanted(Terminal())


@pytest.mark.parametrize(
    ("line", "seen"),
    [
        ("  ! The mesh is unstable.", "\033[33m  ! The mesh is unstable.\033[0m"),
        ("branch 1", "\033[1mbranch 1\033[0m"),
        ("  BP   0.1", "  \033[36mBP\033[0m   0.1"),
        ("  is stable, then unstable", "  is \033[32mstable\033[0m, then \033[31munstable\033[0m"),
        ("  load", "  load"),
        ("", ""),
    ],
)
def test_colours(line: str, seen: str) -> None:
    assert painted(line) == seen


def test_the_live_line_says_what_is_known_and_what_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "160")
    scene, plan = hemitropic_cases.scene(span=(0.0, 0.2)), Plan(depth=1, error_bars=False)
    seen, plain = Terminal(), io.StringIO()
    for stream in (seen, plain):
        trace(scene, MESH, plan, Report(stream=stream))
    lines = re.findall(r"  \.\.\. [^\r]*", seen.getvalue())
    assert lines and all(len(line) < 80 for line in lines)
    assert "; 1 known, 1 waiting" in lines[-1] or "; 2 known, 0 waiting" in lines[-1]
    assert re.match(r"  \.\.\. straight: lam = 0\.\d+, index 0, \d+ points; 1 known, 0 waiting", lines[0])
    assert "..." not in plain.getvalue().replace("+ ...", "") and "\033" not in plain.getvalue()
    assert re.sub(r"\r?(  \.\.\. [^\r]*)?\r\x1b\[K|\r\x1b\[K", "", seen.getvalue()) == plain.getvalue()
    monkeypatch.setattr("rodfem.app.terminal.PAUSE", -1.0)  # a log of a long run has lines of progress that stay
    log = io.StringIO()
    trace(scene, MESH, plan, Report(stream=log))
    assert [
        line for line in log.getvalue().splitlines() if not line.startswith("  ... ")
    ] == plain.getvalue().splitlines()
    assert log.getvalue().count("\n  ... straight: lam = ") > 2
    monkeypatch.setenv("COLUMNS", "60")  # a narrow window breaks lines between words
    narrow = Terminal()
    trace(scene, MESH, plan, Report(stream=narrow))
    lines = re.sub(r"\r\x1b\[K", "", re.sub(r"  \.\.\. [^\r]*\r\x1b\[K", "", narrow.getvalue())).splitlines()
    assert max(map(len, lines)) <= 60 and "".join(lines).split() == "".join(plain.getvalue().splitlines()).split()


def test_most_branches() -> None:
    scene = hemitropic_cases.scene(span=(0.0, 0.5))
    found = trace(scene, MESH, Plan(most_branches=1, error_bars=False))
    assert len(found) == 1 and sum(s.to_follow for s in found.special()) == 2
    assert found.in_words().endswith("2 branch points were not followed.")


def test_a_quick_look(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    common = ("--range", "0", "0.5", "--elements", "6", "--degree", "3", "--output", str(folder))
    run_demo(*common, "--quick", "--most-branches", "2")
    out = capfd.readouterr().out
    assert "no estimate" in out and not list(folder.glob("*.png"))
    assert "1 branch point was not followed, as there are 2 branches: --most-branches 4 follows what leaves" in out
    assert "The first branch, straight, is stable from lam = 0 to 0.11" in out
    assert "\033" not in out
