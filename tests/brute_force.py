"""The sums of theory, sect. 2.1 to 2.3, as they are written, in 60 digits: T_i and T_ij of every body, traces of products of 4 x 4
matrices.

A model is plain data (see `random_models.py`). Nothing here is fast or clever, and nothing is shared with the generator. Energies of named
springs, programme rows and velocities of points are differentiated by central differences, which at 60 digits leave at least 28 correct
digits.
"""
import functools
import types

import mpmath
import numpy

mpmath.mp.dps = 60
STEP = mpmath.mpf(10) ** -16
AXES = {"x": 0, "y": 1, "z": 2, "phi": 0, "theta": 1, "psi": 2}
TURNS = ("phi", "theta", "psi")


def number(value):
    return mpmath.mpf(value)


def numbers(values):
    return numpy.array([number(value) for value in values], dtype=object)


def matrix(rows):
    return numpy.array([[number(entry) for entry in row] for row in rows], dtype=object)


def identity(size=4):
    return matrix([[int(i == j) for j in range(size)] for i in range(size)])


def shift(vector):
    result = identity()
    result[:3, 3] = numbers(vector)
    return result


@functools.lru_cache(maxsize=None)
def elementary(kind, value, order):
    """D of one coordinate, or its derivative of the given order."""
    axis = AXES[kind]
    result = identity() if order == 0 else identity() * 0
    if kind not in TURNS:
        if order < 2:
            result[axis, 3] = [number(value), number(1)][order]
        return result
    value = number(value) + order * mpmath.pi / 2
    a, b = (axis + 1) % 3, (axis + 2) % 3
    result[a, a] = result[b, b] = mpmath.cos(value)
    result[a, b], result[b, a] = -mpmath.sin(value), mpmath.sin(value)
    return result


def turns(link):
    """Constant rotations. An angle given as text is "rd.pi/2" and exact."""
    return [elementary(TURNS["xyz".index(axis)], mpmath.pi / 2 if isinstance(angle, str) else number(angle), 0)
            for axis, angle in link.get("turn", [])]


# ---- bodies ----

def pseudo_inertia(mass, center, tensor):
    """H = int r r^T dm from mass, centre of mass and the inertia tensor about it (xx yy zz xy xz yz)."""
    xx, yy, zz, xy, xz, yz = numbers(tensor)
    about_center = matrix([[(yy + zz - xx) / 2, -xy, -xz], [-xy, (xx + zz - yy) / 2, -yz], [-xz, -yz, (xx + yy - zz) / 2]])
    c = numbers(center)
    H = identity() * 0
    H[:3, :3] = about_center + number(mass) * numpy.outer(c, c)
    H[:3, 3] = H[3, :3] = number(mass) * c
    H[3, 3] = number(mass)
    return H


def given_inertia(body):
    entries = [body.get("inertia", {}).get(name, 0) for name in ("xx", "yy", "zz", "xy", "xz", "yz")]
    return pseudo_inertia(body["mass"], body.get("center", (0, 0, 0)), entries)


def second_moments(volume, xx, yy, zz):
    """H of density 1: volume and int x^2, int y^2, int z^2, the centre at the origin."""
    H = identity() * 0
    for i, entry in enumerate((xx, yy, zz, volume)):
        H[i, i] = entry
    return H


def round_body(outer, inner, length, axis):
    """Between two radii: int y^2 = pi (R^4 - r^4) L / 4 across the axis, V L^2 / 12 along it."""
    R, r, L = number(outer) / 2, number(inner) / 2, number(length)
    volume = mpmath.pi * (R ** 2 - r ** 2) * L
    moments = [mpmath.pi * (R ** 4 - r ** 4) * L / 4] * 3
    moments["xyz".index(axis)] = volume * L ** 2 / 12
    return second_moments(volume, *moments)


