/* Multifrontal factorisation of matrices whose graph is a chain, with delayed pivots.

   The unknowns are eliminated along the chain, front after front.  A front is a small dense matrix: the pivots that were
   delayed, the unknowns whose equations are complete with this front (fully summed), and those that later fronts have as
   well.  Of a rod of finite elements it is one cell: [delayed | left vertex | interior] fully summed, and [right vertex |
   border], the border being the scalars that couple to everything.  What is left after the elimination, the Schur
   complement, is added into the next front.  (Duff & Reid, ACM Trans. Math. Softw. 9 (1983) 302; delayed pivots: Liu,
   SIAM Review 34 (1992) 82.)

   LDL^t has pivots of order one and two, chosen among the fully summed columns so that no multiplier is larger than
   1/THRESHOLD, counted over the whole column; what has no such pivot is delayed to the next front.  The last front
   eliminates everything.  The inertia is that of the pivots (Sylvester).  LU takes pivots by columns in the same fronts.

   Columns are stored one after the other.  Of a symmetric front only the lower triangle is used.  */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PUBLIC static /* called from Python */

#define THRESHOLD 0.01 /* least pivot over the largest entry of its column: multipliers are bounded by its inverse */
#define GOOD 10.0      /* growth of a pivot that is taken without looking for a better one */
#define CANCELLED 1e-8 /* a pair of pivots whose determinant is smaller than this, over its terms, is none */
#define SWEEPS 3       /* of the equilibration, at least */
#define MOST 10        /* and at most: fine meshes need six */
#define SERVES 16.0    /* a scale serves while all sizes are within this of one */

static long factored, solved_columns; /* work since the module was loaded: a measure without noise */
PUBLIC long chain_factored(void) { return factored; }
PUBLIC long chain_solved_columns(void) { return solved_columns; }

typedef struct {
    int own, m;              /* number of fully summed unknowns, and of all, without delayed ones */
    int *unknowns;           /* m of them: the fully summed ones first */
    long entries, first;     /* entries of the matrix that are added in this front: first ... first + entries */
    /* of the last factorisation: */
    int pivots, size;        /* unknowns eliminated, and order of the front with the delayed ones */
    long rows, columns;      /* where the `size` unknowns of its rows (and, of LU, columns) are in `order` */
    long values;             /* where the panels are in `panel`: size x pivots of L; of LU also pivots x size of U */
    long diagonal;           /* where its pivots are in `pivot`: 2 x pivots, diagonal and subdiagonal of D */
} Front;

typedef struct {
    void *data;
    size_t used, room, width;
} Pile;

typedef struct chain {
    int n, symmetric, fronts, largest; /* largest: order of a front */
    Front *front;
    int *unknowns, *target;  /* of all fronts; places of the entries in their fronts, row and column in turn */
    int *source;             /* places of the entries among the values of the matrix */
    int *starts, *indices;   /* pattern of the matrix */
    double *natural;         /* sizes of the unknowns, powers of two, from which the scale starts */
    double *scale, *work, *dense, *schur, *forward, *back;
    char *of_border;
    int *place, *left, *right;      /* place of an unknown in the front at hand; unknowns of the Schur complement */
    size_t dense_room, schur_room, forward_room, back_room;
    Pile order, panel, pivot;
    int negative, zero, scaled;
    double growth;
} chain;

static int resize(Pile *pile, size_t room)
{
    void *data = realloc(pile->data, room * pile->width);
    if (!data) return 0;
    pile->data = data;
    pile->room = room;
    return 1;
}

static void *room_for(Pile *pile, size_t more)
{
    if (pile->used + more > pile->room) {
        size_t used = pile->used + more;
        if (!resize(pile, used + used / 4 + 16)) return NULL; /* the largest piles by far are kept: twice is too much */
    }
    void *at = (char *)pile->data + pile->used * pile->width;
    pile->used += more;
    return at;
}

static int at_least(double **array, size_t *room, size_t size)
{
    if (size <= *room) return 1;
    free(*array);
    *array = malloc(2 * size * sizeof(double));
    *room = *array ? 2 * size : 0;
    return *array != NULL;
}

