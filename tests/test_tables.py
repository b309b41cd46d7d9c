"""Coefficients of the integrators, read out of the compiled C: order conditions of all rooted trees, stability."""
import ctypes
import functools
import itertools
import subprocess

import mpmath
import pytest

from program import SCALE, SOURCE

DIGITS = 40
THETAS = [mpmath.mpf(k) / 8 for k in range(9)]


# ---- Rooted trees, as tuples of their branches in order; () is the single vertex

@functools.lru_cache(None)
def trees(order):
    """All rooted trees with so many vertices: a root, and branches whose sizes add up to the rest."""
    def forests(size, largest):
        """Multisets of trees; none comes behind `largest` = (size, index) in the order of sizes and places."""
        if not size:
            yield ()
        for first in range(min(size, largest[0]), 0, -1):
            count = len(trees(first)) if first < largest[0] else largest[1] + 1
            for index in range(count):
                for rest in forests(size - first, (first, index)):
                    yield (trees(first)[index], *rest)
    return tuple(forests(order - 1, (order, -1)))


def size(tree):
    return 1 + sum(map(size, tree))


def density(tree):
    """gamma(tree) (Hairer, Norsett and Wanner, Solving ODEs I, II.2)."""
    return size(tree) * mpmath.fprod(map(density, tree))


def markings(tree):
    """The tree with every choice of fat vertices, each of which has one branch: (branches, is_fat)."""
    for branches in itertools.product(*(tuple(markings(branch)) for branch in tree)):
        yield branches, False
        if len(branches) == 1:
            yield branches, True


def has_fat(marked):
    branches, is_fat = marked
    return is_fat or any(map(has_fat, branches))


def test_trees():
    assert [len(trees(order)) for order in range(1, 9)] == [1, 1, 2, 4, 9, 20, 48, 115]   # Solving ODEs I, table II.2.2
    assert len({tree for order in range(1, 9) for tree in trees(order)}) == 200
    assert sorted(map(density, trees(4))) == [4, 8, 12, 24]


# ---- The tables in C

class Rosenbrock(ctypes.Structure):
    """struct refdyn_rosenbrock_table"""
    _fields_ = ([("name", ctypes.c_char_p)]
                + [(name, ctypes.c_int) for name in ("stages", "interpolant_stages", "order", "order_error", "order_interpolant",
                                                     "interpolant_terms", "is_w_method")]
                + [("gamma", ctypes.c_double)]
                + [(name, ctypes.POINTER(ctypes.c_double)) for name in ("a", "c", "alpha", "gamma_sum", "b", "e", "interpolant")])


class RungeKutta(ctypes.Structure):
    """struct refdyn_tableau"""
    _fields_ = ([("name", ctypes.c_char_p)]
                + [(name, ctypes.c_int) for name in ("stages", "interpolant_stages", "order", "order_error", "order_error_low",
                                                     "order_interpolant", "degree", "is_last_new")]
                + [(name, ctypes.POINTER(ctypes.c_double)) for name in ("a", "b", "c", "e", "e_low", "interpolant_a", "interpolant_c",
                                                                        "interpolant")])


def matrix(values, rows, columns):
    return mpmath.matrix([[mpmath.mpf(values[i * columns + j]) for j in range(columns)] for i in range(rows)])


def entrywise(columns, rows):
    """Product entry by entry of column vectors."""
    return mpmath.matrix([mpmath.fprod(column[i] for column in columns) for i in range(rows)])


class RosenbrockTable:
    """A table turned back into alpha_ij, gamma_ij and the weights of the k_j, U = G k (Solving ODEs II, IV.7)."""

    def __init__(self, table):
        self.table, self.all = table, table.stages + table.interpolant_stages
        s = self.all
        for lower in (table.a, table.c):
            assert all(lower[i * s + j] == 0 for i in range(s) for j in range(i, s))
        self.G = (mpmath.eye(s) / mpmath.mpf(table.gamma) - matrix(table.c, s, s)) ** -1
        self.A = matrix(table.a, s, s) * self.G
        self.b, self.e = (matrix(values, 1, s) * self.G for values in (table.b, table.e))
        self.interpolant = matrix(table.interpolant, table.interpolant_terms, s) * self.G if table.interpolant_terms else None

    def weights(self, theta):
        """Of y(t + theta h) - y."""
        polynomial = mpmath.zeros(1, self.all)
        for k in reversed(range(self.table.interpolant_terms)):
            polynomial = polynomial * theta + self.interpolant[k, :]
        return theta * (self.b + (1 - theta) * polynomial)

    @functools.lru_cache(None)
    def value(self, tree):
        """Elementary weights of the k_i: a vertex with one branch stands for f_y as well as for J (IV.7, theorem 7.4)."""
        branches = [self.value(branch) for branch in tree]
        if len(branches) == 1:
            return (self.A + self.G) * branches[0]
        return entrywise([self.A * branch for branch in branches], self.all)

    @functools.lru_cache(None)
    def value_marked(self, tree):
        """The same with another matrix in place of J, which the fat vertices stand for (IV.7, inexact Jacobian)."""
        branches, is_fat = tree
        values = [self.value_marked(branch) for branch in branches]
        return self.G * values[0] if is_fat else entrywise([self.A * value for value in values], self.all)


