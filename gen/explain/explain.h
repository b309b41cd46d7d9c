/*
 * A pass at work, for people who change the generator: what the generator holds behind it, as text.
 *
 * Two of these texts beside each other show what the passes between them did: with `--emit M`, those of
 * `derive` and `sums` are the expressions of M before and after the order of summands was found, and that of
 * `plan` is the code that is made of them.
 */
#ifndef REFDYN_GEN_EXPLAIN_H
#define REFDYN_GEN_EXPLAIN_H

#include "gen/base/base.h"
#include "gen/gen.h"

/* Frames, behind `expand`, and runs, behind `roll`. */
void explain_tree(const struct generation *gen, struct text *text);
void explain_rolled_tree(const struct generation *gen, struct text *text);
/* Of each function the number of nodes by operation, its expressions and its results, behind `derive` and
 * `sums`. */
void explain_graph(const struct generation *gen, struct text *text);
/* Of each function blocks, statements and results in the order of execution, behind `plan`. */
void explain_plan(const struct generation *gen, struct text *text);

#endif