PUBLIC void chain_free(chain *c)
{
    if (!c) return;
    free(c->front); free(c->unknowns); free(c->target); free(c->source); free(c->starts); free(c->indices);
    free(c->natural); free(c->scale); free(c->work); free(c->of_border); free(c->dense); free(c->schur); free(c->forward); free(c->back);
    free(c->place); free(c->left); free(c->right);
    free(c->order.data); free(c->panel.data); free(c->pivot.data);
    free(c);
}

/* Add the unknowns that later fronts have as well.  */
static int close_front(Front *f, Pile *unknowns, const int *active, int count)
{
    f->m = f->own + count;
    if (!count) return 1;
    int *rest = room_for(unknowns, count);
    if (rest) memcpy(rest, active, count * sizeof(int));
    return rest != NULL;
}

/* Fronts of a matrix of n rows with the pattern (starts, indices).  The unknowns come in the `sequence` of elimination,
   in `groups` groups, group g from begin[g] to begin[g + 1]; those of the last group, the border, may couple to all.  A
   front has those of the border that couple to it or to one before.  A group that adds no unknown to the front before it
   belongs to that front.  NULL: out of memory.  */
PUBLIC chain *chain_new(int n, const int *starts, const int *indices, const int *sequence, int groups, const int *begin,
                        int symmetric, int largest)
{
    chain *c = calloc(1, sizeof(chain));
    int *seen = calloc(n + 1, sizeof(int));
    int *active = malloc((n + 1) * sizeof(int)), *owner = malloc((n + 1) * sizeof(int));
    int *below = calloc(n + 2, sizeof(int)), *rows = malloc((starts[n] + 1) * sizeof(int)); /* the transposed pattern */
    int *entry = malloc((starts[n] + 1) * sizeof(int));
    Pile unknowns = {NULL, 0, 0, sizeof(int)}, target = {NULL, 0, 0, 2 * sizeof(int)}, source = {NULL, 0, 0, sizeof(int)};
    if (!c || !seen || !active || !owner || !below || !rows || !entry) goto failed;
    c->n = n; c->symmetric = symmetric; c->largest = largest;
    c->order.width = sizeof(int); c->panel.width = c->pivot.width = sizeof(double);
    c->front = calloc(groups + 1, sizeof(Front));
    c->starts = malloc((n + 1) * sizeof(int));
    c->indices = malloc((starts[n] + 1) * sizeof(int));
    c->natural = malloc((n + 1) * sizeof(double));
    c->scale = malloc((n + 1) * sizeof(double));
    c->work = malloc((n + 1) * sizeof(double));
    c->of_border = calloc(n + 1, 1);
    c->place = malloc((n + 1) * sizeof(int));
    c->left = malloc((n + 1) * sizeof(int));
    c->right = malloc((n + 1) * sizeof(int));
    if (!c->front || !c->starts || !c->indices || !c->natural || !c->scale || !c->work || !c->of_border || !c->place
        || !c->left || !c->right) goto failed;
    memcpy(c->starts, starts, (n + 1) * sizeof(int));
    memcpy(c->indices, indices, starts[n] * sizeof(int));
    for (int i = 0; i < n; i++) owner[i] = -1;
    for (int i = 0; i < n; i++) c->natural[i] = 1.0;
    for (int k = 0; k < starts[n]; k++) below[indices[k] + 2]++;
    for (int i = 0; i < n; i++) below[i + 2] += below[i + 1];
    for (int i = 0; i < n; i++)
        for (int k = starts[i]; k < starts[i + 1]; k++) { int e = below[indices[k] + 1]++; rows[e] = i; entry[e] = k; }
    for (int i = begin[groups - 1]; i < n; i++) c->of_border[sequence[i]] = 1;
    if (!room_for(&unknowns, n + 1)) goto failed; /* some, even if there are no unknowns at all */
    unknowns.used = 0;
    int border = begin[groups - 1], count = 0; /* of active unknowns: in the front, not fully summed yet */
    for (int g = 0; g < groups; g++) {
        int a = begin[g], b = begin[g + 1], before = count, last = g == groups - 1;
        for (int i = a; i < b; i++) {
            int u = sequence[i];
            if (!seen[u]) { seen[u] = 1; active[count++] = u; }
            for (int k = starts[u]; k < starts[u + 1]; k++) {
                int v = indices[k];
                if (!seen[v]) { seen[v] = 1; active[count++] = v; }
            }
        }
        if (count > before || !c->fronts || (last && border < n)) {
            if (c->fronts && !close_front(&c->front[c->fronts - 1], &unknowns, active, before)) goto failed;
            c->fronts++;
        }
        if (b > a) {
            int *at = room_for(&unknowns, b - a);
            if (!at) goto failed;
            memcpy(at, sequence + a, (b - a) * sizeof(int));
        }
        c->front[c->fronts - 1].own += b - a;
        int kept = 0; /* those of this group are not active any more */
        for (int i = a; i < b; i++) owner[sequence[i]] = c->fronts - 1;
        for (int i = 0; i < count; i++) if (owner[active[i]] < 0) active[kept++] = active[i];
        count = kept;
    }
    close_front(&c->front[c->fronts - 1], &unknowns, active, 0); /* all are fully summed */
    c->unknowns = unknowns.data;
    unknowns.data = NULL;
    if (!resize(&source, starts[n] + 1) || !resize(&target, starts[n] + 1)) goto failed;
    int *list = c->unknowns;
    for (int i = 0; i < c->fronts; i++) { /* each entry belongs to the front that first has one of its unknowns */
        Front *f = &c->front[i];
        f->unknowns = list;
        list += f->m;
        for (int k = 0; k < f->m; k++) c->place[f->unknowns[k]] = k;
        f->first = (long)source.used;
        for (int k = 0; k < f->own; k++) {
            int u = f->unknowns[k];
            for (int e = starts[u]; e < starts[u + 1]; e++) {
                int v = indices[e];
                if (owner[v] < i) continue;
                int p = k, q = c->place[v];
                if (symmetric && q > p && owner[v] == i) continue; /* once, by its row in the lower triangle */
                if (symmetric && q > p) { int t = p; p = q; q = t; }
                int *from = room_for(&source, 1);
                int *to = room_for(&target, 1);
                if (!from || !to) goto failed;
                *from = e; to[0] = p; to[1] = q;
            }
        }
        if (!symmetric) for (int k = 0; k < f->own; k++) { /* columns of the fully summed in the rows of the others */
            int v = f->unknowns[k];
            for (int e = below[v]; e < below[v + 1]; e++) {
                int u = rows[e];
                if (owner[u] <= i) continue;
                int *from = room_for(&source, 1);
                int *to = room_for(&target, 1);
                if (!from || !to) goto failed;
                *from = entry[e]; to[0] = c->place[u]; to[1] = k;
            }
        }
        f->entries = (long)source.used - f->first;
    }
    if (!resize(&source, source.used + 1) || !resize(&target, target.used + 1)) goto failed; /* of symmetric ones half */
    c->source = source.data;
    c->target = target.data;
    free(seen); free(active); free(owner); free(below); free(rows); free(entry);
    return c;
failed:
    free(seen); free(active); free(owner); free(below); free(rows); free(entry);
    free(unknowns.data); free(target.data); free(source.data);
    chain_free(c);
    return NULL;
}

