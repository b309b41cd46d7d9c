"""Coefficients of the integrators, read from the compiled C: order conditions of all rooted trees, stability."""
import ctypes
import functools
import itertools
import math
import subprocess

import mpmath
import pytest

from program import BUILD, SCALE

DIGITS = 50
THETAS = [mpmath.mpf(k) / 8 for k in range(9)]


# ---- Rooted trees, as tuples of their branches in order; () is the single vertex

@functools.lru_cache(None)
def trees(order):
    """All rooted trees with this number of vertices: a root, and branches with the remaining vertices."""
    def forests(size, largest):
        """Multisets of trees; none is after `largest` = (size, index) in the order of sizes and indices."""
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

class Definition(ctypes.Structure):
    """struct refdyn_method_definition"""
    _fields_ = ([("name", ctypes.c_char_p)]
                + [(name, ctypes.c_int) for name in ("order", "order_error", "is_last_new", "projects_by_matrix")]
                + [("kind", ctypes.c_void_p), ("table", ctypes.c_void_p)])


def table_of(library, kind, name):
    """The coefficients of a method, and the data common to all methods."""
    method = Definition.from_address(ctypes.c_void_p.in_dll(library, "shown_" + name).value)
    table = kind.from_address(method.table)
    assert method.name.decode() == name
    table.name, table.order, table.is_last_new = name, method.order, method.is_last_new
    return table


class Rosenbrock(ctypes.Structure):
    """struct refdyn_rosenbrock_table"""
    _fields_ = ([(name, ctypes.c_int) for name in ("stages", "interpolant_stages", "order_error", "order_interpolant",
                                                   "interpolant_terms", "is_w_method")]
                + [("gamma", ctypes.c_double)]
                + [(name, ctypes.POINTER(ctypes.c_double)) for name in ("a", "c", "alpha", "gamma_sum", "b", "e", "interpolant")])


class Collocation(ctypes.Structure):
    """struct refdyn_collocation_table"""
    _fields_ = ([(name, ctypes.c_int) for name in ("stages", "continued", "eigenvalues")]
                + [(name, ctypes.c_double) for name in ("ratio", "share")]
                + [(name, ctypes.POINTER(ctypes.c_double)) for name in ("c", "a", "aa", "b", "bb", "lagrange", "e", "e_low", "lambda",
                                                                        "left", "right")])


class RungeKutta(ctypes.Structure):
    """struct refdyn_tableau"""
    _fields_ = ([(name, ctypes.c_int) for name in ("stages", "interpolant_stages", "order_error", "order_error_low",
                                                   "order_interpolant", "degree")]
                + [(name, ctypes.POINTER(ctypes.c_double)) for name in ("a", "b", "c", "e", "e_low", "interpolant_a", "interpolant_c",
                                                                        "interpolant")])


def matrix(values, rows, columns):
    return mpmath.matrix([[mpmath.mpf(values[i * columns + j]) for j in range(columns)] for i in range(rows)])


def entrywise(columns, rows):
    """Product entry by entry of column vectors."""
    return mpmath.matrix([mpmath.fprod(column[i] for column in columns) for i in range(rows)])


class RosenbrockTable:
    """A table converted back to alpha_ij, gamma_ij and the weights of the k_j, U = G k (Solving ODEs II, IV.7)."""

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
        """Elementary weights of the k_i: a vertex with one branch represents f_y as well as J (IV.7, theorem 7.4)."""
        branches = [self.value(branch) for branch in tree]
        if len(branches) == 1:
            return (self.A + self.G) * branches[0]
        return entrywise([self.A * branch for branch in branches], self.all)

    @functools.lru_cache(None)
    def value_marked(self, tree):
        """The same with another matrix in place of J, which the fat vertices represent (IV.7, inexact Jacobian)."""
        branches, is_fat = tree
        values = [self.value_marked(branch) for branch in branches]
        return self.G * values[0] if is_fat else entrywise([self.A * value for value in values], self.all)


class RungeKuttaTable:
    """A tableau followed by the stages of the interpolant."""

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


