"""Links of the documentation lead somewhere, and those into the code to the line that they name."""

import re
import runpy
from functools import cache
from pathlib import Path

import pytest

import rodfem

HOME = Path(__file__).parents[2]
links = runpy.run_path(str(HOME / "docs" / "links.py"))
TARGET = re.compile(r"\]\((?!https?:|mailto:)([^)\s#]*)(?:#([^)\s]+))?\)")


def prose(page: Path) -> str:
    """Text of a page without its code."""
    return re.sub(
        r"```.*?```|`[^`\n]*`", lambda m: "`" * 2 if m[0][:3] != "```" else "", page.read_text(), flags=re.DOTALL
    )


@cache
def anchors(page: Path) -> set[str]:
    """Anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", links["pages"](), ids=lambda page: str(page.relative_to(HOME)))
def test_links_lead_to_files_headings_and_lines(page: Path) -> None:
    for file, anchor in TARGET.findall(prose(page)):
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), f"{page.name}: there is no {file}"
        if anchor and target.suffix == ".md":
            assert anchor in anchors(target), f"{page.name}: {file} has no heading {anchor}"
    assert page.read_text() == links["refreshed"](page), "lines have moved: python docs/links.py writes them anew"


def test_every_public_name_is_described() -> None:
    described = "\n".join(page.read_text() for page in (HOME / "docs" / "api").glob("*.md"))
    missing = [
        name
        for name in dir(rodfem)
        if not re.search(rf"auto\w+:: rodfem\.{name}$|auto\w+:: {name}$|`{name}`", described, re.M)
    ]
    assert not missing, f"docs/api lacks {', '.join(missing)}"