#define NOTHING 1e-30 /* an entry smaller than this, over the largest one off the border, is zero to the equilibration */

/* Natural sizes of the unknowns, as powers of two: the scale of the next matrix starts from them.  Where a stiffness is
   many orders below the constraints beside it the largest entries of all rows are those of constraints, which tell
   nothing of it.  */
PUBLIC void chain_sizes(chain *c, const double *sizes)
{
    for (int i = 0; i < c->n; i++) c->natural[i] = ldexp(1.0, ilogb(sizes[i]));
    c->scaled = 0;
}

/* Size of the k-th entry of the matrix, in row i, for unknowns in units of their natural sizes.  */
static double in_units(const chain *c, const double *values, int i, int k)
{
    return fabs(values[k]) * c->natural[i] * c->natural[c->indices[k]];
}

static double lowered(double scale, double size, int by) /* scale / size^(1/by), in powers of two */
{
    int exponent = 0;
    if (size > 0) frexp(size, &exponent);
    return ldexp(scale, -(exponent / by));
}

/* Scale of the border by the sums of its rows: couplings to it add up along the chain.  */
static void equilibrate_border(chain *c, const double *values, double least)
{
    double *size = c->work, *s = c->scale;
    memset(size, 0, c->n * sizeof(double));
    for (int i = 0; i < c->n; i++)
        for (int k = c->starts[i]; k < c->starts[i + 1]; k++) {
            int j = c->indices[k];
            double a = fabs(values[k]);
            if (c->of_border[i] == c->of_border[j] || in_units(c, values, i, k) < least) continue;
            if (c->of_border[j]) size[j] += a * s[i];
            else if (!c->symmetric) size[i] += a * s[j];
        }
    for (int i = 0; i < c->n; i++) if (c->of_border[i]) s[i] = lowered(1.0, size[i], 1);
}

