/* The slope r' = R v of the centreline at the Gauss points of each cell, and the least stretch: rodfem/fem/shape.py.

   Rotations are by quaternions of any length, R = (Euler-Rodrigues) / |q|^2, or by one angle about e1 or e2.  Held strains
   have the values of the undeformed rod.  */

#include <math.h>

#define PUBLIC static /* called from Python */

typedef struct {
    int cells, points, nodes, strain_nodes; /* points of the Gauss rule; nodes of the rotation, and of the strains */
    int normal;                 /* of the plane of an angle, 0 or 1; -1: quaternions */
    int strains;                /* number of strains that are unknown */
    const int *component;       /* which of v1, v2, v3 they are */
    const double *held;         /* 3: values of the others */
    const int *rotation;        /* cells x nodes x 4 or 1: local degrees of freedom */
    const int *strain;          /* cells x strain_nodes x strains */
    const double *basis, *strain_basis; /* points x nodes, points x strain_nodes */
    int samples;                /* places in a cell where the stretch is evaluated */
    const double *sample_basis; /* samples x strain_nodes */
} Shape;

static void turned(const double *q, const double *v, double *out)
{
    double a = q[0], x = q[1], y = q[2], z = q[3], size = a * a + x * x + y * y + z * z;
    out[0] = ((a * a + x * x - y * y - z * z) * v[0] + 2 * (x * y - a * z) * v[1] + 2 * (x * z + a * y) * v[2]) / size;
    out[1] = (2 * (x * y + a * z) * v[0] + (a * a - x * x + y * y - z * z) * v[1] + 2 * (y * z - a * x) * v[2]) / size;
    out[2] = (2 * (x * z - a * y) * v[0] + 2 * (y * z + a * x) * v[1] + (a * a - x * x - y * y + z * z) * v[2]) / size;
}

/* Slopes (cells, points, 3) of the local values u. */
PUBLIC void slopes(const Shape *shape, const double *u, double *out)
{
    int size = shape->normal < 0 ? 4 : 1;
    for (int cell = 0; cell < shape->cells; cell++) {
        const int *rotation = shape->rotation + (long)cell * shape->nodes * size;
        const int *strain = shape->strain + (long)cell * shape->strain_nodes * shape->strains;
        for (int g = 0; g < shape->points; g++, out += 3) {
            double q[4] = {0, 0, 0, 0}, v[3] = {shape->held[0], shape->held[1], shape->held[2]};
            for (int i = 0; i < shape->nodes; i++)
                for (int k = 0; k < size; k++) q[k] += shape->basis[g * shape->nodes + i] * u[rotation[i * size + k]];
            if (shape->normal >= 0) {
                double half = q[0] / 2;
                q[0] = cos(half);
                q[shape->normal + 1] = sin(half);
            }
            for (int i = 0; i < shape->strain_nodes; i++)
                for (int k = 0; k < shape->strains; k++)
                    v[shape->component[k]] += shape->strain_basis[g * shape->strain_nodes + i] * u[strain[i * shape->strains + k]];
            turned(q, v, out);
        }
    }
}

/* Least value of the last strain at the samples of all cells; place: its cell, and the sample there. */
PUBLIC double least(const Shape *shape, const double *u, int *place)
{
    double least = INFINITY;
    for (int cell = 0; cell < shape->cells; cell++) {
        const int *strain = shape->strain + (long)cell * shape->strain_nodes * shape->strains + shape->strains - 1;
        for (int sample = 0; sample < shape->samples; sample++) {
            double value = 0;
            for (int i = 0; i < shape->strain_nodes; i++)
                value += shape->sample_basis[sample * shape->strain_nodes + i] * u[strain[i * shape->strains]];
            if (value >= least) continue;
            least = value;
            place[0] = cell;
            place[1] = sample;
        }
    }
    return least;
}