def shape(body):
    """H of a solid of uniform density in its own frame."""
    if body.tag == "box":
        a, b, c = numbers(body["size"])
        H = second_moments(a * b * c, *(a * b * c * edge ** 2 / 12 for edge in (a, b, c)))
    elif body.tag == "sphere":
        R = number(body["diameter"]) / 2
        H = second_moments(4 * mpmath.pi * R ** 3 / 3, *[4 * mpmath.pi * R ** 5 / 15] * 3)
    elif body.tag == "cylinder":
        H = round_body(body["diameter"], 0, body["length"], body.get("axis", "x"))
    else:
        H = round_body(body["outer"], body["inner"], body["length"], body.get("axis", "x"))
    return H * (number(body["density"]) if "density" in body else number(body["mass"]) / H[3, 3])


def placed_body(body):
    H = shape(body) if hasattr(body, "tag") else given_inertia(body)
    T = functools.reduce(numpy.dot, [shift(body.get("at", (0, 0, 0)))] + turns(body))
    return T.dot(H).dot(T.T)


# ---- beams ----

@functools.lru_cache(maxsize=None)
def section(tag, values):
    """Area, Iy, Iz, It."""
    if tag == "rectangle":
        b, h = values
        long, short = max(b, h), min(b, h)
        series = sum(mpmath.tanh(n * mpmath.pi * long / (2 * short)) / mpmath.mpf(n) ** 5 for n in range(1, 2000, 2))
        It = long * short ** 3 / 3 * (1 - 192 * short / (mpmath.pi ** 5 * long) * series)
        return b * h, b * h ** 3 / 12, b ** 3 * h / 12, It
    if tag is None:
        return values
    outer, inner = values if tag == "tube" else (values[0], 0)
    area, fourth = mpmath.pi * (outer ** 2 - inner ** 2) / 4, mpmath.pi * (outer ** 4 - inner ** 4) / 64
    return area, fourth, fourth, 2 * fourth


def section_of(part):
    given = part["section"]
    if hasattr(given, "tag"):
        return section(given.tag, tuple(numbers(given.items)))
    return tuple(number(given[name]) for name in ("area", "Iy", "Iz", "It"))


def mode_root(mode, load):
    """beta L of a clamped beam with a point mass of `load` times its own at its end."""
    def equation(b):
        return 1 + mpmath.cos(b) * mpmath.cosh(b) + load * b * (mpmath.cos(b) * mpmath.sinh(b) - mpmath.sin(b) * mpmath.cosh(b))
    low, roots = mpmath.mpf("0.01"), []
    while len(roots) < mode:
        if equation(low) * equation(low + 0.05) < 0:
            roots.append(mpmath.findroot(equation, (low, low + 0.05), solver="anderson", tol=1e-60))
        low += mpmath.mpf("0.05")
    return roots[-1]


ORDER = ("psi", "theta", "phi")


def commutators(turns):
    """Half the commutators of three successive turns: the second-order part of their rotation vector, beyond the turns themselves."""
    axes = [identity(3)[AXES[kind]] for kind in ORDER]
    vector = sum(numpy.cross(axes[a], axes[b]) * turns[a] * turns[b] / 2 for a, b in ((0, 1), (0, 2), (1, 2)))
    return numbers(axis.dot(vector) for axis in axes)


class Beam:
    """The numbers of one segment; the beam provides those that the segment omits."""

    def __init__(self, beam, segment):
        part = {**beam, **segment}
        self.rfe, self.length = part["rfe"], number(part["length"])
        self.dl = self.length / (self.rfe - 1) if self.rfe > 1 else self.length
        self.area, self.Iy, self.Iz, It = section_of(part)
        self.E, self.rho = number(part["E"]), number(part["rho"])
        self.stiffness = {"psi": self.E * self.Iz / self.dl, "theta": self.E * self.Iy / self.dl,
                          "phi": self.E / (2 * (1 + number(part["nu"]))) * It / self.dl}
        self.is_strained = "springs" not in beam and set(beam.get("dofs", ORDER)) == set(ORDER)
        turns = numbers(number(part.get("curvature", {}).get(kind, 0)) * self.dl for kind in ORDER)
        self.rest = dict(zip(ORDER, turns - commutators(turns) if self.is_strained else turns))
        given = part.get("damping", {})
        eta = number(part.get("eta", 0))
        if "ratio" in given:
            eta = 2 * number(given["ratio"]) / self.omega(given, "psi" in beam.get("dofs", ("psi",)))
        self.damping = {kind: eta * self.stiffness[kind] + number(given.get(kind, 0)) for kind in TURNS}

    def omega(self, given, in_plane):
        if "frequency" in given:
            return 2 * mpmath.pi * number(given["frequency"])
        line = self.rho * self.area
        b = mode_root(given.get("mode", 1), number(given.get("tip_mass", 0)) / (line * self.length))
        return b ** 2 * mpmath.sqrt(self.E * (self.Iz if in_plane else self.Iy) / (line * self.length ** 4))

    def element_length(self, r):
        return self.dl / 2 if self.rfe > 1 and r in (0, self.rfe - 1) else self.dl

    def prism(self, length):
        H = identity() * 0
        H[0, 0], H[1, 1], H[2, 2] = self.area * length ** 3 / 3, self.Iz * length, self.Iy * length
        H[0, 3] = H[3, 0] = self.area * length ** 2 / 2
        H[3, 3] = self.area * length
        return H * self.rho


