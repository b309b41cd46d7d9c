"""The arm of two flexible links from rest to rest with the least effort, by two independent discretisations.

    refdyn gen docs/casadi/arm.lua --emit qdd,step --for-casadi -o arm
    cc -O2 -fPIC -shared -Iruntime arm/arm_casadi.c -o arm/libarm_casadi.so -lm
    python3 docs/casadi/rest_to_rest.py arm/libarm_casadi.so
"""
import sys

import casadi
import numpy

LIBRARY = sys.argv[1]
T, TURNS = 1.0, [1.0, -0.8]                              # [s], and how far the two joints turn [rad]
START = casadi.external("arm_defaults", LIBRARY)()      # q, qd, inputs and parameters of the model
N = START["q"].numel()
JOINTS = [0, N // 2]                                     # the elements of a link stand behind its joint


def goal():
    q = numpy.zeros(N)
    q[JOINTS] = TURNS
    return q


def twice_differentiable(name):
    """An emitted function, whose second derivatives are differences of its exact first ones."""
    function, jacobian = casadi.external(name, LIBRARY), casadi.external(f"jac_{name}", LIBRARY, {"enable_fd": True})
    arguments = function.mx_in()
    return casadi.Function(name, arguments, function.call(arguments), function.name_in(), function.name_out(),
                           {"custom_jacobian": jacobian, "jac_penalty": 0, "never_inline": True})


def solve(unknowns, guess, effort, conditions):
    """IPOPT, with exact first derivatives and differences of these as second ones."""
    options = {"ipopt.tol": 1e-7, "ipopt.max_iter": 300, "ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes"}
    problem = {"x": casadi.vertcat(*unknowns), "f": effort, "g": casadi.vertcat(*conditions)}
    solver = casadi.nlpsol("solver", "ipopt", problem, options)
    solution = solver(x0=numpy.concatenate(guess), lbg=0, ubg=0)
    assert solver.stats()["success"], solver.stats()["return_status"]
    return float(solution["f"])


def collocation(intervals, degree=3):
    """States are polynomials in each interval, which obey qdd at Gauss's points; inputs are free at these."""
    qdd = twice_differentiable("arm_qdd")
    h, points = T / intervals, casadi.collocation_points(degree, "legendre")
    C, D, B = casadi.collocation_coeff(points)           # slopes at the points, value at the end, weights
    unknowns, guess, conditions, effort = [], [], [], 0
    state = casadi.DM(casadi.vertcat(START["q"], START["qd"]))
    for i in range(intervals):
        stages, inputs = casadi.MX.sym("stages", 2 * N, degree), casadi.MX.sym("inputs", 2, degree)
        end = casadi.MX.sym("end", 2 * N)
        known = casadi.horzcat(state, stages)
        rates = [casadi.vertcat(stages[N:, k], qdd(stages[:N, k], stages[N:, k], h * (i + points[k]), inputs[:, k], START["parameters"]))
                 for k in range(degree)]
        conditions += [casadi.vec(known @ C - h * casadi.horzcat(*rates)), known @ D - end]
        effort += h * casadi.sumsqr(inputs @ casadi.diag(casadi.sqrt(B)))
        unknowns += [casadi.vec(stages), casadi.vec(inputs), end]
        part = (i + 1) / intervals
        guess += [*[numpy.concatenate([part * goal(), 0 * goal()])] * degree, numpy.zeros(2 * degree), numpy.concatenate([part * goal(), 0 * goal()])]
        state = end
    conditions.append(state - numpy.concatenate([goal(), 0 * goal()]))
    return solve(unknowns, guess, effort, conditions)


def shooting(intervals, method="gauss"):
    """One emitted step an interval, in which the inputs are held."""
    step = twice_differentiable(f"arm_step_{method}")
    h, unknowns, guess, conditions, effort = T / intervals, [], [], [], 0
    q, qd = START["q"], START["qd"]
    for i in range(intervals):
        inputs, end = casadi.MX.sym("inputs", 2), casadi.MX.sym("end", 2 * N)
        conditions.append(casadi.vertcat(*step(q, qd, i * h, h, inputs, START["parameters"])) - end)
        effort += h * casadi.sumsqr(inputs)
        unknowns += [inputs, end]
        guess += [numpy.zeros(2), numpy.concatenate([(i + 1) / intervals * goal(), 0 * goal()])]
        q, qd = end[:N], end[N:]
    conditions.append(casadi.vertcat(q, qd) - numpy.concatenate([goal(), 0 * goal()]))
    return solve(unknowns, guess, effort, conditions)


if __name__ == "__main__":
    first, second = collocation(25), shooting(200)
    print(f"least effort [N^2 m^2 s]: {first:.7g} by collocation, {second:.7g} by shooting, {abs(second / first - 1):.1e} apart")
