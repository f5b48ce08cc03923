"""A run on a pseudo-terminal: colours, the line that changes, interrupts; and a session as text."""

from __future__ import annotations

import io
import os
import pty
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import hemitropic_cases
import pytest
from hard.folders import surroundings

from rodfem import Discretization, Plan, trace
from rodfem.app.screen import coloured
from rodfem.app.terminal import Report, is_screen
from rodfem.ranks import RANK

pytestmark = pytest.mark.alone
HOME = Path(__file__).parents[2]
MESH = Discretization("reduced", 6, 3)
CONTROL = re.compile(r"\x1b\[[?\d;]*[a-zA-Z]")
SPINNING = re.compile(r"[⠀-⣿] ([^\r\n]*?) +\d:\d\d:\d\d")
"""A picture of the line that changes, without its control sequences."""
PATIENCE = 60.0


class Seen:
    """What a terminal is given, read as it comes: its buffer is small."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        self.parts: list[bytes] = []
        self.news = threading.Condition()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        while True:
            try:
                part = os.read(self.master, 65536)
            except OSError:  # Linux: nobody has the other end any more
                part = b""
            with self.news:
                if part:
                    self.parts.append(part)
                self.news.notify_all()
            if not part:
                return

    @property
    def text(self) -> str:
        return b"".join(self.parts).decode()

    def wait_for(self, words: str) -> None:
        with self.news:
            assert self.news.wait_for(lambda: words in self.text, PATIENCE), self.text[-2000:]

    def end(self) -> str:
        self.reader.join(PATIENCE)
        os.close(self.master)
        return self.text


@contextmanager
def terminal() -> Iterator[tuple[Seen, io.TextIOWrapper]]:
    seen = Seen()
    with open(seen.slave, "w") as stream:
        yield seen, stream
    seen.end()


def lines_that_stay(text: str) -> list[str]:
    """Lines as they stand on the terminal at the end: what is erased in the last one of them is gone."""
    text = re.sub(r"[^\n]*\n(?:\x1b\[\?25h)?\r\x1b\[1A\x1b\[2K", "", text.replace("\r\n", "\n"))
    return [line.rstrip() for line in CONTROL.sub("", re.sub(r"[^\n]*\x1b\[2K", "", text)).split("\n")]


@pytest.fixture(autouse=True)
def ordinary(monkeypatch: pytest.MonkeyPatch) -> None:
    """A terminal that nobody has restricted."""
    for name in ("NO_COLOR", "FORCE_COLOR", *RANK):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.setattr("rodfem.app.screen.SHORT", 0.0)


def test_what_a_terminal_is(monkeypatch: pytest.MonkeyPatch) -> None:
    with terminal() as (_, stream):
        assert is_screen(stream) and not is_screen(io.StringIO())
        # ranks write into a terminal of mpirun's, wherever that writes
        for name, value in (("TERM", "dumb"), ("OMPI_COMM_WORLD_RANK", "0")):
            with monkeypatch.context() as changed:
                changed.setenv(name, value)
                assert not is_screen(stream)
                assert not Report(stream=stream).live
        assert Report(stream=stream).live


@pytest.mark.parametrize(
    ("line", "seen"),
    [
        ("  ! The mesh is unstable.", "\033[33m  ! The mesh is unstable.\033[0m"),
        ("branch 1", "\033[1mbranch 1\033[0m"),
        ("  BP   0.1", "  \033[36mBP\033[0m   0.1"),
        ("  is stable, then unstable", "  is \033[32mstable\033[0m, then \033[31munstable\033[0m"),
        ("  load [bold] :warning:", "  load [bold] :warning:"),
        ("", ""),
    ],
)
def test_colours(line: str, seen: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert coloured(line).plain == line
    for refused in (False, True):
        if refused:
            monkeypatch.setenv("NO_COLOR", "1")  # https://no-color.org
        with terminal() as (screen, stream):
            Report(stream=stream).say(line)
        expected = re.sub(r"\x1b\[(3\d)m(.*?)\x1b\[0m", r"\2", seen) if refused else seen
        assert screen.text == expected + "\r\n"


def test_the_line_that_changes_says_what_is_known_and_what_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in 'branch 2.1, 7 known, 3 branch points left to follow, lam = 12.3'; lines that stay are those of a pipe."""
    scene, plan = hemitropic_cases.scene(span=(0.0, 0.2)), Plan(depth=1, error_bars=False)
    plain = io.StringIO()
    trace(scene, MESH, plan, Report(stream=plain))
    assert " left to follow, " not in plain.getvalue() and "\033" not in plain.getvalue()
    with terminal() as (seen, stream), Report(stream=stream) as report:
        trace(scene, MESH, plan, report)
        report.screen._progress.refresh()  # type: ignore[union-attr]
        report.say("the end")
    changing = [SPINNING.search(CONTROL.sub("", part)) for part in re.split(r"\r\x1b\[2K|\n", seen.text)]
    found = [one[1] for one in changing if one]
    line = r"[\w ]+, \d known, \d branch points? left to follow, lam = 0\.\d+, index \d, \d+ points"
    assert found and all(re.fullmatch(line, x) for x in found)
    assert re.match(r"(straight, 1 known, 1|branch 1, 2 known, 0) branch points? left to follow", found[-1])
    assert lines_that_stay(seen.text) == [*plain.getvalue().splitlines(), "the end", ""]
    assert seen.text.count("\x1b[?25l") == seen.text.count("\x1b[?25h") == 1  # the cursor is back


