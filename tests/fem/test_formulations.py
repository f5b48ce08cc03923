"""The registry of formulations: what is in it is offered, checked and chosen by name."""

from pathlib import Path

import classics
import demo_cases as demos
import pytest
from problem.test_remedies import parser

from rodfem import InputError, Scene
from rodfem.fem.fields import Discretization, Fields
from rodfem.fem.formulations import AUTO, FORMULATIONS, Formulation, names

HOME = Path(__file__).parents[2]


class Third(Formulation):
    """The pointwise one, by another name and for rods in space alone."""

    name, words = "third", "all fields once more"

    def refusal(self, scene: Scene) -> str:
        return "is for rods in space" if scene.planar else ""


def test_another_formulation(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is registered is known everywhere; ``auto`` stays the first that applies."""
    scene = demos.scene("cord")
    with pytest.raises(InputError, match=f"'third': choose one of {', '.join(names())}"):
        Discretization("third")
    with monkeypatch.context() as registered:
        registered.setitem(FORMULATIONS, "third", Third())
        with pytest.raises(InputError, match=r"'fourth': choose one of auto, .*, third"):
            Discretization("fourth")
        assert f"{Third.name}: {Third.words}" in " ".join(parser().format_help().split())
        third, other = (Fields(scene, Discretization(name, 4, 3)) for name in ("third", "pointwise"))
        assert third.discretization.formulation == "third"
        assert (third.blocks, third.scalars) == (other.blocks, other.scalars)
        assert Fields(scene, Discretization(AUTO, 4, 3)).formulation is next(iter(FORMULATIONS.values()))
        with pytest.raises(InputError, match=r"third formulation is for rods in space: use .*formulation='reduced'"):
            Fields(classics.planar_column(), Discretization("third", 4, 3))
    assert "third" not in names()


def test_all_are_named() -> None:
    """By their keys, in the help and in the page about files."""
    page, words = (HOME / "docs" / "files.md").read_text(), " ".join(parser().format_help().split())
    assert "{" + ",".join((AUTO, *FORMULATIONS)) + "}" in words
    for name, made in FORMULATIONS.items():
        assert made.name == name and f"`{name}`" in page and f"{name}: {made.words}" in words


def test_no_other_module_compares_names() -> None:
    """A formulation is asked, not recognised."""
    for path in (HOME / "rodfem").rglob("*.py"):
        text = path.read_text()
        for name in FORMULATIONS:
            assert f'== "{name}"' not in text and f'!= "{name}"' not in text, path
