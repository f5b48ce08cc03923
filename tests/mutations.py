"""Faults planted by hand, one at a time, each of which the tests must catch: ``python -m tests.mutations [NAME ...]``.

A fault is a few characters changed in one file.  The tests named with it run on a copy of the tree, and must fail:
those of ``make test``, or, where they pass, those marked ``long``, which is said.
``tests/house/test_mutations.py`` checks that every fault still has its place in the code.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

HOME = Path(__file__).parents[1]
LIMIT = 1500
"""Seconds of the tests of one fault."""


class Fault(NamedTuple):
    """In ``file`` the text ``old``, which occurs once, becomes ``new``; one of ``tests`` fails then."""

    file: str
    old: str
    new: str
    tests: str


HEMITROPIC = "tests/literature/test_hemitropic_straight.py"
BUCKLED = "tests/literature/test_hemitropic_buckled.py"
CORD = "tests/literature/test_cord.py"
CLASSICS = "tests/literature/test_classics.py"
GOLDEN = "tests/diagram/test_golden.py"
CHAIN = "tests/continuation/test_index_chain.py"
MIXED = "tests/continuation/test_laws_of_mixed_ordinates.py"
FOLLOW = "tests/continuation/test_continuation.py"
LOCATE = "tests/continuation/test_locate.py"
LOCI = "tests/hard/test_hard_loci.py"
IN_WORDS = "tests/codim2/test_locus_in_words.py"
ERRORS = "tests/adaptivity/test_error_estimate.py"
FILES = "tests/output/test_files.py tests/output/test_formats.py"
KILLS = "tests/hard/test_files_after_a_kill.py"
INERTIA = "tests/stability/test_inertia.py tests/stability/test_assessment.py"
HARD = "tests/hard/test_hard_cases.py"
DIAGRAM = "tests/diagram/test_diagram.py"
WORK = "tests/continuation/test_work.py"
RECORDED = "tests/modes/test_recorded.py"
CLOSE = "tests/diagram/test_close_critical_loads.py"
AT_SPECIAL = "tests/diagram/test_at_special_points.py"
OTHER_CONSTANTS = "tests/diagram/test_other_constants.py"

CONTINUATION, STABILITY = "rodfem/continuation/", "rodfem/stability/"

FAULTS = {
    "constants-of-the-first-scene-stay": Fault(
        "rodfem/fem/equations.py",
        "if line is self.register.line:",
        "if self.register.line is not None:",
        OTHER_CONSTANTS,
    ),
    "forms-of-other-functions-serve": Fault(
        "rodfem/fem/equations.py",
        "== (discretization, comm) and f.scene.alike(scene)",
        "== (discretization, comm)",
        OTHER_CONSTANTS,
    ),
    "unknowns-of-other-constants-stay": Fault(
        "rodfem/fem/fields.py",
        "(out.formulation, out.unknown_scalars) == (self.formulation, self.unknown_scalars)",
        "True",
        OTHER_CONSTANTS,
    ),
    "phase-conditions-do-not-move": Fault(
        "rodfem/stability/reduced_stiffness.py",
        "                out += term + term.T",
        "                pass",
        "tests/continuation/test_reduced_stiffness.py",
    ),
    "singular-states-are-solved-with": Fault(
        "rodfem/stability/reduced_stiffness.py",
        "        if near:\n",
        "        if False:\n",
        "tests/continuation/test_reduced_stiffness.py",
    ),
    "no-pair-is-near-the-axis": Fault(
        "rodfem/continuation/crossings.py",
        "AXIS, REAL = 0.4,",
        "AXIS, REAL = 0.0,",
        "tests/continuation/test_reduced_stiffness.py",
    ),
    "eigenvalues-have-the-units-of-loads": Fault(
        "rodfem/continuation/singular.py",
        "least[m if self.fold else m - k : m] /= units[0]",
        "least[m if self.fold else m - k :] /= units[0]",
        HARD,
    ),
    "what-turns-back-near-zero-is-passed": Fault(
        "rodfem/diagram/special_search.py",
        "            self._missed(piece, p, resolved=True)",
        "            pass",
        "tests/continuation/test_unfolding.py",
    ),
    "known-row": Fault(
        "rodfem/deflation/search.py",
        "if a.load == load:",
        "if a.load == load and b is not a:",
        "tests/diagram/test_load_at_an_end.py",
    ),
    "known-singular": Fault(
        "rodfem/deflation/search.py",
        "if a.load == load and id(a.x) in singular:",
        "if a.load == load and id(a) in singular:",
        AT_SPECIAL,
    ),
    "vanishing": Fault(
        "rodfem/adaptivity/soft_states.py",
        "_across(metric, near.vectors, vanishing)",
        "_across(metric, near.vectors, ())",
        AT_SPECIAL,
    ),
    "changed-by-itself": Fault(
        "rodfem/adaptivity/soft_states.py",
        "np.where(away > abs(coarse), left + away, left)",
        "np.where(contrary, left + away, left)",
        AT_SPECIAL,
    ),
    "another-state": Fault(
        "rodfem/adaptivity/soft_states.py",
        "if soft and not again.resolved:",
        "if soft and again.changed < 0:",
        AT_SPECIAL,
    ),
    "special-at": Fault(
        "rodfem/diagram/diagram.py",
        "return self.solver(point).assess(self._special_at(point) or point, method, number)",
        "return self.solver(point).assess(point, method, number)",
        AT_SPECIAL,
    ),
    "compared-across-the-branch": Fault(
        "rodfem/diagram/solver.py",
        "fixed_load=special is None",
        "fixed_load=True",
        AT_SPECIAL,
    ),
    "left-out-by-vectors": Fault(
        "rodfem/adaptivity/soft_states.py",
        "number + SPARE, NULL)[1]",
        "number + SPARE, NULL)[1][len(zeros) :]",
        AT_SPECIAL,
    ),
    "special-left": Fault(
        "rodfem/diagram/diagram.py",
        "return self[leaves].special[number]",
        "return None",
        AT_SPECIAL,
    ),
    "known-twice": Fault(
        "rodfem/deflation/search.py",
        "if known.distance(point.x) >= APART:",
        "if known.distance(point.x) >= 0:",
        "tests/diagram/test_load_at_an_end.py",
    ),
    "asked-row": Fault(
        "rodfem/diagram/events.py",
        "        yield arc.b\n",
        "        yield replace(arc.b)\n",
        "tests/diagram/test_load_at_an_end.py",
    ),
    "start-anew": Fault(
        "rodfem/diagram/tracer.py",
        "anew = trouble.point, branch.points[0]  #",
        "anew = (trouble.point,)  #",
        "tests/diagram/test_load_at_an_end.py",
    ),
    "corrections-in-the-metric-alone": Fault(
        "rodfem/fem/newton.c",
        "if (!(newton->size > in_metric)) newton->size",
        "newton->size",
        "tests/continuation/test_compiled_newton.py",
    ),
    "matrix-of-another-state": Fault(
        f"{STABILITY}inertia.py",
        "held is state and phase is self.system.phase and",
        "held is not None and",
        INERTIA,
    ),
    "matrix-with-its-shift": Fault(f"{STABILITY}inertia.py", " and changes == self.matrix.stateGet()", "", INERTIA),
    "round-off-of-forces": Fault(
        "rodfem/fem/newton.c",
        "double moved = step[i] / rod->sizes[i], value = x[i] / rod->sizes[i];",
        "double moved = step[i], value = x[i];",
        "tests/diagram/test_stiff_units.py",
    ),
    "rows-of-a-table-in-an-element-do-not-count": Fault(
        "rodfem/fem/known.py",
        "*table.knots[(table.knots > a) & (table.knots < b)], b])",
        "b])",
        "tests/problem/test_tables.py",
    ),
    "beyond-a-corner-the-tangent-is-that-before-it": Fault(
        "rodfem/continuation/follow.py",
        "_moved(self.solver, point.x, self._offset)",
        "_moved(self.solver, point.x, -self._offset)",
        "tests/problem/test_tables.py",
    ),
    "out-of-the-range": Fault(
        "rodfem/continuation/follow.py",
        "(beyond - last.load) * last.slope > 0:",
        "(made.load - last.load) * last.slope > 9e9:",
        "tests/diagram/test_load_at_an_end.py",
    ),
    "names-twice": Fault(
        "rodfem/diagram/explorer.py",
        '(name := f"{before}{number}{after}") in names',
        '(name := f"{before}{number}{after}") in ()',
        "tests/diagram/test_first_name.py",
    ),
    "ranges-are-left-and-entered-again": Fault(
        "rodfem/diagram/tracer.py", "        if out is None:", "        if True:", HARD
    ),
    "bars-of-modes-by-the-nearest": Fault(
        "rodfem/modes/finder.py",
        'others[np.argsort(abs(values), kind="stable")] = found.values[_moving(found, number)]',
        "others[:] = [found.values[np.argmin(abs(found.values - v))] for v in values]",
        "tests/modes/test_modes.py",
    ),
    "zeros-beside-the-fastest-motions": Fault(
        "rodfem/stability/nonsymmetric.py",
        "return greatest if self.floating else",
        "return greatest if True else",
        "tests/diagram/test_sweep.py",
    ),
    "bars-of-loads-by-those-of-ordinates": Fault(
        "rodfem/diagram/sweep.py",
        "        of_ordinate = of_load = self",
        "        of_ordinate = of_load = s.error_estimate = self",
        "tests/diagram/test_sweep.py",
    ),
    "matrices-pile-up": Fault(
        "rodfem/stability/nonsymmetric.py", "if self.filled % 64 == 0:", "if False:", "tests/diagram/test_sweep.py"
    ),
    "more-modes-than-there-are": Fault(
        "rodfem/fem/fields.py",
        "if number > (most := most_eigenvalues(scene, discretization)):",
        "if number > 10**9 * (most := most_eigenvalues(scene, discretization)):",
        "tests/stability/test_assessment.py",
    ),
    "no-new-folders": Fault(
        "rodfem/whole_files.py",
        "        path.parent.mkdir(parents=True, exist_ok=True)\n        draft.unlink",
        "        draft.unlink",
        "tests/codim2/test_locus.py",
    ),
    "mirror-images-by-what-richer-meshes-decide": Fault(
        "rodfem/diagram/explorer.py",
        "firsts.append(replace(first))",
        "firsts.append(first)",
        "tests/continuation/test_degenerate_pitchforks.py",
    ),
    "damped-beside-a-fold": Fault(
        "rodfem/diagram/doubts.py",
        "            solver.damp(_exact(solver, (point,), extra))",
        "            solver.damp(extra)",
        "tests/continuation/test_degenerate_pitchforks.py",
    ),
    "reasons-of-kinks-are-lost": Fault(
        "rodfem/output/words.py",
        'if row.get("kink"):',
        "if False:",
        "tests/diagram/test_kinks.py",
    ),
    "kinks-are-stable": Fault(
        "rodfem/stability/soft_mode.py", "if doubt:", "if doubt and not negative:", "tests/diagram/test_kinks.py"
    ),
    "constants-are-compared": Fault(
        "rodfem/problem/trials.py",
        "abs(symbolic - number) <= least:",
        "abs(symbolic - number) <= 1e9:",
        "tests/problem/test_symbols.py",
    ),
    "pairs-that-have-just-met-enter": Fault(
        "rodfem/diagram/collisions.py",
        "if D > 0 or just_met:",
        "if D > 0:",
        "tests/diagram/test_flutter_at_a_row.py",
    ),
    "steps-of-round-off-in-a-sweep": Fault(
        "rodfem/diagram/sweep.py",
        "least = 1e-12",
        "least = 0.0",
        "tests/diagram/test_flutter_at_a_row.py",
    ),
    "slow-frequencies-are-round-off": Fault(
        "rodfem/stability/nonsymmetric.py",
        "slow = np.flatnonzero(abs(values) < SLOW * one)",
        "slow = np.flatnonzero(abs(values) < 0.0)",
        HARD,
    ),
    "rods-that-soften-are-not-slow": Fault(
        "rodfem/stability/nonsymmetric.py",
        "not (self.solver.slow or several)",
        "not self.solver.slow",
        "tests/diagram/test_slow_and_far_frequencies.py",
    ),
    "differences-along-a-locus-by-the-bounds-alone": Fault(
        "rodfem/codim2/criteria.py",
        "float(min(DIFFERENCE, room / 100 / plane.width[which]))",
        "DIFFERENCE",
        "tests/codim2/test_locus.py",
    ),
    "zeros-of-a-mesh-make-two-branches-of-an-oval": Fault(
        "rodfem/diagram/equivalence.py",
        "alike = (noise > 0) & (first * second > 0)",
        "alike = (noise > 0) & False",
        "tests/hard/test_fuzz.py",
    ),
    "a-wave-that-is-even-on-its-elements-is-smooth": Fault(
        "rodfem/adaptivity/grading.py",
        "if last >= 4 and row[last - 1] * row[last - 4] < row[last - 2] ** 2:",
        "if False:",
        "tests/adaptivity/test_grading.py",
    ),
    "sides-on-both-sides-of-a-load-are-images": Fault(
        "rodfem/diagram/equivalence.py",
        "LOCATED * special.located_to",
        "1e9 * special.located_to",
        "tests/hard/test_fuzz.py",
    ),
    "steps-are-short-from-where-a-branch-goes-back-to": Fault(
        "rodfem/diagram/special_search.py",
        "max(largest, since - s)",
        "largest",
        "tests/diagram/test_many_returns.py",
    ),
    "bars-of-a-double-point-hold-for-one-load": Fault(
        f"{CONTINUATION}branch.py",
        "max(q.error_estimate, apart + p.error_estimate)",
        "q.error_estimate",
        "tests/continuation/test_index_chain.py",
    ),
    "the-first-mesh-that-does-not-help-is-the-last": Fault(
        "rodfem/diagram/sweep.py",
        "(3 if least > 1e-6 else 1)",
        "1",
        "tests/adaptivity/test_accuracy_control.py",
    ),
    "loci-count-what-is-nearest": Fault(
        "rodfem/codim2/criteria.py",
        "[: len(own) - size]",
        "[: len(own) - size]\n    chosen = np.intersect1d(chosen, np.argsort(abs(spectrum.values))[:10])",
        "tests/diagram/test_slow_and_far_frequencies.py",
    ),
    "events-where-the-sign-changes-from-row-to-row-alone": Fault(
        f"{CONTINUATION}event_piece.py",
        "if p.slope.item() * q.slope.item() < 0]",
        "if False]",
        "tests/diagram/test_events.py",
    ),
    "events-all-along-a-branch": Fault(
        "rodfem/diagram/events.py",
        "if piece.is_zero(piece.first) and piece.is_zero(piece.last):",
        "if False:",
        "tests/diagram/test_events.py",
    ),
    "events-know-no-round-off-of-states": Fault(
        f"{CONTINUATION}event_piece.py",
        "others = stepped(self.solver, x, self.row), x +",
        "others = x, x +",
        "tests/diagram/test_events.py",
    ),
    "events-of-nodes-have-bars-of-ends": Fault(
        "rodfem/adaptivity/error_estimate.py", "LEFT = 0.5", "LEFT = 0.0", "tests/adaptivity/test_event_bars.py"
    ),
    "curves-turn-into-another-branch": Fault(
        f"{CONTINUATION}arc.py",
        "dot(tangent) > ALIGNED",
        "dot(tangent) > 0.0",
        "tests/diagram/test_events.py",
    ),
    "a-read-diagram-forgets-its-plan": Fault(
        "rodfem/diagram/saved.py",
        "Plan() if asked is None else plan_without(asked)",
        "Plan()",
        "tests/diagram/test_another_rod.py",
    ),
    "convexity-is-looked-at-in-rows-alone": Fault(
        f"{CONTINUATION}arc.py",
        "if margin(t) <= 0.0 and not holds(t):",
        "if margin(t) <= 0.0 and t == 1.0 and not holds(t):",
        "tests/continuation/test_convexity.py",
    ),
    "convexity-of-the-undeformed-state-alone": Fault(
        "rodfem/fem/convexity.py",
        "self.alters = of_state or",
        "self.alters =",
        "tests/diagram/test_functions_between_rows.py",
    ),
    "branches-follow-polynomials-beyond-bends": Fault(
        f"{CONTINUATION}follow.py", "FAILURES = 2", "FAILURES = 200", HARD
    ),
    "loci-follow-polynomials-beyond-bends": Fault(
        "rodfem/codim2/follow.py", "if failures < 2", "if failures < 200", "tests/codim2/test_locus.py"
    ),
    "convexity-in-units-of-one-end": Fault(
        f"{CONTINUATION}arc.py",
        "convexity.scales(state(0.0), state(1.0))",
        "convexity.scales(state(0.0))",
        "tests/continuation/test_convexity.py",
    ),
    "convexity-at-places-of-a-grid-alone": Fault(
        "rodfem/fem/convexity.py",
        "b[believed] - slope[believed] ** 2 / (2 * curvature[believed])",
        "b[believed]",
        "tests/continuation/test_convexity.py",
    ),
    "parabolas-through-steps-are-believed": Fault(
        "rodfem/fem/convexity.py",
        " & (off <= 0.1 * (np.maximum(a, c) - b))",
        "",
        "tests/continuation/test_convexity.py",
    ),
    "energies-prefer-a-side": Fault(
        "rodfem/problem/trials.py",
        "abs(one - other) > NEGLIGIBLE * ",
        "abs(one - other) > 1e12 * ",
        "tests/problem/test_scene_errors.py",
    ),
    "energies-are-tried-at-one-load": Fault(
        "rodfem/problem/trials.py",
        "*map(scene.constants, scene.loads()), ",
        "",
        "tests/problem/test_scene_errors.py",
    ),
    "pitchforks-by-their-loads": Fault(
        f"{CONTINUATION}normal_form.py",
        "_pitchfork(leading(amplitudes, even, 2, origin.load_left), hidden",
        "_pitchfork(Leading(even[-1], even[-1], 0.0), hidden",
        "tests/continuation/test_degenerate_pitchforks.py",
    ),
    "no-index-before-zero-stretch": Fault(
        "rodfem/diagram/tracer.py",
        "if near.negative != a.negative:",
        "if False:",
        "tests/adaptivity/test_zero_stretch.py",
    ),
    "stable-in-space-by-frequencies": Fault(
        "rodfem/output/summary.py",
        'if data.get("planar") and interval.in_space is None',
        'if data.get("planar") and interval.in_space is None and not is_sweep(data)',
        "tests/output/test_summary.py",
    ),
    "the-sign-of-round-off-along-a-locus": Fault(
        f"{CONTINUATION}singular.py",
        "self.inertia.move(-self.inertia.tolerance)",
        "pass",
        "tests/codim2/test_locus.py",
    ),
    "turning-points-by-differences": Fault(
        "rodfem/codim2/points.py",
        "found.append((self._placed(turn, sought),",
        "found.append((turn,",
        "tests/codim2/test_places.py",
    ),
    "bars-across-loci-only": Fault(
        "rodfem/codim2/points.py",
        "located = better.located_to + found.dp",
        "located = better.located_to",
        "tests/codim2/test_places.py",
    ),
    "places-of-one-mesh": Fault(
        "rodfem/codim2/follow.py",
        "there, located_to = sought.p, sought.dp",
        "there, located_to = node.p, sought.dp",
        "tests/codim2/test_places.py",
    ),
    "ends-of-folds-corrected": Fault(
        "rodfem/codim2/points.py",
        "end = found.interpolated(node)",
        "end = replace(node)",
        "tests/codim2/test_places.py",
    ),
    "double-zeros-by-their-sign": Fault(
        "rodfem/codim2/points.py",
        "len(end.modes) * (int(a.omega2 < 0) - int(end.omega2 < 0))",
        "0",
        "tests/codim2/test_places.py",
    ),
    "ends-of-folds-counted": Fault(
        "rodfem/codim2/points.py",
        "dx=dx / size, s=s,",
        "dx=dx / size, s=s, rest=0,",
        "tests/codim2/test_locus.py",
    ),
    "special-points-of-small-loads-are-one": Fault(
        "rodfem/codim2/locus.py",
        "one = special.point, (units.load, units.ordinate)",
        "one = special.point, (1.0, 1.0)",
        "tests/codim2/test_locus.py",
    ),
    "loci-of-small-loads-start-everywhere": Fault(
        "rodfem/report/branches.py",
        '(natural["load"], natural["ordinate"])',
        "(1.0, 1.0)",
        "tests/codim2/test_locus.py",
    ),
    "moments-without-a-natural-size": Fault(
        "rodfem/output/files.py", '"length", "force", "moment", "energy")', '"length", "force", "energy")', FILES
    ),
    "mirrors-asked-of-a-molecule-in-metres": Fault(
        "rodfem/deflation/symmetries.py",
        "amplitude * units.of_field(block)",
        "amplitude",
        "tests/deflation/test_deflation.py",
    ),
    "deflated-steps-in-newtons": Fault(
        "rodfem/deflation/search.py",
        "relative_size(system, x, step)",
        "step.norm() / (1.0 + x.norm())",
        "tests/deflation/test_deflation.py",
    ),
    "sections-that-turn-without-their-shear": Fault(
        "rodfem/fem/symmetries.py",
        "_of_strains(list(fields.scene.free_strains))",
        "[]",
        "tests/fem/test_symmetries.py",
    ),
    "factors-begin-with-entries-of-energies": Fault(
        "rodfem/fem/system.py",
        "self.sizes * self.scene.units.energy**-0.5",
        "self.sizes * 1.0",
        "tests/problem/test_units.py",
    ),
    "scales-start-from-one": Fault(
        "rodfem/linalg/chain.c",
        "memcpy(s, c->natural, c->n * sizeof(double));",
        "for (int i = 0; i < c->n; i++) s[i] = 1.0;",
        "tests/problem/test_units.py",
    ),
    "quaternions-of-one-sign": Fault(
        "rodfem/deflation/symmetries.py",
        "for each in (y, *_same_rotations(self.system, y)):",
        "for each in (y,):",
        "tests/deflation/test_deflation.py",
    ),
    "no-convexity-before-zero-stretch": Fault(
        "rodfem/diagram/tracer.py",
        "if reason := self._lost_convexity(branch, a, near):",
        "if reason := '':",
        "tests/continuation/test_convexity.py",
    ),
    "symmetric-pencils-without-natural-units": Fault(
        f"{STABILITY}pencil.py",
        "    if units.ordinary:\n        return matrix, mass\n",
        "    if True:\n        return matrix, mass\n",
        "tests/stability/test_eigenvalues_in_si_units.py",
    ),
    "natural-sizes-of-the-least-stiffness": Fault(
        "rodfem/problem/units.py",
        "(least * middle) ** 0.5  # a rod",
        "least  # a rod",
        "tests/diagram/test_sweep.py",
    ),
    "masses-at-nine-loads": Fault(
        f"{STABILITY}pencil.py",
        "raise ConvergenceError(trouble)",
        "pass",
        "tests/diagram/test_inertia_of_a_load.py",
    ),
    "starts-that-jump": Fault(
        "rodfem/problem/validation.py", "if left > TURNED / 2:", "if left > 9:", "tests/problem/test_scene_errors.py"
    ),
    "states-that-cannot-be-counted": Fault(
        f"{CONTINUATION}first_equilibrium.py",
        "return replace(outcome, converged=False), False",
        "return outcome, True",
        "tests/stability/test_far_states.py",
    ),
    "rows-beyond-a-meeting-are-kept": Fault(
        "rodfem/diagram/tracer.py",
        "                branch.cut(special.point.arclength)\n",
        "                branch.points = [p for p in branch.points if p.arclength <= special.point.arclength]\n",
        "tests/hard/test_fuzz.py",
    ),
    "what-closes-a-ring-has-no-part": Fault(
        "rodfem/fem/invariance.py",
        "    table -= across @ (across.T @ table)\n",
        "",
        HARD,
    ),
    "sweeps-leave-their-path": Fault(
        "rodfem/diagram/equilibria.py",
        "(off > np.maximum(ASTRAY * step, FLOOR)).any()",
        "False",
        HARD,
    ),
    "first-states-beside-the-start-are-passed": Fault(
        "rodfem/continuation/first_equilibrium.py",
        "            x, outcome = other\n",
        "            pass\n",
        "tests/diagram/test_first_state.py",
    ),
    "first-states-without-forces": Fault(
        f"{CONTINUATION}first_equilibrium.py",
        "solver.at_load(_balanced(solver, guess), load)",
        "solver.at_load(guess, load)",
        FOLLOW,
    ),
    "loads-felt-by-their-unit": Fault(
        f"{CONTINUATION}singular_points.py",
        "derivative.norm() * solver.units.load <",
        "derivative.norm() <",
        "tests/problem/test_units.py",
    ),
    "what-is-free-on-the-trunk-stays-free": Fault(
        f"{CONTINUATION}switching.py",
        "return None if still else neighbouring_index(",
        "return neighbouring_index(",
        CHAIN,
    ),
    "detached-through-nothing": Fault(
        "rodfem/diagram/explorer.py", "and point.stretch > 0 and not", "and not", "tests/hard/test_fuzz.py"
    ),
    "eigenvalues-beside-the-edge-of-the-band": Fault(
        f"{STABILITY}inertia.py", "\nFAR = 0.1\n", "\nFAR = 1e9\n", "tests/stability/test_round_off.py"
    ),
    "stiffness-that-the-load-takes-away": Fault(
        f"{CONTINUATION}branch_solver.py",
        "return Convexity(self.system, self.system.scene.load)",
        "return Convexity(self.system)",
        "tests/continuation/test_convexity.py",
    ),
    "planes-are-tried-at-the-ends": Fault(
        "rodfem/problem/trials.py",
        "for load in scene.loads() if scene.load in asked",
        "for load in scene.span if scene.load in asked",
        "tests/problem/test_scene_errors.py",
    ),
    "bar-below-the-location": Fault(
        "rodfem/adaptivity/error_estimate.py", "max(load_error, special.located_to)", "load_error", ERRORS
    ),
    "bar-of-another-law": Fault(
        "rodfem/adaptivity/error_estimate.py",
        "if again is not None and alike(again, law):",
        "if again is not None:",
        ERRORS,
    ),
    "potential-of-constraints-at-nodes": Fault(
        "rodfem/fem/equations.py", '{"potential": potential}', '{"potential": L}', WORK
    ),
    "writhe-of-one-polygon": Fault(
        "rodfem/writhe.py", "(4 * fine - coarse) / 3", "fine", "tests/report/test_contents.py"
    ),
    "fewer-eigenvalues-than-asked-for": Fault(
        "rodfem/stability/assessment.py",
        "len(found.values) < number and name != COUNT",
        "False",
        "tests/stability/test_too_many_eigenvalues.py",
    ),
    "a-far-state-leaves-its-round-off": Fault(
        "rodfem/continuation/first_equilibrium.py",
        "        solver.inertia.forget_band()",
        "        pass",
        "tests/stability/test_far_states.py",
    ),
    "a-family-of-states-is-not-said": Fault(
        "rodfem/diagram/sweep.py",
        "        if self._still:",
        "        if False:",
        "tests/diagram/test_family_of_states.py",
    ),
    "constants-of-what-is-not-derived": Fault(
        "rodfem/fem/form_compiler.py",
        "derived = differentiated(form)",
        "derived = form",
        "tests/fem/test_form_constants.py",
    ),
    "stiff-strains-hide-bending": Fault(
        "rodfem/fem/invariance.py", "INVARIANT = 1e-12", "INVARIANT = 1e-9", "tests/fem/test_symmetries.py"
    ),
    "a-stiff-twist-hides-a-load": Fault(
        "rodfem/fem/invariance.py", "zero = 1e-10", "zero = 1e-4", "tests/fem/test_near_symmetries.py"
    ),
    "stiff-strains-hide-the-load": Fault(
        "rodfem/continuation/singular_points.py",
        "max(INSENSITIVE * system.stiffness_scale, ",
        "max(INSENSITIVE * system.matrix_in_units(matrix).norm(), ",
        "tests/continuation/test_coupling.py",
    ),
    "a-hinge-without-mass-in-small-units": Fault(
        "rodfem/stability/pencil.py",
        "        scaled.diagonalScale(system.sizes, system.sizes)",
        "        pass",
        "tests/stability/test_eigenvalues_in_si_units.py",
    ),
    "threads-work-at-once": Fault(
        "rodfem/problem/arguments.py", "with ONE_THREAD:", "with RLock():", "tests/app/test_threads.py"
    ),
    "free-rod-drifts-without-a-moment": Fault(
        "rodfem/fem/symmetries.py",
        "uniform(-0.3, 0.3, (len",
        "uniform(-0.0, 0.0, (len",
        "tests/literature/test_free_rods.py",
    ),
    "modes-without-their-parts-along-free-motions": Fault(
        f"{STABILITY}nonsymmetric.py",
        "            force.array[drifts] = 0.0\n",
        "",
        "tests/literature/test_free_rods.py",
    ),
    "signs-by-the-edge-of-the-band": Fault(
        f"{STABILITY}inertia.py",
        "if own.factored == self._filled and abs(own.shift) > FAR * own.scale:",
        "if False:",
        "tests/stability/test_near_zero.py",
    ),
    "a-ring-nearly-breaks-its-motion-along-itself": Fault(
        "rodfem/fem/symmetries.py", "_jumps(state), 1e-5", "_jumps(state), 1e-3", "tests/fem/test_near_symmetries.py"
    ),
    "a-bent-rod-breaks-a-symmetry": Fault(
        "rodfem/fem/symmetries.py",
        "SYMMETRIC_STATE = 1e-4",
        "SYMMETRIC_STATE = 1e-6",
        "tests/fem/test_near_symmetries.py",
    ),
    "a-mass-brings-a-unit-rotary-inertia": Fault(
        "rodfem/problem/scene.py", '"rho_I", _no_rotary)', '"rho_I", _unit_rotary)', "tests/problem/test_mass.py"
    ),
    "pictures-draw-chords": Fault(
        "rodfem/output/plot_diagram.py",
        "SEEN = 2e-4",
        "SEEN = 1e3",
        "tests/output/test_plot_diagram.py",
    ),
    # rows
    "rows-of-another-branch-are-kept": Fault(
        f"{CONTINUATION}follow.py",
        "defect(system, rows) <= UNEXPLAINED",
        "defect(system, rows) <= 1e9 * UNEXPLAINED",
        "tests/continuation/test_row_checks.py",
    ),
    "a-defect-by-one-tangent": Fault(
        f"{CONTINUATION}follow.py",
        "known = [p for p in rows[-ROWS:] if",
        "known = [p for p in rows[-1:] if",
        "tests/continuation/test_row_checks.py",
    ),
    "rows-are-no-equilibria": Fault(
        f"{CONTINUATION}follow.py",
        "if not worst <= VIOLATED and",
        "if not worst <= 1e9 * VIOLATED and",
        "tests/continuation/test_row_checks.py",
    ),
    # location
    "location-is-blunt": Fault(
        f"{CONTINUATION}eigenvalue_curves.py", "SHARP, ENOUGH = 1e-11,", "SHARP, ENOUGH = 1e-4,", LOCATE
    ),
    "location-at-another-zero": Fault(
        f"{CONTINUATION}eigenvalue_curves.py", "np.argmin(abs(real))", "np.argmax(abs(real))", LOCATE
    ),
    "unresolved-points-are-merged-with-others": Fault(
        f"{CONTINUATION}branch.py",
        "s.resolved is not False for s in (p, q))",
        "True for s in (p, q))",
        CHAIN,
    ),
    "two-passages-of-one-load-are-merged": Fault(
        f"{CONTINUATION}branch.py", "for row in between)\n", "for row in ())\n", CHAIN
    ),
    "breaks-are-not-recorded": Fault(
        f"{CONTINUATION}branch.py",
        "if left[1] < right[0] or right[1] < left[0]:",
        "if left[1] < right[0] and right[1] < left[0]:",
        CHAIN,
    ),
    "stability-is-not-exchanged": Fault(
        f"{CONTINUATION}switching.py",
        "return low if there == high else low + 1",
        "return low",
        f"{CHAIN} {GOLDEN}",
    ),
    "pitchfork-opens-the-other-way": Fault(
        f"{CONTINUATION}normal_form.py",
        "return NormalForm(PITCHFORK, best /",
        'return NormalForm("pitchfork", -best /',
        f"{ERRORS}",
    ),
    "law-of-an-ordinate-that-says-nothing": Fault(
        f"{CONTINUATION}normal_form.py",
        "return (QUADRATIC, quadratic, hidden / abs(quadratic.best)) if turns else None",
        "return QUADRATIC, quadratic, hidden / abs(quadratic.best)",
        "tests/literature/test_postbuckling.py",
    ),
    "law-by-one-side-of-a-mixed-ordinate": Fault(
        f"{CONTINUATION}normal_form.py",
        "even, odd = parts(ordinates)",
        "even, odd = ordinates[0], ordinates[0]",
        MIXED,
    ),
    "quadratic-term-that-hides-no-linear-one": Fault(
        f"{CONTINUATION}normal_form.py",
        "hidden = (abs(linear.best) + linear.missed) / amplitudes[0]",
        "hidden = 0.0",
        MIXED,
    ),
    "a-linear-term-below-round-off-leads": Fault(
        f"{CONTINUATION}normal_form.py",
        "and not (turns and linear.best**2 <= SEEN * left * abs(quadratic.best))",
        "and True",
        MIXED,
    ),
    # index
    "constraints-are-miscounted": Fault(
        f"{STABILITY}inertia.py",
        "below = negative - self.constraints - drifts",
        "below = negative - self.constraints",
        INERTIA,
    ),
    "symmetries-are-no-zeros": Fault(
        f"{STABILITY}inertia.py",
        "zero = self.below(own.tolerance) - negative + self.drifts",
        "zero = self.below(own.tolerance) - negative",
        f"{INERTIA} {BUCKLED}",
    ),
    "band-is-wide": Fault(
        f"{STABILITY}inertia.py", "ZERO_BAND = 1e-7", "ZERO_BAND = 1e-2", f"{INERTIA} {CORD} {CHAIN}"
    ),
    "quotients-of-the-wrong-sign": Fault(
        f"{STABILITY}near_zero.py",
        "(self.values < -self.uncertainty).sum()",
        "(self.values > self.uncertainty).sum()",
        INERTIA,
    ),
    "pivots-of-two-rows": Fault(
        "rodfem/linalg/chain.c", "det < 0 ? 1 : 2 * (e < 0)", "det < 0 ? 1 : 0", "tests/linalg/test_chain.py"
    ),
    "pivots-of-one-row": Fault(
        "rodfem/linalg/chain.c",
        "c->negative += pivot < 0;",
        "c->negative += pivot < 1e-3;",
        "tests/linalg/test_chain.py",
    ),
    "index-in-space-of-the-plane": Fault(
        f"{STABILITY}in_space.py",
        "return self.inertia.at(settled if converged else state)",
        "return Inertia(self.planar).at(x)",
        "tests/literature/test_rods.py tests/literature/test_ruler.py tests/literature/test_classics.py",
    ),
    "what-no-mesh-decides-is-refined-again": Fault(
        "rodfem/adaptivity/soft_states.py",
        "abs(finer) + of_mesh <= rounding",
        "abs(finer) < 0",
        "tests/stability/test_soft_modes.py",
    ),
    "all-that-is-undecided-is-within-round-off": Fault(
        "rodfem/adaptivity/soft_states.py",
        "abs(finer) + of_mesh <= rounding",
        "abs(finer) >= 0",
        "tests/adaptivity tests/stability/test_soft_modes.py tests/diagram/test_at_special_points.py",
    ),
    "zeros-that-nobody-decided": Fault(
        "rodfem/adaptivity/soft_states.py",
        "0.0 if self._richer else self.solver.inertia.tolerance",
        "0.0",
        "tests/stability/test_soft_modes.py",
    ),
    "segments-beside-undecided-rows": Fault(
        "rodfem/output/pieces.py",
        "if self.kind == UNDECIDED and self.soft else",
        "if False else",
        "tests/output/test_summary.py",
    ),
    "mumps-in-any-units": Fault(
        "rodfem/linalg/chain.py",
        "Mumps(kind, sizes)",
        "Mumps(kind)",
        "tests/problem/test_units.py",
    ),
    "frequencies-that-meet-and-part-in-a-step": Fault(
        "rodfem/diagram/critical_loads.py",
        "for meeting in sorted(ahead,",
        "for meeting in sorted(ahead[:0],",
        "tests/hard/test_hard_cases.py",
    ),
    "two-that-cross-may-meet": Fault(
        "rodfem/diagram/critical_loads.py",
        "(products[:, i, j].real < -rounded) | ",
        "np.ones_like(D[:2], bool) | ",
        "tests/diagram/test_all_frequencies.py",
    ),
    "frequencies-are-the-nearest-ones": Fault(
        f"{STABILITY}spectrum.py",
        "return len(self.negative) + 2 * len(self.upper)",
        "return len(self.negative) + 2 * int((self.upper < 14).sum())",
        "tests/diagram/test_all_frequencies.py",
    ),
    "round-off-of-two-that-meet-has-no-bound": Fault(
        f"{STABILITY}spectrum.py",
        "np.minimum(rounded * np.linalg.norm(left, axis=1), np.sqrt(rounded * np.linalg.norm(matrix)))",
        "rounded * np.linalg.norm(left, axis=1)",
        "tests/codim2/test_locus.py",
    ),
    "a-cluster-is-sought-from-one-shift": Fault(
        f"{STABILITY}cluster.py", "FARTHER = 3.0", "FARTHER = 1.0", "tests/codim2/test_places.py"
    ),
    "slepc-sorts-all-eigenvalues": Fault(
        f"{STABILITY}spectrum.py",
        "                if self.rank > ALL:",
        "                if True:",
        "tests/literature/test_joss_paper.py",
    ),
    "mass-of-a-quaternions-own-length": Fault(
        f"{STABILITY}spectrum.py", "RANK = 1e-13", "RANK = 1e-3", "tests/diagram/test_all_frequencies.py"
    ),
    "divergence-numbered-across-collisions": Fault(
        "rodfem/diagram/critical_loads.py",
        "if (passed and negative) or",
        "if",
        "tests/literature/test_rods.py",
    ),
    "divergence-of-rigid-motions": Fault(
        "rodfem/diagram/critical_loads.py",
        "[self._still :]",
        "[0:]",
        "tests/literature/test_free_rods.py",
    ),
    "divergence-by-vectors-of-rigid-motions": Fault(
        "rodfem/diagram/collisions.py",
        "if not self.still:",
        "if True:",
        "tests/literature/test_free_rods.py",
    ),
    "falls-out-of-the-plane-slowly": Fault(
        f"{STABILITY}in_space.py",
        "int(sum(falling))",
        "0 * sum(falling)",
        "tests/literature/test_postbuckling.py",
    ),
    "flutter-beside-the-collision": Fault(
        f"{CONTINUATION}eigenvalue_curves.py",
        "abs(root) < 1 and uncertainty < best.uncertainty",
        "uncertainty < 10 * best.uncertainty",
        LOCATE,
    ),
    "steps-are-not-parted": Fault(
        "rodfem/diagram/critical_loads.py",
        "if self._parted == PARTS or",
        "if True or",
        "tests/diagram/test_close_critical_loads.py",
    ),
    "a-one-of-other-units-beside-the-stiffness": Fault(
        f"{STABILITY}pencil.py",
        "return 1.0 if units.ordinary else units.energy / float(system.sizes.getValue(index).real) ** 2",
        "return 1.0",
        "tests/problem/test_units.py",
    ),
    "a-small-imperfection-is-a-symmetry": Fault(
        "rodfem/diagram/equivalence.py",
        "found = mirrors(system, first.x, found) if found else []",
        "",
        "tests/hard/test_fuzz.py",
    ),
    "as-many-branches-as-leave-a-point": Fault(
        "rodfem/diagram/explorer.py",
        "                if self._enough():\n                    break\n",
        "",
        "tests/literature/test_several_modes.py",
    ),
    "pairs-taken-for-one-meet-at-one-load": Fault(
        "rodfem/diagram/collisions.py",
        "noise.of_discriminant + clear.split) /",
        "noise.of_discriminant) /",
        HARD,
    ),
    "the-cubic-is-the-branch": Fault(
        "rodfem/continuation/crossings.py",
        "off = None if size is None else SAFE * (b.s - a.s) ** 4 / 16 * size",
        "off = 0 * np.eye(len(a.H))",
        "tests/continuation/test_reduced_stiffness.py",
    ),
    "signs-that-are-the-mesh's-are-the-rod's": Fault(
        "rodfem/adaptivity/soft_states.py",
        "return int(self._moved(point, found) if again.resolved else not fixed_load)",
        "return 0",
        "tests/stability/test_soft_modes.py",
    ),
    # error bars
    "bound-without-what-is-left": Fault(
        "rodfem/adaptivity/error_estimate.py", "change + rho / (1 - rho) * max(change, about) + left", "change", ERRORS
    ),
    "bound-of-a-place-by-itself": Fault(
        "rodfem/adaptivity/error_estimate.py", "max(change, about) + left", "change + left", ERRORS
    ),
    "bound-is-a-tenth": Fault(
        "rodfem/adaptivity/error_estimate.py",
        "change + rho / (1 - rho) * max(change, about) + left",
        "0.1 * change + left",
        ERRORS,
    ),
    "ordinate-of-a-load-that-is-exact": Fault(
        "rodfem/diagram/sweep.py",
        "of_ordinate += self._moved(x, point.load, of_load)",
        "pass",
        "tests/literature/test_follower.py",
    ),
    "every-state-is-resolved": Fault(
        "rodfem/adaptivity/error_estimate.py", "RESOLVED_TO = 0.1", "RESOLVED_TO = 1e9", f"{ERRORS} {HARD}"
    ),
    "bars-are-rounded": Fault(
        "rodfem/output/words.py",
        "ceil(error / 10.0**power * (1 - NEGLIGIBLE))",
        "round(error / 10.0**power)",
        ERRORS,
    ),
    "bar-without-digits-left-out": Fault(
        "rodfem/output/words.py",
        "error + abs(value - float(text))",
        "error",
        ERRORS,
    ),
    "end-of-a-branch-is-too-sharp": Fault(
        "rodfem/adaptivity/error_estimate.py", "else 0.25", "else 0.0025", "tests/adaptivity/test_zero_stretch.py"
    ),
    # files
    "no-drafts": Fault(
        "rodfem/whole_files.py",
        'draft = path.with_name(f".{path.stem}.rodfem-part{path.suffix}")',
        "draft = path",
        f"{KILLS} {FILES}",
    ),
    "drafts-go-through-links": Fault(
        "rodfem/whole_files.py",
        "draft.unlink(missing_ok=True)  # it may be a link to another file",
        "pass",
        "tests/output/test_foreign_files.py",
    ),
    "files-of-others-are-removed": Fault(
        "rodfem/app/run.py", "return [str(name) for name in named] if", "return os.listdir(folder) if", KILLS
    ),
    "earlier-branches-are-lost": Fault(
        "rodfem/app/run.py", "first=not self._saved", "first=True", f"{FILES} {KILLS} {DIAGRAM}"
    ),
    "another-row-is-restored": Fault(
        "rodfem/output/files.py", "_trimmed(value[row])", "_trimmed(value[row - 1])", f"{FILES} {DIAGRAM}"
    ),
    "files-of-two-runs": Fault(
        "rodfem/output/states.py",
        'if run != data.get("run"):',
        "if False:",
        f"{FILES} {KILLS} tests/output/test_foreign_files.py",
    ),
    "not-finite-numbers-in-a-file": Fault(
        "rodfem/output/table.py",
        "return float(value) if np.isfinite(value) else None",
        "return float(value)",
        f"{FILES} tests/output/test_foreign_files.py",
    ),
    "folder-without-a-lock": Fault(
        "rodfem/whole_files.py",
        "if comm.bcast(place in FOLDERS):",
        "if comm.bcast(True):",
        f"{KILLS} {FILES} tests/hard/test_numerical_faults.py",
    ),
    "decided-zeros-without-symmetries": Fault(
        f"{STABILITY}near_zero.py", "zero=q.zero + found.drifts", "zero=q.zero", "tests/stability/test_round_off.py"
    ),
    "what-newton-leaves-is-nothing": Fault(
        "rodfem/adaptivity/error_estimate.py", "left = STEADY * moved + ROUND_OFF", "left = ROUND_OFF", ERRORS
    ),
    "another-state-confirms-an-index": Fault(
        "rodfem/adaptivity/soft_states.py",
        'self.uncompared = "" if again.resolved else again.unlike(point.load)',
        'self.uncompared = ""',
        "tests/stability/test_soft_modes.py",
    ),
    "a-search-finds-states-that-are-not-convex": Fault(
        "rodfem/diagram/explorer.py",
        "(others if self.solver.lost_convexity(point.x) else convex).append(point)",
        "convex.append(point)",
        "tests/continuation/test_convexity.py",
    ),
    "taut-rods-have-frequencies": Fault(
        "rodfem/diagram/sweep.py",
        " or self._dependent(state)",
        "",
        "tests/stability/test_missing_frequencies.py",
    ),
    "eigensolvers-leave-nothing-open": Fault(
        "rodfem/stability/cluster.py", "DRAWN = 3.0", "DRAWN = 0.0", "tests/stability/test_cluster_noise.py"
    ),
    "clusters-are-not-closed": Fault(
        "rodfem/stability/cluster.py",
        "for pairs in range(min(len(above), size // 2) + 1):",
        "for pairs in range(1):",
        "tests/stability/test_cluster_noise.py",
    ),
    "left-vectors-have-free-motions": Fault(
        "rodfem/stability/nonsymmetric.py",
        "if free and not left:",
        "if free:",
        "tests/literature/test_free_rods.py",
    ),
    "sweeps-go-in-one-step": Fault(
        "rodfem/diagram/equilibria.py", "for parts in (1, 2, 4, 8)", "for parts in (1,)", "tests/diagram/test_held.py"
    ),
    "round-off-is-a-rotation": Fault(
        "rodfem/stability/motion_names.py", "LEAST = 1e-5", "LEAST = 0.0", "tests/stability/test_mode_type.py"
    ),
    "straight-rods-have-no-stiffness": Fault(
        "rodfem/fem/quadrature_check.py",
        "np.array([first, moved - first])",
        "np.array([first, first])",
        "tests/fem/test_quadrature_check.py",
    ),
    "quadrature-of-halves-alone": Fault(
        "rodfem/fem/quadrature_check.py",
        "np.maximum(second, third) / allowed",
        "second / allowed",
        "tests/fem/test_quadrature_check.py",
    ),
    "masses-are-integrated": Fault(
        "rodfem/fem/quadrature_check.py",
        "if equations.even:",
        "if True:",
        "tests/fem/test_quadrature_check.py",
    ),
    "rules-as-good-as-they-are": Fault(
        "rodfem/fem/quadrature_check.py",
        "np.maximum(0.5**self._pieces.points * ",
        "np.maximum(1.0 * ",
        "tests/fem/test_quadrature_check.py",
    ),
    "composite-rules-of-few-points": Fault(
        "rodfem/fem/quadrature_check.py",
        "POINTS, LEAST = 4096, 4",
        "POINTS, LEAST = 256, 4",
        "tests/fem/test_quadrature_check.py",
    ),
    "kinks-to-one-side-are-none": Fault(
        "rodfem/fem/quadrature_check.py",
        "(bent | (larger < 2 * change)).any()",
        "(larger < 2 * change).any()",
        "tests/diagram/test_kinks.py",
    ),
    "special-points-keep-their-bars": Fault(
        "rodfem/diagram/doubts.py",
        "special.ordinate_error = point.estimate = special.omega2_error",
        "special.omega2_error",
        "tests/diagram/test_kinks.py tests/fem/test_quadrature_check.py",
    ),
    "loci-have-bars-at-kinks": Fault(
        "rodfem/codim2/follow.py",
        "                error[row] = np.nan\n",
        "",
        "tests/diagram/test_sharp_in_state.py",
    ),
    "modes-have-bars-at-kinks": Fault(
        "rodfem/modes/finder.py",
        "        if self.error_bars and not note:",
        "        if self.error_bars:",
        "tests/diagram/test_sharp_in_state.py",
    ),
    "branches-that-attract-alone": Fault(
        "rodfem/continuation/switching.py",
        "        if max(abs(values[i : i + 2])) > felt\n",
        "        if False\n",
        "tests/continuation/test_reduced.py",
    ),
    "weak-springs-are-round-off": Fault(
        "rodfem/fem/invariance.py",
        "    if not found or equations.loads is None:",
        "    if True:",
        "tests/fem/test_near_symmetries.py",
    ),
    "what-comes-back-is-known-by-its-last-rows": Fault(
        "rodfem/diagram/explorer.py",
        "max(min(rows, len(parent.points) - TAIL), 0)",
        "len(parent.points) - TAIL",
        "tests/continuation/test_index_chain.py",
    ),
    "options-of-petsc-keep-their-dash": Fault(
        "rodfem/app/main.py",
        "word[1:].encode()",
        "word.encode()",
        "tests/app/test_command_lines.py",
    ),
    "a-pole-is-a-divergence": Fault(
        "rodfem/diagram/critical_loads.py",
        "        if pole:",
        "        if False:",
        "tests/diagram/test_light_rods.py",
    ),
    "units-make-constraints-depend": Fault(
        f"{STABILITY}dependence.py",
        "C = sp.diags(_units(pencil, length)) @ pencil.C",
        "C = pencil.C",
        "tests/stability/test_assessment.py",
    ),
    "ways-down-that-go-uphill": Fault(
        "rodfem/fem/newton.py",
        "if isfinite(longest) and along(system, x, step) < 0:",
        "if False:",
        "tests/hard/test_fuzz.py",
    ),
    "constraints-count-as-uphill": Fault(
        "rodfem/fem/newton.py",
        "- first] = -1.0",
        "- first] = 1.0",
        "tests/fem/test_way_down.py",
    ),
    "dependent-only-where-sigma-is-zero": Fault(
        f"{STABILITY}dependence.py",
        "_distance(blocks, x, pencil, w) > STALLED",
        "_distance(blocks, x, pencil, w) > 1e-12",
        "tests/stability/test_dependence.py",
    ),
    "distances-of-the-mesh": Fault(
        f"{STABILITY}dependence.py",
        "steepness = float(np.linalg.norm(slope) * np.sqrt(len(change)))",
        "steepness = float(np.sqrt(len(change)))",
        "tests/stability/test_dependence.py",
    ),
    "taut-rods-are-begun-with": Fault(
        f"{STABILITY}dependence.py",
        "return bool(shape.system.scene.constraints) or taut(shape, x)",
        "return bool(shape.system.scene.constraints)",
        "tests/stability/test_dependence.py",
    ),
    "flutter-without-the-matrix-s-round-off": Fault(
        f"{STABILITY}cluster.py",
        "of(2 * W @ B.T), *left",
        "0.0, *left",
        "tests/stability/test_cluster_noise.py",
    ),
    "modules-beside-a-file-come-first": Fault(
        "rodfem/app/persons_file.py",
        "sys.path.append(str(path.parent))",
        "sys.path.insert(0, str(path.parent))",
        "tests/app/test_run_command.py",
    ),
    "rods-of-another-inertia-are-one": Fault(
        "rodfem/fem/fingerprint.py", "(mass * change).dot(change).real / 2", "0.0", "tests/diagram/test_another_rod.py"
    ),
    "rods-that-differ-inside-the-range-are-one": Fault(
        "rodfem/fem/fingerprint.py", ", *inside(own)] + (", "] + (", "tests/diagram/test_another_rod.py"
    ),
    "scene-of-another-name": Fault(
        "rodfem/diagram/saved.py", "if (name, load) != (scene.name, scene.load):", "if load != scene.load:", DIAGRAM
    ),
    "rigid-motions-take-all-digits": Fault(
        f"{STABILITY}nonsymmetric.py",
        "found = self.near(number + BEYOND, SHIFT * self._one, left=left)",
        "found = self.near(number + BEYOND, 0.0, left=left)",
        "tests/literature/test_free_rods.py",
    ),
    "double-eigenvalue-of-flutter-twice": Fault(
        "rodfem/modes/finder.py",
        "for i in _upper(values) if i not in left_out]",
        "for i in _upper(values)]",
        RECORDED,
    ),
    "recorded-modes-without-those-of-special-points": Fault(
        "rodfem/modes/finder.py", "    for special in branch.special:\n", "    for special in ():\n", RECORDED
    ),
    "terminal-left-without-its-cursor": Fault(
        "rodfem/app/screen.py", "            self._progress.stop()\n", "", "tests/app/test_screen.py"
    ),
    "locus-of-a-mean-with-the-bar-of-one": Fault(
        "rodfem/codim2/criteria.py", "split = SPLIT * found.spread", "split = 0.0 * found.spread", LOCI
    ),
    "flutter-locus-of-a-mean-with-the-bar-of-one": Fault(
        "rodfem/codim2/criteria.py", "+ SPLIT * here.split", "+ 0.0 * here.split", LOCI
    ),
    "flutter-locus-of-a-mean": Fault("rodfem/codim2/criteria.py", "if here.split > FEWER", "if False and here", LOCI),
    "locus-across-a-gap": Fault(
        "rodfem/codim2/follow.py", "if node.orientation != last.orientation and not", "if False and not", LOCI
    ),
    "a-fold-that-passes-a-branch-point-ends": Fault(
        "rodfem/codim2/points.py", " and (a.dp * b.dp < 0)[moves].all()", "", LOCI
    ),
    "a-passage-is-a-cusp": Fault(
        "rodfem/codim2/points.py", "if _coupling_vanishes(cusp, a, b, PASSED):", "if False:", LOCI
    ),
    "cusps-are-turns": Fault("rodfem/codim2/points.py", "sides[0].curvature * sides[1].curvature < 0", "False", LOCI),
    "cusps-hide-in-a-step": Fault(
        "rodfem/codim2/points.py",
        "pairwise([a, *self._hidden(a, b, other), b])",
        "pairwise([a, b])",
        LOCI,
    ),
    "no-turn-beside-a-cusp": Fault(
        "rodfem/codim2/points.py",
        "        if sides and depth:\n",
        "        if False:\n",
        LOCI,
    ),
    "the-end-of-a-fold-has-no-bar": Fault(
        "rodfem/codim2/points.py",
        "np.maximum(abs(node.p - a.p), abs(node.p - b.p)) + a.located_to",
        "a.located_to",
        LOCI,
    ),
    "a-locus-drops-symmetries-for-good": Fault(
        "rodfem/codim2/criteria.py",
        "verification.dropped, verification.notices = dropped, notices",
        "pass",
        IN_WORDS,
    ),
    "close-special-points-are-on-one-locus": Fault(
        "rodfem/tolerances.py",
        "<= LOCATED * (located_to + round_off(load, of_load))",
        "<= SAME_SPECIAL * unit(load, one=of_load)",
        IN_WORDS,
    ),
    "stable-in-a-plane-is-stable": Fault(
        "rodfem/codim2/follow.py",
        "planar=bool(scene.planar)",
        "planar=False",
        IN_WORDS,
    ),
    "loci-of-unresolved-points-are-resolved": Fault(
        "rodfem/codim2/follow.py",
        "doubtful=doubtful or special.resolved is False",
        "doubtful=False",
        LOCI,
    ),
    "rows-of-loci-are-resolved": Fault(
        "rodfem/codim2/follow.py",
        "<= RESOLVED_TO",
        "<= 1e9",
        IN_WORDS,
    ),
    "bars-of-loci-stay-off-the-page": Fault(
        "rodfem/report/branches.py",
        "found.append([] if None in pair else",
        "found.append([] if True else",
        IN_WORDS,
    ),
    "a-gap-of-loci-is-a-crossing-for-sure": Fault(
        "rodfem/codim2/points.py",
        ", or turns back within {GAP:g} of the bounds from one",
        "",
        LOCI,
    ),
    "every-crossing-of-loci-is-a-gap": Fault(
        "rodfem/codim2/follow.py",
        "                return False\n        return True\n",
        "                return False\n        return False\n",
        LOCI,
    ),
    "stable-side-beyond-a-crossing": Fault(
        "rodfem/output/plot_locus.py", "if crossed or not side", "if not side", LOCI
    ),
    "locus-through-an-imperfection": Fault(
        "rodfem/codim2/criteria.py", "curve.part > IMPERFECT", "curve.part > 1e9", LOCI
    ),
    "states-drift-along-null-vectors": Fault(
        f"{CONTINUATION}singular.py", "constant = -at.Z.T @ at.b[:, 0]", "constant = -0.0 * at.Z.T @ at.b[:, 0]", LOCI
    ),
    "flutter-locus-by-eigenvalues-alone": Fault(
        "rodfem/codim2/criteria.py", "step = -noise.two_sided / slope", "step = 0.0", LOCI
    ),
    "closed-locus-goes-round-again": Fault(
        "rodfem/codim2/follow.py", "< 0.1 * (b.s - a.s)", "< 1e-4 * (b.s - a.s)", LOCI
    ),
    "bar-of-a-locus-without-what-is-left": Fault(
        "rodfem/codim2/follow.py", "[bound(*pair, self.rho)", "[bound(*pair, 0.0)", "tests/codim2/test_places.py"
    ),
    "modes-that-meet-without-round-off": Fault(
        "rodfem/modes/finder.py",
        "np.maximum(noise, FLOOR",
        "np.maximum(0.0 * noise, FLOOR",
        "tests/modes/test_modes.py",
    ),
}


def main(names: list[str]) -> int:
    """Plant the faults named, or all, one after the other; returns the number of those that no test caught."""
    if unknown := [name for name in names if name not in FAULTS]:
        sys.exit(f"usage: python -m tests.mutations [NAME ...]; no fault is called {', '.join(unknown)}")
    missed = 0
    for name in names or FAULTS:
        began, caught = time.time(), caught_by(FAULTS[name])
        missed += not caught or caught.startswith("NOT")
        print(f"{name:<34} {caught or 'NOT CAUGHT'} ({time.time() - began:.0f} s)", flush=True)
    print(f"{missed} not caught")
    return missed


def caught_by(fault: Fault) -> str:
    """Name of the first test that fails with a fault planted, and passes without; empty where there is none."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "rodfem"
        files = subprocess.run(["git", "ls-files", "-z"], cwd=HOME, capture_output=True, text=True, check=True).stdout
        for file in filter(None, files.split("\0")):
            (tree / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(HOME / file, tree / file, follow_symlinks=False)
        place, whole = tree / fault.file, (tree / fault.file).read_text()
        for marks in ("not long", "long"):
            place.write_text(planted(whole, fault))
            failed = first_failure(tree, fault.tests.split(), marks)
            place.write_text(whole)
            if failed and (always := first_failure(tree, [failed], "")):
                return f"NOT CAUGHT: without the fault, too, {always} fails"
            if failed:
                return failed + " (long)" * (marks == "long")
        return ""


def first_failure(tree: Path, tests: list[str], marks: str) -> str:
    """Name of the first test with such ``marks`` that fails in a copy of the tree; empty where all pass."""
    options = ["-x", "-q", "--no-header", "-p", "no:cacheprovider", "-m", marks]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, *tests],
        cwd=tree,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (tree, tree / "tests")))},
        capture_output=True,
        text=True,
        timeout=LIMIT,
    )
    failed = [line.split(" - ")[0].split() for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return " ".join(failed[0][1:]) if done.returncode == 1 and failed else ""


def planted(text: str, fault: Fault) -> str:
    """Text with a fault; raises ValueError unless it has one place for it."""
    if text.count(fault.old) != 1:
        raise ValueError(f"{fault.file} has {text.count(fault.old)} times {fault.old!r}: give the fault another place")
    return text.replace(fault.old, fault.new)


if __name__ == "__main__":
    sys.exit(min(main(sys.argv[1:]), 1))
