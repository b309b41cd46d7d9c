/* What is asked of a tree of XML elements: see xml.h. */
#include "runtime/tool/support/xml/xml.h"

#include <stddef.h>
#include <string.h>

const char *xml_attribute(const struct xml_element *element, const char *name) {
    for (const struct xml_attribute *at = element->attributes; at->name; at++)
        if (strcmp(at->name, name) == 0)
            return at->value;
    return NULL;
}

const struct xml_element *xml_child(const struct xml_element *element, const char *name) {
    const struct xml_element *child = element->first;
    while (child && strcmp(child->name, name) != 0)
        child = child->next;
    return child;
}

const struct xml_element *xml_behind(const struct xml_element *at, const struct xml_element *root) {
    while (at != root && !at->next)
        at = at->parent;
    return at == root ? NULL : at->next;
}

const struct xml_element *xml_next(const struct xml_element *at, const struct xml_element *root) {
    return at->first ? at->first : xml_behind(at, root);
}

int xml_count(const struct xml_element *root, const char *name) {
    int count = 0;
    for (const struct xml_element *at = root; at; at = xml_next(at, root))
        count += strcmp(at->name, name) == 0;
    return count;
}
