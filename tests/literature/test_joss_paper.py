"""The journal paper: its sections, its length, its citations, and numbers that a page of the documentation has, too."""

import re
from pathlib import Path

HOME = Path(__file__).parents[2]
TEXT = (HOME / "paper" / "paper.md").read_text().partition("\n---\n")[2]
SECTIONS = [
    *("Summary", "Statement of need", "State of the field", "Software design", "Research impact statement"),
    *("Availability", "References"),
]


def test_sections_and_length() -> None:
    assert re.findall(r"^# (.*)$", TEXT, flags=re.M) == SECTIONS
    assert "```" not in TEXT and 750 <= len(TEXT.split()) <= 1750


def test_citations_are_in_the_bibliography() -> None:
    cited = set(re.findall(r"@(\w+)", TEXT))
    assert cited == set(re.findall(r"^@\w+\{(\w+),", (HOME / "paper" / "paper.bib").read_text(), flags=re.M))


def test_numbers_are_those_of_the_documentation() -> None:
    page = (HOME / "docs" / "trades" / "two-grippers.md").read_text()
    found = re.findall(r"\d+\.\d+ %|\d+ of the 150", TEXT)
    assert found and all(number in page for number in found)
