/* Files as one ZIP archive, the same byte for byte for the same files. */
#ifndef REFDYN_TOOL_ARCHIVE_H
#define REFDYN_TOOL_ARCHIVE_H

#include "export/fmu.h"

/* Is this refdyn built with what archives need? Complains on stderr when it is not. */
bool archive_is_there(void);
/* Complains on stderr when it fails. */
bool archive_put(FILE *out, const struct fmu_files *files);

#endif
