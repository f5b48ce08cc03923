/* One step of pseudo-arclength continuation in one call: rodfem/continuation/branch_solver.py has the same in Python, step
   by step, for several ranks, PETSc's factors, and wherever this one gives up.

   Prediction across the orbit of the last state, phase conditions at the prediction, Newton's method (newton.c), phase
   conditions, factors, tangent and index at the state found, and what is checked there: the equations, the norms of the
   quaternions, and that the symmetries are null vectors of S.  */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define PUBLIC static /* called from Python */

#define MOST 16 /* symmetries */

typedef int correct_state(const void *, void *, void *, double *, const double *);
typedef int factor_at(const void *, void *, const double *);
typedef int equations_at(const void *, const double *, double *);
typedef int assemble_form(const void *, const void *, const double *, const double *, double *);

typedef struct {
    int rows;
    const int *starts, *indices;
    const double *values;
} Sparse;

typedef struct {
    uintptr_t correct, factor, equations, assemble; /* functions of newton.c, and of assembly.c */
    const void *rod;
    void *block, *newton;       /* structures of newton.c */
    const int *iterations;      /* of the Newton iteration, and its error: they are in newton */
    const double *error;
    const double *factored_tangent; /* unit tangent at the state last factored: in block */
    int n, load, drifts;        /* unknowns, the load's number, and that of the first drift: drifts come last */
    Sparse metric, saddle;      /* M, and S with its border */
    const double *sizes;        /* natural size of each unknown; NULL: one */
    const double *u;            /* local values of the state whose equations were evaluated last */
    int quaternions;
    const int *quaternion;      /* quaternions x 4: local degrees of freedom */
    const void *energy, *potential; /* forms of the stored and the potential energy (NULL: none), and their constants */
    const double *energy_constants, *potential_constants;
    /* symmetries: g = A x + c */
    int symmetries;
    Sparse generator;           /* A of all, one below the other: symmetries * drifts rows */
    const double *constants;    /* c */
    const double *generic;      /* weights of the combination that is verified */
    double symmetric;           /* size of a generator below which the state has the symmetry itself */
    int *active;                /* whether the condition of each drift is active: in rod, as the next two */
    double *conditions, *offsets; /* drifts x n: M g; g . M x0 */
    double norm, zero, round_off, residual, tiny; /* bounds of what is left: rodfem/fem/verification.py */
    /* room */
    double *generators, *images; /* symmetries x drifts */
    double *right;              /* n */
    double *combined;           /* n: the combination that is verified */
    /* results */
    double weights[MOST * MOST]; /* of the generators in each condition, a row each; of those that vanish unscaled */
    double *x, *direction, *row, *tangent;
    double predicted, along, length, energy_value, potential_value, unbalanced, stretched;
    int broken, verified;
} Step;

enum { MADE, OUTSIDE, TURNED, NOT_CORRECTED, SINGULAR };

static double dot(int n, const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

static void times(const Sparse *matrix, const double *x, double *out)
{
    for (int i = 0; i < matrix->rows; i++) {
        double sum = 0;
        for (int k = matrix->starts[i]; k < matrix->starts[i + 1]; k++) sum += matrix->values[k] * x[matrix->indices[k]];
        out[i] = sum;
    }
}

static double size_of(const Sparse *metric, const double *x)
{
    double sum = 0;
    for (int i = 0; i < metric->rows; i++)
        for (int k = metric->starts[i]; k < metric->starts[i + 1]; k++) sum += x[i] * metric->values[k] * x[metric->indices[k]];
    return sqrt(sum > 0 ? sum : 0);
}

/* Eigenvalues (on the diagonal of a) and eigenvectors (rows of v) of a symmetric matrix, by Jacobi's rotations. */
static void diagonalise(int m, double *a, double *v)
{
    for (int i = 0; i < m * m; i++) v[i] = i % (m + 1) == 0;
    for (int sweep = 0; sweep < 60; sweep++) {
        double off = 0, all = 0;
        for (int i = 0; i < m; i++) for (int j = 0; j < m; j++) {
            all += a[i * m + j] * a[i * m + j];
            if (i != j) off += a[i * m + j] * a[i * m + j];
        }
        if (off <= 1e-34 * all) return;
        for (int p = 0; p < m; p++) for (int q = p + 1; q < m; q++) {
            if (a[p * m + q] == 0) continue;
            double theta = (a[q * m + q] - a[p * m + p]) / (2 * a[p * m + q]);
            double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1)), c = 1 / sqrt(t * t + 1), s = t * c;
            for (int k = 0; k < m; k++) {
                double x = a[k * m + p], y = a[k * m + q];
                a[k * m + p] = c * x - s * y;
                a[k * m + q] = s * x + c * y;
            }
            for (int k = 0; k < m; k++) {
                double x = a[p * m + k], y = a[q * m + k], f = v[p * m + k], g = v[q * m + k];
                a[p * m + k] = c * x - s * y;
                a[q * m + k] = s * x + c * y;
                v[p * m + k] = c * f - s * g;
                v[q * m + k] = s * f + c * g;
            }
        }
    }
}

