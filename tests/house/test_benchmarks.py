"""The benchmarks' own arithmetic, and the boundary value problems for other programs."""

import shutil
from pathlib import Path
from types import ModuleType

import pytest

from benchmarks import fronts, reduced_stiffness, stability
from benchmarks.auto.output import AutoError
from benchmarks.auto.problems import PROBLEMS
from benchmarks.auto.program import check, require_auto
from benchmarks.speed import plots
from benchmarks.speed.scipy_bvp import RODS, solve
from benchmarks.targets import TARGETS
from rodfem.fem import system

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.few(1)
@pytest.mark.parametrize(("scene", "branch"), RODS)
def test_scipy_solves_the_same_rods(scene: str, branch: str) -> None:
    rod, (target,) = RODS[scene, branch], [t for t in TARGETS[scene][branch] if t.at is not None]
    found = solve(rod, rod.at, *rod.guess(), 1e-4)
    if target.at != rod.at:
        found = solve(rod, target.at, found.x, found.y, rod.guess()[2], 1e-4)
    assert found.success
    assert rod.ordinate(found.sol(rod.place)[7:]) == pytest.approx(target.reference, rel=1e-5)


@pytest.mark.parametrize("name", PROBLEMS)
def test_derivatives_given_to_auto(name: str) -> None:
    try:
        require_auto()
    except AutoError as missing:
        pytest.skip(str(missing))
    assert max(check(PROBLEMS[name])) < 1e-8


@pytest.mark.long
def test_figures_are_drawn_from_the_page_alone(tmp_path: Path) -> None:
    page = tmp_path / "speed-log.md"
    page.write_text((DOCS / "speed-log.md").read_text())
    drawn = plots.draw(page)
    assert [path.name for path in drawn] == list(plots.FIGURES.values())
    assert all(path.stat().st_size > 20_000 and f"]({path.name})" in page.read_text() for path in drawn)
    tables = plots.read(page.read_text())
    (row,) = [r for r in tables["All branches"][0] if r[:3] == ["cord", "straight", "2 P8 reduced"]]
    assert float(row[3]) == 78 and plots.discretisation(row[2]) == (2, 8, "reduced")
    assert not plots.draw(Path(shutil.copy(DOCS / "rods.md", tmp_path)))


def test_every_way_to_judge_a_state_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that find eigenvalues agree with scipy's shift-invert on the same pencil."""
    monkeypatch.setattr(stability, "ENOUGH", 0.0)
    monkeypatch.setattr(system, "find_symmetries", system.find_symmetries)  # benchmarks leave the search out
    found = {name: stability.measure(name, "reduced", 20, 1)["first"] for name in (*stability.METHODS, "proof")}
    assert [v for v in found.values() if v is not None] == pytest.approx([found["scipy"]] * 7, rel=1e-7)


@pytest.mark.parametrize("picture", [fronts, reduced_stiffness])
def test_a_picture_is_drawn(tmp_path: Path, picture: ModuleType) -> None:
    picture.main(tmp_path / "drawn.png")
    assert (tmp_path / "drawn.png").stat().st_size > 20_000
