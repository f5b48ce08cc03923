"""Sphinx's configuration: ``make docs`` builds the site from these pages, the lessons and the docstrings.

The pages are written for a reader of the repository.  Their links into the code lead in the site to the description of
the name, where there is one.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import rodfem

PAGES = Path(__file__).parent
HOME = PAGES.parent
LINK = re.compile(
    r"(?P<image>!?)\[(?P<text>[^\]\n]*(?:\n[^\]\n]+)?)\]\((?P<file>(?!https?:|#)[^)\s#]+)(?P<anchor>#[^)\s]*)?\)"
)
NAME = re.compile(r"`rodfem(?:\.\w+)+`")
INCLUDED = {HOME / "README.md": PAGES / "start.md", HOME / "CONTRIBUTING.md": PAGES / "contributing.md"}
"""Pages of the repository that pages of the site include."""
LESSONS = re.compile(r"```{toctree}\n:hidden:\n:caption: Learn\n.*?\n```\n", re.DOTALL)

project, author = "rodfem", "rodfem authors"
release = version = rodfem.__version__
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx-mathjax-offline",
]
exclude_patterns = ["*.py", "course/check.py", "course/lesson", "course/solutions"]
html_theme = "furo"
html_title = "rodfem"
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["site.css"]

myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 4
nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = os.environ.get("RODFEM_LESSONS", "force")
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True
suppress_warnings = ["myst-nb.lexer"]  # lessons that are not executed name no language

KERNEL = TemporaryDirectory()  # of the lessons' kernels, which warn of a connection that nobody else hears
profile = Path(KERNEL.name) / "profile_default"
profile.mkdir()
(profile / "ipython_kernel_config.py").write_text("c.IPKernelApp.log_level = 40\n")
os.environ["IPYTHONDIR"] = KERNEL.name

autodoc_typehints = "none"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True


def setup(app: Any) -> None:
    """Have links and docstrings mended as they are read."""
    app.connect("source-read", lambda app, page, source: _mend(source, app.env.doc2path(page)))
    app.connect("include-read", lambda app, path, parent, source: _mend(source, PAGES / path))
    app.connect("autodoc-process-docstring", _separate, priority=100)  # before napoleon


def _separate(app: Any, what: str, name: str, described: Any, options: Any, lines: list[str]) -> None:
    """Head a paragraph that follows a section of a docstring, which is none of the section's entries, with Notes."""
    first = next((i for i, line in enumerate(lines) if set(line) == {"-"}), len(lines))
    for i in range(len(lines) - 1, first + 1, -1):
        heads = i + 1 < len(lines) and set(lines[i + 1]) == {"-"}
        if (
            lines[i]
            and not lines[i][0].isspace()
            and lines[i - 2 : i][1:] == [""]
            and lines[i - 2][:1] == " "
            and not heads
        ):
            lines[i:i] = ["Notes", "-----"]


def _mend(source: list[str], path: Any) -> None:
    """Mend the links of a page in place; without lessons the index does not list them."""
    if str(path).endswith(".md"):
        source[0] = source[0] if (PAGES / "course").is_dir() else LESSONS.sub("", source[0])
        source[0] = LINK.sub(lambda link: _mended(link, Path(path).resolve().parent), source[0])


def _mended(link: re.Match[str], folder: Path) -> str:
    """Link of a page as the site has it: what is no page of the site is a name in the code, or text."""
    target = Path(os.path.normpath(folder / link["file"]))
    target = INCLUDED.get(target, target)
    if NAME.fullmatch(link["text"]) and target.suffix == ".py":
        return f"{{py:obj}}{link['text']}"
    if target.is_dir():
        target /= "README.md"
    lesson = target.parent == PAGES / "course" and target.suffix == ".py"
    if target.is_relative_to(PAGES) and target.exists() and (target.suffix == ".md" or link["image"] or lesson):
        inside = os.path.relpath(target, PAGES if folder == HOME else folder)
        return f"{link['image']}[{link['text']}]({inside}{link['anchor'] or ''})"
    return link["text"]
