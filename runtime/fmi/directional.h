/* Directional derivatives of accelerations and outputs by states and inputs. */
#ifndef REFDYN_FMI_DIRECTIONAL_H
#define REFDYN_FMI_DIRECTIONAL_H

#include "fmi/instance.h"

/* sensitivity (unknown_count) = d unknowns / d knowns seed (known_count), at the present state. */
enum fmu_status fmu_directional(struct fmu_instance *instance, const unsigned *unknowns, size_t unknown_count,
                                const unsigned *knowns, size_t known_count, const double *seed,
                                double *sensitivity);

/* sensitivity (known_count) = seed (unknown_count) d unknowns / d knowns. */
enum fmu_status fmu_adjoint(struct fmu_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity);

#endif