/* Sizes of the rows of D A D, and of its columns: their largest entries, of the border their sums; whether all are near
   one.  */
static int measure(chain *c, const double *values, double least)
{
    double *size = c->work, *s = c->scale;
    memset(size, 0, c->n * sizeof(double));
    for (int i = 0; i < c->n; i++) {
        if (c->symmetric && c->of_border[i]) continue;
        double most = 0, sum = 0, mine = s[i];
        for (int k = c->starts[i]; k < c->starts[i + 1]; k++) {
            int j = c->indices[k];
            double a = fabs(values[k]);
            if (in_units(c, values, i, k) < least) continue;
            a *= mine * s[j];
            if (a > most) most = a;
            if (c->of_border[j]) { if (!c->of_border[i]) size[j] += a; continue; }
            sum += a;
            if (!c->symmetric && a > size[j]) size[j] = a;
        }
        if (c->of_border[i]) size[i] += sum; else if (most > size[i]) size[i] = most;
    }
    for (int i = 0; i < c->n; i++) if (size[i] != 0 && !(size[i] > 1 / SERVES && size[i] < SERVES)) return 0;
    return 1;
}

/* Equilibration in powers of two (Ruiz, RAL-TR-2001-034): the largest entries of the rows and columns of D A D are about
   one.  The scale of the matrix before is kept as long as it serves.  */
static void equilibrate(chain *c, const double *values, double least)
{
    double *s = c->scale;
    if (c->scaled && measure(c, values, least)) return;
    memcpy(s, c->natural, c->n * sizeof(double));
    for (int sweep = 0;; sweep++) {
        equilibrate_border(c, values, least);
        int serves = measure(c, values, least);
        if ((serves && sweep >= SWEEPS) || sweep == MOST) break;
        for (int i = 0; i < c->n; i++) if (!c->of_border[i]) s[i] = lowered(s[i], c->work[i], 2);
    }
    c->scaled = 1;
}

/* --- symmetric ---------------------------------------------------------------------------------------------------- */

#define A(i, j) a[(size_t)(j) * m + (i)]
#define LOW(i, j) ((i) > (j) ? A(i, j) : A(j, i))

static void swap_symmetric(double *a, int m, int *unknowns, int p, int q)
{
    if (p == q) return;
    if (p > q) { int t = p; p = q; q = t; }
    int u = unknowns[p]; unknowns[p] = unknowns[q]; unknowns[q] = u;
    double t = A(p, p); A(p, p) = A(q, q); A(q, q) = t;
    for (int j = 0; j < p; j++) { t = A(p, j); A(p, j) = A(q, j); A(q, j) = t; }
    for (int j = p + 1; j < q; j++) { t = A(j, p); A(j, p) = A(q, j); A(q, j) = t; }
    for (int i = q + 1; i < m; i++) { t = A(i, p); A(i, p) = A(i, q); A(i, q) = t; }
}

