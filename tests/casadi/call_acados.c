/*
 * Calls docs/casadi/acados_step.c like acados: state and inputs in one vector, inputs first. Prints the next
 * state, then the derivatives, one column of BLASFEO's matrix a line.
 */
#include "acados_step.c"

#include <stdio.h>
#include <stdlib.h>

int main(int count, char **words) {
    double ux[INPUTS + STATES], next[STATES], entries[STATES * (INPUTS + STATES)];
    struct blasfeo_dvec vector = {ux}, result = {next};
    struct blasfeo_dmat matrix = {entries, INPUTS + STATES};
    struct blasfeo_dvec_args x = {&vector, INPUTS}, u = {&vector, 0}, fun = {&result, 0};
    struct blasfeo_dmat_args jac = {&matrix, 0, 0};
    void *in[] = {&x, &u}, *out[] = {&fun, &jac};
    for (int i = 0; i < INPUTS + STATES && i + 1 < count; i++)
        ux[i] = atof(words[i + 1]);
    if (arm_disc_dyn_fun_jac(in, out, 0))
        return 1;
    for (int i = 0; i < STATES; i++)
        printf("%.17g ", next[i]);
    for (int i = 0; i < STATES; i++) {
        printf("\n");
        for (int j = 0; j < INPUTS + STATES; j++)
            printf("%.17g ", entries[i * (INPUTS + STATES) + j]);
    }
    return arm_disc_dyn_fun(in, out, 0);
}