class RungeKuttaTable:
    """A tableau with the stages of the interpolant behind the others."""

    def __init__(self, table):
        self.table, self.all = table, table.stages + table.interpolant_stages
        s, extra = table.stages, table.interpolant_stages
        self.A = mpmath.zeros(self.all)
        self.A[:s, :s] = matrix(table.a, s, s)
        self.c = [table.c[i] for i in range(s)]
        if extra:
            self.A[s:, :] = matrix(table.interpolant_a, extra, self.all)
            self.c += [table.interpolant_c[i] for i in range(extra)]
        assert all(self.A[i, j] == 0 for i in range(self.all) for j in range(i, self.all))
        self.b, self.e, self.e_low = (self.row(values) for values in (table.b, table.e, table.e_low))
        self.interpolant = matrix(table.interpolant, self.all, table.degree)

    def row(self, values):
        return mpmath.matrix([[values[i] if i < self.table.stages else 0 for i in range(self.all)]]) if values else None

    def weights(self, theta):
        """Of y(t + theta h) - y, in h."""
        return (self.interpolant * mpmath.matrix([theta ** (k + 1) for k in range(self.table.degree)])).T

    def weights_slope(self, theta):
        return (self.interpolant * mpmath.matrix([(k + 1) * theta ** k for k in range(self.table.degree)])).T

    @functools.lru_cache(None)
    def value(self, tree):
        """Elementary weights of the slopes (Solving ODEs I, II.2)."""
        return entrywise([self.A * self.value(branch) for branch in tree], self.all)


@pytest.fixture(autouse=True, scope="module")
def precision():
    with mpmath.workdps(DIGITS):
        yield


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    path = tmp_path_factory.mktemp("tables") / "tables.so"
    subprocess.run(["gcc", "-std=c11", "-fPIC", "-shared", *(SOURCE / "runtime").glob("*_tables.c"), "-o", path], check=True)
    return ctypes.CDLL(str(path))


@pytest.fixture(scope="module", params=["rodas5p", "rodas6p", "ros34pw2"])
def rosenbrock(request, library):
    table = Rosenbrock.in_dll(library, "refdyn_" + request.param)
    assert table.name.decode() == request.param
    return RosenbrockTable(table)


@pytest.fixture(scope="module", params=["rk4", "rk54", "rk8"])
def runge_kutta(request, library):
    table = RungeKutta.in_dll(library, "refdyn_" + request.param)
    assert table.name.decode() == request.param
    return RungeKuttaTable(table)


def residuals(weights, value, order, theta=1):
    """Of the conditions of all trees with `order` vertices, in units of theirs: weights . value = theta^order / gamma."""
    return [abs((weights * value(tree))[0] * density(tree) - theta ** order) for tree in trees(order)]


def check_order(weights, value, order, bound, what):
    worst = max(max(residuals(weights, value, k)) for k in range(1, order + 1))
    print(f"{what}: order {order}, residual {float(worst):.1e}, of the next {float(max(residuals(weights, value, order + 1))):.1e}")
    assert worst <= bound * SCALE, what
    assert max(residuals(weights, value, order + 1)) > 1e-5, f"{what} is of a higher order than it says"


def check_interpolant(method, bound):
    """Every theta has its own weights and conditions."""
    order, name = method.table.order_interpolant, method.table.name.decode()
    worst = max(max(residuals(method.weights(theta), method.value, k, theta)) for theta in THETAS for k in range(1, order + 1))
    beyond = max(max(residuals(method.weights(theta), method.value, order + 1, theta)) for theta in THETAS)
    print(f"{name} interpolant: order {order}, residual {float(worst):.1e}, of the next {float(beyond):.1e}")
    assert worst <= bound * SCALE
    assert beyond > 1e-5


