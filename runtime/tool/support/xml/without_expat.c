/* What stands for the reading of XML in a refdyn that was built without expat: a complaint. */
#include "runtime/tool/support/xml/xml.h"
#include "runtime/tool/support/format/format.h"

#include <stddef.h>

struct xml_element *xml_read(const char *path) {
    complain_line(path, 0, "this refdyn is built without expat, which reads XML");
    return NULL;
}
