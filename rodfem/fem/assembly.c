/* Assembly of the element tensors of a form, by the kernels that FFCx compiled for it.

   A form is a sum of integrals over cells, exterior and interior facets (points, on an interval).  Its kernel computes
   the tensor of one entity from the values of the coefficient in the cell (or, of an interior facet, in both cells), the
   constants and the coordinates.  A scalar is summed; a vector is added where the degrees of freedom of the cell are; a
   matrix is added to the values of a compressed sparse row matrix that couples all degrees of freedom within cells.  In
   such a matrix rows with the same pattern have the same offsets: entry (i, j) of a cell is at row[i] + column[kind[i]][j].

   The interface of the kernels is ufcx.h of FFCx.  */

#include <stdint.h>
#include <string.h>

#define PUBLIC static /* called from Python */
#define WIDTH 8 /* columns that are multiplied at once */

typedef void kernel(double *, const double *, const double *, const double *, const int *, const uint8_t *);
typedef void custom_kernel(double *, const double *, const double *, const double *, const int *, const uint8_t *, void *);

typedef struct {
    uintptr_t kernel;
    int custom;          /* whether it takes a seventh argument */
    int kind;            /* numbers of an entity: cell; cell and facet; cell and facet on both sides */
    int count;
    const int *entities;
} Integral;

typedef struct {
    int dof;             /* where the load is among the values of the unknown */
    int pieces, size;    /* of its table; numbers of a row of that */
    const double *line;  /* what it is called with, at load zero, and the slope in the load */
    const double *rows;  /* pieces x size: where a piece begins, then the coefficients of its cubics */
} Path;

typedef struct {
    int rank, size;      /* of its tensor; degrees of freedom of a cell */
    int functions;       /* that its kernels read, of those whose values are given one after the other */
    const int *function; /* their numbers: 0 is the unknown, of which all others are changes */
    int integrals, locals; /* number of integrals; of values of a function */
    const Integral *integral;
    const double *x;     /* coordinates, cells x 2 x 3 */
    const int *dofs;     /* cells x size */
    int tables, paths, pieces;  /* further values of a cell, of tables; number of paths; values of their pieces */
    const double *table; /* cells x tables */
    const Path *path;
    double *piece;       /* room: pieces */
    double *tensor, *w;  /* room: (2 size)^rank, 2 (functions size + tables + pieces) */
} Form;

typedef struct {
    int kinds;
    const int *row;      /* cells x size: where the row begins among the values, or the place in a vector; -1: left out */
    const int *kind;     /* cells x size: which pattern the row has */
    const int *column;   /* cells x kinds x size: offset of the column in rows of that pattern; -1: not there */
} Places;

static long assembled; /* forms since the module was loaded */
PUBLIC long assemblies(void) { return assembled; }

/* Lay the pieces of the paths of the load where the values u have it.  */
static void lay(const Form *form, const double *u)
{
    double *to = form->piece;
    for (int i = 0; i < form->paths; i++) {
        const Path *path = &form->path[i];
        double t = path->line[0] + path->line[1] * u[path->dof];
        int low = 0, high = path->pieces;
        while (high - low > 1) {
            int middle = low + (high - low) / 2;
            if (path->rows[(size_t)middle * path->size] > t) high = middle; else low = middle;
        }
        memcpy(to, path->rows + (size_t)low * path->size, path->size * sizeof(double));
        to += path->size;
    }
}

/* The element tensor of the form at an entity of an integral, for the values u.  Returns NULL where an interior facet
   couples more than the cell of its first side, which no place is for.  */
static const double *tensor_of(const Form *form, const Integral *integral, const int *entity, const double *u,
                               const double *constants)
{
    const uint8_t permutations[2] = {0, 0};
    int n = form->size, known = form->tables + form->pieces, sides = integral->kind == 4 ? 2 : 1, m = sides * n;
    int facets[2] = {integral->kind > 1 ? entity[1] : 0, integral->kind == 4 ? entity[3] : 0};
    size_t entries = form->rank == 0 ? 1 : form->rank == 1 ? (size_t)m : (size_t)m * m;
    double coordinates[12], *a = form->tensor;
    for (int side = 0; side < sides; side++) {
        int cell = entity[2 * side];
        const int *dofs = form->dofs + (size_t)cell * n;
        double *to = form->w + sides * form->functions * n + side * known;
        for (int f = 0; f < form->functions; f++) for (int i = 0; i < n; i++)
            form->w[(f * sides + side) * n + i] = u[form->function[f] * form->locals + dofs[i]];
        memcpy(to, form->table + (size_t)cell * form->tables, form->tables * sizeof(double));
        memcpy(to + form->tables, form->piece, form->pieces * sizeof(double));
        memcpy(coordinates + 6 * side, form->x + (size_t)cell * 6, 6 * sizeof(double));
    }
    memset(a, 0, entries * sizeof(double));
    if (integral->custom)
        ((custom_kernel *)integral->kernel)(a, form->w, constants, coordinates, facets, permutations, NULL);
    else
        ((kernel *)integral->kernel)(a, form->w, constants, coordinates, facets, permutations);
    for (size_t i = n; form->rank > 0 && sides == 2 && i < entries; i++)
        if (a[i] != 0 && (form->rank == 1 || i / m >= (size_t)n || i % m >= (size_t)n)) return NULL;
    return a;
}

