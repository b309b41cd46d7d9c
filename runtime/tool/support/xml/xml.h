/*
 * An XML file as a tree of elements with their attributes and lines. Text between elements is passed over.
 *
 * Files with a document type are refused, so that no entity of theirs is ever read, inside the file or from
 * outside; so are files that are larger or deeper than any robot's. Complaints go to stderr as
 * FILE:LINE: WHAT: fact, what is needed.
 */
#ifndef REFDYN_TOOL_XML_H
#define REFDYN_TOOL_XML_H

struct xml_attribute {
    const char *name, *value; /* UTF-8; prefixes of name spaces are part of the name */
};

struct xml_element {
    const char *name;
    int line;
    struct xml_attribute *attributes; /* the last one has the name NULL */
    struct xml_element *parent, *first, *last, *next;
};

/* The outermost element, NULL with a complaint. It lives until the program's end. */
struct xml_element *xml_read(const char *path);

/* The value of an attribute; NULL: not there. */
const char *xml_attribute(const struct xml_element *element, const char *name);
/* The first child of that name; NULL: none. */
const struct xml_element *xml_child(const struct xml_element *element, const char *name);
/* How many elements of that name there are in `root`, itself included. */
int xml_count(const struct xml_element *root, const char *name);
/* The element behind `at` on a way through all that is in `root`, in the order of the file; NULL: it ends. */
const struct xml_element *xml_next(const struct xml_element *at, const struct xml_element *root);
/* The same, but not into `at`. */
const struct xml_element *xml_behind(const struct xml_element *at, const struct xml_element *root);

#endif
