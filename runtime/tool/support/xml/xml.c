/*
 * Reads XML with expat. The file goes through the parser in pieces, whose handlers grow the tree. Text
 * between elements is skipped. A program that was built without expat reports that instead.
 *
 * Files with a document type are refused, so that no entity is ever read, inside the file or from outside.
 * Files that are larger or deeper than any robot's are refused, too.
 */
#include "runtime/tool/support/xml/xml.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#ifdef REFDYN_HAS_EXPAT
#include <expat.h>

enum { BYTES_MOST = 16 << 20, DEPTH_MOST = 100, COUNT_MOST = 200000, PIECE = 1 << 16 };

struct reading {
    const char *path;
    XML_Parser parser;
    struct xml_element *root, *open; /* the innermost open element */
    int depth, count;
    bool is_refused; /* for a reason that was reported */
};

static void refuse(struct reading *reading, const char *fact) {
    reading->is_refused = true;
    format_complain_line(reading->path, (long)XML_GetCurrentLineNumber(reading->parser), fact);
    XML_StopParser(reading->parser, XML_FALSE);
}

static struct xml_attribute *keep_attributes(const char **list) {
    int count = 0;
    while (list[2 * count])
        count++;
    struct xml_attribute *kept = format_allocate((size_t)count + 1, sizeof *kept);
    for (int i = 0; i < count; i++)
        kept[i] = (struct xml_attribute){memory_text(&format_memory, list[2 * i]),
                                         memory_text(&format_memory, list[2 * i + 1])};
    return kept;
}

static void XMLCALL begin_element(void *context, const char *name, const char **attributes) {
    struct reading *reading = context;
    if (reading->is_refused)
        return;
    if (reading->depth == DEPTH_MOST) {
        refuse(reading, format_text("XML: elements are nested more than %d deep", DEPTH_MOST));
        return;
    }
    if (++reading->count > COUNT_MOST) {
        refuse(reading, format_text("XML: more than %d elements", COUNT_MOST));
        return;
    }
    struct xml_element *element = format_allocate(1, sizeof *element), *parent = reading->open;
    *element = (struct xml_element){.name = memory_text(&format_memory, name),
                                    .line = (int)XML_GetCurrentLineNumber(reading->parser),
                                    .attributes = keep_attributes(attributes),
                                    .parent = parent};
    if (!parent)
        reading->root = element;
    else if (parent->last)
        parent->last->next = element;
    else
        parent->first = element;
    if (parent)
        parent->last = element;
    reading->open = element;
    reading->depth++;
}

static void XMLCALL end_element(void *context, const char *name) {
    struct reading *reading = context;
    (void)name;
    if (reading->is_refused)
        return;
    reading->open = reading->open->parent;
    reading->depth--;
}

static void XMLCALL refuse_document_type(void *context, const char *name, const char *system,
                                         const char *public, int has_subset) {
    (void)name, (void)system, (void)public, (void)has_subset;
    refuse(context, "XML: a document type, which may define entities; remove it");
}

static bool complain_of_syntax(const struct reading *reading) {
    if (!reading->is_refused)
        format_complain_line(reading->path, (long)XML_GetCurrentLineNumber(reading->parser),
                             format_text("XML: %s; must be a well-formed file",
                                         XML_ErrorString(XML_GetErrorCode(reading->parser))));
    return false;
}

static bool complain_of_file(const char *path, const char *fault) {
    format_complain_line(path, 0, format_text("URDF: %s; must be a readable file", fault));
    return false;
}

static bool read_pieces(struct reading *reading, FILE *file) {
    static const char too_large[] = "URDF: larger than %d bytes, the most that is read";
    char piece[PIECE];
    size_t length, total = 0;
    do {
        length = fread(piece, 1, sizeof piece, file);
        if (ferror(file))
            return complain_of_file(reading->path, strerror(errno));
        total += length;
        if (total > BYTES_MOST) {
            format_complain_line(reading->path, 0, format_text(too_large, BYTES_MOST));
            return false;
        }
        if (XML_Parse(reading->parser, piece, (int)length, length == 0) != XML_STATUS_OK)
            return complain_of_syntax(reading);
    } while (length > 0);
    return true;
}

struct xml_element *xml_read(const char *path) {
    const char *fault;
    FILE *file = format_open_input(path, &fault);
    if (!file) {
        complain_of_file(path, fault);
        return NULL;
    }
    struct reading reading = {.path = path, .parser = XML_ParserCreate(NULL)};
    if (!reading.parser)
        format_memory.fail(format_memory.context);
    XML_SetUserData(reading.parser, &reading);
    XML_SetElementHandler(reading.parser, begin_element, end_element);
    XML_SetStartDoctypeDeclHandler(reading.parser, refuse_document_type);
    const bool is_read = read_pieces(&reading, file);
    XML_ParserFree(reading.parser);
    fclose(file);
    return is_read ? reading.root : NULL;
}

#else

struct xml_element *xml_read(const char *path) {
    format_complain_line(path, 0, "this refdyn is built without expat, which reads XML");
    return NULL;
}

#endif

/* ---- Elements of a tree ---- */

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
