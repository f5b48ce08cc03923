"""What the page and its log say in words; numbers come from elsewhere."""

PAGE = """
How long is the wait, and how many digits come out of it? Written by `make bench` on {machine}, one thread, on {day}
(load of the machine between {low:.1f} and {high:.1f}). Times are medians of {runs} runs with warm caches, in
processor time. Errors are relative to closed forms and to shooting, which neither rodfem nor AUTO-07p has computed.
Everything that was measured, with the references and the versions of all libraries, is in the [log]({log}).
"""
FIGURE = """
Each panel is one branch, followed from end to end with its index at every row and its special points located. Lines
join meshes of one degree, from coarse to fine; crosses are AUTO-07p, which has no index; a star is the
discretisation of Kumar & Healey (2010), 150 linear elements with the midpoint rule. Degree 6 or 8 on a few elements
is the choice for every error below 1e-4: that is rodfem's default, and why `--elements` is rarely needed.
"""
CHOICE = """
For three errors the fastest mesh of either program and the time of the whole branch with its special points (AUTO
counts no index). `ratio` is rodfem's time over AUTO's: below one rodfem is faster. `paper` is how many times longer
a row takes with the paper's mesh, which reaches errors of 1e-2 to 1e-5 only, than with the fastest mesh that is as
accurate.
"""
STAGES = """
Processor time in milliseconds of the demos' diagrams on the default mesh, forms compiled: *set-up* (spaces, forms,
first equilibrium), *following* all branches with their index, *special points* (locating them, switching branches),
*error bars* (everything about the second mesh), and all of it. A *second rod* is the same scene with other
constants: equations and spaces are kept, error bars left away.
"""
ELSE = """
The [log]({log}) has: each mesh with its error and time; AUTO's and scipy's (`solve_bvp`) at each error; how time
and memory grow with the number of elements, up to 100,000; eigenvalues of straight rods against closed forms; many
rods on several ranks; whole processes with imports, files and terminal.
"""
INTRODUCTION = """
Errors are relative to references that neither rodfem nor what it is compared with has computed. Times are medians of
{runs} with warm caches, after one that is not counted, in processor time (user and system) except where wall time is
said. `10 P6 reduced` is ten elements of degree 6 in the reduced formulation.
"""
REFERENCES = """
All but the hemitropic rod's bent states (multiple shooting, `tests/reference_values.py`) were computed anew in this
run, and differ from the table by at most {deviation:.0e}: smaller errors are meaningless.
"""
EQUILIBRIA = """
Time per accepted point of following a branch, index included, special points not, against the largest error of the
branch's targets (the ordinate at a load, and the fold of a branch 2; of scipy the ordinate alone). Lines join meshes
of one degree, from coarse to fine. A star is the discretisation of Kumar & Healey (2010).
"""
SPECIAL = """
Time of a whole branch, index included and special points located, against the largest error of the branch's targets.
"""
PAPER = """
150 linear elements with the midpoint rule, and the fastest discretisation that is at least as accurate on all targets
of the branch (and whose finer ones of the same degree are, too). The ratio is how many times faster that is.
"""
GOALS = """
Time per accepted point over AUTO's, full rod against full rod, on one core: of following alone (rodfem with its index,
AUTO has none), and with special points and all else included; and over AUTO's half rod, of which it makes use of the
symmetry, against the full rod here. `compiled alone` is the same ratio for what compiled code takes of it (kernels of
the forms, factors, solutions, counts): where that exceeds the goal, nothing that Python saves would meet it. The reason
is where rodfem's time goes.
"""
AUTO = """
For each error the fastest discretisation of either: AUTO's NTST x NCOL found by a sweep (`benchmarks/auto`), rodfem's
from the last table of this page. The error is the largest of the branch's targets. `ms/point` and `ms/branch` include
special points and the loads asked for, `following` does not; rodfem's always include the index of every point. Each
program takes the steps that its own control chooses. Ratios are rodfem's over AUTO's. The follower load's peer is
`flutter.f90`, whose equations were linearised by hand; rodfem computes six frequencies or more at each of its points.
"""
SCIPY = """
`scipy.integrate.solve_bvp` on the same equations as AUTO, from load to load through those of rodfem's points; the time
is the median over them. The ratio is scipy's time over that of rodfem at an error that is no greater.
"""
EIGENVALUES = """
Left-most eigenvalues of straight rods with closed forms or by Ritz's method (`benchmarks/references.py`). A judgement
is assembly, index, eigenvalues and the certificate that none is missing (under the follower load: assembly and
eigenvalues). AUTO and solve_bvp have nothing of the kind.
"""
GROWTH = """
The cord at lam = 40 with elements of degree 2. Medians of three; memory is what the rod adds to the process.
An equilibrium is computed at a load a thousandth off; exponents are fitted from {far} unknowns on.
"""
MANY = """
`demos/map.py` with fewer rods, wall time. Taken up again, when all is finished, it only starts, reads and draws.
"""
SWEEPS = """
Of a sweep of frequencies, time per load, six or more of them at each.
"""
PROCESSES = """
Processor time (user and system) of whole processes, `python demos/... --no-figures`, warm, error bars and files
included; medians.
"""
MINUTE = "`python demos/hemitropic.py --no-figures`, wall time. Cold is with an empty cache of compiled forms."
