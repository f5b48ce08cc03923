/* Right and left invariant subspaces of a pencil without symmetry, improved one side at a time by inverse iteration:
   rodfem/stability/followed_pairs.py has the mathematics.

   Blocks of vectors are stored row after row, `width` numbers each, so that loops over columns become wide instructions:
   the first p are of a basis, the next ones, on the right side, of the probes, and zeros fill it up.  Of the mass M only
   the rows with entries count, the `heavy` ones: of a rod without rotary inertia a quarter.  */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define PUBLIC static /* called from Python */

#define LANES 8 /* `width` is a multiple of this */
typedef double lanes __attribute__((vector_size(8 * LANES), aligned(8)));

enum { RIGHT, LEFT };

typedef int solve_columns(void *, int, const double *, double *);

typedef struct {
    uintptr_t solve[2];          /* functions that solve with the factors of S - a M, and with the transposed ones */
    void *factors;
    int n, p, probes, width;     /* unknowns, vectors of a basis, probes */
    const int *starts, *indices; /* M, compressed sparse rows */
    const double *mass;
    double *basis[2], *image[2]; /* n x width: V, on the right with the probes, and M V */
    double *change[2];           /* width x width: products, in the mass, of the last changes of the vectors */
    const double *fresh;         /* n x probes: random vectors */
    double share, outside;       /* their part of a probe; growth of the probes */
    double *overlap, *matrix;    /* width x width: N = Y^t M X, and T = N^-1 Y^t M B X */
    int heavies, *heavy;         /* rows of M with entries: room for n */
    double *columns, *solved, *block, *mapped; /* room: n x width each */
    double *small;               /* room: 3 x width x width */
} Spaces;

#define AT(array, i, j) (array)[(size_t)(i) * f->width + (j)]
#define WIDE(array, i, j) (*(lanes *)&AT(array, i, j))

static void find_heavy(Spaces *f)
{
    f->heavies = 0;
    for (int i = 0; i < f->n; i++)
        for (int k = f->starts[i]; k < f->starts[i + 1]; k++) if (f->mass[k] != 0) { f->heavy[f->heavies++] = i; break; }
}

static void times_mass(const Spaces *f, const double *block, double *out)
{
    memset(out, 0, (size_t)f->n * f->width * sizeof(double));
    for (int h = 0; h < f->heavies; h++) {
        int i = f->heavy[h];
        for (int k = f->starts[i]; k < f->starts[i + 1]; k++) {
            double m = f->mass[k];
            if (m != 0) for (int q = 0; q < f->width; q += LANES) WIDE(out, i, q) += m * WIDE(block, f->indices[k], q);
        }
    }
}

/* a^t b, one of them a product with M.  */
static void product(const Spaces *f, const double *a, const double *b, double *out)
{
    for (int p = 0; p < f->width; p += LANES) for (int q = 0; q < f->width; q += LANES) {
        lanes sum[LANES] = {{0}};
        for (int h = 0; h < f->heavies; h++) {
            lanes row = WIDE(b, f->heavy[h], q);
            for (int r = 0; r < LANES; r++) sum[r] += AT(a, f->heavy[h], p + r) * row;
        }
        for (int r = 0; r < LANES; r++) WIDE(out, p + r, q) = sum[r];
    }
}

/* Rows of a block, those given or (NULL) the first ones, times the p x columns matrix t.  */
static void turned(const Spaces *f, const int *rows, int count, const double *block, const double *t, int columns,
                   double *out)
{
    for (int first = 0; first < count; first += LANES) {
        int here = count - first < LANES ? count - first : LANES, at[LANES];
        for (int r = 0; r < LANES; r++) {
            int row = first + (r < here ? r : 0);
            at[r] = rows ? rows[row] : row;
        }
        for (int q = 0; q < columns; q += LANES) {
            lanes sum[LANES] = {{0}};
            for (int k = 0; k < f->p; k++) {
                lanes row = WIDE(t, k, q);
                for (int r = 0; r < LANES; r++) sum[r] += AT(block, at[r], k) * row;
            }
            for (int r = 0; r < here; r++) WIDE(out, at[r], q) = sum[r];
        }
    }
}

