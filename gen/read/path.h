/*
 * A smooth path through points in space, as functions of the length along it.
 *
 * Takes points, gives knots s and samples of x, y, z at them for splines: natural cubic splines through the
 * points by arc length, found by iteration from the chords and sampled more finely, so that a step in s is a
 * step along the path.
 */
#ifndef REFDYN_GEN_PATH_H
#define REFDYN_GEN_PATH_H

struct memory;

struct path {
    int count;
    double *length;        /* knots, from 0 [m] */
    double *coordinate[3]; /* at the knots [m] */
};

/* Coordinates of `count` points, no two neighbours alike; count >= 2. */
struct path path_through(struct memory *memory, const double *const points[3], int count);

#endif