/* Largest entry of column j among rows k ... m, without j and `but`; where the largest fully summed one is.  */
static double largest_of(const double *a, int m, int k, int j, int but, int full, int *where)
{
    double most = 0, inside = -1;
    *where = -1;
    for (int i = k; i < m; i++) {
        if (i == j || i == but) continue;
        double x = fabs(LOW(i, j));
        if (x > most) most = x;
        if (i < full && x > inside) { inside = x; *where = i; }
    }
    return most;
}

/* Largest multiplier that the pivot of columns p and q would make.  */
static double growth_of_pair(const double *a, int m, int k, int p, int q)
{
    double d = LOW(p, q), e = A(p, p), f = A(q, q);
    double det = e * f - d * d;
    if (!(fabs(det) > CANCELLED * (fabs(e * f) + d * d))) return INFINITY;
    int where;
    double other = largest_of(a, m, k, q, p, k, &where), mine = 0;
    for (int i = k; i < m; i++) {
        if (i == p || i == q) continue;
        double x = fabs(LOW(i, p));
        if (x > mine) mine = x;
    }
    double first = (fabs(f) * mine + fabs(d) * other) / fabs(det), second = (fabs(d) * mine + fabs(e) * other) / fabs(det);
    return first > second ? first : second;
}

/* Partial LDL^t of a front of order m, of which `full` unknowns are fully summed; the number of pivots.  */
static int eliminate_symmetric(chain *c, double *a, int m, int full, int *unknowns, double *d, int last)
{
    int k = 0;
    while (k < full) {
        double best = INFINITY;
        int p = -1, q = -1;
        for (int j = k; j < full; j++) {
            int where;
            double most = largest_of(a, m, k, j, -1, full, &where), x = fabs(A(j, j));
            double growth = x > 0 ? most / x : INFINITY;
            if (growth < best) { best = growth; p = j; q = -1; }
            if (best <= GOOD) break;
            if (where >= 0 && LOW(where, j) != 0) {
                growth = growth_of_pair(a, m, k, j, where);
                if (growth < best) { best = growth; p = j; q = where; }
                if (best <= GOOD) break;
            }
        }
        if (!isfinite(best) || (!last && best > 1.0 / THRESHOLD)) break;
        if (best > c->growth) c->growth = best;
        if (q < 0) {
            swap_symmetric(a, m, unknowns, k, p);
            double pivot = A(k, k), inverse = 1.0 / pivot;
            d[2 * k] = pivot; d[2 * k + 1] = 0;
            c->negative += pivot < 0;
            for (int j = k + 1; j < m; j++) {
                double x = A(j, k) * inverse;
                if (x != 0) for (int i = j; i < m; i++) A(i, j) -= x * A(i, k);
            }
            for (int i = k + 1; i < m; i++) A(i, k) *= inverse;
            k += 1;
        } else {
            if (p > q) { int t = p; p = q; q = t; }
            swap_symmetric(a, m, unknowns, k, p);
            swap_symmetric(a, m, unknowns, k + 1, q);
            double e = A(k, k), f = A(k + 1, k + 1), g = A(k + 1, k), det = e * f - g * g;
            d[2 * k] = e; d[2 * k + 1] = g; d[2 * k + 2] = f; d[2 * k + 3] = 0;
            c->negative += det < 0 ? 1 : 2 * (e < 0);
            A(k + 1, k) = 0;
            for (int j = k + 2; j < m; j++) {
                double x = A(j, k), y = A(j, k + 1);
                double u = (f * x - g * y) / det, v = (e * y - g * x) / det;
                if (u != 0 || v != 0) for (int i = j; i < m; i++) A(i, j) -= u * A(i, k) + v * A(i, k + 1);
            }
            for (int i = k + 2; i < m; i++) {
                double x = A(i, k), y = A(i, k + 1);
                A(i, k) = (f * x - g * y) / det;
                A(i, k + 1) = (e * y - g * x) / det;
            }
            k += 2;
        }
    }
    return k;
}

/* --- without symmetry --------------------------------------------------------------------------------------------- */

