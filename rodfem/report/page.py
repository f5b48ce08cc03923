"""The page of a report: template, style, libraries, modules and data in one HTML file that needs no network.

Its data are collected from the files of a run: diagram, states, modes and loci.  Modules stand in an import map as data
URLs, so that they need no bundler and work from ``file://``.
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

import h5py

from rodfem.file_format import DIAGRAM, STATES, read_json
from rodfem.output.states import check_run
from rodfem.output.style import ordinate_in_words
from rodfem.output.table import ENTRIES, NAMES
from rodfem.output.words import mesh_in_words
from rodfem.report.branches import DERIVED, html_of, label_of, loci_of, ordinates_of, plain_of, script_json
from rodfem.report.rods import rods_of
from rodfem.whole_files import write_whole

STATIC = files("rodfem.report") / "static"
LIBRARIES = {"three": "three.module.min.js", "three/orbit": "OrbitControls.js"}
NEEDED = tuple("scene parameter parameter_label constants branches meshes discretization ordinate range".split())
"""Entries of a diagram that has a page."""


@dataclass(frozen=True)
class Page:
    """A report as one page, which a notebook shows; empty on all ranks but the first."""

    html: str

    def __repr__(self) -> str:
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
    """Write the report on the run in a folder, to ``report.html`` there by default; returns its path."""
    path = folder / "report.html" if path is None else path
    write_whole({path: page_of(payload_of(folder)).encode()})
    return path


def page_of(payload: Mapping[str, Any]) -> str:
    """HTML of a report on this data; no text of it is an element of the page."""
    data, head = script_json(payload), "data:text/javascript;charset=utf-8;base64,"
    modules = {f"report/{file.name.removesuffix('.js')}": file for file in (STATIC / "js").iterdir()}
    modules |= {name: STATIC / "vendor" / file for name, file in LIBRARIES.items()}
    urls = {name: head + b64encode(file.read_bytes()).decode() for name, file in sorted(modules.items())}
    parts = {
        "title": escape(f"{payload['title']} · rodfem"),
        "nonce": sha256(data.encode()).hexdigest(),
        "style": _text(STATIC / "report.css"),
        "payload": data,
        "plotly": _text(STATIC / "vendor" / "plotly-basic.min.js"),
        "imports": script_json({"imports": urls}),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _text(STATIC / "template.html"))


def _text(file: Traversable) -> str:
    return file.read_text(encoding="utf-8")


# --- data


class Loaded(dict[str, Any]):
    """Entries of a group by name, arrays and groups alike; ``attrs``, ``name`` and ``file`` are those of the group."""

    def __init__(self, group: Any) -> None:
        super().__init__({name: Loaded(x) if isinstance(x, h5py.Group) else x[()] for name, x in group.items()})
        self.attrs, self.name, self.file = dict(group.attrs), group.name, group.file


def payload_of(folder: Path) -> dict[str, Any]:
    """Everything that the page of a folder shows; raises :class:`InputError` where its files are unfit."""
    data = read_json(folder / "diagram.json", DIAGRAM, NEEDED)
    check_run(data, folder / "states.h5")
    unfit = f"The files in {folder} do not belong together ({{}}): run the scene again."
    with STATES.opened(folder / "states.h5", ("branches",), unfit) as file:
        about, rods = _header(data, folder), rods_of(data, Loaded(file["branches"]), folder)
        names = [name for name in rods["branches"][0]["ordinates"] if name.startswith("reaction")]
        about["ordinates"] += [{"key": name, "name": name, "label": name} for name in names]
        return about | rods


def _header(data: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Titles, labels, constants and origin."""
    units = {x: str(data.get(f"{name}_unit") or "") for x, name in (("load", "parameter"), ("ordinate", "ordinate"))}
    words = str(data.get("parameter_words") or "").replace("$", "")
    names = {"ordinate": data["ordinate"], **DERIVED}
    labels = names | {"ordinate": ordinate_in_words(data)}
    return {
        **{name: data[name] for name in ("scene", "parameter", "constants", "natural", "meaning")},
        "title": plain_of(data["title"]),
        "symbol": plain_of(data["parameter_label"], always=True),
        "label": label_of(words, data["parameter_label"], units["load"]),
        "ordinates": [
            {"key": key, "name": names.get(key, key), "label": html_of(labels.get(key, key))}
            for key in ordinates_of(data)
        ],
        "units": units,
        "complete": data.get("complete", True),
        "mesh": mesh_in_words(data["discretization"]),
        "program": data["format"]["program"],
        "origin": _origin(data.get("origin") or {}),
        "folder": str(folder),
        "loci": loci_of(folder, data),
        "glossary": {name: ENTRIES[key] for name, key in NAMES.items()},
    }


def _origin(origin: Mapping[str, Any]) -> list[list[str]]:
    """Command, date and versions, as far as they are recorded, each with its name."""
    versions = ", ".join(f"{name} {version}" for name, version in (origin.get("versions") or {}).items())
    found = {"command": origin.get("command"), "date": origin.get("date"), "versions": versions}
    return [[name, str(text)] for name, text in found.items() if text]
