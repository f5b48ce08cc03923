"""The glossary has an entry for each word that tables, files and pictures use."""

import re
from pathlib import Path

import pytest

from rodfem.app import console
from rodfem.continuation.kinds import KINDS
from rodfem.errors import InputError
from rodfem.output.plot_diagram import MARKERS
from rodfem.output.plot_frequencies import COLORS, PARTS
from rodfem.output.plot_locus import LINES as LOCI
from rodfem.output.plot_locus import POINTS
from rodfem.output.style import LINES as STYLES
from rodfem.output.table import COLUMNS, ENTRIES, NAMES, PAGE, REMARK, SPECIAL, explanation

FILES = (Path(__file__).parents[2] / "docs" / "files.md").read_text()


def test_every_word_has_an_entry() -> None:
    words = {*KINDS, *(entry.name for entry in (*COLUMNS, *SPECIAL[1:])), *MARKERS, *STYLES, *PARTS, *COLORS}
    words |= {"image, not traced", "stable, as far as these curves tell", "range of flutter", "range of divergence"}
    words |= {str(style["label"]) for style in POINTS.values()}
    words |= {kind.code for kind in KINDS.values()}
    headings = {"load", "ordinate", "int W ds", "index", "zero", "located to", "unstable"}  # of the terminal
    columns = re.findall(r"^\| `(\w+)` \|.*", FILES.split("### `branches[].col")[1])
    for word in words | headings | set(columns):
        assert explanation(word), word


def test_the_page_of_files_has_the_table() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("| `")]
    assert len(rows) == len(COLUMNS) + len(SPECIAL) + len(REMARK) > 40
    assert [row for row in rows if row not in FILES.splitlines()] == []


def test_the_page_of_files_has_all_kinds() -> None:
    rows = re.findall(r"^\| `kind` \| text \| \| (`branch point`, .*) \|$", FILES, flags=re.MULTILINE)
    every, loci = (set(re.findall(r"`([a-z ]+)`", row)) for row in rows)
    assert set(KINDS) <= every and set(LOCI) == loci


def test_each_name_has_one_entry() -> None:
    assert len(NAMES) == sum(key.count(" | ") + 1 for key in ENTRIES)
    assert all(text[-1] == "." and text == " ".join(text.split()) for text in ENTRIES.values())


@pytest.mark.parametrize(
    "word", ["snap", "buckle", "buckling", "hysteresis", "tipping", "eigenvalue", "moment", "pinned"]
)
def test_words_that_a_newcomer_tries_have_entries(word: str) -> None:
    assert len(explanation(word)) == 1


def test_words_on_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    console.main(["explain", "branch", "point"])
    assert capsys.readouterr().out.startswith("branch point, BP: An equilibrium in which branches cross")
    console.main(["explain", "LP", "index"])  # two entries
    assert [line.split(",")[0] for line in capsys.readouterr().out.splitlines() if line[0] != " "] == ["fold", "index"]
    console.main(["explain"])
    listed = capsys.readouterr().out.splitlines()
    assert len(listed) == len(ENTRIES) and "fold, LP" in listed
    with pytest.raises(InputError, match="no entry 'foldd': try fold"):
        explanation("foldd")
    with pytest.raises(InputError, match="no entry 'circle': try circle of states, or rodfem explain"):
        explanation("circle")
    with pytest.raises(InputError, match="no entry 'gravity': try rodfem explain, which lists all"):
        explanation("gravity")