/* a^-1 b for the first p rows, by Gauss's elimination with pivots; both are changed, the solution is in b.  1: singular.  */
static int divide(const Spaces *f, double *a, double *b)
{
    for (int j = 0; j < f->p; j++) {
        int best = j;
        for (int i = j + 1; i < f->p; i++) if (fabs(AT(a, i, j)) > fabs(AT(a, best, j))) best = i;
        if (!(fabs(AT(a, best, j)) > 0)) return 1;
        for (int q = 0; best != j && q < f->width; q += LANES) {
            lanes s = WIDE(a, j, q), t = WIDE(b, j, q);
            WIDE(a, j, q) = WIDE(a, best, q); WIDE(a, best, q) = s;
            WIDE(b, j, q) = WIDE(b, best, q); WIDE(b, best, q) = t;
        }
        for (int i = j + 1; i < f->p; i++) {
            double ratio = AT(a, i, j) / AT(a, j, j);
            for (int q = j / LANES * LANES; q < f->width; q += LANES) WIDE(a, i, q) -= ratio * WIDE(a, j, q);
            for (int q = 0; q < f->width; q += LANES) WIDE(b, i, q) -= ratio * WIDE(b, j, q);
        }
    }
    for (int j = f->p - 1; j >= 0; j--)
        for (int q = 0; q < f->width; q += LANES) {
            lanes sum = WIDE(b, j, q);
            for (int k = j + 1; k < f->p; k++) sum -= AT(a, j, k) * WIDE(b, k, q);
            WIDE(b, j, q) = sum / AT(a, j, j);
        }
    return 0;
}

static void transpose(const Spaces *f, const double *a, double *out)
{
    for (int i = 0; i < f->width; i++) for (int j = 0; j < f->width; j++) AT(out, j, i) = AT(a, i, j);
}

/* Growth of what the probes have outside of the right basis, and the next probes.  Their coefficients in the basis after
   the step are behind the first p columns of t.  */
static void probe(Spaces *f, const double *t)
{
    f->outside = 0;
    for (int j = f->p; j < f->p + f->probes; j++) {
        double before = 0, after = 0;
        for (int h = 0; h < f->heavies; h++) {
            int i = f->heavy[h];
            double v = AT(f->block, i, j), image = AT(f->mapped, i, j);
            for (int k = 0; k < f->p; k++) {
                v -= AT(f->block, i, k) * AT(t, k, j);
                image -= AT(f->mapped, i, k) * AT(t, k, j);
            }
            before += AT(f->basis[RIGHT], i, j) * AT(f->image[RIGHT], i, j);
            after += v * image;
            AT(f->basis[RIGHT], i, j) = v;
        }
        double size = sqrt(fmax(after, 1e-300));
        f->outside = fmax(f->outside, size / sqrt(fmax(before, 1e-300)));
        for (int i = 0; i < f->n; i++) {
            double *v = &AT(f->basis[RIGHT], i, j);
            *v = *v / size + f->share * f->fresh[(size_t)i * f->probes + j - f->p];
        }
    }
}

/* The new basis, `block` t, and products in the mass of what it differs by from the one before.  */
static void go_on(Spaces *f, int side, const double *t)
{
    double *change = f->block, *image = f->mapped;
    turned(f, NULL, f->n, f->block, t, f->p, f->solved);
    turned(f, f->heavy, f->heavies, f->mapped, t, f->p, f->columns);
    for (int h = 0; h < f->heavies; h++) {
        int i = f->heavy[h];
        for (int j = 0; j < f->p; j++) {
            AT(change, i, j) = AT(f->solved, i, j) - AT(f->basis[side], i, j);
            AT(image, i, j) = AT(f->columns, i, j) - AT(f->image[side], i, j);
        }
    }
    product(f, change, image, f->change[side]);
    for (int i = 0; i < f->n; i++) memcpy(&AT(f->basis[side], i, 0), &AT(f->solved, i, 0), f->p * sizeof(double));
}

