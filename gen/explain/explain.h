/*
 * What the generator holds after a pass, as text for people who change the generator.
 *
 * Two of these texts show what the passes between them did. With `--emit M`, those of `derive` and `sums` are
 * the expressions of M before and after summands are ordered, and that of `plan` is the code made of them.
 */
#ifndef REFDYN_GEN_EXPLAIN_H
#define REFDYN_GEN_EXPLAIN_H

#include "gen/base/base.h"
#include "gen/gen.h"

/* Frames after `expand`; frames and runs after `roll`. */
void explain_tree(const struct generation *gen, struct text *text);
void explain_rolled_tree(const struct generation *gen, struct text *text);
/* For each function: the number of nodes by operation, its expressions and its results, after `derive` or
 * `sums`. */
void explain_graph(const struct generation *gen, struct text *text);
/* For each function: blocks, statements and results in the order of execution, after `plan`. */
void explain_plan(const struct generation *gen, struct text *text);

#endif