ROSENBROCK = ["rodas5p", "rodas6p", "ros34pw2"]
RUNGE_KUTTA = ["rk4", "rk54", "rk8"]
COLLOCATION = ["gauss12", "radau9"]


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The tables have no public names; only pointers to them do."""
    folder = tmp_path_factory.mktemp("tables")
    names = (*ROSENBROCK, *RUNGE_KUTTA, *COLLOCATION)
    (folder / "shown.c").write_text("".join(f"extern const char refdyn_method_{name}[];\nconst void *const shown_{name} = refdyn_method_{name};\n"
                                            for name in names))
    subprocess.run(["gcc", "-shared", "-fPIC", folder / "shown.c", BUILD / "librefdyn_runtime.a", "-lm", "-o", folder / "tables.so"], check=True)
    return ctypes.CDLL(str(folder / "tables.so"))


@pytest.fixture(scope="module", params=ROSENBROCK)
def rosenbrock(request, library):
    table = table_of(library, Rosenbrock, request.param)
    return RosenbrockTable(table)


@pytest.fixture(scope="module", params=RUNGE_KUTTA)
def runge_kutta(request, library):
    table = table_of(library, RungeKutta, request.param)
    return RungeKuttaTable(table)


def residuals(weights, value, order, theta=1):
    """Residuals of the conditions of all trees with `order` vertices, in units of the conditions: weights . value = theta^order / gamma."""
    return [abs((weights * value(tree))[0] * density(tree) - theta ** order) for tree in trees(order)]


def check_order(weights, value, order, bound, what):
    worst = max(max(residuals(weights, value, k)) for k in range(1, order + 1))
    print(f"{what}: order {order}, residual {float(worst):.1e}, of the next {float(max(residuals(weights, value, order + 1))):.1e}")
    assert worst <= bound * SCALE, what
    assert max(residuals(weights, value, order + 1)) > 1e-5, f"{what} is of a higher order than it says"


def check_interpolant(method, bound):
    """Every theta has its own weights and conditions."""
    order, name = method.table.order_interpolant, method.table.name
    worst = max(max(residuals(method.weights(theta), method.value, k, theta)) for theta in THETAS for k in range(1, order + 1))
    beyond = max(max(residuals(method.weights(theta), method.value, order + 1, theta)) for theta in THETAS)
    print(f"{name} interpolant: order {order}, residual {float(worst):.1e}, of the next {float(beyond):.1e}")
    assert worst <= bound * SCALE
    assert beyond > 1e-5


BOUNDS = {"rodas5p": 1e-13, "rodas6p": 1e-13, "ros34pw2": 1e-14, "rk4": 1e-15, "rk54": 1e-14, "rk8": 1e-12}


# ---- Runge-Kutta

def test_runge_kutta_order(runge_kutta):
    name = runge_kutta.table.name
    check_order(runge_kutta.b, runge_kutta.value, runge_kutta.table.order, BOUNDS[name], name)


def test_runge_kutta_embedded_orders(runge_kutta):
    table = runge_kutta.table
    name = table.name
    for e, order in (runge_kutta.e, table.order_error), (runge_kutta.e_low, table.order_error_low):
        assert (e is None) == (order == 0)
        if e is not None:
            check_order(runge_kutta.b - e, runge_kutta.value, order, BOUNDS[name], f"{name} embedded")


def test_runge_kutta_interpolant(runge_kutta):
    check_interpolant(runge_kutta, BOUNDS[runge_kutta.table.name])


def test_runge_kutta_ends(runge_kutta):
    """c is the sum of a row of a; the interpolant has the state and the slope at both ends."""
    table, s, bound = runge_kutta.table, runge_kutta.all, BOUNDS[runge_kutta.table.name] * SCALE
    sums = runge_kutta.A * mpmath.ones(s, 1)
    assert max(abs(sums[i] - runge_kutta.c[i]) for i in range(s)) <= bound
    new = table.stages - (1 if table.is_last_new else 0)
    assert max(abs(runge_kutta.A[new, i] - runge_kutta.b[i]) for i in range(s)) <= bound and runge_kutta.c[new] == 1
    for weights, slope in (runge_kutta.weights_slope(0), 0), (runge_kutta.weights_slope(1), new):
        assert max(abs(weights[i] - (i == slope)) for i in range(s)) <= bound
    assert max(abs(runge_kutta.weights(1)[i] - runge_kutta.b[i]) for i in range(s)) <= bound


# ---- Rosenbrock

def test_rosenbrock_order(rosenbrock):
    name = rosenbrock.table.name
    check_order(rosenbrock.b, rosenbrock.value, rosenbrock.table.order, BOUNDS[name], name)


def test_rosenbrock_embedded_order(rosenbrock):
    name = rosenbrock.table.name
    check_order(rosenbrock.b - rosenbrock.e, rosenbrock.value, rosenbrock.table.order_error, BOUNDS[name], name + " embedded")


def test_rosenbrock_interpolant(rosenbrock):
    if rosenbrock.table.interpolant_terms:
        check_interpolant(rosenbrock, BOUNDS[rosenbrock.table.name])


def test_rosenbrock_sums(rosenbrock):
    """The condition for a step of y' = f(t, y) to be the step of the autonomous system (Solving ODEs II, IV.7)."""
    s, table, ones = rosenbrock.all, rosenbrock.table, mpmath.ones(rosenbrock.all, 1)
    bound = BOUNDS[table.name] * SCALE
    alpha, gamma_sum = rosenbrock.A * ones, rosenbrock.G * ones
    worst = [max(abs(alpha[i] - table.alpha[i]) for i in range(s)), max(abs(gamma_sum[i] - table.gamma_sum[i]) for i in range(s))]
    print(f"{table.name}: alpha {float(worst[0]):.1e}, gamma_sum {float(worst[1]):.1e}")
    assert max(worst) <= bound
    assert all(table.b[i] == table.e[i] == 0 for i in range(table.stages, s))


