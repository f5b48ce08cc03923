/* Random matrices through the elimination, for the sanitizers: right answers, no leak, no access out of bounds.  */
#include <math.h>
#include <stdio.h>
#include "chain.c"

static double number(unsigned long *state)
{
    *state = *state * 6364136223846793005UL + 1442695040888963407UL;
    return (double)(*state >> 33) / 4294967296.0 - 0.25;
}

static int whole(unsigned long *state, int most) { return (int)((number(state) + 0.25) * 2 * most) % most; }

/* Solve with an open chain: what it leaves is eliminated densely.  */
static int joined(chain *c, int symmetric, int k, double *x)
{
    int m = chain_rest(c), begin[] = {0, m, m}, status = 0;
    double *left = malloc((size_t)m * m * sizeof(double) + 1), *turned = malloc((size_t)m * m * sizeof(double) + 1);
    double *rest = malloc((size_t)m * k * sizeof(double) + 1);
    int *starts = malloc((m + 1) * sizeof(int)), *indices = malloc((size_t)m * m * sizeof(int) + 1);
    int *places = malloc((size_t)m * m * sizeof(int) + 1);
    chain_schur(c, left);
    for (int i = 0; i < m; i++) for (int j = 0; j < m; j++) {
        turned[i * m + j] = left[symmetric && i < j ? i * m + j : j * m + i];
        indices[i * m + j] = j;
        places[i * m + j] = i * m + j;
    }
    for (int i = 0; i <= m; i++) starts[i] = i * m;
    chain *joint = chain_new(m, starts, indices, places, indices, 2, begin, symmetric, 0, 2000);
    if (!joint || chain_factor(joint, turned) > 1) status = 2;
    if (!status) {
        status = chain_forward(c, k, x, rest) || chain_forward(joint, k, rest, NULL);
        chain_back(joint, k, NULL, rest);
        chain_back(c, k, rest, x);
    }
    chain_free(joint);
    free(left); free(turned); free(rest); free(starts); free(indices); free(places);
    return status;
}

int main(void)
{
    unsigned long state = 1;
    int wrong = 0;
    for (int trial = 0; trial < 400; trial++) {
        int symmetric = trial % 2, cells = 1 + whole(&state, 6), vertex = 1 + whole(&state, 4), inner = whole(&state, 6);
        int border = whole(&state, 4), fields = cells * (vertex + inner) + vertex, n = fields + border, groups = 0;
        double *a = calloc((size_t)n * n, sizeof(double));
        char *coupled = calloc((size_t)n * n, 1);
        int *begin = malloc((2 * cells + 4) * sizeof(int)), *sequence = malloc(n * sizeof(int));
        for (int c = 0; c < cells; c++) {
            int first = c * (vertex + inner), last = first + 2 * vertex + inner;
            begin[groups++] = first;
            if (inner) begin[groups++] = first + vertex;
            for (int i = first; i < last; i++) for (int j = first; j < last; j++) coupled[i * n + j] = 1;
        }
        begin[groups++] = cells * (vertex + inner);
        begin[groups++] = fields;
        begin[groups] = n;
        for (int i = 0; i < n; i++) for (int j = 0; j < n; j++) {
            if (i >= fields || j >= fields) coupled[i * n + j] = 1;
            /* the diagonal of every third unknown is zero: pivots are delayed */
            if (coupled[i * n + j]) a[i * n + j] = i == j && i % 3 == 0 ? 0.0 : number(&state);
        }
        if (symmetric) for (int i = 0; i < n; i++) for (int j = 0; j < i; j++) a[i * n + j] = a[j * n + i];
        int *starts = malloc((n + 1) * sizeof(int)), *indices = malloc((size_t)n * n * sizeof(int)), used = 0;
        int *places = malloc((size_t)n * n * sizeof(int));
        double *values = malloc((size_t)n * n * sizeof(double));
        for (int i = 0; i < n; i++) {
            starts[i] = used;
            sequence[i] = i;
            for (int j = 0; j < n; j++) if (coupled[i * n + j]) {
                places[used] = (int)((size_t)n * n) - 1 - used; /* values come in reverse */
                values[places[used]] = a[i * n + j];
                indices[used++] = j;
            }
        }
        starts[n] = used;
        int open = trial / 2 % 2, k = 1 + whole(&state, 6);
        double *x = calloc((size_t)n * k, sizeof(double)), *b = calloc((size_t)n * k, sizeof(double));
        chain *c = chain_new(n, starts, indices, places, sequence, groups, begin, symmetric, open, 2000);
        if (!c) return 2;
        for (int repeat = 0; repeat < 2; repeat++) {
            int status = chain_factor(c, values);
            if (status == 1) continue;
            if (status) { wrong++; continue; }
            for (int i = 0; i < n * k; i++) { b[i] = number(&state); x[i] = b[i]; }
            if (open ? joined(c, symmetric, k, x) : chain_forward(c, k, x, NULL)) return 2;
            if (!open) chain_back(c, k, NULL, x);
            for (int transposed = 0; transposed <= (!open && !symmetric); transposed++) {
                if (transposed && chain_solve_transposed(c, k, b, x)) return 2;
                for (int column = 0; column < k; column++) {
                    double worst = 0, size = 0;
                    for (int i = 0; i < n; i++) {
                        double r = -b[column * n + i];
                        for (int j = 0; j < n; j++) r += a[transposed ? j * n + i : i * n + j] * x[column * n + j];
                        worst = fmax(worst, fabs(r));
                        size = fmax(size, fabs(x[column * n + i]));
                    }
                    if (!(worst < 1e-10 * (size + 1))) { wrong++; printf("trial %d, transposed %d: residual %g of %g\n", trial, transposed, worst, size); }
                }
            }
        }
        chain_free(c);
        free(a); free(x); free(b); free(coupled); free(begin); free(sequence); free(starts); free(indices); free(places); free(values);
    }
    printf("%d wrong\n", wrong);
    return wrong > 0;
}
