/* Newton's method on the plane across a row, in one call: rodfem/fem/newton.py and rodfem/continuation/corrector.py have
   the same iteration in Python, step by step, for several ranks and for PETSc's factors.

   The second variation S is assembled with its border: drifts with their phase conditions, and the column F_lam of the
   load.  For symmetric factors that column is taken out; the Jacobian, for LU factors, has it, and the row.  Blocks of
   columns are stored one column after the other.  */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define PUBLIC static /* called from Python */

#define MOST 8 /* vectors of a block */

typedef int assemble_form(const void *, const void *, const double *, const double *, double *);
typedef int factor_matrix(void *, const double *);
typedef int solve_columns(const void *, int, const double *, double *);
typedef int count_pivots(const void *);

typedef struct {
    uintptr_t assemble, factor, solve, negative, zero;    /* functions of the modules that assemble and factor */
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
    double *load_equation;      /* equation of the load at the last residual: the Lagrangian's derivative in it */
} Rod;

typedef struct {
    int block, started;         /* number of vectors, at most MOST; whether they are those of a state nearby */
    double *vectors, *images;   /* n x block: v and M v */
    const double *fresh, *fresh_images;
    double share, near_zero;    /* weight of a fresh vector; distance from zero below which S is too near singular */
    double *right, *solved;     /* room: n x (block + 2) */
    double nearest;             /* estimated distance of the nearest eigenvalue from zero */
    double *tangent, *step;     /* unit tangent, and S^-1 r */
} Block;

typedef struct {
    int most;
    int held;                   /* whether there are LU factors of a state nearby, which serve first */
    double reach, tolerance;    /* bound of a correction; error that is small enough */
    double converged, still, kept, shrunk; /* constants of rodfem/fem/newton.py */
    int iterations, singular;   /* singular: the Jacobian was, exactly */
    int factorisations;         /* made so far: none where the equations are no numbers at x */
    int status;                 /* 0: converged, 1: not, 2: S too near singular, 3: factors failed */
    double error, moved;
    double *step, *origin, *equations; /* correction; x at first; residual */
    double *factored, *factored_equations; /* state last factored, and its residual */
} Newton;