BOUNDS = {"rodas5p": 1e-13, "rodas6p": 1e-13, "ros34pw2": 1e-14, "rk4": 1e-15, "rk54": 1e-14, "rk8": 1e-12}


# ---- Runge-Kutta

def test_runge_kutta_order(runge_kutta):
    name = runge_kutta.table.name.decode()
    check_order(runge_kutta.b, runge_kutta.value, runge_kutta.table.order, BOUNDS[name], name)


def test_runge_kutta_embedded_orders(runge_kutta):
    table = runge_kutta.table
    name = table.name.decode()
    for e, order in (runge_kutta.e, table.order_error), (runge_kutta.e_low, table.order_error_low):
        assert (e is None) == (order == 0)
        if e is not None:
            check_order(runge_kutta.b - e, runge_kutta.value, order, BOUNDS[name], f"{name} embedded")


def test_runge_kutta_interpolant(runge_kutta):
    check_interpolant(runge_kutta, BOUNDS[runge_kutta.table.name.decode()])


def test_runge_kutta_ends(runge_kutta):
    """c is the sum of a row of a; the interpolant begins and ends with the state and the slope of its end."""
    table, s, bound = runge_kutta.table, runge_kutta.all, BOUNDS[runge_kutta.table.name.decode()] * SCALE
    sums = runge_kutta.A * mpmath.ones(s, 1)
    assert max(abs(sums[i] - runge_kutta.c[i]) for i in range(s)) <= bound
    new = table.stages - (1 if table.is_last_new else 0)
    assert max(abs(runge_kutta.A[new, i] - runge_kutta.b[i]) for i in range(s)) <= bound and runge_kutta.c[new] == 1
    for weights, slope in (runge_kutta.weights_slope(0), 0), (runge_kutta.weights_slope(1), new):
        assert max(abs(weights[i] - (i == slope)) for i in range(s)) <= bound
    assert max(abs(runge_kutta.weights(1)[i] - runge_kutta.b[i]) for i in range(s)) <= bound


# ---- Rosenbrock

def test_rosenbrock_order(rosenbrock):
    name = rosenbrock.table.name.decode()
    check_order(rosenbrock.b, rosenbrock.value, rosenbrock.table.order, BOUNDS[name], name)


def test_rosenbrock_embedded_order(rosenbrock):
    name = rosenbrock.table.name.decode()
    check_order(rosenbrock.b - rosenbrock.e, rosenbrock.value, rosenbrock.table.order_error, BOUNDS[name], name + " embedded")


def test_rosenbrock_interpolant(rosenbrock):
    if rosenbrock.table.interpolant_terms:
        check_interpolant(rosenbrock, BOUNDS[rosenbrock.table.name.decode()])


def test_rosenbrock_sums(rosenbrock):
    """What makes a step of y' = f(t, y) the step of the same without t (Solving ODEs II, IV.7)."""
    s, table, ones = rosenbrock.all, rosenbrock.table, mpmath.ones(rosenbrock.all, 1)
    bound = BOUNDS[table.name.decode()] * SCALE
    alpha, gamma_sum = rosenbrock.A * ones, rosenbrock.G * ones
    worst = [max(abs(alpha[i] - table.alpha[i]) for i in range(s)), max(abs(gamma_sum[i] - table.gamma_sum[i]) for i in range(s))]
    print(f"{table.name.decode()}: alpha {float(worst[0]):.1e}, gamma_sum {float(worst[1]):.1e}")
    assert max(worst) <= bound
    assert all(table.b[i] == table.e[i] == 0 for i in range(table.stages, s))


def test_rosenbrock_stability(rosenbrock):
    """R(z) = 1 + z b (I - z (A + G))^-1 1: zero at infinity, for stiff accuracy, and at most 1 on the imaginary axis."""
    table, s = rosenbrock.table, rosenbrock.table.stages
    B, b = (rosenbrock.A + rosenbrock.G)[:s, :s], rosenbrock.b[:, :s]
    ones = mpmath.ones(s, 1)
    at_infinity = abs(1 - (b * mpmath.lu_solve(B, ones))[0])
    largest = max(abs(1 + 1j * y * (b * mpmath.lu_solve(mpmath.eye(s) - 1j * y * B, ones))[0])
                  for y in (mpmath.mpf(10) ** (mpmath.mpf(k) / 8) for k in range(-16, 25)))
    print(f"{table.name.decode()}: |R(infinity)| {float(at_infinity):.1e}, largest on the axis 1 + {float(largest - 1):.1e}")
    assert at_infinity <= BOUNDS[table.name.decode()] * SCALE
    assert largest <= 1 + BOUNDS[table.name.decode()] * SCALE


