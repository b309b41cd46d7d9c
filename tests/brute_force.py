"""The formulation evaluated as it is written, in 50 digits: T_i and T_ij of every body, traces of 4 x 4 products.

A model is plain data (see `random_models.py`). Nothing here is fast or clever, and nothing is shared with the
generator. Programme rows are differentiated by central differences, which at 50 digits leave 30 correct ones.
"""
import mpmath
import numpy

mpmath.mp.dps = 50
STEP = mpmath.mpf(10) ** -16
AXES = {"x": 0, "y": 1, "z": 2, "phi": 0, "theta": 1, "psi": 2}
TURNS = ("phi", "theta", "psi")


def number(value):
    return mpmath.mpf(value)


def matrix(rows):
    return numpy.array([[number(entry) for entry in row] for row in rows], dtype=object)


def identity():
    return matrix([[int(i == j) for j in range(4)] for i in range(4)])


def shift(vector):
    result = identity()
    result[:3, 3] = [number(entry) for entry in vector]
    return result


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


def pseudo_inertia(mass, center, tensor):
    """H = int r r^T dm from mass, centre of mass and the inertia tensor about it (xx yy zz xy xz yz)."""
    xx, yy, zz, xy, xz, yz = [number(entry) for entry in tensor]
    about_center = matrix([[(yy + zz - xx) / 2, -xy, -xz], [-xy, (xx + zz - yy) / 2, -yz], [-xz, -yz, (xx + yy - zz) / 2]])
    c = numpy.array([number(entry) for entry in center], dtype=object)
    H = identity() * 0
    H[:3, :3] = about_center + number(mass) * numpy.outer(c, c)
    H[:3, 3] = H[3, :3] = number(mass) * c
    H[3, 3] = number(mass)
    return H


class Tree:
    """Bodies as products of constant placements and elementary coordinates."""

    def __init__(self, model):
        self.model = model
        self.names, self.kinds, self.spring, self.damper = [], [], [], []
        self.bodies = []  # (factors, H); a factor is a 4 x 4 matrix or the index of a coordinate
        self.frames = {None: []}
        for link in model["links"]:
            self.add_link(link)
        self.n = len(self.names)

    def add_coordinate(self, name, kind, spring, damper):
        self.names.append(name)
        self.kinds.append(kind)
        self.spring.append(number(spring))
        self.damper.append(number(damper))
        return self.n_so_far() - 1

    def n_so_far(self):
        return len(self.names)

    def add_link(self, link):
        factors = self.frames[link.get("on")] + [shift(link.get("at", (0, 0, 0)))]
        for axis, angle in link.get("turn", []):
            factors = factors + [elementary({"x": "phi", "y": "theta", "z": "psi"}[axis], angle, 0)]
        for kind in link.get("joint", []):
            factors = factors + [self.add_coordinate(f"{link['name']}_{kind}", kind, link.get("spring", {}).get(kind, 0),
                                                     link.get("damper", {}).get(kind, 0))]
        self.frames[link["name"]] = factors
        if "mass" in link:
            self.bodies.append((factors, pseudo_inertia(link["mass"], link.get("center", (0, 0, 0)),
                                                        link.get("inertia", (0,) * 6))))
        if "beam" in link:
            self.add_beam(link["name"], link["beam"], factors)

    def add_beam(self, name, beam, factors):
        rfe, length, d = beam["rfe"], number(beam["length"]), number(beam["diameter"])
        area, bending, torsion = mpmath.pi * d ** 2 / 4, mpmath.pi * d ** 4 / 64, mpmath.pi * d ** 4 / 32
        E, rho = number(beam["E"]), number(beam["rho"])
        G = E / (2 * (1 + number(beam["nu"])))
        dl = length / (rfe - 1) if rfe > 1 else 2 * length
        for element in range(rfe):
            if element:
                factors = factors + [shift((dl / 2 if element == 1 else dl, 0, 0))]
                for kind in beam.get("dofs", ("psi", "theta", "phi")):
                    stiffness = (G * torsion if kind == "phi" else E * bending) / dl
                    factors = factors + [self.add_coordinate(f"{name}_{kind}_{element}", kind, stiffness,
                                                             number(beam.get("eta", 0)) * stiffness)]
            long = dl / 2 if element in (0, rfe - 1) else dl
            H = identity() * 0
            H[0, 0], H[1, 1], H[2, 2] = area * long ** 3 / 3, bending * long, bending * long
            H[0, 3] = H[3, 0] = area * long ** 2 / 2
            H[3, 3] = area * long
            self.bodies.append((factors, H * rho))
        self.frames[name + ".tip"] = factors + [shift((long, 0, 0))]

    def product(self, factors, q, derivatives=()):
        """T, T_i or T_ij: each coordinate named in `derivatives` is differentiated once for each time it is named."""
        if any(which not in [factor for factor in factors if isinstance(factor, int)] for which in derivatives):
            return None
        result = identity()
        for factor in factors:
            if isinstance(factor, int):
                factor = elementary(self.kinds[factor], q[factor], list(derivatives).count(factor))
            result = result.dot(factor)
        return result

    def moving(self, factors):
        return [factor for factor in factors if isinstance(factor, int)]

    def point(self, name):
        point = self.model["points"][name]
        return self.frames[point["on"]] + [shift(point.get("at", (0, 0, 0)))]

    def r(self, name, q):
        return self.product(self.point(name), q)[:3, 3]

    def C(self, name, q):
        result = numpy.array([[number(0)] * self.n for _ in range(3)], dtype=object)
        factors = self.point(name)
        for i in self.moving(factors):
            result[:, i] = self.product(factors, q, (i,))[:3, 3]
        return result

    def d(self, name, q, qd):
        factors = self.point(name)
        moving = self.moving(factors)
        return sum((self.product(factors, q, (i, j))[:3, 3] * qd[i] * qd[j] for i in moving for j in moving),
                   numpy.array([number(0)] * 3, dtype=object))