# ---- the tree ----

def moved(factors, *constants):
    """Factors followed by constant ones; adjacent constant factors are multiplied."""
    for constant in constants:
        if factors and not isinstance(factors[-1], int):
            factors = factors[:-1] + [factors[-1].dot(constant)]
        else:
            factors = factors + [constant]
    return factors


class Tree:
    """Bodies as products of constant placements and elementary coordinates."""

    def __init__(self, model):
        self.model = model
        self.names, self.kinds, self.spring, self.rest, self.damper, self.start = [], [], [], [], [], []
        self.strained = []  # coordinates of three turns with springs on the strains
        self.bodies = []  # (factors, H); a factor is a 4 x 4 matrix or the index of a coordinate
        self.frames, self.elements, self.places = {"ground": []}, {}, {}
        for link in model["links"]:
            self.add_link(link)
        self.n = len(self.names)
        self.points = {name: self.place(value) for name, value in model.get("points", {}).items()}

    def add_coordinate(self, name, kind, spring, rest, damper, start):
        self.names.append(name)
        self.kinds.append(kind)
        for values, value in zip((self.spring, self.rest, self.damper, self.start), (spring, rest, damper, start)):
            values.append(number(value))
        return len(self.names) - 1

    def place(self, value):
        """Factors of a place; each place is computed once."""
        key = repr(value)
        if key not in self.places:
            self.places[key] = self.find_place(value)
        return self.places[key]

    def find_place(self, value):
        """Finds the place of "ground", "arm", "arm.tip", a point, or { on, along, at, turn }."""
        if isinstance(value, str):
            return self.points[value] if value in getattr(self, "points", {}) else self.frames[value]
        factors = self.place(value.get("on", "ground"))
        if "along" in value:
            along = number(value["along"])
            start, factors = [element for element in self.elements[value["on"]] if element[0] <= along][-1]
            factors = moved(factors, shift((along - start, 0, 0)))
        return moved(factors, shift(value["at"]), *turns(value)) if "at" in value else moved(factors, *turns(value))

    def add_link(self, link):
        factors = self.place(link)
        joints = link.get("joint", [])
        for kind in ("x", "y", "z", "psi", "theta", "phi") if joints == ["free"] else joints:
            numbers_of_joint = [link.get(field, {}).get(kind, 0) for field in ("spring", "rest", "damper", "start")]
            factors = factors + [self.add_coordinate(f"{link['name']}_{kind}", kind, *numbers_of_joint)]
        self.frames[link["name"]] = factors
        if "mass" in link:
            self.add_body(factors, given_inertia(link))
        for body in link.get("bodies", []):
            self.add_body(factors, placed_body(body))
        if "beam" in link:
            self.add_beam(link["name"], link["beam"], factors)

    def add_body(self, factors, H):
        if self.bodies and self.bodies[-1][0] is factors:
            H = self.bodies.pop()[1] + H
        self.bodies.append((factors, H))

    def add_beam(self, name, beam, factors):
        count, along = 0, number(0)
        self.elements[name] = []
        for segment in beam.get("segments", [{}]):
            part = Beam(beam, segment)
            for r in range(part.rfe):
                count += r > 0
                for kind in ("psi", "theta", "phi") if r else ():
                    if kind in beam.get("dofs", ("psi", "theta", "phi")):
                        factors = factors + [self.add_coordinate(f"{name}_{kind}_{count}", kind, part.stiffness[kind], part.rest[kind],
                                                                 part.damping[kind], part.rest[kind])]
                if r and part.is_strained:
                    self.strained.append([len(self.names) - 3, len(self.names) - 2, len(self.names) - 1])
                length = part.element_length(r)
                self.add_body(factors, part.prism(length))
                self.elements[name].append((along, factors))
                factors, along = moved(factors, shift((length, 0, 0))), along + length
        self.frames[name + ".tip"] = factors

    def product(self, factors, q, derivatives=()):
        """T, T_i or T_ij: each coordinate is differentiated as often as `derivatives` names it."""
        result = identity()
        for factor in factors:
            if isinstance(factor, int):
                factor = elementary(self.kinds[factor], q[factor], derivatives.count(factor))
            result = result.dot(factor)
        return result

    def moving(self, factors):
        return [factor for factor in factors if isinstance(factor, int)]

    def r(self, name, q):
        return self.product(self.points[name], q)[:3, 3]

    def C(self, name, q):
        return self.columns(self.points[name], q)

    def columns(self, factors, q):
        result = numpy.array([[number(0)] * self.n for _ in range(3)], dtype=object)
        for i in self.moving(factors):
            result[:, i] = self.product(factors, q, (i,))[:3, 3]
        return result

    def turn_columns(self, factors, q):
        """Angular velocities for unit rates: the axial vectors of R_i R^T."""
        result = numpy.array([[number(0)] * self.n for _ in range(3)], dtype=object)
        R = self.product(factors, q)[:3, :3]
        for i in self.moving(factors):
            spin = self.product(factors, q, (i,))[:3, :3].dot(R.T)
            result[:, i] = [spin[2, 1], spin[0, 2], spin[1, 0]]
        return result

    def d(self, name, q, qd):
        factors = self.points[name]
        moving = self.moving(factors)
        return sum((self.product(factors, q, (i, j))[:3, 3] * qd[i] * qd[j] for i in moving for j in moving),
                   numpy.array([number(0)] * 3, dtype=object))


