/* Lines that bend: their moments in the vertices between cells. */

#include "core.h"

#include <math.h>

/* |t x m| in vertices, t there as the equation of m has it on one of the two cells: with it the moments on every part of
 * the line balance.  |m| itself is of lower order from degree 3 on. */
void size_moments(const void *context)
{
    const vertices *V = context;
    const int nodes = V->m.nodes;
    for (int cell = 0; cell < V->m.cells; ++cell) {
        const int vertex = V->vertex[cell];
        double t[3] = {0, 0, 0}, m[3], slope[3];
        for (int point = 0; point < V->m.points; ++point) {
            value_at(&V->m, V->u, cell, point, m);
            value_at(&V->slope, V->u, cell, point, slope);
            const double bend = V->weights[point] * V->size_per_EI[cell] * V->m.basis[point * nodes + vertex];
            const double turn = V->weights[point] * V->slope.basis[point * nodes + vertex] / sqrt(dot(slope, slope));
            for (int i = 0; i < 3; ++i)
                t[i] += bend * m[i] + turn * slope[i];
        }
        for (int i = 0; i < 3; ++i)
            m[i] = V->u[V->m.dofs[3 * (cell * nodes + vertex) + i]];
        const double M[3] = {t[1] * m[2] - t[2] * m[1], t[2] * m[0] - t[0] * m[2], t[0] * m[1] - t[1] * m[0]};
        V->sizes[V->row[cell]] = sqrt(dot(M, M));
    }
}
