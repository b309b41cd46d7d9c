/*
 * What the libraries show: the functions of the public headers. The build includes this before each file of
 * the runtime, and hides all other names (-fvisibility=hidden) from who links a library of which the runtime
 * is a part.
 */
#ifndef REFDYN_PUBLIC_NAMES_H
#define REFDYN_PUBLIC_NAMES_H

#pragma GCC visibility push(default)
#include "refdyn.h"
#include "refdyn_batch.h"
#pragma GCC visibility pop

#endif