/* Phase conditions at x, as rodfem.fem.symmetries.phase_at, with the generators there.  */
static void set_phase(Step *step, const double *x)
{
    int m = step->symmetries, own = step->drifts, n = step->n;
    double gram[MOST * MOST];
    if (!m) return;
    times(&step->generator, x, step->generators);
    for (int i = 0; i < m * own; i++) step->generators[i] += step->constants[i];
    for (int i = 0; i < m; i++) {
        double *padded = step->combined;
        memcpy(padded, step->generators + (size_t)i * own, own * sizeof(double));
        memset(padded + own, 0, (n - own) * sizeof(double));
        times(&step->metric, padded, step->right);
        memcpy(step->images + (size_t)i * own, step->right, own * sizeof(double));
    }
    for (int i = 0; i < m; i++)
        for (int j = 0; j < m; j++)
            gram[i * m + j] = dot(own, step->generators + (size_t)i * own, step->images + (size_t)j * own);
    diagonalise(m, gram, step->weights);
    step->broken = 0;
    for (int i = 0; i < m; i++) {
        double size = sqrt(fmax(gram[i * m + i], 0)), *condition = step->conditions + (size_t)i * n;
        step->active[i] = size >= step->symmetric;
        step->offsets[i] = 0;
        if (!step->active[i]) continue;
        step->broken++;
        memset(condition, 0, n * sizeof(double));
        for (int j = 0; j < m; j++) {
            double weight = step->weights[i * m + j] /= size;
            for (int k = 0; k < own; k++) condition[k] += weight * step->images[(size_t)j * own + k];
        }
        step->offsets[i] = dot(own, condition, x);
    }
}

/* Take from the prediction and its direction what moves the last state along its symmetries.  */
static void across_orbit(Step *step, const double *last)
{
    int m = step->symmetries, own = step->drifts, n = step->n;
    if (!m) return;
    set_phase(step, last);
    for (int i = 0; i < m; i++) {
        if (!step->active[i]) continue;
        const double *condition = step->conditions + (size_t)i * n;
        double off = step->offsets[i] - dot(n, condition, step->x), along = dot(n, condition, step->direction);
        for (int j = 0; j < m; j++) {
            const double *g = step->generators + (size_t)j * own;
            double weight = step->weights[i * m + j];
            for (int k = 0; k < own; k++) {
                step->x[k] += off * weight * g[k];
                step->direction[k] -= along * weight * g[k];
            }
        }
    }
}

/* Root of the sum of the squares of all terms of g.Sg, of the first rows: times eps, its round-off.  */
static double rounding(const Sparse *S, int rows, const double *g)
{
    double sum = 0;
    for (int i = 0; i < rows; i++)
        for (int k = S->starts[i]; k < S->starts[i + 1]; k++) {
            double term = g[i] * S->values[k] * g[S->indices[k]];
            sum += term * term;
        }
    return sqrt(sum);
}