def test_rosenbrock_stability(rosenbrock):
    """R(z) = 1 + z b (I - z (A + G))^-1 1: zero at infinity for stiff accuracy, and at most 1 on the imaginary axis."""
    table, s = rosenbrock.table, rosenbrock.table.stages
    B, b = (rosenbrock.A + rosenbrock.G)[:s, :s], rosenbrock.b[:, :s]
    ones = mpmath.ones(s, 1)
    at_infinity = abs(1 - (b * mpmath.lu_solve(B, ones))[0])
    largest = max(abs(1 + 1j * y * (b * mpmath.lu_solve(mpmath.eye(s) - 1j * y * B, ones))[0])
                  for y in (mpmath.mpf(10) ** (mpmath.mpf(k) / 8) for k in range(-16, 25)))
    print(f"{table.name}: |R(infinity)| {float(at_infinity):.1e}, largest on the axis 1 + {float(largest - 1):.1e}")
    assert at_infinity <= BOUNDS[table.name] * SCALE
    assert largest <= 1 + BOUNDS[table.name] * SCALE


def test_w_method_order(rosenbrock):
    """With any matrix in place of J: trees with fat vertices must vanish, the other conditions are unchanged."""
    table = rosenbrock.table
    if not table.is_w_method:
        return
    worst = 0
    for order in range(1, table.order + 1):
        for tree in trees(order):
            for marked in set(markings(tree)):
                found = (rosenbrock.b * rosenbrock.value_marked(marked))[0]
                worst = max(worst, abs(found - (0 if has_fat(marked) else 1 / density(tree))))
    print(f"{table.name}: with any matrix, residual {float(worst):.1e}")
    assert worst <= BOUNDS[table.name] * SCALE


# ---- One step as described in rosenbrock.h

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
    """The error of one step falls with the method's order when the step is halved; for a W-method also without any derivative."""
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
        print(f"{table.name}: error of a step, embedded, within it, falls with h^{[round(float(rate), 2) for rate in rates]}")
        for rate, order in zip(rates, (table.order, table.order_error, table.order_interpolant)):
            assert rate == pytest.approx(order + 1, abs=0.35)


