"""The page of a report: template, style, libraries, modules and data in one HTML file that needs no network.

Modules stand in an import map as data URLs, so that they need no bundler and work from ``file://``.
"""

from __future__ import annotations

import re
import webbrowser
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from html import escape
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from rodfem.report.packing import script_json
from rodfem.report.payload import payload_of
from rodfem.whole_files import write_whole

STATIC = files("rodfem.report") / "static"
LIBRARIES = {"three": "three.module.min.js", "three/orbit": "OrbitControls.js"}
PLACE = re.compile(r"\{\{(\w+)\}\}")
"""A place in the template."""


@dataclass(frozen=True)
class Page:
    """A report as one page, which a notebook shows; empty on all ranks but the first."""

    html: str

    def __repr__(self) -> str:
        """Size."""
        return f"<Page of {len(self.html) / 1e6:.1f} MB: .open() shows it in a browser, .save(path) keeps it>"

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{escape(self.html)}" width="100%" height="800" style="border: 0"></iframe>'

    def save(self, path: Path | str) -> Path:
        """Write it; raises :class:`~rodfem.errors.InputError` where it cannot be written."""
        path = Path(path)
        write_whole({path: self.html.encode()})
        return path

    def open(self) -> None:
        """Show it in the browser, from a temporary file."""
        if self.html:
            webbrowser.open(self.save(Path(mkdtemp()) / "report.html").as_uri())


def write_report(folder: Path, path: Path | None = None) -> Path:
    """Write the report on the run in a folder, to ``report.html`` there by default; returns its path.

    Raises :class:`~rodfem.errors.InputError` where the files of the run are unfit, or the page cannot be written.
    """
    path = folder / "report.html" if path is None else path
    write_whole({path: page_of(payload_of(folder)).encode()})
    return path


def page_of(payload: Mapping[str, Any]) -> str:
    """HTML of a report on this data; no text of it is an element of the page."""
    data = script_json(payload)
    parts = {
        "title": escape(f"{payload['title']} · rodfem"),
        "nonce": sha256(data.encode()).hexdigest(),
        "style": _text(STATIC / "report.css"),
        "payload": data,
        "plotly": _text(STATIC / "vendor" / "plotly-basic.min.js"),
        "imports": script_json({"imports": _modules()}),
    }
    return PLACE.sub(lambda found: parts[found[1]], _text(STATIC / "template.html"))


def _modules() -> dict[str, str]:
    """Names of all modules, and each as a data URL."""
    own = {f"report/{file.name.removesuffix('.js')}": file for file in (STATIC / "js").iterdir()}
    libraries = {name: STATIC / "vendor" / file for name, file in LIBRARIES.items()}
    return {name: _url(_text(file)) for name, file in sorted({**own, **libraries}.items())}


def _url(source: str) -> str:
    return f"data:text/javascript;charset=utf-8;base64,{b64encode(source.encode()).decode()}"


def _text(file: Traversable) -> str:
    return file.read_text(encoding="utf-8")
