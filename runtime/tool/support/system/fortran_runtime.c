/*
 * The functions of gfortran's runtime library that LAPACK calls, for a program that contains LAPACK
 * (runtime/archives.cmake). The library itself would add its input and output, and libquadmath, which is
 * under the LGPL.
 */
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void _gfortran_concat_string(size_t size, char *to, size_t first_size, const char *first, size_t second_size,
                             const char *second);
void xerbla_(const char *name, const int *argument, size_t name_size);

/* Joins two texts; blanks fill the rest of `to`. */
void _gfortran_concat_string(size_t size, char *to, size_t first_size, const char *first, size_t second_size,
                             const char *second) {
    const size_t begin = first_size < size ? first_size : size;
    const size_t added = second_size < size - begin ? second_size : size - begin;
    memcpy(to, first, begin);
    memcpy(to + begin, second, added);
    memset(to + begin + added, ' ', size - begin - added);
}

/* LAPACK calls it for a wrong argument, which is an error in this program. */
void xerbla_(const char *name, const int *argument, size_t name_size) {
    fprintf(stderr, "refdyn: LAPACK: %.*s: argument %d is wrong\n", (int)name_size, name, *argument);
    abort();
}
