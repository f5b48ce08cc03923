"""The public interface of 0.1.0: what users call stays, whatever becomes smaller behind it."""

import rodfem
from rodfem.app.console import COMMANDS
from rodfem.stability import METHODS

NAMES = """
Attachment Branch Constraint ConvergenceError Design Diagram Discretization Drag End Event Field
Identified IndexStepControl Inertia InputError Level Locus Modes Observer Ordinate Parameter Plan
Point Ring Scene SceneError SetupError Solver SpecialPoint StepControl at circular_guide clamped
design elastic everywhere family free hinged identify integral load load_json load_modes many path
pinned run section sliding sliding_hinge tabulated tendon trace
"""


def test_names_commands_and_methods_stay() -> None:
    assert set(NAMES.split()) <= set(dir(rodfem))
    assert set(COMMANDS) >= {"convert", "explain", "info", "list", "many", "run", "view"}
    assert set(METHODS) >= {"count", "shift-invert", "slicing", "dense", "reduction", "cayley"}