# ---- formulas: the text of the model, read as Python ----

class Vector:
    """x y z, xd yd zd, xdd ydd zdd of a point or a direction along the motion; axes of a point."""

    def __init__(self, view, factors, direction=(0, 0, 0, 1)):
        self.view, self.factors, self.direction = view, factors, numbers(direction)

    def at(self, s):
        return self.view.frame(self.factors, s).dot(self.direction)[:3]

    @functools.cached_property
    def now(self):
        return self.at(number(0))

    @functools.cached_property
    def rate(self):
        return (self.at(STEP) - self.at(-STEP)) / (2 * STEP)

    @functools.cached_property
    def second_rate(self):
        return (self.at(STEP) - 2 * self.now + self.at(-STEP)) / STEP ** 2

    def __getattr__(self, name):
        if name[0] not in "xyz" or name[1:] not in ("", "d", "dd"):
            raise AttributeError(name)
        return [self.now, self.rate, self.second_rate][len(name) - 1]["xyz".index(name[0])]

    @functools.cached_property
    def axes(self):
        return Axes(self.view, self.factors)


class Axes:
    def __init__(self, view, factors):
        self.x, self.y, self.z = (Vector(view, factors, [int(i == axis) for i in range(4)]) for axis in range(3))


class Names:
    """Members by name, made on first use."""

    def __init__(self, make):
        self.make = make

    def __getattr__(self, name):
        self.__dict__[name] = self.make(name)
        return self.__dict__[name]

    def __getitem__(self, name):
        return getattr(self, name)


