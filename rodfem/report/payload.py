"""Data of a report, collected from the files of a run: its diagram, states, modes and loci."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

import h5py

from rodfem.errors import InputError
from rodfem.file_format import DIAGRAM, STATES, UNREADABLE, read_json
from rodfem.output.digits import with_unit
from rodfem.output.states import check_run
from rodfem.output.style import mesh_in_words, ordinate_in_words
from rodfem.report.branches import DERIVED, ordinates_of
from rodfem.report.labels import html_of, plain_of
from rodfem.report.loci import loci_of
from rodfem.report.rods import rods_of

NEEDED = ("parameter", "parameter_label", "constants", "branches", "meshes", "discretization", "ordinate", "range")


class Loaded(dict[str, Any]):
    """Entries of a group by name, arrays and groups alike; ``attrs``, ``name`` and ``file`` are those of the group.

    One reading for all rows, where each row would read a dozen small arrays.
    """

    def __init__(self, group: Any) -> None:
        """Read a group and all below it."""
        super().__init__({name: Loaded(x) if isinstance(x, h5py.Group) else x[()] for name, x in group.items()})
        self.attrs, self.name, self.file = dict(group.attrs), group.name, group.file


def payload_of(folder: Path) -> dict[str, Any]:
    """Everything that the page of a folder shows; raises :class:`InputError` where its files are unfit."""
    data = read_json(folder / "diagram.json", DIAGRAM, NEEDED)
    if not data["branches"]:
        raise InputError(f"{folder / 'diagram.json'} has no branches: run the scene again.")
    check_run(data, folder / "states.h5")
    try:
        with h5py.File(folder / "states.h5", "r") as file:
            STATES.check_hdf5(file, ("branches",))
            return _about(data, folder) | rods_of(data, Loaded(file["branches"]), folder)
    except UNREADABLE as trouble:
        if isinstance(trouble, InputError):
            raise
        raise InputError(f"The files in {folder} do not belong together ({trouble}): run the scene again.") from trouble


def _about(data: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Titles, labels, constants and origin."""
    units = {x: str(data.get(f"{name}_unit") or "") for x, name in (("load", "parameter"), ("ordinate", "ordinate"))}
    words, unit = str(data.get("parameter_words") or "").replace("$", ""), with_unit("", units["load"]).strip()
    names = {"ordinate": data["ordinate"], **DERIVED}
    labels = names | {"ordinate": ordinate_in_words(data)}
    return {
        "scene": data["scene"],
        "title": plain_of(data.get("title") or data["scene"]),
        "parameter": data["parameter"],
        "symbol": plain_of(data["parameter_label"], always=True),
        "label": " ".join(filter(None, (escape(words), html_of(data["parameter_label"], always=True), escape(unit)))),
        "ordinates": [
            {"key": key, "name": names.get(key, key), "label": html_of(labels.get(key, key))}
            for key in ordinates_of(data)
        ],
        "constants": data["constants"],
        "natural": data.get("natural") or {},
        "units": units,
        "complete": data.get("complete", True),
        "meaning": data.get("meaning", {}),
        "mesh": mesh_in_words(data["discretization"]),
        "program": (data.get("format") or {}).get("program", "an earlier version of rodfem"),
        "origin": _origin(data.get("origin") or {}),
        "folder": str(folder),
        "loci": loci_of(folder, data),
    }


def _origin(origin: Mapping[str, Any]) -> list[list[str]]:
    """Command, date and versions, as far as they are recorded, each with its name."""
    versions = ", ".join(f"{name} {version}" for name, version in (origin.get("versions") or {}).items())
    found = {"command": origin.get("command"), "date": origin.get("date"), "versions": versions}
    return [[name, str(text)] for name, text in found.items() if text]
