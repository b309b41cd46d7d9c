/*
 * The chain of linearised intervals, dy_k+1 = Phi_k dy_k + gap_k, solved for the changes of all nodes.
 *
 * The interior nodes are eliminated one after the other by orthogonal factors of the columns that belong to
 * each (S. J. Wright, SIAM J. Sci. Stat. Comput. 13:742-764, 1992), which is stable although some modes grow
 * and others decay. What remains are 2 n equations between the first and the last node, and the rows of the
 * first node. They leave a freedom, which least squares of the distances of both ends from their wanted
 * states fixes: of the start, from which the forces are played back, with the greater weight.
 */
#include <lapacke.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"

static const double weight_of_start = 1e5;

/* R dy_k + first dy_0 + next dy_k+1 = side for an eliminated node; columns one after the other. */
struct eliminated {
    double *R, *first, *next, *side;
};

/* E dy_0 + F dy_k = g. */
struct relation {
    double *E, *F, *g;
};

static void put(double *to, int to_rows, int at_row, int at_column, const double *from, int rows,
                int columns) {
    for (int j = 0; j < columns; j++)
        for (int i = 0; i < rows; i++)
            to[(size_t)(at_column + j) * (size_t)to_rows + (size_t)(at_row + i)] =
                from[(size_t)j * (size_t)rows + (size_t)i];
}

static void take(double *to, const double *from, int from_rows, int at_row, int at_column, int rows,
                 int columns) {
    for (int j = 0; j < columns; j++)
        for (int i = 0; i < rows; i++)
            to[(size_t)j * (size_t)rows + (size_t)i] =
                from[(size_t)(at_column + j) * (size_t)from_rows + (size_t)(at_row + i)];
}

/* Phi and -gap of states that are divided by their scales. */
static void scaled(const struct realise_interval *interval, const double *scale, int size, double *Phi,
                   double *gap) {
    for (int i = 0; i < size; i++) {
        for (int j = 0; j < size; j++)
            Phi[j * size + i] = interval->Phi[j * size + i] * scale[j] / scale[i];
        gap[i] = -interval->gap[i] / scale[i];
    }
}

/* Eliminates node k, which the relation and the interval after it share; it then ends at the next node. */
static void eliminate(struct relation *relation, const double *Phi, const double *gap, int size,
                      struct eliminated *out) {
    const int rows = 2 * size, columns = 2 * size + 1;
    const struct memory_mark mark = memory_mark(&format_memory);
    double *A = realise_scratch(rows, size), *C = realise_scratch(rows, columns),
           *reflectors = realise_scratch(size, 1);
    put(A, rows, 0, 0, relation->F, size, size);
    put(A, rows, size, 0, Phi, size, size);
    put(C, rows, 0, 0, relation->E, size, size);
    for (int i = 0; i < size; i++)
        C[(size + i) * rows + size + i] = -1;
    put(C, rows, 0, 2 * size, relation->g, size, 1);
    put(C, rows, size, 2 * size, gap, size, 1);
    LAPACKE_dgeqrf(LAPACK_COL_MAJOR, rows, size, A, rows, reflectors);
    LAPACKE_dormqr(LAPACK_COL_MAJOR, 'L', 'T', rows, columns, size, A, rows, reflectors, C, rows);
    take(out->R, A, rows, 0, 0, size, size);
    take(out->first, C, rows, 0, 0, size, size);
    take(out->next, C, rows, 0, size, size, size);
    take(out->side, C, rows, 0, 2 * size, size, 1);
    take(relation->E, C, rows, size, 0, size, size);
    take(relation->F, C, rows, size, size, size, size);
    take(relation->g, C, rows, size, 2 * size, size, 1);
    memory_back(&format_memory, mark);
}

/* The changes of both ends: least squares under the equations of the relation and the rows of the first node.
 */
static bool close_chain(const struct relation *relation, const struct realise_ends *ends, int size,
                        double *both) {
    const int unknowns = 2 * size, equations = size + ends->count;
    double *A = realise_scratch(unknowns, unknowns), *b = realise_scratch(unknowns, 1),
           *B = realise_scratch(equations, unknowns), *d = realise_scratch(equations, 1);
    for (int i = 0; i < size; i++) {
        A[i * unknowns + i] = weight_of_start * ends->scale[i] / ends->unit[i];
        b[i] = weight_of_start * ends->first[i] / ends->unit[i];
        A[(size + i) * unknowns + size + i] = ends->scale[i] / ends->unit[i];
        b[size + i] = ends->last[i] / ends->unit[i];
    }
    put(B, equations, 0, 0, relation->E, size, size);
    put(B, equations, 0, size, relation->F, size, size);
    put(d, equations, 0, 0, relation->g, size, 1);
    for (int i = 0; i < ends->count; i++) {
        for (int j = 0; j < size; j++)
            B[j * equations + size + i] = ends->rows[j * ends->count + i] * ends->scale[j];
        d[size + i] = ends->sides[i];
    }
    return LAPACKE_dgglse(LAPACK_COL_MAJOR, unknowns, unknowns, equations, A, unknowns, B, equations, b, d,
                          both) == 0;
}

/* R x = side - first dy_0 - next dy_k+1 by back substitution. */
static void find_node(const struct eliminated *node, const double *first, const double *next, int size,
                      double *x) {
    for (int i = 0; i < size; i++) {
        x[i] = node->side[i];
        for (int j = 0; j < size; j++)
            x[i] -= node->first[j * size + i] * first[j] + node->next[j * size + i] * next[j];
    }
    for (int i = size - 1; i >= 0; i--) {
        for (int j = i + 1; j < size; j++)
            x[i] -= node->R[j * size + i] * x[j];
        x[i] /= node->R[i * size + i];
    }
}

bool realise_chain_solve(const struct realise_interval *intervals, int count, int n,
                         const struct realise_ends *ends, double *changes) {
    const int size = 2 * n;
    const struct memory_mark mark = memory_mark(&format_memory);
    struct eliminated *nodes = memory_scratch(&format_memory, (size_t)count * sizeof *nodes);
    struct relation relation = {realise_scratch(size, size), realise_scratch(size, size),
                                realise_scratch(size, 1)};
    double *Phi = realise_scratch(size, size), *gap = realise_scratch(size, 1),
           *both = realise_scratch(2, size);
    scaled(&intervals[0], ends->scale, size, relation.E, relation.g);
    for (int i = 0; i < size; i++)
        relation.F[i * size + i] = -1;
    for (int k = 1; k < count; k++) {
        nodes[k] = (struct eliminated){realise_scratch(size, size), realise_scratch(size, size),
                                       realise_scratch(size, size), realise_scratch(size, 1)};
        scaled(&intervals[k], ends->scale, size, Phi, gap);
        eliminate(&relation, Phi, gap, size, &nodes[k]);
    }
    const bool is_closed = close_chain(&relation, ends, size, both);
    memcpy(changes, both, (size_t)size * sizeof *both);
    memcpy(changes + (size_t)count * (size_t)size, both + size, (size_t)size * sizeof *both);
    for (int k = count - 1; k > 0; k--)
        find_node(&nodes[k], changes, changes + (size_t)(k + 1) * (size_t)size, size,
                  changes + (size_t)k * (size_t)size);
    for (int k = 0; k <= count; k++)
        for (int i = 0; i < size; i++)
            changes[(size_t)k * (size_t)size + (size_t)i] *= ends->scale[i];
    memory_back(&format_memory, mark);
    return is_closed;
}