/* Partial LU with pivots by columns: the largest fully summed entry, unless it is too small in its column.  */
static int eliminate_general(chain *c, double *a, int m, int full, int *rows, int *columns, int last)
{
    for (int k = 0; k < full; k++) {
        int p = -1, q = -1;
        double best = INFINITY;
        for (int j = k; j < full; j++) {
            double most = 0, inside = 0;
            int where = -1;
            for (int i = k; i < m; i++) {
                double x = fabs(A(i, j));
                if (x > most) most = x;
                if (i < full && x > inside) { inside = x; where = i; }
            }
            double growth = inside > 0 ? most / inside : INFINITY;
            if (growth < best) { best = growth; p = where; q = j; }
            if (best <= GOOD) break;
        }
        if (!isfinite(best) || (!last && best > 1.0 / THRESHOLD)) return k;
        if (best > c->growth) c->growth = best;
        if (p != k) {
            int t = rows[p]; rows[p] = rows[k]; rows[k] = t;
            for (int j = 0; j < m; j++) { double x = A(p, j); A(p, j) = A(k, j); A(k, j) = x; }
        }
        if (q != k) {
            int t = columns[q]; columns[q] = columns[k]; columns[k] = t;
            for (int i = 0; i < m; i++) { double x = A(i, q); A(i, q) = A(i, k); A(i, k) = x; }
        }
        double inverse = 1.0 / A(k, k);
        for (int i = k + 1; i < m; i++) A(i, k) *= inverse;
        for (int j = k + 1; j < m; j++) {
            double x = A(k, j);
            if (x != 0) for (int i = k + 1; i < m; i++) A(i, j) -= x * A(i, k);
        }
    }
    return full;
}

/* --- the whole chain ---------------------------------------------------------------------------------------------- */

/* Factor the matrix of the given values: 0, 1 where it is exactly singular, 2 where a front is too large or memory
   ends, 3 where a value is no number.  */
PUBLIC int chain_factor(chain *c, const double *values)
{
    factored++;
    double most = 0, sum = 0;
    for (int i = 0; i < c->n; i++)
        for (int k = c->starts[i]; k < c->starts[i + 1]; k++) {
            double a = in_units(c, values, i, k);
            sum += a;
            if (a > most && !(c->of_border[i] && c->of_border[c->indices[k]])) most = a;
        }
    if (!isfinite(sum)) return 3;
    c->order.used = c->panel.used = c->pivot.used = 0;
    c->negative = c->zero = 0;
    c->growth = 0;
    equilibrate(c, values, NOTHING * most);
    const double *s = c->scale;
    int delayed = 0, remaining = 0; /* of the Schur complement: fully summed unknowns first */
    for (int index = 0; index < c->fronts; index++) {
        Front *f = &c->front[index];
        int m = delayed + f->m, last = index == c->fronts - 1, full = delayed + f->own;
        if (m > c->largest + f->m || !at_least(&c->dense, &c->dense_room, (size_t)m * m + 1)) return 2;
        double *a = c->dense;
        memset(a, 0, (size_t)m * m * sizeof(double));
        f->size = m;
        f->rows = (long)c->order.used;
        if (!room_for(&c->order, (size_t)(c->symmetric ? m : 2 * m) + 1)) return 2;
        int *rows = (int *)c->order.data + f->rows, *columns = c->symmetric ? rows : rows + m;
        f->columns = f->rows + (c->symmetric ? 0 : m);
        memcpy(rows, c->left, delayed * sizeof(int));
        memcpy(rows + delayed, f->unknowns, f->m * sizeof(int));
        if (!c->symmetric) {
            memcpy(columns, c->right, delayed * sizeof(int));
            memcpy(columns + delayed, f->unknowns, f->m * sizeof(int));
        }
        for (long e = f->first; e < f->first + f->entries; e++) {
            int i = delayed + c->target[2 * e], j = delayed + c->target[2 * e + 1];
            A(i, j) += values[c->source[e]] * s[rows[i]] * s[columns[j]];
        }
        /* the Schur complement of the front before; its unknowns that are not delayed are all in this front */
        for (int k = 0; k < f->m; k++) c->place[f->unknowns[k]] = delayed + k;
        for (int j = 0; j < remaining; j++) {
            int q = j < delayed ? j : c->place[c->right[j]];
            const double *column = c->schur + (size_t)j * remaining;
            if (c->symmetric) for (int i = j; i < remaining; i++) {
                int p = i < delayed ? i : c->place[c->left[i]];
                if (p > q) A(p, q) += column[i]; else A(q, p) += column[i];
            } else for (int i = 0; i < remaining; i++) A(i < delayed ? i : c->place[c->left[i]], q) += column[i];
        }
        f->diagonal = (long)c->pivot.used;
        double *d = room_for(&c->pivot, 2 * (size_t)full + 2);
        if (!d) return 2;
        int done = c->symmetric ? eliminate_symmetric(c, a, m, full, rows, d, last)
                                : eliminate_general(c, a, m, full, rows, columns, last);
        f->pivots = done;
        f->values = (long)c->panel.used;
        double *panel = room_for(&c->panel, (size_t)m * done * (c->symmetric ? 1 : 2) + 1);
        if (!panel) return 2;
        memcpy(panel, a, (size_t)m * done * sizeof(double));
        if (!c->symmetric) for (int k = 0; k < done; k++) /* rows of U, one after the other */
            for (int j = 0; j < m; j++) panel[(size_t)m * done + (size_t)k * m + j] = A(k, j);
        if (last) { c->zero = m - done; break; }
        remaining = m - done;
        if (!at_least(&c->schur, &c->schur_room, (size_t)remaining * remaining + 1)) return 2;
        for (int j = 0; j < remaining; j++)
            memcpy(c->schur + (size_t)j * remaining, a + (size_t)(done + j) * m + done, remaining * sizeof(double));
        memcpy(c->left, rows + done, remaining * sizeof(int));
        memcpy(c->right, columns + done, remaining * sizeof(int));
        delayed = full - done;
    }
    return c->zero ? 1 : 0;
}

