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
        double *values = malloc((size_t)n * n * sizeof(double));
        for (int i = 0; i < n; i++) {
            starts[i] = used;
            sequence[i] = i;
            for (int j = 0; j < n; j++) if (coupled[i * n + j]) {
                values[used] = a[i * n + j];
                indices[used++] = j;
            }
        }
        starts[n] = used;
        int k = 1 + whole(&state, 6);
        double *x = calloc((size_t)n * k, sizeof(double)), *b = calloc((size_t)n * k, sizeof(double));
        chain *c = chain_new(n, starts, indices, sequence, groups, begin, symmetric, 2000);
        if (!c) return 2;
        for (int repeat = 0; repeat < 2; repeat++) {
            int status = chain_factor(c, values);
            if (status == 1) continue;
            if (status) { wrong++; continue; }
            for (int i = 0; i < n * k; i++) b[i] = number(&state);
            if (chain_solve(c, k, b, x)) return 2;
            for (int column = 0; column < k; column++) {
                double worst = 0, size = 0;
                for (int i = 0; i < n; i++) {
                    double r = -b[column * n + i];
                    for (int j = 0; j < n; j++) r += a[i * n + j] * x[column * n + j];
                    worst = fmax(worst, fabs(r));
                    size = fmax(size, fabs(x[column * n + i]));
                }
                if (!(worst < 1e-10 * (size + 1))) { wrong++; printf("trial %d: residual %g of %g\n", trial, worst, size); }
            }
        }
        chain_free(c);
        free(a); free(x); free(b); free(coupled); free(begin); free(sequence); free(starts); free(indices); free(values);
    }
    printf("%d wrong\n", wrong);
    return wrong > 0;
}