class View:
    """The state as the formulas of a model see it."""

    def __init__(self, tree, t, q, qd, qdd=None):
        self.tree, self.t = tree, number(t)
        self.known = {}
        for name, values in (("q", q), ("qd", qd), ("qdd", [0] * tree.n if qdd is None else qdd)):
            setattr(self, name, numbers(values))
        index = tree.names.index
        self.s = types.SimpleNamespace(
            t=self.t, q=Names(lambda name: self.q[index(name)]), qd=Names(lambda name: self.qd[index(name)]),
            qdd=Names(lambda name: self.qdd[index(name)]), inputs=types.SimpleNamespace(**{
                name: number(value) for name, value in tree.model.get("inputs", {}).items()}),
            points=Names(lambda name: Vector(self, tree.points[name])), axes=Names(lambda name: Axes(self, tree.frames[name])))

    def frame(self, factors, s):
        """T of a place after s seconds of motion."""
        key = id(factors), s
        if key not in self.known:
            self.known[key] = self.tree.product(factors, self.q + self.qd * s + self.qdd * s ** 2 / 2)
        return self.known[key]

    def value(self, formula):
        if not isinstance(formula, str):
            return number(formula)
        names = {"s": self.s, "rd": FUNCTIONS, **{name: curve(samples) for name, samples in self.tree.model.get("curves", {}).items()}}
        return eval(compiled(formula), names)  # pylint: disable=eval-used

    def place(self, place):
        return Vector(self, self.tree.place(place))

    def axes_of(self, place):
        factors = self.tree.place(place)
        return [Vector(self, factors, [int(i == axis) for i in range(4)]).now for axis in range(3)]


@functools.lru_cache(maxsize=None)
def compiled(formula):
    return compile(formula.replace("^", "**"), formula, "eval")


def clamped(t, t0, t1):
    return min(max((t - t0) / (t1 - t0), 0), 1)


FUNCTIONS = types.SimpleNamespace(
    pi=number(float(mpmath.pi)), **{name: getattr(mpmath, name) for name in (
        "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt")},
    pow=lambda a, b: number(a) ** number(b), abs=abs, min=min, max=max, less=lambda a, b: number(int(a < b)), where=lambda c, a, b: number(a if c else b),
    ramp=lambda *a: (1 - mpmath.cos(mpmath.pi * clamped(*a))) / 2, smoothstep=lambda *a: clamped(*a) ** 2 * (3 - 2 * clamped(*a)),
    friction=lambda level, rate, width: -level * mpmath.tanh(rate / width))


@functools.lru_cache(maxsize=None)
def knots(samples):
    """x, y and second derivatives of the natural cubic spline, from a full linear system."""
    x, y = numbers(at for at, _ in samples), numbers(value for _, value in samples)
    n = len(x)
    A, b = mpmath.eye(n), mpmath.zeros(n, 1)
    for i in range(1, n - 1):
        A[i, i - 1], A[i, i], A[i, i + 1] = x[i] - x[i - 1], 2 * (x[i + 1] - x[i - 1]), x[i + 1] - x[i]
        b[i] = 6 * ((y[i + 1] - y[i]) / (x[i + 1] - x[i]) - (y[i] - y[i - 1]) / (x[i] - x[i - 1]))
    return x, y, mpmath.lu_solve(A, b)


def curve(samples):
    """Natural cubic spline, straight outside; ascending samples."""
    x, y, m = knots(tuple(map(tuple, samples)))

    def piece(i, at):
        h, a, b = x[i + 1] - x[i], x[i + 1] - at, at - x[i]
        return (m[i] * a ** 3 + m[i + 1] * b ** 3) / (6 * h) + (y[i] / h - m[i] * h / 6) * a + (y[i + 1] / h - m[i + 1] * h / 6) * b

    def value(at):
        n = len(x)
        if at < x[0]:
            return y[0] + (at - x[0]) * (piece(0, x[0] + STEP) - piece(0, x[0] - STEP)) / (2 * STEP)
        if at >= x[n - 1]:
            return y[n - 1] + (at - x[n - 1]) * (piece(n - 2, x[n - 1] + STEP) - piece(n - 2, x[n - 1] - STEP)) / (2 * STEP)
        return piece(max(i for i in range(n - 1) if x[i] <= at), at)
    return value


# ---- forces ----

def length(vector):
    return mpmath.sqrt(vector.dot(vector))


