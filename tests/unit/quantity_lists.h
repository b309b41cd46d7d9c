/*
 * All emitted quantities by name, with the length of their results. `n`, `m`, `points`, `variables` and
 * `model` are variables of the including file.
 */
#ifndef REFDYN_TESTS_UNIT_QUANTITIES_H
#define REFDYN_TESTS_UNIT_QUANTITIES_H

#define QUANTITIES(ENTRY)                                                         \
    ENTRY(start, 2 * n)                                                           \
    ENTRY(M, n *n)                                                                \
    ENTRY(h, n)                                                                   \
    ENTRY(Q, n)                                                                   \
    ENTRY(u, m *n)                                                                \
    ENTRY(v, m)                                                                   \
    ENTRY(phi, m)                                                                 \
    ENTRY(psi, m)                                                                 \
    ENTRY(k, m)                                                                   \
    ENTRY(r, 3 * points)                                                          \
    ENTRY(rd, 3 * points)                                                         \
    ENTRY(C, 3 * points * n)                                                      \
    ENTRY(d, 3 * points)                                                          \
    ENTRY(energy, 2)                                                              \
    ENTRY(power, 1)                                                               \
    ENTRY(Q_q, n *n)                                                              \
    ENTRY(qdd_free, n)                                                            \
    ENTRY(qdd, n)                                                                 \
    ENTRY(force, n)                                                               \
    ENTRY(inverse, n)                                                             \
    ENTRY(equations, n *n + n + m * n + 4 * m)                                    \
    ENTRY(constrained, n + 1 + m)                                                 \
    ENTRY(accelerations, 2 * n + 1 + m)                                           \
    ENTRY(row_terms, m *(n + 4))                                                  \
    ENTRY(point_terms, 3 * points * (n + 3))                                      \
    ENTRY(terms, m *(n + 4) + 3 * points * (n + 3))                               \
    ENTRY(tangent, 3 * n * n + n + 3 * m * n + m)                                 \
    ENTRY(tangent_vectors, n + m * (1 + 3 * n) + refdyn_chain_result_size(model)) \
    ENTRY(d_qdd, n *variables)                                                    \
    ENTRY(d_qdd_free, n *variables)                                               \
    ENTRY(d_force, n *variables)                                                  \
    ENTRY(d_inverse, n *(variables + n))                                          \
    ENTRY(d_statics, n *(variables - n))                                          \
    ENTRY(d_rows, m *(3 * variables - n))

#endif
