/* What docs/casadi/acados_step.c uses of acados: where vectors and matrices begin in those of BLASFEO. */
#include "../../blasfeo_d_aux.h"
struct blasfeo_dvec_args {
    struct blasfeo_dvec *x;
    int xi;
};
struct blasfeo_dmat_args {
    struct blasfeo_dmat *A;
    int ai, aj;
};
