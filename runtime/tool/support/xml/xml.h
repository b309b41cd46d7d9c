/* Reads an XML file as a tree of elements with their attributes and lines. Errors go to stderr as FILE:LINE:
 * WHAT: fact; what to do. */
#ifndef REFDYN_TOOL_XML_H
#define REFDYN_TOOL_XML_H

struct xml_attribute {
    const char *name, *value; /* UTF-8; prefixes of name spaces are part of the name */
};

struct xml_element {
    const char *name;
    int line;
    struct xml_attribute *attributes; /* the name NULL at the end */
    struct xml_element *parent, *first, *last, *next;
};

/* Returns the outermost element, or NULL after a reported error. It lives until the program ends. */
struct xml_element *xml_read(const char *path);

/* The value of an attribute; NULL if it is missing. */
const char *xml_attribute(const struct xml_element *element, const char *name);
/* The first child of that name; NULL if there is none. */
const struct xml_element *xml_child(const struct xml_element *element, const char *name);
/* How many elements of that name `root` contains, itself included. */
int xml_count(const struct xml_element *root, const char *name);
/* The element after `at` among all elements in `root`, in the order of the file; NULL at the end. */
const struct xml_element *xml_next(const struct xml_element *at, const struct xml_element *root);
/* The same, without the elements inside `at`. */
const struct xml_element *xml_behind(const struct xml_element *at, const struct xml_element *root);

#endif
