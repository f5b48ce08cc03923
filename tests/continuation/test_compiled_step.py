"""The compiled step of continuation beside the same step made one by one, at every row of every scene."""

from __future__ import annotations

import numpy as np
import pytest
from golden_cases import cases, single_branches

from rodfem import Diagram, Discretization, Plan, trace
from rodfem.continuation.compiled_step import CompiledStep, Made
from rodfem.fem.symmetries import phase_at
from rodfem.fem.verification import Verification

pytestmark = pytest.mark.alone
SAME = 1e-10
"""Difference of loads, ordinates, energies and stretches, relative to numbers greater than one."""


def traced(name: str) -> Diagram:
    scene = cases()[name]()
    mesh = Discretization("auto", 8 if scene.start is None else 16, 6)
    return trace(scene, mesh, Plan(depth=1, error_bars=False))


@pytest.mark.parametrize("name", single_branches())
def test_every_row_of_every_scene(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """All branches: the same rows with the same indices and special points; open rods take most steps compiled."""
    steps, whole = [], CompiledStep.__call__

    def counted(*arguments: object) -> Made | None:
        steps.append(whole(*arguments))  # type: ignore[arg-type]
        return steps[-1]

    monkeypatch.setattr(CompiledStep, "__call__", counted)
    ours = traced(name)
    monkeypatch.setattr(CompiledStep, "__call__", lambda *arguments: None)
    theirs = traced(name)
    if not cases()[name]().closed:
        assert sum(step is not None for step in steps) > 0.5 * len(steps) > 5
    for branch, other in zip(ours.branches, theirs.branches, strict=True):
        for key in ("negative", "zero"):
            assert [getattr(p, key) for p in branch.points] == [getattr(p, key) for p in other.points], branch.name
        assert [s.kind for s in branch.special] == [s.kind for s in other.special]
        for key in ("load", "ordinate", "energy", "potential", "conjugate", "stretch"):
            a, b = (np.array([getattr(p, key) for p in x.points]) for x in (branch, other))
            assert (abs(a - b) < SAME * np.maximum(1.0, abs(b))).all(), (branch.name, key)


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["demo hemitropic", "classic foundation", "docs bow"])
def test_phase_conditions_are_those_of_python(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same number of conditions, which span the same space, with the same offsets along it, at every step."""
    compared, made = [], CompiledStep._made

    def compare(self: CompiledStep) -> Made | None:
        step = made(self)
        if step is not None and self.system.phase.reference is not None:
            ours, theirs = self.system.phase, phase_at(self.system, step.x, set())
            assert (len(ours.rows), len(ours.kept)) == (len(theirs.rows), len(theirs.kept))
            if ours.rows:
                a, b = (np.array(list(phase.rows.values())) for phase in (ours, theirs))
                weights, left = np.linalg.lstsq(a.T, b.T, rcond=None)[:2]
                assert abs(a.T @ weights - b.T).max() < 1e-12 * abs(b).max(), left
                found = np.array([ours.offsets[i] for i in ours.rows]) @ weights
                np.testing.assert_allclose(found, [theirs.offsets[i] for i in theirs.rows], atol=1e-12)
                compared.append(len(ours.rows))
        return step

    monkeypatch.setattr(CompiledStep, "_made", compare)
    traced(name)
    assert len(compared) > 10


def test_a_symmetry_that_is_none_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiled step that does not verify a symmetry leaves that to Python's verification."""
    asked, tried = [], Verification.__call__

    def noted(self: Verification, *arguments: object) -> bool:
        asked.append(arguments)
        return tried(self, *arguments)  # type: ignore[arg-type]

    usual = traced("demo hemitropic")
    monkeypatch.setattr("rodfem.fem.verification.RESIDUAL", 1e-30)
    monkeypatch.setattr(Verification, "__call__", noted)
    strict = Discretization("auto", 8, 6)
    found = trace(cases()["demo hemitropic"](), strict, Plan(depth=0, error_bars=False))
    assert any("No symmetry is" in warning for warning in found.warnings)
    assert asked
    assert not usual.warnings


@pytest.mark.long
def test_checks_are_of_the_state_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a step checks is what the equations and the quaternions of that state give."""
    seen, made = [], CompiledStep._made

    def compare(self: CompiledStep) -> Made | None:
        step = made(self)
        if step is not None and self.checked is not None:
            system, residual = self.system, self.system.new_vector()
            system.set_phase(step.x)
            state = system.at(step.x)
            state.residual(residual)
            worst = abs(system.in_units(residual, 1).array_r).max()
            norm = abs((state.values("q") ** 2).sum(axis=-1) - 1).max()
            assert abs(self.checked.residual - worst) < 1e-13
            assert abs(self.checked.norm - norm) < 1e-14
            np.testing.assert_allclose(step.energies, state.energies(), rtol=1e-13, atol=1e-13)
            seen.append(worst)
        return step

    monkeypatch.setattr(CompiledStep, "_made", compare)
    traced("demo cord")
    assert len(seen) > 50
