"""The demos' scenes, and reading off a branch what the targets ask for."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from math import nan
from typing import Any

from benchmarks.common import ROOT
from benchmarks.references import Spectrum
from benchmarks.targets import TARGETS, Target
from rodfem.continuation.branch import Branch
from rodfem.problem.scene import Inertia, Scene

sys.path.append(str(ROOT / "tests"))

import demo_cases
import hemitropic_cases

WEAK = "bending about d1"


def scene(name: str) -> Scene:
    """The scene of a demo with its default constants."""
    return hemitropic_cases.scene() if name == "hemitropic" else demo_cases.scene(name)


def with_inertia(spectrum: Spectrum) -> Scene:
    """The scene of a spectrum, with its mass and rotary inertia."""
    return replace(scene(spectrum.scene), inertia=Inertia(lambda c: spectrum.rho_A, lambda c: spectrum.rho_I))


def loads(name: str) -> tuple[float, ...]:
    """Loads at which the targets of a scene ask for the ordinate."""
    return tuple(sorted({t.at for targets in TARGETS[name].values() for t in targets if t.at is not None}))


def value(target: Target, branch: Branch) -> float:
    """What the branch has for a target; nan if nothing."""
    found = [s.point for s in branch.special if s.kind.code == target.kind]
    if target.at is None:
        return found[target.number].load if target.number < len(found) else nan
    found = [p for p in found if p.load == target.at]
    if found and found[0].omega2:
        values: Sequence[Any] = [
            mu[0] for mu, kind in zip(found[0].omega2, found[0].motion, strict=True) if kind == WEAK
        ]
    else:
        values = [p.ordinate for p in found]
    return float(values[target.number]) if target.number < len(values) else nan