def test_a_log_of_a_long_run_has_lines_of_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, plan = hemitropic_cases.scene(span=(0.0, 0.2)), Plan(depth=1, error_bars=False)
    plain, log = io.StringIO(), io.StringIO()
    trace(scene, MESH, plan, Report(stream=plain))
    monkeypatch.setattr("rodfem.app.terminal.PAUSE", -1.0)
    trace(scene, MESH, plan, Report(stream=log))
    assert [x for x in log.getvalue().splitlines() if not x.startswith("  ... ")] == plain.getvalue().splitlines()
    assert log.getvalue().count("\n  ... straight, 1 known, 0 branch points left to follow, lam = ") > 2


@pytest.mark.long
def test_an_interrupt_is_one_sentence(folder: Path) -> None:
    """By the key, as a person does it: the terminal sends the signal.  The line that changes is gone by then."""
    command = ["run", str(HOME / "demos" / "cord.py"), "--elements", "200", "--no-figures", "--output", str(folder)]
    seen = Seen()
    session = "import os, fcntl, termios, runpy, sys; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    program = [sys.executable, "-c", session + "runpy.run_module('rodfem', run_name='__main__')", *command]
    child = subprocess.Popen(
        program,
        stdin=seen.slave,
        stdout=seen.slave,
        stderr=seen.slave,
        start_new_session=True,
        cwd=HOME,
        env=surroundings(),
    )
    os.close(seen.slave)
    seen.wait_for(" known, ")
    os.write(seen.master, b"\x03")
    assert child.wait(PATIENCE) == 128 + signal.SIGINT
    text = seen.end()
    assert lines_that_stay(text)[-2:] == [
        f"interrupted; the branches that were finished are in {folder}: rodfem.load reads them",
        "",
    ]
    assert "Traceback" not in text and text.count("\x1b[?25l") == text.count("\x1b[?25h") == 1


def test_a_pipe_needs_no_rich(folder: Path) -> None:
    program = (
        "import sys, rodfem; from rodfem.app.terminal import Report; Report().say('a line'); Report().working('work'); "
        "print([name for name in sys.modules if name.split('.')[0] == 'rich'])"
    )
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert out == "a line\n[]\n"


def test_most_branches() -> None:
    scene = hemitropic_cases.scene(span=(0.0, 0.5))
    found = trace(scene, MESH, Plan(most_branches=1, error_bars=False))
    assert len(found) == 1 and sum(s.to_follow for s in found.special()) == 2
    assert found.in_words().endswith("2 branch points were not followed.")
