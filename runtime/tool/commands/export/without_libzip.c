/* What stands for archives in a refdyn that was built without libzip: a complaint. */
#include "runtime/tool/commands/export/export.h"

bool archive_is_there(void) {
    fputs("refdyn: this refdyn is built without libzip, which FMUs need\n", stderr);
    return false;
}

/* Is not called then. */
bool archive_put(FILE *out, const struct fmu_files *files) {
    return out && files && false;
}