# ---- Collocation: everything derived again from the abscissae, which are roots of polynomials

LAST_PLACES = 2   # allowed error of an entry in units in the last place
ROUNDING = mpmath.mpf(10) ** -40   # smaller values, in 50 digits, are zero


def abscissae(name):
    """Roots of the Legendre polynomial of degree 6, and of P_5 - P_4, on (0, 1) (Solving ODEs II, IV.5)."""
    degree = {"gauss12": 6, "radau9": 5}[name]

    def legendre(n):
        """Coefficients of x^n P_n(2 x - 1), lowest first."""
        return [(-1) ** (n + k) * mpmath.binomial(n, k) * mpmath.binomial(n + k, k) for k in range(n + 1)]
    polynomial = legendre(degree)
    if name == "radau9":
        polynomial = [p - q for p, q in zip(polynomial, legendre(degree - 1) + [0])]
    return sorted(mpmath.re(root) for root in mpmath.polyroots(polynomial[::-1], maxsteps=200, extraprec=200))


def lagrange_polynomials(c):
    """Coefficients of L_j, lowest first."""
    rows = []
    for j, own in enumerate(c):
        row = [mpmath.mpf(1)]
        for other in c[:j] + c[j + 1:]:
            row = [(low - other * high) / (own - other) for low, high in zip([0, *row], [*row, 0])]
        rows.append(row)
    return rows


def integral(polynomial, end):
    return mpmath.fsum(value * end ** (k + 1) / (k + 1) for k, value in enumerate(polynomial))


class DerivedCollocation:
    """All entries of a table, as collocation.h defines them."""

    def __init__(self, table):
        self.name, self.order, s = table.name, table.order, table.stages
        self.c, self.s = abscissae(self.name), s
        self.lagrange = lagrange_polynomials(self.c)
        self.a = mpmath.matrix([[integral(L, c) for L in self.lagrange] for c in self.c])
        self.aa = self.a * self.a
        self.b = mpmath.matrix([[integral(L, 1) for L in self.lagrange]])
        self.bb = self.b * self.a
        self.e = [-L[0] for L in self.lagrange]
        self.e_low = [-L[0] for L in lagrange_polynomials(self.c[:-1])] + [mpmath.mpf(0)]
        values, vectors = mpmath.eig(self.a.T)
        listed = sorted((k for k in range(s) if mpmath.im(values[k]) > -ROUNDING),
                        key=lambda k: (abs(mpmath.im(values[k])) > ROUNDING, mpmath.re(values[k])))
        self.eigenvalues = [self.cleaned(values[k]) for k in listed]
        self.left = [[self.cleaned(vectors[i, k] / vectors[0, k]) for i in range(s)] for k in listed]
        # all left vectors with their conjugates; the columns of the inverse are the right vectors
        pairs = [row for value, row in zip(self.eigenvalues, self.left)
                 for row in ([row] if mpmath.im(value) == 0 else [row, [mpmath.conj(entry) for entry in row]])]
        inverse, at = mpmath.matrix(pairs) ** -1, 0
        self.real_left, right = [], []  # L by rows, R by columns
        for value, row in zip(self.eigenvalues, self.left):
            count = 1 if mpmath.im(value) == 0 else 2
            column = [self.cleaned(count * inverse[i, at]) for i in range(s)]
            self.real_left += [mpmath.re(entry) for entry in row], [mpmath.im(entry) for entry in row][:s * (count - 1)]
            right += [mpmath.re(entry) for entry in column], [-mpmath.im(entry) for entry in column][:s * (count - 1)]
            at += count
        self.real_left, right = ([row for row in rows if row] for rows in (self.real_left, right))
        self.real_right = [list(row) for row in zip(*right)]

    @staticmethod
    def cleaned(value):
        """Removes imaginary parts that are rounding."""
        value = mpmath.mpc(value)
        return mpmath.mpc(value.real, 0) if abs(value.imag) < ROUNDING else value

    def vibration(self, x):
        """For q = exp(i x theta), stepped over 0 <= theta <= 1: d, d_low, and the error of q at the end."""
        eye, ones, c = mpmath.eye(self.s), mpmath.ones(self.s, 1), mpmath.matrix(self.c)
        # a = -x^2 (q + c qd + aa a) in the time of a step
        a = mpmath.lu_solve(eye + x * x * self.aa, -x * x * (ones + 1j * x * c))
        d, d_low = (-x * x + mpmath.fdot(weights, a) for weights in (self.e, self.e_low))
        return d, d_low, 1 + 1j * x + (self.bb * a)[0] - mpmath.expj(x)

    def constants(self):
        """K, K_low and C of collocation.h: remainders of interpolation and of Pade's approximation (Solving ODEs II, IV.3)."""
        s, factorial = self.s, mpmath.factorial
        C = factorial(s) * factorial(self.order - s) / (factorial(self.order) * factorial(self.order + 1))
        return mpmath.fprod(self.c) / factorial(s), mpmath.fprod(self.c[:-1]) / factorial(s - 1), C


