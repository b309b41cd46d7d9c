/*
 * Where something stands in a JSON text: its line, counted from 1.
 */
#ifndef REFDYN_TOOL_LOCATE_H
#define REFDYN_TOOL_LOCATE_H

/*
 * Line of member `key` of the outermost object; with `member`, of that member of the object it holds; with
 * index >= 0, of that element of the array it holds. Line 1 when it is not there. `text` is correct JSON.
 */
int locate_line(const char *text, const char *key, const char *member, int index);

#endif