/* Whether a generic combination of the generators is a null vector of S, at the state of the phase conditions.  */
static int verified(Step *step)
{
    int m = step->symmetries, own = step->drifts, n = step->n;
    double *g = step->combined, length = 0, left = 0;
    if (!m) return 1;
    memset(g, 0, n * sizeof(double));
    for (int i = 0; i < m; i++)
        for (int k = 0; k < own; k++) g[k] += step->generic[i] * step->generators[(size_t)i * own + k];
    times(&step->saddle, g, step->right);
    double size = size_of(&step->metric, g), quotient = dot(own, step->right, g);
    for (int k = 0; k < own; k++) {
        double unit = step->sizes ? step->sizes[k] : 1;
        length += g[k] / unit * g[k] / unit;
        left += step->right[k] * unit * step->right[k] * unit;
    }
    if (sqrt(left) > step->residual * step->norm * (sqrt(length) + step->tiny)) return 0;
    double excess = fabs(quotient) - step->zero * fmax(size * size, step->symmetric * step->symmetric);
    return excess <= 0 || excess <= step->round_off * rounding(&step->saddle, own, g);
}

/* Largest residual of the equations at x, in natural units, and largest difference of the squared norm of a quaternion
   from one; the phase conditions are those of x.  */
static int check(Step *step, const double *x)
{
    if (((equations_at *)step->equations)(step->rod, x, step->right)) return 1;
    step->unbalanced = step->stretched = 0;
    for (int i = 0; i < step->n; i++) {
        double left = fabs(step->right[i]) * (step->sizes ? step->sizes[i] : 1);
        if (!(left <= step->unbalanced)) step->unbalanced = left; /* nan stays */
    }
    for (int i = 0; i < step->quaternions; i++) {
        double size = 0;
        for (int k = 0; k < 4; k++) size += step->u[step->quaternion[4 * i + k]] * step->u[step->quaternion[4 * i + k]];
        if (!(fabs(size - 1) <= step->stretched)) step->stretched = fabs(size - 1);
    }
    return 0;
}

/* A step: prediction by the `known` states with weights of its value and its slope; the last of the rows is at `last`, and
   has the tangent `before` (NULL: none).  The load stays between low and high; a correction smaller than `same` lends its
   factors.  Not MADE: all is to be done step by step.  */
PUBLIC int advance(Step *step, int known, const double **states, const double *value, const double *slope,
                   const double *last, const double *before, double low, double high, double same)
{
    int n = step->n;
    memset(step->x, 0, n * sizeof(double));
    memset(step->direction, 0, n * sizeof(double));
    for (int j = 0; j < known; j++)
        for (int i = 0; i < n; i++) {
            step->x[i] += value[j] * states[j][i];
            step->direction[i] += slope[j] * states[j][i];
        }
    across_orbit(step, last);
    step->predicted = step->x[step->load];
    if (!(low <= step->predicted && step->predicted <= high)) return OUTSIDE;
    times(&step->metric, step->direction, step->row);
    double size = size_of(&step->metric, step->direction);
    for (int i = 0; i < n; i++) step->row[i] /= size;
    if (before && !(dot(n, step->row, before) > 0)) return TURNED;
    set_phase(step, step->x);
    int broken = step->broken;
    if (((correct_state *)step->correct)(step->rod, step->block, step->newton, step->x, step->row)) return NOT_CORRECTED;
    set_phase(step, step->x);
    int moved = *step->iterations > 1 || !(*step->error <= same) || step->broken != broken;
    if (moved && ((factor_at *)step->factor)(step->rod, step->block, step->x)) return SINGULAR;
    step->verified = verified(step);
    memcpy(step->tangent, step->factored_tangent, n * sizeof(double));
    step->along = dot(n, step->row, step->tangent);
    if (step->along < 0) {
        step->along = -step->along;
        for (int i = 0; i < n; i++) step->tangent[i] = -step->tangent[i];
    }
    for (int i = 0; i < n; i++) step->right[i] = step->x[i] - last[i];
    step->length = size_of(&step->metric, step->right);
    if (check(step, step->x)) return NOT_CORRECTED;
    assemble_form *assemble = (assemble_form *)step->assemble;
    step->energy_value = step->potential_value = 0;
    if (assemble(step->energy, NULL, step->u, step->energy_constants, &step->energy_value)) return NOT_CORRECTED;
    if (step->potential && assemble(step->potential, NULL, step->u, step->potential_constants, &step->potential_value))
        return NOT_CORRECTED;
    return MADE;
}
