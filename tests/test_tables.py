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


@pytest.fixture(autouse=True, scope="module")
def precision():
    with mpmath.workdps(DIGITS):
        yield


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    path = tmp_path_factory.mktemp("tables") / "tables.so"
    subprocess.run(["gcc", "-std=c11", "-fPIC", "-shared", SOURCE / "runtime" / "rosenbrock_tables.c", "-o", path], check=True)
    return ctypes.CDLL(str(path))


@pytest.fixture(scope="module", params=["rodas5p", "rodas6p", "ros34pw2"])
def rosenbrock(request, library):
    table = Rosenbrock.in_dll(library, "refdyn_" + request.param)
    assert table.name.decode() == request.param
    return RosenbrockTable(table)


def residuals(weights, value, order, theta=1):
    """Of the conditions of all trees with `order` vertices, in units of theirs: weights . value = theta^order / gamma."""
    return [abs((weights * value(tree))[0] * density(tree) - theta ** order) for tree in trees(order)]


def check_order(weights, value, order, bound, what):
    worst = max(max(residuals(weights, value, k)) for k in range(1, order + 1))
    print(f"{what}: order {order}, residual {float(worst):.1e}, of the next {float(max(residuals(weights, value, order + 1))):.1e}")
    assert worst <= bound * SCALE, what
    assert max(residuals(weights, value, order + 1)) > 1e-5, f"{what} is of a higher order than it says"


BOUNDS = {"rodas5p": 1e-12, "rodas6p": 1e-12, "ros34pw2": 1e-14}


def test_rosenbrock_order(rosenbrock):
    name = rosenbrock.table.name.decode()
    check_order(rosenbrock.b, rosenbrock.value, rosenbrock.table.order, BOUNDS[name], name)


def test_rosenbrock_embedded_order(rosenbrock):
    name = rosenbrock.table.name.decode()
    check_order(rosenbrock.b - rosenbrock.e, rosenbrock.value, rosenbrock.table.order_error, BOUNDS[name], name + " embedded")


def test_rosenbrock_interpolant(rosenbrock):
    """Every theta has its own weights and conditions; at the ends they are y and y_new."""
    table = rosenbrock.table
    if not table.interpolant_terms:
        return
    worst = max(max(residuals(rosenbrock.weights(theta), rosenbrock.value, k, theta))
                for theta in THETAS for k in range(1, table.order_interpolant + 1))
    beyond = max(max(residuals(rosenbrock.weights(theta), rosenbrock.value, table.order_interpolant + 1, theta)) for theta in THETAS)
    print(f"{table.name.decode()} interpolant: residual {float(worst):.1e}, of the next {float(beyond):.1e}")
    assert worst <= BOUNDS[table.name.decode()] * SCALE
    assert beyond > 1e-5


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
