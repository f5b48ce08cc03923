"""What the page says in words; numbers come from elsewhere."""

INTRODUCTION = """
Errors are relative to references that neither rodfem nor what it is compared with has computed. Times are medians of
{runs} with warm caches, after one that is not counted, in processor time (user and system) except where wall time is
said. `10 P6 reduced` is ten elements of degree 6 in the reduced formulation.
"""
REFERENCES = """
All but the hemitropic rod's bent states (multiple shooting, `tests/reference_values.py`) were computed anew in this
run, and differ from the table by at most {deviation:.0e}: errors below that mean nothing.
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
