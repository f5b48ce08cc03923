/* Equations and matrices of a state with their borders, and one iteration of Newton's method on the plane across a row.
   rodfem/fem/newton.py has the loop around it: when it has converged, and when factors serve once more.

   The second variation S is assembled with its border: drifts with their phase conditions, and the column F_lam of the
   load.  The Jacobian has the row of the arclength equation, too; for symmetric factors the column is taken out.  */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define PUBLIC static /* called from Python */

typedef int assemble_form(const void *, const void *, const double *, const double *, double *);
typedef int multiply_form(const void *, const int *, const double *, const double *, int, int, const double *, double *);
typedef int factor_matrix(void *, const double *);
typedef int solve_columns(const void *, int, const double *, double *);

typedef struct {
    uintptr_t assemble, multiply, factor, solve; /* functions of the modules that assemble and factor */
    const void *residual, *equation_places, *jacobian, *entry_places;
    const double *residual_constants, *jacobian_constants;
    void *factors;
    int n, locals, entries;     /* unknowns; local degrees of freedom; values of S */
    const int *number;          /* unknown of each local degree of freedom; -1: clamped */
    double *u;                  /* local values, those of clamps given */
    double *values;             /* of S, compressed sparse rows */
    int load, load_diagonal;    /* its number, and place of its diagonal entry */
    const int *load_column;     /* n: places of the entries of its column; -1: its diagonal */
    const int *load_row;        /* n: places of those of its row */
    int drifts;
    const int *drift;           /* numbers of the drifts */
    const int *active;          /* whether each has a phase condition */
    const double *conditions;   /* drifts x n: phase conditions, M g */
    const double *forces;       /* drifts x n: what a drift of one adds to the equations */
    const double *offsets;      /* g . M x0 */
    const int *drift_row, *drift_column; /* drifts x n: places in S */
    const int *starts, *indices;
    const double *metric;       /* compressed sparse rows */
    const double *sizes;        /* natural sizes of the unknowns */
    double *border;             /* F_lam */
} Rod;

typedef struct {
    int factored;               /* whether the matrix holds the Jacobian of the last iterate */
    double *origin;             /* the state that the iteration began with */
    double *equations, *step, *away; /* residual, correction, and distance from the origin */
    double distance, size;      /* of that in the metric; of the correction in it, or relative if that is more */
} Newton;

enum { MOVED, UNDEFINED, SINGULAR, BROKEN };

