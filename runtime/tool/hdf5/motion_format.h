/*
 * Names that who writes and who reads a file of one motion agree on.
 */
#ifndef REFDYN_TOOL_MOTION_FORMAT_H
#define REFDYN_TOOL_MOTION_FORMAT_H

#define MOTION_CONTENT "refdyn motion"
#define MOTION_COLUMNS "columns" /* of each dataset, by number */

enum { MOTION_VERSION = 1 };

#endif
