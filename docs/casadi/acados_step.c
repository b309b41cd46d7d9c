/*
 * The emitted step of the arm as discrete dynamics of acados, in the form of its generic external functions
 * (its example generic_dyn_disc): in[0] the state, in[1] the inputs; out[0] the next state, out[1] its
 * derivatives, transposed, by the inputs and below them by the state. Emitted with --fold, so that the arm
 * has no parameters. SPACING is the time between two nodes [s].
 */
#include "acados/utils/external_function_generic.h"
#include "blasfeo_d_aux.h"

#include "arm.c"
#include "arm_step.c"

#ifndef SPACING
#define SPACING 0.02
#endif
_Static_assert(arm_parameter_count == 0, "arm.lua is to be emitted with --fold");
enum { STATES = 2 * arm_n, INPUTS = arm_input_count };

static int step(void **in, void **out, struct arm_step_derivatives *derivatives) {
    const struct blasfeo_dvec_args *x = (struct blasfeo_dvec_args *)in[0],
                                   *u = (struct blasfeo_dvec_args *)in[1];
    const struct blasfeo_dvec_args *next = (struct blasfeo_dvec_args *)out[0];
    double state[STATES], inputs[INPUTS], after[STATES], work[arm_step_gauss_derivatives_work];
    for (int i = 0; i < STATES; i++)
        state[i] = BLASFEO_DVECEL(x->x, x->xi + i);
    for (int i = 0; i < INPUTS; i++)
        inputs[i] = BLASFEO_DVECEL(u->x, u->xi + i);
    const int failed = arm_step_gauss(0, (const struct arm_inputs *)(const void *)inputs, 0.0, SPACING, 1,
                                      state, state + arm_n, after, derivatives, work);
    for (int i = 0; i < STATES; i++)
        BLASFEO_DVECEL(next->x, next->xi + i) = after[i];
    return failed;
}

int arm_disc_dyn_fun(void **in, void **out, void *parameters) {
    (void)parameters;
    return step(in, out, 0);
}

int arm_disc_dyn_fun_jac(void **in, void **out, void *parameters) {
    struct arm_step_derivatives d;
    const struct blasfeo_dmat_args *jac = (struct blasfeo_dmat_args *)out[1];
    const int failed = step(in, out, &d);
    (void)parameters;
    /* rows of ours are columns of BLASFEO's: both are transposed by being read so */
    blasfeo_pack_dmat(INPUTS, STATES, d.x, INPUTS, jac->A, jac->ai, jac->aj);
    blasfeo_pack_dmat(STATES, STATES, d.state, STATES, jac->A, jac->ai + INPUTS, jac->aj);
    return failed;
}
