"""Modes that every run records: closed forms at the states of a diagram, what files hold of them, what they change."""

import json
from collections.abc import Callable
from pathlib import Path

import classics
import h5py
import numpy as np
import pytest
from modes.test_modes import shape

import rodfem
from rodfem import ConvergenceError, Discretization, Plan, Scene
from rodfem.modes.finder import ModeFinder
from rodfem.modes.modes import Typical, typical_of
from rodfem.ranks import in_words
from rodfem.report.page import payload_of

MESH = Discretization("auto", 4, 6)


def recorded(scene: Scene, plan: Plan, folder: Path, mesh: Discretization = MESH) -> dict[str, list[Typical]]:
    """Modes in the file of a run, by branch."""
    rodfem.run(scene, mesh, plan, folder, figures=False, quiet=True)
    with h5py.File(folder / "states.h5") as file:
        return {name: list(typical_of(group)) for name, group in file["branches"].items()}


@pytest.mark.usefixtures("few_loads")
@pytest.mark.parametrize("mesh", [(4, 6), (6, 6)])
def test_a_double_eigenvalue_has_one_mode(folder: Path, mesh: tuple[int, int]) -> None:
    """Where Beck's column flutters, P = 20.05, omega = 11.02 (Beck 1952): the one mode of the closed form there."""
    found = recorded(classics.beck(span=(19.0, 21.0)), Plan(error_bars=False), folder, Discretization("auto", *mesh))
    branch = json.loads((folder / "diagram.json").read_text())["branches"][0]
    (special,) = [s for s in branch["special"] if s["kind"] == "flutter"]
    (few,) = [each.found for each in found[branch["name"]] if each.row == special["row"]]
    assert few is not None and special["load"] == pytest.approx(20.0509536, abs=1e-6)
    (i,) = np.flatnonzero(abs(few.value - special["omega2"]) < 1e-2 * special["omega2"])
    assert few.value[i] == special["omega2"] and special["omega2"] ** 0.5 == pytest.approx(11.0156, abs=1e-4)
    assert abs(few.displacement[i].imag).max() == 0.0
    s = np.linspace(0, 1, few.displacement.shape[1])[::6]  # vertices
    exact, moved = shape(special["omega2"], special["load"], s, False).real, few.displacement[i, ::6, 1].real
    np.testing.assert_allclose(moved / moved[-1], exact / exact[-1], atol=1e-4)


@pytest.mark.few(1)
@pytest.mark.parametrize("fault", [lambda: ConvergenceError("No eigenvalue was found."), MemoryError])
@pytest.mark.parametrize("often", [1, 100])
def test_where_they_are_not_found_the_file_says_why(
    folder: Path, monkeypatch: pytest.MonkeyPatch, fault: Callable[[], Exception], often: int
) -> None:
    """At one state or at all: the run goes on, and its report has the sentence."""
    whole, failed = ModeFinder.few, []

    def few(self: ModeFinder, *what: object) -> object:
        if len(failed) < often:
            failed.append(what)
            raise fault()
        return whole(self, *what)  # type: ignore[arg-type]

    monkeypatch.setattr(ModeFinder, "few", few)
    found = recorded(classics.euler("clamped-free"), Plan((0.0, 2.0), depth=0, error_bars=False), folder)["straight"]
    sentence = in_words(fault()) if fault is MemoryError else str(fault())
    assert [each.trouble for each in found] == [sentence if i < often else "" for i in range(len(found))]
    assert [each.found is None for each in found] == [i < often for i in range(len(found))]
    (shown,) = payload_of(folder)["branches"]
    assert list(shown["missed"].values()) == [sentence] * min(often, len(found))
    assert len(shown["modes"]) == max(len(found) - often, 0)