@pytest.fixture(scope="module", params=COLLOCATION)
def collocation(request, library, precision):
    table = table_of(library, Collocation, request.param)
    return table, DerivedCollocation(table)


def last_places(found, exact):
    """Largest difference in units of the last place of the exact value; zeros must be exact."""
    units = [math.ulp(float(right)) if abs(right) > ROUNDING else float(ROUNDING) for right in exact]
    return max(abs(mpmath.mpf(value) - right) / unit for value, right, unit in zip(found, exact, units, strict=True))


def pairs_of(entries):
    return [part for entry in entries for part in (mpmath.re(entry), mpmath.im(entry))]


def test_collocation_entries(collocation):
    table, derived = collocation
    assert table.eigenvalues == len(derived.eigenvalues)
    K, K_low, C = derived.constants()
    entries = {"c": derived.c, "a": list(derived.a), "aa": list(derived.aa), "b": list(derived.b), "bb": list(derived.bb),
               "lagrange": sum(derived.lagrange, []), "e": derived.e, "e_low": derived.e_low, "lambda": pairs_of(derived.eigenvalues),
               "left": sum(derived.real_left, []), "right": sum(derived.real_right, [])}
    worst = {name: last_places(getattr(table, name)[:len(exact)], exact) for name, exact in entries.items()}
    worst["ratio"], worst["share"] = last_places([table.ratio], [K_low / K]), last_places([table.share], [C / K])
    print(table.name, {name: round(float(value), 2) for name, value in worst.items()})
    assert all(value <= LAST_PLACES * SCALE for value in worst.values()), worst


def test_collocation_parts_make_the_whole(collocation):
    """R B L = a_ij and R L = 1, in the numbers of the table."""
    table, derived = collocation
    s, at, B = table.stages, 0, {}
    for k in range(table.eigenvalues):
        re, im = (mpmath.mpf(part) for part in getattr(table, "lambda")[2 * k:2 * k + 2])
        B |= {(at, at): re} if im == 0 else {(at, at): re, (at, at + 1): -im, (at + 1, at): im, (at + 1, at + 1): re}
        at += 1 if im == 0 else 2
    assert at == s
    for is_a in True, False:
        worst = 0
        for i, j in itertools.product(range(s), repeat=2):
            terms = [mpmath.mpf(table.right[i * s + k]) * value * mpmath.mpf(table.left[m * s + j])
                     for (k, m), value in (B.items() if is_a else [((k, k), 1) for k in range(s)])]
            size = mpmath.fsum(map(abs, terms))
            worst = max(worst, abs(mpmath.fsum(terms) - (mpmath.mpf(table.a[i * s + j]) if is_a else i == j)) / size)
        print(f"{table.name}: {'a' if is_a else 'identity'} to {float(worst):.1e} of its terms")
        assert worst <= 4 * mpmath.mpf(2) ** -53 * SCALE


