/*
 * The part of BLASFEO that docs/casadi/acados_step.c uses, with column-major matrices like its reference
 * implementation.
 */
#ifndef BLASFEO_D_AUX_H
#define BLASFEO_D_AUX_H
struct blasfeo_dvec {
    double *pa;
};
struct blasfeo_dmat {
    double *pA;
    int m;
};
#define BLASFEO_DVECEL(sx, xi) ((sx)->pa[xi])

static inline void blasfeo_pack_dmat(int m, int n, double *A, int lda, struct blasfeo_dmat *sB, int bi,
                                     int bj) {
    for (int j = 0; j < n; j++)
        for (int i = 0; i < m; i++)
            sB->pA[bi + i + (bj + j) * sB->m] = A[i + j * lda];
}
#endif