def named_energy(tree, q):
    """Energy of the springs and potentials that `forces` lists."""
    view, energy = View(tree, 0, q, [0] * tree.n), number(0)
    for entry in tree.model.get("forces", {}).get("list", []):
        if entry.tag == "energy":
            energy += view.value(entry.items[0])
        elif entry.tag == "spring":
            stretch = length(view.place(entry.items[1]).now - view.place(entry.items[0]).now) - number(entry.get("rest", 0))
            energy += number(entry["stiffness"]) * stretch ** 2 / 2
    return energy


def loads(view):
    """(place, force, torque) of all loads without an energy."""
    for entry in view.tree.model.get("forces", {}).get("list", []):
        if entry.tag in ("damper", "actuator"):
            a, b = (view.place(place) for place in entry.items[:2])
            apart = b.now - a.now
            along = apart / length(apart)
            push = view.value(entry.items[2]) if entry.tag == "actuator" else -number(entry["damping"]) * along.dot(b.rate - a.rate)
            yield entry.items[1], along * push, None
            yield entry.items[0], -along * push, None
        elif entry.tag in ("force", "torque"):
            value = numbers(view.value(component) for component in entry.items[1])
            if "axes" in entry:
                value = sum(component * axis for component, axis in zip(value, view.axes_of(entry["axes"])))
            if entry.tag == "force":
                yield entry.items[0], value, None
            else:
                yield entry.items[0], None, value
                if "against" in entry:
                    yield entry["against"], None, -value


def other_forces(tree, t, q, qd):
    """Dampers, named forces and loads, and the forces of named springs and energies."""
    q, qd = numbers(q), numbers(qd)
    view = View(tree, t, q, qd)
    J = strain_slopes(tree, q)
    Q = -J.T.dot(numbers(tree.damper) * J.dot(qd))
    for name, formula in tree.model.get("forces", {}).get("by_coordinate", {}).items():
        Q[tree.names.index(name)] += view.value(formula)
    for place, force, torque in loads(view):
        factors = tree.place(place)
        Q = Q + (force.dot(tree.columns(factors, q)) if torque is None else torque.dot(tree.turn_columns(factors, q)))
    return Q


def energy_slopes(tree, q):
    if not any(entry.tag in ("spring", "energy") for entry in tree.model.get("forces", {}).get("list", [])):
        return numbers([0] * tree.n)
    unit = identity(tree.n) * STEP
    return numbers((named_energy(tree, q + e) - named_energy(tree, q - e)) / (2 * STEP) for e in unit)


def weight_forces(tree, q):
    """-dEp_g/dq_i"""
    g = numbers([0] * tree.n)
    gravity = numbers(list(tree.model["gravity"]) + [0])
    for factors, H in tree.bodies:
        for i in tree.moving(factors):
            g[i] += gravity.dot(tree.product(factors, q, (i,)).dot(H[:, 3]))
    return g


def strains(tree, q):
    """Coordinates, with strains in place of the turns of elements."""
    w = numbers(q)
    for places in tree.strained:
        w[places] = w[places] + commutators(w[places])
    return w


def stretches(tree, q):
    return strains(tree, q) - strains(tree, tree.rest)


def strain_slopes(tree, q):
    """J = dw/dq. w is of second order, so differences are exact."""
    return numpy.array([(strains(tree, numbers(q) + e) - strains(tree, numbers(q) - e)) / 2 for e in identity(tree.n)], dtype=object).T


def forces(tree, t, q, qd):
    """Q of the corrected form."""
    q = numbers(q)
    springs = strain_slopes(tree, q).T.dot(numbers(tree.spring) * stretches(tree, q))
    return weight_forces(tree, q) - springs - energy_slopes(tree, q) + other_forces(tree, t, q, qd)


def force_tangent(tree, t, q):
    """dQ_i/dq_j at rest."""
    q, still = numbers(q), [0] * tree.n
    columns = [(forces(tree, t, q + e, still) - forces(tree, t, q - e, still)) / (2 * STEP) for e in identity(tree.n) * STEP]
    return numpy.array(columns, dtype=object).T


def potential(tree, q):
    gravity = numbers(list(tree.model["gravity"]) + [0])
    energy = sum(s * x ** 2 / 2 for s, x in zip(tree.spring, stretches(tree, q))) + named_energy(tree, q)
    for factors, H in tree.bodies:
        if tree.moving(factors):  # a body welded to the ground is part of it
            energy -= gravity.dot(tree.product(factors, q).dot(H[:, 3]))
    return energy


