/* Model Exchange: the importer integrates, this finds and takes what happens in event mode. */
#ifndef REFDYN_FMI_MODEL_EXCHANGE_H
#define REFDYN_FMI_MODEL_EXCHANGE_H

#include "fmi/instance.h"

struct fmu_event_update {
    int ends;           /* an event of the model ends the motion */
    int changes_states; /* q, qd are other ones */
    double t_next;      /* of the next time event; INFINITY: none is known [s] */
};

enum fmu_status fmu_set_time(struct fmu_instance *instance, double t);
/* state (2 n) */
enum fmu_status fmu_set_states(struct fmu_instance *instance, const double *state);
enum fmu_status fmu_get_derivatives(struct fmu_instance *instance, double *derivatives);
/* indicators (fmu_count_indicators) */
enum fmu_status fmu_get_indicators(struct fmu_instance *instance, double *indicators);
/* Everything that happens at the present time and state. */
enum fmu_status fmu_update_events(struct fmu_instance *instance, struct fmu_event_update *update);
/* After a step of the importer. 1: the importer has passed an event without seeing it, and must enter event
 * mode. Importers do not see a value that leaves zero and comes back within one step. */
int fmu_complete_step(struct fmu_instance *instance);

#endif
