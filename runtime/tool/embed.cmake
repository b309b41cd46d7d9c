# Writes the text of INPUT as a C array NAME, with its length NAME_size, into OUTPUT.
cmake_minimum_required(VERSION 3.25)
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
string(REGEX REPLACE "(................................................................................)" "\\1\n" bytes "${bytes}")
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT "/* The text of a file, for printing and compiling. */
#include <stddef.h>

extern const char @NAME@[];
extern const size_t @NAME@_size;

const char @NAME@[] = {
@bytes@0};
const size_t @NAME@_size = sizeof @NAME@ - 1;
")
