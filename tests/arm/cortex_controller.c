/*
 * A controller at 1 kHz: torque on the column of the rigid manipulator by its angle and rate, computed with
 * floats, and the manipulator itself by steps of rk4. Prints the state after each 0.1 s as the bits of its
 * floats, and on a microcontroller (PAINTED) the bytes of stack that a call used.
 */
#include "manipulator_step.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { N = manipulator_n, CYCLES = 500, PRINTED = 100 };

#ifdef PAINTED
enum { AREA = 16384, COLOUR = 0xA5 };

/* The stack below the frame of the caller. It is painted before a call, which leaves the colour where it uses
 * no stack. */
static unsigned char *area_below(void) {
    return (unsigned char *)__builtin_frame_address(0) - AREA - 256;
}

static int measure(const struct manipulator_parameters *p, const struct manipulator_inputs *x,
                   const float *state, float *next, float *work) {
    unsigned char *const area = area_below();
    int left = 0;
    for (volatile unsigned char *c = area; c < area + AREA; c++)
        *c = COLOUR;
    manipulator_step_rk4_state(p, x, 0.0f, 1e-3f, 1, state, state + N, next, work);
    while (left < AREA && area[left] == COLOUR)
        left++;
    return AREA + 256 - left;
}
#endif

static void print(const float *state) {
    for (int k = 0; k < 2 * N; k++) {
        uint32_t bits;
        memcpy(&bits, &state[k], sizeof bits);
        printf("%08lx%c", (unsigned long)bits, k < 2 * N - 1 ? ' ' : '\n');
    }
}

int main(void) {
    static float state[2 * N], work[manipulator_step_rk4_work];
    struct manipulator_parameters p;
    struct manipulator_inputs x = {0.0f};
    manipulator_defaults(&p);
    state[1] = 0.1f;
    state[2] = 0.7853982f;
    for (int i = 1; i <= CYCLES; i++) {
        const float *q = state, *qd = state + N;
        x.tau = 5.0f * (0.4f - q[manipulator_COORDINATE_column_psi]) -
                2.0f * qd[manipulator_COORDINATE_column_psi];
        float next[2 * N];
        if (manipulator_step_rk4_state(&p, &x, 1e-3f * (float)(i - 1), 1e-3f, 1, q, qd, next, work))
            return 3;
        memcpy(state, next, sizeof state);
        if (i % PRINTED == 0)
            print(state);
    }
#ifdef PAINTED
    float next[2 * N];
    printf("stack %d\n", measure(&p, &x, state, next, work));
#endif
    return 0;
}
