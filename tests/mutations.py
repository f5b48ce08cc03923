"""Faults planted by hand, one at a time, each of which the tests must catch: ``python -m tests.mutations [NAME ...]``.

A fault is a few characters changed in one file.  The tests named with it run on a copy of the tree, and must fail:
those of ``make test``, or, where they pass, those marked ``long``, which is said.
``tests/house/test_mutations.py`` checks that every fault still has its place in the code.
"""

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


CHAIN = "continuation/test_index_chain.py"
MIXED = "continuation/test_laws_of_mixed_ordinates.py"
LOCATE = "continuation/test_locate.py"
LOCI = "hard/test_hard_loci.py"
IN_WORDS = "codim2/test_locus_in_words.py"
ERRORS = "adaptivity/test_error_estimate.py"
INERTIA = "stability/test_inertia.py stability/test_assessment.py"
HARD = "hard/test_hard_cases.py"
RECORDED = "modes/test_recorded.py"
AT_SPECIAL = "diagram/test_at_special_points.py"
OTHER_CONSTANTS = "diagram/test_other_constants.py"

# fmt: off
TABLE = {
    "rodfem/adaptivity/error_estimate.py": {
        "events-of-nodes-have-bars-of-ends": ("LEFT = 0.5", "LEFT = 0.0", "adaptivity/test_event_bars.py"),
        "bar-below-the-location": ("max(load_error, special.located_to)", "load_error", ERRORS),
        "end-of-a-branch-is-too-sharp": ("else 0.25", "else 0.0025", "adaptivity/test_zero_stretch.py"),
    },
    "rodfem/adaptivity/grading.py": {
        "a-wave-that-is-even-on-its-elements-is-smooth": (
            "if last >= 4 and row[last - 1] * row[last - 4] < row[last - 2] ** 2:", "if False:",
            "adaptivity/test_grading.py"),
    },
    "rodfem/adaptivity/soft_states.py": {
        "vanishing": ("_rank(metric, near.vectors, vanishing)", "_rank(metric, near.vectors, ())", AT_SPECIAL),
        "what-no-mesh-decides-is-refined-again": (
            "abs(finer) + of_mesh <= rounding", "abs(finer) < 0", "stability/test_soft_modes.py"),
        "all-that-is-undecided-is-within-round-off": (
            "abs(finer) + of_mesh <= rounding", "abs(finer) >= 0",
            "adaptivity stability/test_soft_modes.py diagram/test_at_special_points.py"),
    },
    "rodfem/app/persons_file.py": {
        "modules-beside-a-file-come-first": (
            "sys.path.append(str(path.parent))", "sys.path.insert(0, str(path.parent))", "app/test_run_command.py"),
    },
    "rodfem/app/run.py": {
        "files-of-others-are-removed": (
            'return [str(name) for name in load_json(folder / "diagram.json").get("files", ())]',
            "return os.listdir(folder)",
            "hard/test_files_after_a_kill.py"),
        "earlier-branches-are-lost": (
            "first=not self._saved", "first=True",
            "output/test_files.py output/test_formats.py hard/test_files_after_a_kill.py diagram/test_diagram.py"),
    },
    "rodfem/codim2/adjoint.py": {
        "flutter-of-a-mass-that-is-no-part-of-it": ("V @ A @ Q)", "0.0 * V)", "codim2/test_sensitivity.py"),
    },
    "rodfem/codim2/criteria.py": {
        "the-sign-of-round-off-along-a-locus": (
            "self.inertia.move(-self.inertia.tolerance)", "pass", "codim2/test_locus.py"),
        "loci-count-what-is-nearest": (
            "[: len(own) - size]",
            "[: len(own) - size]\n    chosen = np.intersect1d(chosen, np.argsort(abs(spectrum.values))[:10])",
            "diagram/test_light_and_slow_rods.py"),
        "locus-of-a-mean-with-the-bar-of-one": ("split = SPLIT * found.spread", "split = 0.0 * found.spread", LOCI),
    },
    "rodfem/codim2/follow.py": {
        "loci-follow-polynomials-beyond-bends": ("if failures < 2", "if failures < 200", "codim2/test_locus.py"),
        "places-of-one-mesh": (
            "there, located_to = sought.p, sought.dp", "there, located_to = node.p, sought.dp",
            "codim2/test_places.py"),
        "loci-have-bars-at-kinks": ("                error[row] = np.nan\n", "", "diagram/test_kinks.py"),
        "locus-across-a-gap": ("if node.orientation != last.orientation and not", "if False and not", LOCI),
        "rows-of-loci-are-resolved": ("<= RESOLVED_TO", "<= 1e9", IN_WORDS),
    },
    "rodfem/codim2/locus.py": {
        "stable-in-a-plane-is-stable": ('"planar": bool(scene.planar)', '"planar": False', IN_WORDS),
        "special-points-of-small-loads-are-one": (
            "one = special.point, (units.load, units.ordinate)", "one = special.point, (1.0, 1.0)",
            "codim2/test_locus.py"),
    },
    "rodfem/codim2/points.py": {
        "turning-points-by-differences": (
            "found.append((self._placed(turn, sought),", "found.append((turn,", "codim2/test_places.py"),
        "ends-of-folds-counted": ("dx=dx / size, s=s,", "dx=dx / size, s=s, rest=0,", "codim2/test_locus.py"),
        "a-fold-that-passes-a-branch-point-ends": (" and (a.dp * b.dp < 0)[moves].all()", "", LOCI),
    },
    "rodfem/continuation/arc.py": {
        "events-where-the-sign-changes-from-row-to-row-alone": (
            "if p.slope.item() * q.slope.item() < 0]", "if False]", "diagram/test_events.py"),
    },
    "rodfem/continuation/branch.py": {
        "bars-of-a-double-point-hold-for-one-load": (
            "max(q.error_estimate, apart + p.error_estimate)", "q.error_estimate", CHAIN),
    },
    "rodfem/continuation/branch_solver.py": {
        "stiffness-that-the-load-takes-away": (
            "return Convexity(self.system, self.system.scene.load)", "return Convexity(self.system)",
            "continuation/test_convexity.py"),
    },
    "rodfem/continuation/crossings.py": {
        "no-pair-is-near-the-axis": (
            "AXIS, REAL = 0.4,", "AXIS, REAL = 0.0,", "continuation/test_reduced_stiffness.py"),
    },
    "rodfem/continuation/eigenvalue_curves.py": {
        "location-is-blunt": ("SHARP, ENOUGH = 1e-11,", "SHARP, ENOUGH = 1e-4,", LOCATE),
    },
    "rodfem/continuation/first_equilibrium.py": {
        "states-that-cannot-be-counted": (
            "return replace(outcome, converged=False), False", "return outcome, True", "stability/test_round_off.py"),
        "first-states-beside-the-start-are-passed": (
            "            x, outcome = other\n", "            pass\n", "diagram/test_first_state.py"),
        "first-states-without-forces": (
            "solver.at_load(_balanced(solver, guess), load)", "solver.at_load(guess, load)",
            "continuation/test_continuation.py"),
    },
    "rodfem/continuation/follow.py": {
        "beyond-a-corner-the-tangent-is-that-before-it": (
            "_moved(self.solver, point.x, self._offset)", "_moved(self.solver, point.x, -self._offset)",
            "problem/test_tables.py"),
        "out-of-the-range": (
            "(beyond - last.load) * last.slope > 0:", "(made.load - last.load) * last.slope > 9e9:",
            "diagram/test_load_at_an_end.py"),
        "branches-follow-polynomials-beyond-bends": ("FAILURES = 2", "FAILURES = 200", HARD),
        "rows-of-another-branch-are-kept": (
            "defect(system, rows) <= UNEXPLAINED", "defect(system, rows) <= 1e9 * UNEXPLAINED",
            "continuation/test_row_checks.py"),
    },
    "rodfem/continuation/normal_form.py": {
        "pitchforks-by-their-loads": (
            "load = leading(amplitudes, even, 2, origin.load_left)",
            "load = Leading(even[-1], even[-1], 0.0)", "continuation/test_degenerate_pitchforks.py"),
        "pitchfork-opens-the-other-way": (
            "return NormalForm(PITCHFORK, best /", 'return NormalForm("pitchfork", -best /', ERRORS),
        "a-slope-hides-in-no-pitchfork": (" + hidden / abs(term.best) ** power", "", MIXED),
        "law-of-an-ordinate-that-says-nothing": (
            "return (QUADRATIC, quadratic, hidden / abs(quadratic.best)) if turns else None",
            "return QUADRATIC, quadratic, hidden / abs(quadratic.best)", "literature/test_postbuckling.py"),
    },
    "rodfem/continuation/singular.py": {
        "eigenvalues-have-the-units-of-loads": (
            "least[m if self.fold else m - k : m] /= units[0]", "least[m if self.fold else m - k :] /= units[0]",
            "problem/test_units.py codim2/test_places.py"),
        "states-drift-along-null-vectors": (
            "rows[:, 0] -= at.Z.T @ at.b[:, 0]", "rows[:, 0] -= 0.0 * at.Z.T @ at.b[:, 0]",
            "continuation/test_unfolding.py"),
    },
    "rodfem/continuation/singular_points.py": {
        "loads-felt-by-their-unit": (
            ".norm() * solver.units.load < least", ".norm() < least", "problem/test_units.py"),
        "stiff-strains-hide-the-load": (
            "max(INSENSITIVE * system.stiffness_scale, ", "max(INSENSITIVE * system.matrix_in_units(matrix).norm(), ",
            "continuation/test_unfolding.py"),
    },
    "rodfem/continuation/switching.py": {
        "what-is-free-on-the-trunk-stays-free": (
            "return None if still else neighbouring_index(", "return neighbouring_index(", CHAIN),
        "branches-that-attract-alone": (
            "        if max(abs(values[i : i + 2])) > felt\n", "        if False\n", "continuation/test_reduced.py"),
    },
    "rodfem/deflation/search.py": {
        "known-row": ("if a.load == load:", "if a.load == load and b is not a:", "diagram/test_load_at_an_end.py"),
        "known-singular": (
            "if a.load == load and id(a.x) in singular:", "if a.load == load and id(a) in singular:", AT_SPECIAL),
        "deflated-steps-in-newtons": (
            "relative_size(system, x, step)", "step.norm() / (1.0 + x.norm())", "deflation/test_deflation.py"),
    },
    "rodfem/deflation/symmetries.py": {
        "mirrors-asked-of-a-molecule-in-metres": (
            "f.wave(seed) * f.sizes", "f.wave(seed)", "deflation/test_deflation.py"),
    },
    "rodfem/diagram/critical_loads.py": {
        "divergence-by-vectors-of-rigid-motions": ("if not self.zeros:", "if True:", "literature/test_free_rods.py"),
        "pairs-taken-for-one-meet-at-one-load": (
            "noise.of_discriminant + clear.split) /", "noise.of_discriminant) /", HARD),
        "pairs-that-have-just-met-enter": ("if D > 0 or just_met:", "if D > 0:", HARD),
        "frequencies-that-meet-and-part-in-a-step": (
            "for meeting in sorted(ahead,", "for meeting in sorted(ahead[:0],", HARD),
        "two-that-cross-may-meet": (
            "(products[:, i, j].real < -rounded) | ", "np.ones_like(D[:2], bool) | ",
            "diagram/test_all_frequencies.py"),
        "divergence-numbered-across-collisions": (
            "if passed and not negative:", "if passed:", "literature/test_rods.py"),
        "divergence-of-rigid-motions": ("[self._zeros :]", "[0:]", "literature/test_free_rods.py"),
        "steps-are-not-parted": ("if self._parted == PARTS or", "if True or", "literature/test_rods.py " + HARD),
        "a-pole-next-to-another-eigenvalue-is-a-divergence": (
            "min(abs(mu(low)), abs(mu(high))) / 2,", "min(abs(mu(low)), abs(mu(high))),",
            "diagram/test_light_and_slow_rods.py"),
    },
    "rodfem/diagram/diagram.py": {
        "special-at": (
            "return self.solver(point).assess(self._special_at(point) or point, method, number)",
            "return self.solver(point).assess(point, method, number)", AT_SPECIAL),
    },
    "rodfem/diagram/doubts.py": {
        "damped-beside-a-fold": (
            "            solver.damp(_exact(solver, (point,), extra))", "            solver.damp(extra)",
            "continuation/test_degenerate_pitchforks.py"),
        "special-points-keep-their-bars": (
            "special.ordinate_error = point.estimate = special.omega2_error", "special.omega2_error",
            "diagram/test_kinks.py fem/test_quadrature_check.py"),
    },
    "rodfem/diagram/equilibria.py": {
        "sweeps-leave-their-path": ("(astray > np.maximum(ASTRAY * step, FLOOR)).any()", "False", HARD),
        "sweeps-go-in-one-step": ("for parts in (1, 2, 4, 8)", "for parts in (1,)", "diagram/test_load_steps.py"),
    },
    "rodfem/diagram/equivalence.py": {
        "zeros-of-a-mesh-make-two-branches-of-an-oval": (
            "alike = (noise > 0) & (first * second > 0)", "alike = (noise > 0) & False", "hard/test_fuzz.py"),
    },
    "rodfem/diagram/events.py": {
        "asked-row": ("        yield arc.b\n", "        yield replace(arc.b)\n", "diagram/test_load_at_an_end.py"),
        "events-all-along-a-branch": (
            "if piece.is_zero(piece.first) and piece.is_zero(piece.last):", "if False:", "diagram/test_events.py"),
    },
    "rodfem/diagram/explorer.py": {
        "names-twice": (
            '(name := f"{before}{number}{after}") in names', '(name := f"{before}{number}{after}") in ()',
            "diagram/test_first_state.py"),
        "mirror-images-by-what-richer-meshes-decide": (
            "firsts.append(replace(first))", "firsts.append(first)", "continuation/test_degenerate_pitchforks.py"),
        "detached-through-nothing": ("and point.stretch > 0 and not", "and not", "hard/test_fuzz.py"),
        "as-many-branches-as-leave-a-point": (
            "                if self._enough():\n                    break\n", "", "literature/test_several_modes.py"),
        "a-search-finds-states-that-are-not-convex": (
            "(others if self.solver.lost_convexity(point.x) else convex).append(point)", "convex.append(point)",
            "continuation/test_convexity.py"),
        "what-comes-back-is-known-by-its-last-rows": (
            "max(min(rows, len(parent.points) - TAIL), 0)", "len(parent.points) - TAIL", "diagram/test_golden.py"),
    },
    "rodfem/diagram/saved.py": {
        "a-read-diagram-forgets-its-plan": (
            "plan_without(asked),", "plan_without({'plan': {}}),", "diagram/test_another_rod.py"),
        "scene-of-another-name": (
            "if (name, load) != (scene.name, scene.load):", "if load != scene.load:",
            "diagram/test_diagram.py"),
    },
    "rodfem/diagram/solver.py": {
        "compared-across-the-branch": ("fixed_load=special is None", "fixed_load=True", AT_SPECIAL),
    },
    "rodfem/diagram/special_search.py": {
        "folds-have-no-other-side": (
            "self._missed(piece, at, fold=found)", "pass", "continuation/test_unfolding.py"),
    },
    "rodfem/diagram/sweep.py": {
        "bars-of-loads-by-those-of-ordinates": (
            "        of_ordinate = of_load = self",
            "        of_ordinate = of_load = s.error_estimate = self",
            "diagram/test_sweep.py"),
        "steps-of-round-off-in-a-sweep": ("least = 1e-12", "least = 0.0", "diagram/test_flutter_at_a_row.py"),
        "a-family-of-states-is-not-said": (
            "        if self._zeros:", "        if False:", "diagram/test_family_of_states.py"),
        "ordinate-of-a-load-that-is-exact": (
            "of_ordinate += abs(ordinate(moved) - ordinate(x))", "pass",
            "literature/test_follower.py"),
        "taut-rods-have-frequencies": (" or self._dependent(state)", "", "stability/test_frequencies.py"),
    },
    "rodfem/diagram/tracer.py": {
        "start-anew": (
            "anew = [trouble.point, *history] if len(history) == 1 else [trouble.point]", "anew = [trouble.point]",
            "diagram/test_load_at_an_end.py"),
        "ranges-are-left-and-entered-again": ("        if out is None:", "        if True:", HARD),
        "no-index-before-zero-stretch": (
            "if near.negative != a.negative:", "if False:", "adaptivity/test_zero_stretch.py"),
        "no-convexity-before-zero-stretch": (
            "self._require_convexity(branch, near)", "pass",
            "continuation/test_convexity.py"),
        "rows-beyond-a-meeting-are-kept": (
            "                branch.cut(special.point.arclength)\n",
            "                branch.points = [p for p in branch.points if p.arclength <= special.point.arclength]\n",
            "hard/test_fuzz.py"),
    },
    "rodfem/fem/checks.py": {
        "straight-rods-have-no-stiffness": (
            "np.array([first, moved - first])", "np.array([first, first])", "fem/test_quadrature_check.py"),
        "kinks-to-one-side-are-none": (
            "(bent | (larger < 2 * change)).any()", "(larger < 2 * change).any()", "diagram/test_kinks.py"),
        "convexity-of-the-undeformed-state-alone": (
            "self.alters = of_state or", "self.alters =", "continuation/test_convexity.py"),
    },
    "rodfem/fem/equations.py": {
        "constants-of-the-first-scene-stay": (
            "if line is self.register.line:", "if self.register.line is not None:", OTHER_CONSTANTS),
        "potential-of-constraints-at-nodes": (
            '{"potential": potential}', '{"potential": L}',
            "continuation/test_work.py"),
    },
    "rodfem/fem/fields.py": {
        "unknowns-of-other-constants-stay": (
            "(out.formulation, out.unknown_scalars) == (self.formulation, self.unknown_scalars)", "True",
            OTHER_CONSTANTS),
        "mumps-in-any-units": ("Mumps(kind, sizes)", "Mumps(kind)", "problem/test_units.py"),
        "more-modes-than-there-are": (
            "if number > (most := most_eigenvalues(scene, discretization)):",
            "if number > 10**9 * (most := most_eigenvalues(scene, discretization)):", "stability/test_assessment.py"),
    },
    "rodfem/fem/fingerprint.py": {
        "rods-of-another-inertia-are-one": (
            "(mass * change).dot(change).real / (2", "0.0 / (2", "diagram/test_another_rod.py"),
    },
    "rodfem/fem/form_compiler.py": {
        "constants-of-what-is-not-derived": (
            "derived = differentiated(form)", "derived = form", "fem/test_compat.py"),
    },
    "rodfem/fem/invariance.py": {
        "what-closes-a-ring-has-no-part": ("    table -= across @ (across.T @ table)\n", "", HARD),
        "stiff-strains-hide-bending": ("INVARIANT = 1e-12", "INVARIANT = 1e-9", "fem/test_symmetries.py"),
    },
    "rodfem/fem/known.py": {
        "rows-of-a-table-in-an-element-do-not-count": (
            "*table.knots[(table.knots > a) & (table.knots < b)], b])", "b])", "problem/test_tables.py"),
    },
    "rodfem/fem/newton.c": {
        "corrections-in-the-metric-alone": (
            "if (!(newton->size > in_metric)) newton->size", "newton->size", "continuation/test_compiled_newton.py"),
        "round-off-of-forces": (
            "double moved = step[i] / rod->sizes[i], value = x[i] / rod->sizes[i];",
            "double moved = step[i], value = x[i];", "diagram/test_first_state.py"),
    },
    "rodfem/fem/newton.py": {
        "ways-down-that-go-uphill": (
            "if isfinite(longest) and quadratic_form(system, x, step) < 0:", "if False:", "fem/test_way_down.py"),
        "rows-are-no-equilibria": (
            "if worst <= VIOLATED:", "if worst <= 1e9 * VIOLATED:", "continuation/test_row_checks.py"),
        "corrections-that-grow-are-round-off": (" and self.hold()", "", "literature/test_walls.py"),
        "constraints-count-as-uphill": ("- first] = -1.0", "- first] = 1.0", "fem/test_way_down.py"),
    },
    "rodfem/fem/symmetries.py": {
        "sections-that-turn-without-their-shear": (
            "_of_strains(list(fields.scene.free_strains))", "[]", "fem/test_symmetries.py"),
        "free-rod-drifts-without-a-moment": (
            "uniform(-0.3, 0.3, (len", "uniform(-0.0, 0.0, (len", "literature/test_free_rods.py"),
    },
    "rodfem/linalg/chain.c": {
        "scales-start-from-one": (
            "memcpy(s, c->natural, c->n * sizeof(double));", "for (int i = 0; i < c->n; i++) s[i] = 1.0;",
            "problem/test_units.py"),
        "pivots-of-two-rows": ("det < 0 ? 1 : 2 * (e < 0)", "det < 0 ? 1 : 0", "linalg/test_chain.py"),
    },
    "rodfem/modes/finder.py": {
        "bars-of-modes-by-the-nearest": (
            'others[np.argsort(abs(values), kind="stable")] = found.values[_moving(found, number)]',
            "others[:] = [found.values[np.argmin(abs(found.values - v))] for v in values]", "modes/test_modes.py"),
        "modes-have-bars-at-kinks": (
            "        if self.error_bars and not note:", "        if self.error_bars:",
            "diagram/test_kinks.py"),
        "double-eigenvalue-of-flutter-twice": (
            "for i in _upper(values) if i not in left_out]", "for i in _upper(values)]", RECORDED),
    },
    "rodfem/output/files.py": {
        "moments-without-a-natural-size": (
            '"length", "force", "moment", "energy")', '"length", "force", "energy")',
            "output/test_files.py output/test_formats.py"),
    },
    "rodfem/output/pieces.py": {
        "segments-beside-undecided-rows": (
            "if self.kind == UNDECIDED and self.soft else", "if False else", "output/test_summary.py"),
    },
    "rodfem/output/plot_diagram.py": {
        "pictures-draw-chords": ("SEEN = 2e-4", "SEEN = 1e3", "output/test_plot_diagram.py"),
    },
    "rodfem/output/plot_locus.py": {
        "stable-side-beyond-a-crossing": ("if crossed or not side", "if not side", LOCI),
    },
    "rodfem/output/states.py": {
        "files-of-two-runs": (
            'if run != data.get("run"):', "if False:",
            "output/test_files.py output/test_formats.py "
            "hard/test_files_after_a_kill.py output/test_foreign_files.py"),
    },
    "rodfem/output/summary.py": {
        "stable-in-space-by-frequencies": (
            'if data.get("planar") and interval.in_space is None',
            'if data.get("planar") and interval.in_space is None and not is_sweep(data)', "output/test_summary.py"),
    },
    "rodfem/output/table.py": {
        "not-finite-numbers-in-a-file": (
            "return np.asarray(value).item() if np.isfinite(value) else None", "return np.asarray(value).item()",
            "output/test_files.py output/test_formats.py output/test_foreign_files.py"),
    },
    "rodfem/output/words.py": {
        "reasons-of-kinks-are-lost": ('if row.get("kink"):', "if False:", "diagram/test_kinks.py"),
        "bars-are-rounded": ("ceil(error / 10.0**power * (1 - NEGLIGIBLE))", "round(error / 10.0**power)", ERRORS),
    },
    "rodfem/problem/arguments.py": {
        "threads-work-at-once": ("with ONE_THREAD:", "with RLock():", "app/test_threads.py"),
    },
    "rodfem/problem/scene.py": {
        "a-mass-brings-a-unit-rotary-inertia": (
            '"rho_I", _no_rotary)', '"rho_I", _unit_rotary)', "problem/test_one_place.py"),
    },
    "rodfem/problem/trials.py": {
        "constants-are-compared": (
            "abs(symbolic - number) <= least:", "abs(symbolic - number) <= 1e9:", "problem/test_mistakes.py"),
    },
    "rodfem/report/branches.py": {
        "loci-of-small-loads-start-everywhere": (
            '(natural["load"], natural["ordinate"])', "(1.0, 1.0)", "codim2/test_locus.py"),
        "bars-of-loci-stay-off-the-page": (
            "found.append([] if None in pair else", "found.append([] if True else", IN_WORDS),
    },
    "rodfem/stability/assessment.py": {
        "fewer-eigenvalues-than-asked-for": (
            "len(found.values) < number and name != COUNT", "False", "stability/test_assessment.py"),
    },
    "rodfem/stability/cluster.py": {
        "a-cluster-is-sought-from-one-shift": ("FARTHER = 3.0", "FARTHER = 1.0", "codim2/test_places.py"),
        "eigensolvers-leave-nothing-open": ("DRAWN = 3.0", "DRAWN = 0.0", "stability/test_cluster_noise.py"),
    },
    "rodfem/stability/dependence.py": {
        "units-make-constraints-depend": (
            "C = sp.diags(units) @ pencil.C", "C = pencil.C", "stability/test_assessment.py"),
    },
    "rodfem/stability/in_space.py": {
        "index-in-space-of-the-plane": (
            "return self.inertia.at(settled if converged else state)", "return Inertia(self.planar).at(x)",
            "literature/test_rods.py literature/test_ruler.py literature/test_classics.py"),
        "falls-out-of-the-plane-slowly": ("int(falling.sum())", "0", "literature/test_postbuckling.py"),
    },
    "rodfem/stability/inertia.py": {
        "quotients-of-the-wrong-sign": (
            "(self.values < -self.uncertainty).sum()", "(self.values > self.uncertainty).sum()",
            "stability/test_round_off.py"),
        "matrix-of-another-state": (
            "held is state and phase is self.system.phase and", "held is not None and", INERTIA),
        "eigenvalues-beside-the-edge-of-the-band": ("\nFAR = 0.1\n", "\nFAR = 1e9\n", "stability/test_round_off.py"),
    },
    "rodfem/stability/motion_names.py": {
        "round-off-is-a-rotation": ("LEAST = 1e-5", "LEAST = 0.0", "stability/test_frequencies.py"),
    },
    "rodfem/stability/near_zero.py": {
        "decided-zeros-without-symmetries": (
            "zero=q.zero + found.drifts", "zero=q.zero", "stability/test_round_off.py"),
    },
    "rodfem/stability/nonsymmetric.py": {
        "matrices-pile-up": ("if self.filled % 64 == 0:", "if False:", "diagram/test_sweep.py"),
        "slow-frequencies-are-round-off": (
            "slow = np.flatnonzero(abs(values) < SLOW * one)", "slow = np.flatnonzero(abs(values) < 0.0)", HARD),
        "rods-that-soften-are-not-slow": (
            "not (self.solver.slow or several)", "not self.solver.slow", "diagram/test_light_and_slow_rods.py"),
        "modes-without-their-parts-along-free-motions": (
            "            force.array[drifts] = 0.0\n", "", "literature/test_free_rods.py"),
    },
    "rodfem/stability/pencil.py": {
        "symmetric-pencils-without-natural-units": (
            "    if units.ordinary:\n        return matrix, mass\n", "    if True:\n        return matrix, mass\n",
            "stability/test_eigenvalues_in_si_units.py"),
        "masses-at-nine-loads": ("raise ConvergenceError(trouble)", "pass", "diagram/test_family_of_states.py"),
        "a-one-of-other-units-beside-the-stiffness": (
            "return 1.0 if units.ordinary else units.energy / float(system.sizes.getValue(index).real) ** 2",
            "return 1.0", "problem/test_units.py"),
    },
    "rodfem/stability/reduced_stiffness.py": {
        "phase-conditions-do-not-move": (
            "                out += term + term.T", "                pass", "continuation/test_reduced_stiffness.py"),
    },
    "rodfem/stability/soft_mode.py": {
        "kinks-are-stable": ("if doubt:", "if doubt and not negative:", "diagram/test_kinks.py"),
    },
    "rodfem/stability/spectrum.py": {
        "frequencies-are-the-nearest-ones": (
            "return len(self.negative) + 2 * len(self.growing)",
            "return len(self.negative) + 2 * int((self.growing < 14).sum())", "diagram/test_all_frequencies.py"),
        "round-off-of-two-that-meet-has-no-bound": (
            "np.minimum(rounded * np.linalg.norm(left, axis=1), np.sqrt(rounded * np.linalg.norm(matrix)))",
            "rounded * np.linalg.norm(left, axis=1)", "codim2/test_locus.py"),
    },
    "rodfem/tolerances.py": {
        "close-special-points-are-on-one-locus": (
            "<= LOCATED * (located_to + round_off(load, of_load))", "<= SAME_SPECIAL * unit(load, one=of_load)",
            IN_WORDS),
    },
    "rodfem/whole_files.py": {
        "no-new-folders": (
            "        path.parent.mkdir(parents=True, exist_ok=True)\n        draft.unlink", "        draft.unlink",
            "codim2/test_locus.py"),
        "no-drafts": (
            'draft = path.with_name(f".{path.stem}.rodfem-part{path.suffix}")', "draft = path",
            "hard/test_files_after_a_kill.py output/test_files.py output/test_formats.py"),
        "drafts-go-through-links": (
            "draft.unlink(missing_ok=True)  # it may be a link to another file", "pass",
            "output/test_foreign_files.py"),
    },
    "rodfem/writhe.py": {
        "writhe-of-one-polygon": ("(4 * fine - coarse) / 3", "fine", "report/test_contents.py"),
    },
}
# fmt: on
"""By file: names of faults, each with its ``old`` and ``new`` text, and its tests, below this folder."""

FAULTS = {
    name: Fault(file, old, new, " ".join(f"tests/{test}" for test in tests.split()))
    for file, faults in TABLE.items()
    for name, (old, new, tests) in faults.items()
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