/* Add the form for the values u to out.  Returns 1 where no place is for a part of it.  */
PUBLIC int assemble(const Form *form, const Places *places, const double *u, const double *constants, double *out)
{
    int n = form->size;
    assembled++;
    lay(form, u);
    for (int k = 0; k < form->integrals; k++) {
        const Integral *integral = &form->integral[k];
        int m = integral->kind == 4 ? 2 * n : n;
        for (int e = 0; e < integral->count; e++) {
            const int *entity = integral->entities + (size_t)e * integral->kind;
            const double *a = tensor_of(form, integral, entity, u, constants);
            if (!a) return 1;
            if (form->rank == 0) { out[0] += a[0]; continue; }
            size_t cell = entity[0];
            const int *row = places->row + cell * n;
            for (int i = 0; i < n && form->rank == 1; i++) if (row[i] >= 0) out[row[i]] += a[i];
            if (form->rank == 1) continue;
            const int *kind = places->kind + cell * n, *column = places->column + cell * places->kinds * n;
            for (int i = 0; i < n; i++) {
                if (row[i] < 0) continue;
                const int *offset = column + (size_t)kind[i] * n;
                const double *from = a + (size_t)i * m;
                double *to = out + row[i];
                for (int j = 0; j < n; j++) if (offset[j] >= 0) to[offset[j]] += from[j];
            }
        }
    }
    return 0;
}

/* Add the products of the bilinear form, or of its transpose, with the `count` columns of x to those of out.  Unknowns
   have the number[] of their local degree of freedom; -1: always zero.  Returns 1 where no place is for a part of it.  */
PUBLIC int multiply(const Form *form, const int *number, const double *u, const double *constants, int transposed,
                    int count, const double *x, double *out)
{
    int n = form->size;
    double given[n][WIDTH];
    lay(form, u);
    for (int k = 0; k < form->integrals; k++) {
        const Integral *integral = &form->integral[k];
        int m = integral->kind == 4 ? 2 * n : n, along = transposed ? 1 : m, across = transposed ? m : 1;
        for (int e = 0; e < integral->count; e++) {
            const int *entity = integral->entities + (size_t)e * integral->kind;
            const int *dofs = form->dofs + (size_t)entity[0] * n;
            const double *a = tensor_of(form, integral, entity, u, constants);
            if (!a) return 1;
            for (int first = 0; first < count; first += WIDTH) {
                int wide = count - first < WIDTH ? count - first : WIDTH;
                memset(given, 0, sizeof given);
                for (int j = 0; j < n; j++)
                    if (number[dofs[j]] >= 0)
                        memcpy(given[j], x + (size_t)number[dofs[j]] * count + first, wide * sizeof(double));
                for (int i = 0; i < n; i++) {
                    if (number[dofs[i]] < 0) continue;
                    double sum[WIDTH] = {0}, *to = out + (size_t)number[dofs[i]] * count + first;
                    for (int j = 0; j < n; j++)
                        for (int q = 0; q < WIDTH; q++) sum[q] += a[i * along + j * across] * given[j][q];
                    for (int q = 0; q < wide; q++) to[q] += sum[q];
                }
            }
        }
    }
    return 0;
}

/* Offsets of columns in the rows of a compressed sparse row matrix with sorted indices: for each of `cells` cells and
   each of `kinds` rows, of which -1 is none, of `size` columns, of which -1 is none.  */
PUBLIC void offsets(int cells, int kinds, int size, const int *rows, const int *columns, const int *starts,
                    const int *indices, int *out)
{
    for (int cell = 0; cell < cells; cell++)
        for (int kind = 0; kind < kinds; kind++, rows++)
            for (int j = 0; j < size; j++, out++) {
                int wanted = columns[(size_t)cell * size + j];
                *out = -1;
                if (*rows < 0 || wanted < 0) continue;
                int low = starts[*rows], high = starts[*rows + 1];
                while (low < high) {
                    int middle = low + (high - low) / 2;
                    if (indices[middle] < wanted) low = middle + 1; else high = middle;
                }
                if (low < starts[*rows + 1] && indices[low] == wanted) *out = low - starts[*rows];
            }
}