static double dot(int n, const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

static double size_of(const Rod *rod, const double *x) /* in the metric */
{
    double sum = 0;
    for (int i = 0; i < rod->n; i++)
        for (int k = rod->starts[i]; k < rod->starts[i + 1]; k++) sum += x[i] * rod->metric[k] * x[rod->indices[k]];
    return sqrt(sum > 0 ? sum : 0);
}

static void gather(const Rod *rod, const double *x)
{
    for (int i = 0; i < rod->locals; i++) if (rod->number[i] >= 0) rod->u[i] = x[rod->number[i]];
}

/* Equations and phase conditions at x; the row of the load is zero.  */
static int residual_at(const Rod *rod, const double *x, double *out)
{
    memset(out, 0, rod->n * sizeof(double));
    gather(rod, x);
    if (((assemble_form *)rod->assemble)(rod->residual, rod->equation_places, rod->u, rod->residual_constants, out)) return 1;
    out[rod->load] = 0;
    for (int d = 0; d < rod->drifts; d++) {
        const double *condition = rod->conditions + (size_t)d * rod->n, *force = rod->forces + (size_t)d * rod->n;
        double value = x[rod->drift[d]], row = value;
        if (rod->active[d]) {
            for (int i = 0; i < rod->n; i++) out[i] += value * force[i];
            row = dot(rod->n, condition, x) - rod->offsets[d];
        }
        out[rod->drift[d]] = row;
    }
    return 0;
}

/* S at x into the values of the matrix with its border; the column of the load stays where it is.  */
static int assemble_bordered(const Rod *rod, const double *x)
{
    memset(rod->values, 0, rod->entries * sizeof(double));
    gather(rod, x);
    if (((assemble_form *)rod->assemble)(rod->jacobian, rod->entry_places, rod->u, rod->jacobian_constants, rod->values)) return 1;
    for (int d = 0; d < rod->drifts; d++) {
        const int *row = rod->drift_row + (size_t)d * rod->n, *column = rod->drift_column + (size_t)d * rod->n;
        const double *condition = rod->conditions + (size_t)d * rod->n, *force = rod->forces + (size_t)d * rod->n;
        if (!rod->active[d]) { rod->values[row[rod->drift[d]]] += 1; continue; }
        for (int i = 0; i < rod->n; i++) {
            if (condition[i] != 0) rod->values[row[i]] += condition[i];
            if (force[i] != 0) rod->values[column[i]] += force[i];
        }
    }
    return 0;
}

/* The Jacobian at x: S with its border, and the row of the arclength equation.  */
static int jacobian_at(const Rod *rod, const double *x, const double *row)
{
    if (assemble_bordered(rod, x)) return 1;
    for (int i = 0; i < rod->n; i++) rod->values[rod->load_row[i]] += row[i];
    return 0;
}

/* S at x into the values of the matrix, a one for the load, and F_lam.  */
PUBLIC int assemble_at(const Rod *rod, const double *x)
{
    if (assemble_bordered(rod, x)) return 1;
    for (int i = 0; i < rod->n; i++) {
        rod->border[i] = 0;
        if (rod->load_column[i] < 0) continue;
        rod->border[i] = rod->values[rod->load_column[i]];
        rod->values[rod->load_column[i]] = 0;
    }
    rod->values[rod->load_diagonal] = 1;
    return 0;
}

/* Products of (S F_lam) at x, or of its transpose, with the `count` columns of a change; the row of the load is zero.  */
PUBLIC int multiply_at(const Rod *rod, const double *x, int transposed, int count, const double *change, double *out)
{
    memset(out, 0, (size_t)rod->n * count * sizeof(double));
    gather(rod, x);
    if (((multiply_form *)rod->multiply)(rod->jacobian, rod->number, rod->u, rod->jacobian_constants, transposed, count,
                                         change, out)) return 1;
    for (int d = 0; d < rod->drifts; d++) {
        const double *condition = rod->conditions + (size_t)d * rod->n, *force = rod->forces + (size_t)d * rod->n;
        const double *row = transposed ? force : condition, *column = transposed ? condition : force;
        size_t at = (size_t)rod->drift[d] * count;
        for (int q = 0; q < count; q++) {
            if (!rod->active[d]) { out[at + q] += change[at + q]; continue; }
            for (int i = 0; i < rod->n; i++) {
                out[at + q] += row[i] * change[(size_t)i * count + q];
                out[(size_t)i * count + q] += column[i] * change[at + q];
            }
        }
    }
    memset(out + (size_t)rod->load * count, 0, count * sizeof(double));
    return 0;
}

/* One iteration at x, in place, with factors of the Jacobian there (fresh) or with the last ones.  MOVED; UNDEFINED where
   the stored energy has no value; SINGULAR where the Jacobian is, exactly; BROKEN where there are no factors at all.  */
PUBLIC int iterate(const Rod *rod, Newton *newton, double *x, const double *row, int fresh)
{
    int n = rod->n;
    double *r = newton->equations, *step = newton->step, length = 0, state = 0;
    newton->factored = 0;
    if (residual_at(rod, x, r)) return BROKEN;
    if (!isfinite(dot(n, r, r))) return UNDEFINED;
    if (fresh) {
        newton->factored = 1;
        if (jacobian_at(rod, x, row)) return BROKEN;
        int failed = ((factor_matrix *)rod->factor)(rod->factors, rod->values);
        if (failed) return failed > 1 ? BROKEN : SINGULAR;
    }
    if (((solve_columns *)rod->solve)(rod->factors, 1, r, step)) return BROKEN;
    for (int i = 0; i < n; i++) {
        x[i] -= step[i];
        newton->away[i] = x[i] - newton->origin[i];
        double moved = step[i] / rod->sizes[i], value = x[i] / rod->sizes[i];
        length += moved * moved;
        state += value * value;
    }
    newton->distance = size_of(rod, newton->away);
    newton->size = sqrt(length) / (1 + sqrt(state));
    double in_metric = size_of(rod, step);
    if (!(newton->size > in_metric)) newton->size = in_metric; /* or no number */
    return MOVED;
}