def trace(a, b, c):
    """tr{a b c^T}"""
    return sum((a.dot(b) * c).flatten())


def dynamics(tree, t, q, qd):
    """M, h, Q, kinetic and potential energy by the sums of the formulation, sect. 3."""
    n, q, qd = tree.n, [number(x) for x in q], [number(x) for x in qd]
    M = matrix([[0] * n for _ in range(n)])
    c, potential = [number(0)] * n, number(0)
    gravity = numpy.array([number(x) for x in tree.model["gravity"]] + [number(0)], dtype=object)
    Q = [-tree.spring[i] * q[i] - tree.damper[i] * qd[i] for i in range(n)]
    for factors, H in tree.bodies:
        moving = tree.moving(factors)
        T = {i: tree.product(factors, q, (i,)) for i in moving}
        second = identity() * 0
        for i in moving:
            for j in moving:
                second = second + tree.product(factors, q, (i, j)) * (qd[i] * qd[j])
        for i in moving:
            c[i] += trace(T[i], H, second)
            Q[i] += gravity.dot(T[i].dot(H[:, 3]))
            for j in moving:
                M[i, j] += trace(T[i], H, T[j])
        if moving:  # what is welded to the ground is part of it
            potential -= gravity.dot(tree.product(factors, q).dot(H[:, 3]))
    potential += sum(tree.spring[i] * q[i] ** 2 / 2 for i in range(n))
    for name, force, _ in tree.model.get("forces", []):
        Q[tree.names.index(name)] += force(t, dict(zip(tree.names, q)), dict(zip(tree.names, qd)))
    kinetic = sum(qd[i] * M[i, j] * qd[j] for i in range(n) for j in range(n)) / 2
    return {"M": M, "h": [-entry for entry in c], "Q": Q, "kinetic": kinetic, "potential": potential}


class View:
    """What a row of the model reads: time, coordinates by name and the point E."""

    def __init__(self, tree, t, q, qd, qdd):
        C = tree.C("E", q)
        self.t = t
        self.q, self.qd, self.qdd = (dict(zip(tree.names, x)) for x in (q, qd, qdd))
        self.x, self.y, self.z = tree.r("E", q)
        self.xd, self.yd, self.zd = C.dot(qd)
        if any(qdd) or tree.model.get("bias"):
            self.xdd, self.ydd, self.zdd = C.dot(qdd) + tree.d("E", q, qd)


def rows(tree, t, q, qd):
    """u, v, phi, psi, k of each row by differences of its residual."""
    n = tree.n
    t, q, qd = number(t), numpy.array([number(x) for x in q], dtype=object), numpy.array([number(x) for x in qd], dtype=object)
    nothing = numpy.array([number(0)] * n, dtype=object)
    unit = [numpy.array([number(int(i == j)) for j in range(n)], dtype=object) for i in range(n)]
    result = {"u": [], "v": [], "phi": [], "psi": [], "k": []}
    for row in tree.model.get("rows", []):
        tree.model["bias"] = row["level"] == "acceleration"

        def f(s=0, dq=nothing, dqd=nothing, qdd=nothing):
            return row["residual"](View(tree, t + s, q + qd * s + dq, qd + dqd, qdd))

        along = [f(-STEP), f(), f(STEP)]
        alpha, beta = number(row.get("alpha", 0)), number(row.get("beta", 0))
        phi = psi = None
        if row["level"] == "position":
            u = [(f(dq=e * STEP) - f(dq=-e * STEP)) / (2 * STEP) for e in unit]
            v = (along[2] - 2 * along[1] + along[0]) / STEP ** 2
            phi, psi = along[1], (along[2] - along[0]) / (2 * STEP)
            k = -v - 2 * alpha * psi - beta ** 2 * phi
        elif row["level"] == "velocity":
            u = [(f(dqd=e * STEP) - f(dqd=-e * STEP)) / (2 * STEP) for e in unit]
            v = (along[2] - along[0]) / (2 * STEP)
            psi = along[1]
            k = -v - 2 * alpha * psi
        else:
            v = f()
            u = [f(qdd=e) - v for e in unit]
            k = -v
        for name, value in zip(("u", "v", "phi", "psi", "k"), (u, v, phi, psi, k)):
            result[name].append(value)
    return result