/* --- solutions ---------------------------------------------------------------------------------------------------- */

#define WIDTH 8 /* columns solved for at once, at most: the factors are read once for all of them */
#define ALL(q) for (int q = 0; q < w; q++)

/* Number of columns that are solved for next: those for which there is code.  */
static int strip(int left) { return left >= WIDTH ? WIDTH : left >= 4 ? 4 : left; }

/* L z = y for w columns, interleaved: those of one unknown are next to each other.  */
static inline void down(const chain *c, const int w, double *restrict y, double *restrict z)
{
    for (int index = 0; index < c->fronts; index++) {
        const Front *f = &c->front[index];
        const int *rows = (const int *)c->order.data + f->rows;
        int m = f->size;
        const double *restrict l = (const double *)c->panel.data + f->values;
        for (int i = 0; i < m; i++) ALL(q) z[i * w + q] = y[(size_t)rows[i] * w + q];
        for (int j = 0; j < f->pivots; j++, l += m) {
            double t[WIDTH];
            ALL(q) t[q] = z[j * w + q];
            for (int i = j + 1; i < m; i++) ALL(q) z[i * w + q] -= l[i] * t[q];
        }
        for (int i = 0; i < m; i++) ALL(q) y[(size_t)rows[i] * w + q] = z[i * w + q];
        if (!c->symmetric) continue;
        const double *d = (const double *)c->pivot.data + f->diagonal;
        for (int j = 0; j < f->pivots; j++) { /* D */
            double *u = y + (size_t)rows[j] * w;
            if (d[2 * j + 1] == 0) { ALL(q) u[q] /= d[2 * j]; continue; }
            double *v = y + (size_t)rows[j + 1] * w;
            double e = d[2 * j], g = d[2 * j + 1], h = d[2 * j + 2], det = e * h - g * g;
            ALL(q) {
                double a = u[q], b = v[q];
                u[q] = (h * a - g * b) / det;
                v[q] = (e * b - g * a) / det;
            }
            j++;
        }
    }
}

