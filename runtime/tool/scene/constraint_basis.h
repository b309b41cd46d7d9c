/*
 * What linear rows leave free.
 *
 * Takes rows R v + B x = 0 (count x n each); gives v = basis w + drift x, w the entries of v that stay
 * independent, by elimination with full pivoting. Coordinates that no row names keep to themselves, and so do
 * the digits of soft ones beside stiff ones, which an orthonormal basis would mix.
 */
#ifndef REFDYN_TOOL_CONSTRAINT_BASIS_H
#define REFDYN_TOOL_CONSTRAINT_BASIS_H

struct freedom {
    int n, rank, count;
    int *row;      /* (count) rows: the first `rank` are used, the others redundant */
    int *column;   /* (n) the first `rank` depend, in the order of elimination; then the independent ones,
                      ascending */
    double *basis; /* (n x (n - rank)) */
    double *drift; /* (n x n) */
};

/* B may be NULL: none. */
void find_freedom(struct freedom *freedom, const double *R, const double *B, int count, int n);

#endif
