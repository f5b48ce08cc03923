"""Diagrams from Python: traced without files or output, asked, saved and read again."""

from dataclasses import replace
from pathlib import Path

import demo_cases
import hemitropic_cases
import numpy as np
import pytest

import rodfem
from rodfem import Branch, Diagram, Discretization, InputError, Observer, Parameter, Plan
from rodfem.app import console

MESH = Discretization("reduced", 8, 6)
SHORT = Plan((60.0, 30.0), depth=1)


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    return rodfem.trace(demo_cases.scene("cord"), MESH, SHORT)


def test_nothing_is_printed_and_no_file_is_written(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    found = rodfem.trace(hemitropic_cases.scene(), MESH, Plan((0.0, 0.2), depth=0, error_bars=False))
    assert [s.negative_after for s in found.special()] == [2]
    assert capfd.readouterr() == ("", "")
    assert list(folder.iterdir()) == []


@pytest.mark.ranks
def test_branches_and_special_points(diagram: Diagram) -> None:
    assert [b.name for b in diagram] == ["straight", "branch 1", "branch 2"][: len(diagram)]
    assert diagram["straight"] is diagram[0] and diagram[:1] == [diagram[0]]
    with pytest.raises(KeyError, match="no branch 'plain': there are 'straight', 'branch 1'"):
        _ = diagram["plain"]
    first = diagram.special("branch point", "straight")[0]
    assert first in diagram.special()
    assert diagram.special("fold") == []
    assert {s.kind for s in diagram.special()}.isdisjoint({"end", "user"})
    assert repr(diagram).startswith("<Diagram of 'cord': ")
    assert f"{first.point.load:.6f}"[:6] in diagram._repr_html_()
    end = diagram["straight"].special[-1]  # at the bound of the range: exact
    assert f"<td>{end.point.load:.10g}</td>" in diagram._repr_html_()


@pytest.mark.ranks
def test_states_at_a_load(diagram: Diagram) -> None:
    """Each is at that very load, with the index that another method finds there."""
    found = diagram.at(40.0)
    assert [p.load for p in found] == [40.0] * len(found)
    assert [p.index for p in found] == [1, 0]
    for point in found:
        verdict = diagram.assess(point, method="dense")
        assert verdict.negative == point.index
        values = diagram.modes(point, 2).value
        np.testing.assert_allclose(values, verdict.values[:2], rtol=1e-7)
    assert (found[0].stable, found[1].stable) == (False, True)
    with pytest.raises(InputError, match=r"The load 20 is outside the range 30 to 60 of this diagram: trace a wider"):
        diagram.at(20.0)


@pytest.mark.long
def test_a_saved_diagram_is_a_diagram(diagram: Diagram, folder: Path) -> None:
    saved = diagram.save(folder / "cord")
    assert sorted(p.name for p in saved.iterdir()) == ["diagram.json", "states.h5"]
    again = rodfem.load(saved, diagram.scene)
    assert repr(again) == repr(diagram)
    for branch, other in zip(diagram, again, strict=True):
        np.testing.assert_array_equal([p.load for p in branch.points], [p.load for p in other.points])
        assert [p.index for p in branch.points] == [p.index for p in other.points]
        assert [repr(s) for s in branch.special] == [repr(s) for s in other.special]
        assert [s.multiplicity for s in branch.special] == [s.multiplicity for s in other.special]
    assert [p.ordinate for p in again.at(40.0)] == pytest.approx([p.ordinate for p in diagram.at(40.0)], abs=1e-10)
    special = again.special("branch point", "straight")[0]
    assert again.locus(special, "k0", (9.3, 9.6)).values[0] == pytest.approx(
        diagram.locus(diagram.special("branch point", "straight")[0], "k0", (9.3, 9.6)).values[0], abs=1e-9
    )
    wider = again.again(span=(60.0, 20.0), depth=0, error_bars=False)
    assert wider.span == (60.0, 20.0)
    assert len(wider.at(25.0)) == 1


@pytest.mark.long
def test_files_of_another_scene(diagram: Diagram, folder: Path) -> None:
    saved = diagram.save(folder / "cord")
    with pytest.raises(InputError, match=r"holds the scene 'cord' with the load lam, not 'hemitropic' with lam: give"):
        rodfem.load(saved, hemitropic_cases.scene())
    other = replace(diagram.scene, parameters={**diagram.scene.parameters, "k0": Parameter(3.0)})
    with pytest.raises(InputError, match=r"was computed with k0 = 9.42\d+, and the scene has 3: give the scene that"):
        rodfem.load(saved, other)
    softer = replace(diagram.scene, energy=lambda v, k, c: 0.5 * diagram.scene.energy(v, k, c))
    with pytest.raises(InputError, match="was run with other equations than those of the scene 'cord'"):
        rodfem.load(saved, softer)
    with pytest.raises(InputError, match=r"There is no .*diagram.json"):
        rodfem.load(folder, diagram.scene)


def test_what_a_run_warns_of_is_saved_and_in_its_words(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a first state that is critical, and of an event that is zero all along: live, loaded, and from the shell."""
    rod, critical = demo_cases.scene("cord"), 49.348022005446796
    still = rodfem.Event("still", of=lambda state: state.r[0, 0])
    plan = Plan((critical, 45.0), depth=0, error_bars=False, events=(still,))
    found = rodfem.trace(rod, MESH, plan)
    (said,) = [x for x in found.warnings if "is singular" in x]
    (note,) = [x for x in found.notes if "zero all along" in x]
    assert (said.branch, said.loads) == (note.branch, [critical, critical]) == ("straight", [critical, critical])
    assert note.loads == [45.0, critical]
    again = rodfem.load(found.save(folder / "cord"), rod)
    for live, loaded in ((found.warnings, again.warnings), (found.notes, again.notes)):
        assert [(x, x.branch, x.loads) for x in live] == [(x, x.branch, x.loads) for x in loaded] != []
    assert again.in_words() == found.in_words()
    (first,) = [x for x in found.in_words().splitlines() if x.startswith("The first branch, straight,")]
    assert f"Warning: {said}" in first and f"Note: {note}" in first
    console.main(["info", str(folder / "cord")])
    assert first in capsys.readouterr().out


def test_one_solver(diagram: Diagram) -> None:
    """States that a solver computes one by one are those of the diagram."""
    solver = rodfem.Solver(diagram.scene, MESH)
    straight, buckled = diagram.at(40.0)
    assert solver.equilibrium(40.0).energy == pytest.approx(straight.energy, rel=1e-12)
    near = solver.equilibrium(39.0, guess=buckled)
    assert (near.load, near.index) == (39.0, 0)
    others = solver.search(40.0, [solver.equilibrium(40.0)], tries=6)
    assert any(p.energy == pytest.approx(buckled.energy, rel=1e-9) for p in others)
    with pytest.raises(InputError, match="number is 0: give 1 or more"):
        solver.modes(near, 0)


@pytest.mark.ranks
def test_an_interrupt_loses_no_branch() -> None:
    """What had been traced comes with the error, and can be asked."""

    class Impatient(Observer):
        def finished(self, branch: Branch) -> None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        rodfem.trace(hemitropic_cases.scene(), MESH, Plan((0.0, 0.2), error_bars=False), Impatient())
    (straight,) = caught.value.diagram
    assert [s.negative_after for s in straight.special if s.kind == "branch point"] == [2]
    assert caught.value.diagram.assess(straight.points[0]).negative == 0
