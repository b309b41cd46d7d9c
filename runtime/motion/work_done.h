/* Work of forces on a motion whose method does not integrate it. */
#ifndef REFDYN_WORK_DONE_H
#define REFDYN_WORK_DONE_H

#include "methods/step.h"

/* Work done at theta of the step that was taken, by quadrature. Errors: those of refdyn_rates. */
int refdyn_find_work_done(struct refdyn_step *step, double theta, double *work_done);

#endif
