/*
 * The shortest vector under one-sided conditions: the optimality conditions of Karush, Kuhn and Tucker for
 * random problems with dependent normals, and problems without a solution.
 */
#include "check.h"
#include "runtime/core/constraints/constraints.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { N_MOST = 7, COUNT_MOST = 9, PROBLEMS = 4000, ROOM = 2000 };

static double memory[ROOM];
static uint64_t state = 88172645463325252u;

/* Between -1 and 1 (Marsaglia's xorshift). */
static double random_number(void) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (double)(state >> 11) * 0x1p-52 - 1;
}

static struct refdyn_one_sided new_problem(int count, int n) {
    struct refdyn_one_sided problem;
    struct layout layout = {(char *)memory, 0};
    refdyn_one_sided_lay_out(&problem, count, n, &layout);
    for (int i = 0; i < count; i++) {
        problem.takes_part[i] = 1;
        problem.slack[i] = 1e-12;
    }
    return problem;
}

/* Some normals are sums of others; one point satisfies all conditions. */
static void fill(struct refdyn_one_sided *problem) {
    const int n = problem->n, count = problem->count;
    double point[N_MOST];
    for (int j = 0; j < n; j++)
        point[j] = 3 * random_number();
    for (int i = 0; i < count; i++) {
        double at_point = 0;
        for (int j = 0; j < n; j++) {
            double *normal = problem->normals + i * n;
            normal[j] = i % 3 == 2 ? normal[j - n] + 0.7 * normal[j - 2 * n] : random_number();
            at_point += normal[j] * point[j];
        }
        problem->bounds[i] = at_point - fabs(random_number()) * (i % 2);
    }
}

static double dot(const double *a, const double *b, int n) {
    double sum = 0;
    for (int j = 0; j < n; j++)
        sum += a[j] * b[j];
    return sum;
}

/* x = N^T p, p >= 0, N x >= b, p (N x - b) = 0 */
static void check_optimal(const struct refdyn_one_sided *problem) {
    const int n = problem->n;
    double rest[N_MOST];
    memcpy(rest, problem->x, (size_t)n * sizeof *rest);
    for (int i = 0; i < problem->count; i++) {
        const double *normal = problem->normals + i * n, p = problem->multipliers[i];
        const double over = dot(normal, problem->x, n) - problem->bounds[i];
        CHECK(p >= 0 && over > -1e-9 && fabs(p * over) < 1e-7 * (1 + p));
        for (int j = 0; j < n; j++)
            rest[j] -= p * normal[j];
    }
    CHECK(sqrt(dot(rest, rest, n)) < 1e-7 * (1 + sqrt(dot(problem->x, problem->x, n))));
}

static void test_random_problems(void) {
    for (int k = 0; k < PROBLEMS; k++) {
        struct refdyn_one_sided problem = new_problem(1 + k % COUNT_MOST, 1 + k / COUNT_MOST % N_MOST);
        fill(&problem);
        CHECK(refdyn_one_sided_solve(&problem));
        check_optimal(&problem);
    }
}

/* x >= 1 and -x >= 1; and a normal of zeros with a positive bound. */
static void test_nothing_meets_all(void) {
    struct refdyn_one_sided problem = new_problem(2, 1);
    problem.normals[0] = problem.bounds[0] = problem.bounds[1] = 1;
    problem.normals[1] = -1;
    CHECK(!refdyn_one_sided_solve(&problem));
    problem.normals[1] = 0;
    CHECK(!refdyn_one_sided_solve(&problem));
    problem.takes_part[1] = 0;
    CHECK(refdyn_one_sided_solve(&problem) && fabs(problem.x[0] - 1) < 1e-15);
}

static void test_equalities(void) {
    struct refdyn_one_sided problem = new_problem(3, 4);
    fill(&problem);
    for (int j = 0; j < 4; j++) /* the third is the sum of the first two */
        problem.normals[8 + j] = problem.normals[j] + problem.normals[4 + j];
    problem.bounds[2] = problem.bounds[0] + problem.bounds[1];
    CHECK(refdyn_one_sided_meet(&problem) == 2);
    for (int i = 0; i < 3; i++)
        CHECK(fabs(dot(problem.normals + 4 * i, problem.x, 4) - problem.bounds[i]) < 1e-12);
}

int main(void) {
    test_random_problems();
    test_nothing_meets_all();
    test_equalities();
    return check_summary();
}