/* L^t x = y or U x = y.  Solutions belong to columns, right-hand sides to rows: x may be y if they are the same.  */
static inline void up(const chain *c, const int w, const double *y, double *x, double *restrict z)
{
    const int unit = c->symmetric; /* the diagonal of L is one */
    for (int index = c->fronts - 1; index >= 0; index--) {
        const Front *f = &c->front[index];
        const int *order = (const int *)c->order.data, m = f->size;
        const int *rows = order + f->rows, *columns = order + f->columns;
        const double *restrict u = (const double *)c->panel.data + f->values + (unit ? 0 : (size_t)m * f->pivots);
        for (int i = f->pivots; i < m; i++) ALL(q) z[i * w + q] = x[(size_t)columns[i] * w + q];
        for (int j = f->pivots - 1; j >= 0; j--) {
            double t[WIDTH];
            ALL(q) t[q] = y[(size_t)rows[j] * w + q];
            for (int i = j + 1; i < m; i++) ALL(q) t[q] -= u[(size_t)j * m + i] * z[i * w + q];
            ALL(q) z[j * w + q] = unit ? t[q] : t[q] / u[(size_t)j * m + j];
        }
        for (int i = 0; i < f->pivots; i++) ALL(q) x[(size_t)columns[i] * w + q] = z[i * w + q];
    }
}

/* The same with a width that the compiler knows.  */
static void down_by(const chain *c, int w, double *y, double *z)
{
    switch (w) {
    case 1: down(c, 1, y, z); break;
    case 2: down(c, 2, y, z); break;
    case 3: down(c, 3, y, z); break;
    case 4: down(c, 4, y, z); break;
    default: down(c, WIDTH, y, z);
    }
}

static void up_by(const chain *c, int w, const double *y, double *x, double *z)
{
    switch (w) {
    case 1: up(c, 1, y, x, z); break;
    case 2: up(c, 2, y, x, z); break;
    case 3: up(c, 3, y, x, z); break;
    case 4: up(c, 4, y, x, z); break;
    default: up(c, WIDTH, y, x, z);
    }
}

/* Order of the largest front, delayed pivots included.  */
PUBLIC int chain_largest(const chain *c)
{
    int most = 0;
    for (int i = 0; i < c->fronts; i++) if (c->front[i].size > most) most = c->front[i].size;
    return most;
}

static int room_for_columns(chain *c)
{
    return at_least(&c->forward, &c->forward_room, (size_t)c->n * WIDTH + 1)
        && at_least(&c->back, &c->back_room, ((size_t)c->n + chain_largest(c)) * WIDTH + 1);
}

/* Solutions x for k columns of b, one after the other (n each).  2: out of memory.  */
PUBLIC int chain_solve(chain *c, int k, const double *b, double *x)
{
    solved_columns += k;
    if (!room_for_columns(c)) return 2;
    double *y = c->forward, *solved = c->symmetric ? y : c->back, *z = c->back + (size_t)c->n * WIDTH;
    for (int column = 0, w; column < k; column += w) {
        const double *right = b + (size_t)column * c->n;
        double *out = x + (size_t)column * c->n;
        w = strip(k - column);
        for (int i = 0; i < c->n; i++) ALL(q) y[(size_t)i * w + q] = right[(size_t)q * c->n + i] * c->scale[i];
        down_by(c, w, y, c->back);
        up_by(c, w, y, solved, z);
        for (int i = 0; i < c->n; i++) ALL(q) out[(size_t)q * c->n + i] = solved[(size_t)i * w + q] * c->scale[i];
    }
    return 0;
}

PUBLIC int chain_negative(const chain *c) { return c->negative; }
PUBLIC int chain_zero(const chain *c) { return c->zero; }
PUBLIC int chain_fronts(const chain *c) { return c->fronts; }
PUBLIC double chain_growth(const chain *c) { return c->growth; }
PUBLIC int chain_delayed(const chain *c)
{
    int sum = 0;
    for (int i = 0; i < c->fronts; i++) sum += c->front[i].size - c->front[i].m;
    return sum;
}