/* A step of inverse iteration on one side.  1: a projection is singular; 2: out of memory.  */
PUBLIC int improve(Spaces *f, int side)
{
    int n = f->n, count = f->p + (side == RIGHT ? f->probes : 0);
    size_t square = (size_t)f->width * f->width;
    double *a = f->small, *after = a + square, *t = after + square;
    find_heavy(f);
    for (int s = RIGHT; s <= LEFT; s++) times_mass(f, f->basis[s], f->image[s]);
    memset(f->columns, 0, (size_t)n * count * sizeof(double));
    for (int h = 0; h < f->heavies; h++)
        for (int j = 0; j < count; j++) f->columns[(size_t)j * n + f->heavy[h]] = AT(f->image[side], f->heavy[h], j);
    if (((solve_columns *)f->solve[side])(f->factors, count, f->columns, f->solved)) return 2;
    memset(f->block, 0, (size_t)n * f->width * sizeof(double));
    for (int i = 0; i < n; i++) for (int j = 0; j < count; j++) AT(f->block, i, j) = f->solved[(size_t)j * n + i];
    times_mass(f, f->block, f->mapped);
    product(f, f->basis[LEFT], f->image[RIGHT], f->overlap);
    if (side == RIGHT) product(f, f->basis[LEFT], f->mapped, after);
    else product(f, f->block, f->image[RIGHT], after);
    memcpy(a, f->overlap, square * sizeof(double));
    memcpy(f->matrix, after, square * sizeof(double));
    if (divide(f, a, f->matrix)) return 1;
    if (side == RIGHT) {
        memcpy(a, after, square * sizeof(double));
        memcpy(t, f->overlap, square * sizeof(double));
        for (int i = 0; i < f->p; i++) for (int j = f->p; j < f->width; j++) AT(t, i, j) = AT(after, i, j);
    } else {
        transpose(f, after, a);
        transpose(f, f->overlap, t);
    }
    if (divide(f, a, t)) return 1;
    if (side == RIGHT) probe(f, t);
    go_on(f, side, t);
    return 0;
}

#define SUPPORT 8 /* bases that a prediction is fitted to, at most */

/* Weights of the values at `known` distances in the value at zero of the polynomial of a degree that is fitted to them, by
   polynomials that are orthogonal there (Forsythe, J. SIAM 5 (1957) 74).  */
static void fit(int known, int degree, const double *distances, double *weights)
{
    double values[SUPPORT][SUPPORT], at[SUPPORT], most = 0;
    for (int s = 0; s < known; s++) { most = fmax(most, fabs(distances[s])); weights[s] = 0; }
    for (int k = 0; k <= degree && k < known; k++) {
        double *mine = values[k], square = 0;
        for (int s = 0; s < known; s++) mine[s] = k ? values[k - 1][s] * distances[s] / most : 1;
        at[k] = k ? 0 : 1;
        for (int j = 0; j < k; j++) {
            double share = 0, size = 0;
            for (int s = 0; s < known; s++) { share += mine[s] * values[j][s]; size += values[j][s] * values[j][s]; }
            for (int s = 0; s < known; s++) mine[s] -= share / size * values[j][s];
            at[k] -= share / size * at[j];
        }
        for (int s = 0; s < known; s++) square += mine[s] * mine[s];
        for (int s = 0; s < known; s++) weights[s] += at[k] * mine[s] / square;
    }
}

/* Basis of a side at distance zero by the polynomial of a degree that is fitted to `known` ones (n x p each); what it
   misses of the next power of the distance.  */
PUBLIC double predict(Spaces *f, int side, int known, int degree, const double *distances, const double *past)
{
    size_t size = (size_t)f->n * f->p;
    double weights[SUPPORT], missed = 0;
    fit(known, degree, distances, weights);
    for (int s = 0; s < known; s++) missed += weights[s] * pow(distances[s], degree + 1);
    for (int i = 0; i < f->n; i++) for (int j = 0; j < f->p; j++) AT(f->basis[side], i, j) = 0;
    for (int s = 0; s < known; s++)
        for (int i = 0; i < f->n; i++) {
            const double *row = past + s * size + (size_t)i * f->p;
            for (int j = 0; j < f->p; j++) AT(f->basis[side], i, j) += weights[s] * row[j];
        }
    return fabs(missed);
}

/* Combinations of the right basis with `count` columns of coefficients (p x width, at most as many), and M times them, in
   `block` and in `mapped`; after a step.  */
PUBLIC void combine(Spaces *f, int count, const double *w)
{
    turned(f, NULL, f->n, f->basis[RIGHT], w, count, f->block);
    times_mass(f, f->block, f->mapped);
}