# B(p), C(eta), D(zeta) (Solving ODEs II, IV.5) as far as they are true: p <= eta + zeta + 1 and p <= 2 eta + 2 imply order p.
ASSUMPTIONS = {"gauss12": (12, 6, 6), "radau9": (9, 5, 4)}


def test_collocation_order(collocation):
    table, _ = collocation
    s, name = table.stages, table.name
    p, eta, zeta = ASSUMPTIONS[name]
    assert table.order == p <= min(eta + zeta + 1, 2 * eta + 2)
    a, b, c = matrix(table.a, s, s), matrix(table.b, 1, s), [mpmath.mpf(value) for value in table.c[:s]]

    def power(k):
        return mpmath.matrix([value ** k for value in c])

    def B(q):
        return abs((b * power(q - 1))[0] - mpmath.mpf(1) / q)

    def C(q):
        return max(map(abs, a * power(q - 1) - power(q) / q))

    def D(q):
        return max(abs(mpmath.fsum(b[i] * c[i] ** (q - 1) * a[i, j] for i in range(s)) - b[j] / q * (1 - c[j] ** q)) for j in range(s))
    for what, condition, last in ("B", B, p), ("C", C, eta), ("D", D, zeta):
        worst = max(condition(q) for q in range(1, last + 1))
        print(f"{name}: {what}({last}) to {float(worst):.1e}, {what}({last + 1}) to {float(condition(last + 1)):.1e}")
        assert worst <= 1e-15 * SCALE
        assert condition(last + 1) > 1e-8, f"{what} holds further than it should"


def stability(table, z):
    """R(z) = 1 + z b (I - z a)^-1 1"""
    s = table.stages
    solved = mpmath.lu_solve(mpmath.eye(s) - z * matrix(table.a, s, s), mpmath.ones(s, 1))
    return 1 + z * (matrix(table.b, 1, s) * solved)[0]


def test_collocation_stability(collocation):
    """Gauss is neutral to all vibrations; Radau damps all of them, completely at infinity."""
    table, derived = collocation
    decades = [mpmath.mpf(10) ** (mpmath.mpf(k) / 8) for k in range(-16, 25)]
    axis = [abs(stability(table, 1j * y)) for y in decades]
    left = [abs(stability(table, -y * mpmath.expj(angle))) for y in decades for angle in (0, 0.4, 0.8, 1.2, 1.5, 1.57)]
    assert all(mpmath.re(value) > 0 for value in derived.eigenvalues)
    assert max(left) <= 1 + 1e-13 * SCALE
    if table.name == "gauss12":
        print(f"gauss12: | |R| - 1 | on the axis {float(max(abs(value - 1) for value in axis)):.1e}")
        assert max(abs(value - 1) for value in axis) <= 1e-13 * SCALE
        return
    s = table.stages
    at_infinity = abs(1 - (matrix(table.b, 1, s) * mpmath.lu_solve(matrix(table.a, s, s), mpmath.ones(s, 1)))[0])
    print(f"radau9: |R(infinity)| {float(at_infinity):.1e}, largest on the axis 1 + {float(max(axis) - 1):.1e}")
    assert at_infinity <= 1e-13 * SCALE
    assert max(axis) <= 1 + 1e-13 * SCALE


def test_collocation_error_estimate(collocation):
    """For a vibration that turns by 0.5 to 3 radians in a step, as described in collocation.h."""
    table, derived = collocation
    for x in mpmath.mpf(1) / 100, *(mpmath.mpf(k) / 4 for k in range(2, 13)):
        d, d_low, error = map(abs, derived.vibration(x))
        turned = table.ratio * d / d_low
        estimate = table.share * d * turned ** (table.order - table.stages - 1)
        print(f"{table.name}: {float(x)} rad, seen as {float(turned):.3f}, estimate / error {float(estimate / error):.2f}")
        assert mpmath.mpf(1) / 3 < estimate / error < 3
        assert x > 0.1 or abs(estimate / error - 1) < 1e-3