static double dot(int n, const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

static void weigh(const Rod *rod, const double *x, double *out)
{
    for (int i = 0; i < rod->n; i++) {
        double sum = 0;
        for (int k = rod->starts[i]; k < rod->starts[i + 1]; k++) sum += rod->metric[k] * x[rod->indices[k]];
        out[i] = sum;
    }
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
PUBLIC int residual_at(const Rod *rod, const double *x, double *out)
{
    memset(out, 0, rod->n * sizeof(double));
    gather(rod, x);
    if (((assemble_form *)rod->assemble)(rod->residual, rod->equation_places, rod->u, rod->residual_constants, out)) return 1;
    *rod->load_equation = out[rod->load];
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

/* Factors of the matrix, solutions for r (NULL: none) and F_lam, and a step of inverse iteration of the block, three from
   generic vectors.  0; 2 where S is too near singular; 3 where the factors failed.  */
static int solve_at(const Rod *rod, Block *b, const double *r)
{
    int n = rod->n, columns = b->block + 2;
    if (((factor_matrix *)rod->factor)(rod->factors, rod->values) > 1) return 3;
    if (((count_pivots *)rod->zero)(rod->factors)) return 2;
    for (int turn = b->started ? 1 : 3; turn > 0; turn--) {
        double growth = 0;
        if (r) memcpy(b->right, r, n * sizeof(double)); else memset(b->right, 0, n * sizeof(double));
        memcpy(b->right + n, rod->border, n * sizeof(double));
        double *block = b->right + 2 * (size_t)n, *solved = b->solved + 2 * (size_t)n, sizes[MOST];
        for (int j = 0; j < b->block; j++) {
            double *v = b->vectors + (size_t)j * n, *image = b->images + (size_t)j * n;
            for (int i = 0; i < n; i++) {
                v[i] += b->share * b->fresh[(size_t)j * n + i];
                image[i] += b->share * b->fresh_images[(size_t)j * n + i];
            }
            sizes[j] = sqrt(dot(n, v, image));
            memcpy(block + (size_t)j * n, image, n * sizeof(double));
        }
        if (((solve_columns *)rod->solve)(rod->factors, columns, b->right, b->solved)) return 3;
        for (int j = 0; j < b->block; j++) {
            double *v = b->vectors + (size_t)j * n, *image = b->images + (size_t)j * n;
            memcpy(v, solved + (size_t)j * n, n * sizeof(double));
            weigh(rod, v, image);
            /* |S^-1 M v| / |v| is at most one over the distance of the nearest eigenvalue from zero */
            double grown = sqrt(fmax(dot(n, v, image), 1e-300));
            growth = isfinite(grown) ? fmax(growth, grown / sizes[j]) : INFINITY;
            for (int i = 0; i < n; i++) { v[i] /= grown; image[i] /= grown; }
            for (int other = 0; other < j; other++) { /* else all vectors of the block become the same one */
                const double *w = b->vectors + (size_t)other * n, *w_image = b->images + (size_t)other * n;
                double along = dot(n, image, w);
                for (int i = 0; i < n; i++) { v[i] -= along * w[i]; image[i] -= along * w_image[i]; }
            }
        }
        b->nearest = 1 / growth;
    }
    memcpy(b->step, b->solved, n * sizeof(double));
    for (int i = 0; i < n; i++) b->tangent[i] = -b->solved[n + i]; /* z = (-S^-1 F_lam, 1) */
    b->tangent[rod->load] = 1;
    double length = size_of(rod, b->tangent);
    for (int i = 0; i < n; i++) b->tangent[i] /= length;
    b->started = b->nearest > b->near_zero;
    if (b->started) return 0;
    memcpy(b->vectors, b->fresh, (size_t)n * b->block * sizeof(double));
    memcpy(b->images, b->fresh_images, (size_t)n * b->block * sizeof(double));
    return 2;
}

/* The same at x. */
PUBLIC int factor_at(const Rod *rod, Block *b, const double *x)
{
    return assemble_at(rod, x) ? 3 : solve_at(rod, b, NULL);
}

/* Solve the equations on the plane through x across row, in place; see rodfem.fem.newton.iterate.  With a block the
   factors are those of S, without (NULL) LU factors of the Jacobian; newton->step is the correction.  */
PUBLIC int correct(const Rod *rod, Block *b, Newton *newton, double *x, const double *row)
{
    int n = rod->n, fresh = b || !newton->held;
    double previous = INFINITY, size = INFINITY;
    newton->status = 1;
    newton->singular = newton->factorisations = 0;
    newton->moved = INFINITY;
    memcpy(newton->origin, x, n * sizeof(double));
    for (newton->iterations = 1; newton->iterations <= newton->most; newton->iterations++) {
        double *r = newton->equations;
        if (residual_at(rod, x, r)) return newton->status = 3;
        if (!isfinite(dot(n, r, r))) break; /* outside of where the stored energy is defined */
        newton->factorisations += fresh;
        if (!b) {
            if (fresh && jacobian_at(rod, x, row)) return newton->status = 3;
            int failed = fresh ? ((factor_matrix *)rod->factor)(rod->factors, rod->values) : 0;
            if (failed > 1) return newton->status = 3;
            newton->singular = failed;
            if (failed) break;
            if (((solve_columns *)rod->solve)(rod->factors, 1, r, newton->step)) return newton->status = 3;
        } else if (fresh) {
            if (assemble_at(rod, x)) return newton->status = 3;
            memcpy(newton->factored, x, n * sizeof(double));
            memcpy(newton->factored_equations, r, n * sizeof(double));
            int failed = solve_at(rod, b, r);
            if (failed) return newton->status = failed;
        } else if (((solve_columns *)rod->solve)(rod->factors, 1, r, b->step)) return newton->status = 3;
        double *step = b ? b->step : newton->step, length = 0, state = 0;
        /* J^-1 (r, 0) = y - z (row . y) / (row . z): the step stays on the plane across row */
        double share = b ? dot(n, row, step) / dot(n, row, b->tangent) : 0;
        for (int i = 0; i < n; i++) {
            if (b) step[i] -= share * b->tangent[i];
            x[i] -= step[i];
            double moved = step[i] / rod->sizes[i], value = x[i] / rod->sizes[i];
            length += moved * moved;
            state += value * value;
        }
        double distance = size_of(rod, step);
        size = fmax(distance, sqrt(length) / (1 + sqrt(state)));
        if (!fresh && isinf(previous) && !(size < newton->kept)) { /* no state nearby: begin with new factors */
            memcpy(x, newton->origin, n * sizeof(double));
            fresh = 1;
            continue;
        }
        if (!isfinite(distance) || !isfinite(length) || distance > newton->reach) break;
        /* chord steps converge linearly: their rate, doubled for safety, says what the next correction would be */
        double left = fresh || isinf(previous) ? size : fmin(2 * size / previous, 1) * size;
        if (size < newton->converged || left < newton->tolerance || (fresh && newton->still > size && size > 0.5 * previous)) {
            newton->error = left;
            for (int i = 0; i < n; i++) newton->origin[i] -= x[i];
            newton->moved = size_of(rod, newton->origin);
            return newton->status = 0;
        }
        /* far from a solution, or where the old factors gain less than a digit, new ones are worth their cost */
        fresh = size > newton->kept || size > newton->shrunk * previous;
        previous = size;
    }
    if (newton->iterations > newton->most) newton->iterations = newton->most;
    newton->error = size;
    return newton->status;
}