# ---- equations of motion ----

def trace(a, b, c):
    """tr{a b c^T}"""
    return sum((a.dot(b) * c).flatten())


def dynamics(tree, t, q, qd):
    """M, h, Q, kinetic and potential energy, power, by the sums of theory, sect. 2.2."""
    n, q, qd = tree.n, numbers(q), numbers(qd)
    printed = tree.model.get("form") == "printed"
    M = matrix([[0] * n for _ in range(n)])
    c, s = numbers([0] * n), numbers([0] * n)
    for factors, H in tree.bodies:
        moving = tree.moving(factors)
        T = {i: tree.product(factors, q, (i,)) for i in moving}
        T_of = {(i, j): tree.product(factors, q, (i, j)) for i in moving for j in moving if i <= j}
        second = {i: sum(T_of[min(i, j), max(i, j)] * qd[j] for j in moving) for i in moving}
        along = sum((T[i] * qd[i] for i in moving), identity() * 0)
        twice = sum((second[i] * qd[i] for i in moving), identity() * 0)
        for i in moving:
            c[i] += trace(T[i], H, twice)
            s[i] += trace(along, H, second[i])
            for j in moving:
                M[i, j] += trace(T[i], H, T[j])
    Q = forces(tree, t, q, qd)
    others = other_forces(tree, t, q, qd)
    h = -c
    if printed:
        h = c + 2 * s
        Q = Q + [sum(qd * (other_forces(tree, t, q, qd + e) - other_forces(tree, t, q, qd - e))) / (2 * STEP)
                 for e in identity(n) * STEP]
    return {"M": M, "h": h, "Q": Q, "kinetic": qd.dot(M).dot(qd) / 2, "potential": potential(tree, q), "power": qd.dot(others),
            "power_size": float(abs(qd * others).sum())}


# ---- rows ----

def normals(direction):
    """Two unit vectors across an axis: the next axes if it is a frame's axis, otherwise built from the axis that is farthest away."""
    if sorted(abs(direction)) == [0, 0, 1]:
        axis = list(abs(direction)).index(1)
        return [numbers(int(i == (axis + step) % 3) for i in range(3)) for step in (1, 2)]
    farthest = min(range(3), key=lambda i: abs(direction[i]))
    first = numpy.cross(direction, numbers(int(i == farthest) for i in range(3)))
    first = first / length(first)
    return [first, numpy.cross(direction, first) / length(direction)]


def direction_of(axis):
    given = axis["direction"]
    vector = numbers([int(given == name) for name in "xyz"] if isinstance(given, str) else given)
    return vector / length(vector)


def axis_place(axis):
    return {"on": axis["on"], **{name: axis[name] for name in ("along", "at", "turn") if name in axis}}


def fixed(view, place, direction):
    return Vector(view, view.tree.place(place), list(direction) + [0]).now


def row_levels(entry):
    """The levels of the rows that one entry makes, in order."""
    counts = {"loop": len(entry.get("keep", "xyz")), "parallel": 2, "on_line": 2}
    if entry.tag == "close":
        slides = sum(name in "xyz" for name in entry["joint"])
        turning = 3 if "ball" in entry["joint"] else 0 if "weld" in entry["joint"] else len(entry["joint"]) - slides
        return ["position"] * (3 - slides + [3, 2, 1, 0][turning])
    return [entry.tag if entry.tag in ("velocity", "acceleration") else "position"] * counts.get(entry.tag, 1)