def test_w_method_order(rosenbrock):
    """With any matrix in place of J: trees with fat vertices have to vanish, the others as always."""
    table = rosenbrock.table
    if not table.is_w_method:
        return
    worst = 0
    for order in range(1, table.order + 1):
        for tree in trees(order):
            for marked in set(markings(tree)):
                found = (rosenbrock.b * rosenbrock.value_marked(marked))[0]
                worst = max(worst, abs(found - (0 if has_fat(marked) else 1 / density(tree))))
    print(f"{table.name.decode()}: with any matrix, residual {float(worst):.1e}")
    assert worst <= BOUNDS[table.name.decode()] * SCALE


# ---- One step as rosenbrock.h writes it

def f(t, y):
    return mpmath.matrix([y[1] + mpmath.sin(3 * t), -y[0] * y[1] - y[0] + mpmath.cos(t) * y[1] ** 2])


def J(t, y):
    return mpmath.matrix([[0, 1], [-y[1] - 1, -y[0] + 2 * mpmath.cos(t) * y[1]]])


def f_t(t, y):
    return mpmath.matrix([3 * mpmath.cos(3 * t), -mpmath.sin(t) * y[1] ** 2])


T, Y = mpmath.mpf("0.3"), mpmath.matrix(["0.7", "-0.4"])
THETA = mpmath.mpf("0.3")


def rosenbrock_step(table, h, jacobian, slope_t):
    """y_new, its error estimate, and y(T + THETA h)."""
    s, U = table.stages + table.interpolant_stages, []
    system = mpmath.eye(2) / (h * table.gamma) - jacobian
    for i in range(s):
        y, right = Y.copy(), h * table.gamma_sum[i] * slope_t
        for j in range(i):
            y += table.a[i * s + j] * U[j]
            right += table.c[i * s + j] / h * U[j]
        U.append(mpmath.lu_solve(system, f(T + table.alpha[i] * h, y) + right))

    def combine(weights):
        total = mpmath.zeros(2, 1)
        for j in range(s):
            total += weights[j] * U[j]
        return total
    y_new, inner = Y + combine(table.b), mpmath.zeros(2, 1)
    if table.interpolant_terms:
        for k in reversed(range(table.interpolant_terms)):
            inner = combine(table.interpolant[k * s:k * s + s]) + THETA * inner
    else:
        begin, end = h * f(T, Y) - (y_new - Y), (y_new - Y) - h * f(T + h, y_new)
        inner = (1 - THETA) * begin + THETA * end
    return y_new, combine(table.e), (1 - THETA) * Y + THETA * (y_new + (1 - THETA) * inner)


def solution(t):
    return mpmath.matrix(mpmath.odefun(lambda t, y: list(f(t, y)), T, list(Y), tol=mpmath.mpf(10) ** -30)(t))


def test_rosenbrock_step(rosenbrock):
    """The error of one step halves as its order says; of a W-method with no derivative at all, too."""
    table = rosenbrock.table
    derivatives = [(J(T, Y), f_t(T, Y))] + [(mpmath.zeros(2), mpmath.zeros(2, 1))] * table.is_w_method
    steps = [mpmath.mpf(1) / 40, mpmath.mpf(1) / 80]
    exact = [(solution(T + h), solution(T + THETA * h)) for h in steps]
    for jacobian, slope_t in derivatives:
        errors = []
        for h, (at_end, within) in zip(steps, exact):
            y_new, estimate, between = rosenbrock_step(table, h, jacobian, slope_t)
            errors.append([mpmath.norm(y_new - at_end), mpmath.norm(y_new - estimate - at_end), mpmath.norm(between - within)])
        rates = [mpmath.log(coarse / fine, 2) for coarse, fine in zip(*errors)]
        print(f"{table.name.decode()}: error of a step, embedded, within it, falls with h^{[round(float(rate), 2) for rate in rates]}")
        for rate, order in zip(rates, (table.order, table.order_error, table.order_interpolant)):
            assert rate == pytest.approx(order + 1, abs=0.35)