def residuals(view, entry):
    """Residuals of one entry of `constraints`."""
    def gap(a, b):
        return view.place(a).now - view.place(b).now

    def across(axis):
        return [fixed(view, axis_place(axis), normal) for normal in normals(direction_of(axis))]
    a, b = (list(entry.items) + [None])[:2]
    if entry.tag in ("position", "velocity", "acceleration"):
        return [view.value(a)]
    if entry.tag == "loop":
        return [gap(a, b)["xyz".index(name)] for name in sorted(entry.get("keep", "xyz"))]
    if entry.tag == "parallel":
        return [fixed(view, axis_place(a), direction_of(a)).dot(normal) for normal in across(b)]
    if entry.tag == "perpendicular":
        return [fixed(view, axis_place(a), direction_of(a)).dot(fixed(view, axis_place(b), direction_of(b)))]
    if entry.tag == "on_line":
        return [gap(a, axis_place(b)).dot(normal) for normal in across(b)]
    if entry.tag == "on_plane":
        return [gap(a, axis_place(b)).dot(fixed(view, axis_place(b), direction_of(b)))]
    if entry.tag == "distance":
        return [length(gap(a, b)) - view.value(entry.items[2])]
    if entry.tag == "close":
        return closed(view, entry, gap(a, b), view.axes_of(a), view.axes_of(b))
    i = view.tree.names.index(a)
    return [view.q[i] - (view.tree.start[i] if b is None else view.value(b))]


def closed(view, entry, apart, of_a, of_b):
    joint = entry["joint"]
    slides = [name for name in joint if name in ("x", "y", "z")]
    turning = [AXES[name] for name in joint if name in TURNS]
    rows = [apart.dot(of_b[i]) if slides else apart[i] for i in range(3) if "xyz"[i] not in slides]
    if "ball" in joint or len(turning) == 3:
        return rows
    if len(turning) == 2:
        return rows + [of_a[turning[1]].dot(of_b[turning[0]])]
    if len(turning) == 1:
        return rows + [of_a[turning[0]].dot(of_b[(turning[0] + step) % 3]) for step in (1, 2)]
    return rows + [of_a[i].dot(of_b[(i + 1) % 3]) for i in range(3)]


def rows(tree, t, q, qd):
    """u, v, phi, psi, k of each row by differences of its residual."""
    n, t, q, qd = tree.n, number(t), numbers(q), numbers(qd)
    nothing, units = numbers([0] * n), identity(n)
    result = {"u": [], "v": [], "phi": [], "psi": [], "k": []}
    for entry in tree.model.get("rows", []):
        def f(s=0, dq=nothing, dqd=nothing, qdd=nothing):
            return numbers(residuals(View(tree, t + s, q + qd * s + dq, qd + dqd, qdd), entry))

        levels = row_levels(entry)
        now, ahead, behind = f(), f(STEP), f(-STEP)
        rate, change = (ahead - behind) / (2 * STEP), (ahead - 2 * now + behind) / STEP ** 2
        alpha, beta = number(entry.get("alpha", 0)), number(entry.get("beta", 0))
        if levels[0] == "position":
            u = [(f(dq=e * STEP) - f(dq=-e * STEP)) / (2 * STEP) for e in units]
            v, phi, psi = change, now, rate
        elif levels[0] == "velocity":
            u = [(f(dqd=e * STEP) - f(dqd=-e * STEP)) / (2 * STEP) for e in units]
            v, phi, psi = rate, None, now
        else:
            u = [f(qdd=e) - now for e in units]
            v, phi, psi = now, None, None
        for i in range(len(levels)):
            result["u"].append([column[i] for column in u])
            result["v"].append(v[i])
            result["phi"].append(None if phi is None else phi[i])
            result["psi"].append(None if psi is None else psi[i])
            result["k"].append(-v[i] - (2 * alpha * psi[i] if psi is not None else 0) - (beta ** 2 * phi[i] if phi is not None else 0))
    return result


def accelerations(M, f, u, k):
    """qdd and programme force of [M u^T; u 0] [qdd; -lambda] = [f; k]."""
    n, m = len(f), len(k)
    A, b = mpmath.zeros(n + m, n + m), mpmath.zeros(n + m, 1)
    for i in range(n):
        b[i] = f[i]
        for j in range(n):
            A[i, j] = M[i][j]
        for row in range(m):
            A[i, n + row] = A[n + row, i] = u[row][i]
    for row in range(m):
        b[n + row] = k[row]
    x = mpmath.lu_solve(A, b)
    force = [-sum(u[row][i] * x[n + row] for row in range(m)) for i in range(n)]
    return [x[i] for i in range(n)], force
