"""Recursive dynamics of a serial chain over numbers of any kind, after Featherstone, Rigid Body Dynamics Algorithms (2008).

The same lines compute the reference values, with numbers of 60 digits, and the expressions from which CasADi generates C. Spatial vectors
hold the rotation first, then the translation; X transforms motions from the frame before a joint to the frame after it.
"""
import mpmath
import numpy as np

import chain

DIGITS = 60
STEP = mpmath.mpf(10) ** -20  # of central differences; with 60 digits they are right to about 40


class Kind:
    """What the recursions need to know about a kind of numbers."""

    def __init__(self, number, sin, cos):
        self.number, self.sin, self.cos = number, sin, cos


EXACT = Kind(mpmath.mpf, mpmath.sin, mpmath.cos)


def table(rows):
    """An array of objects, filled one by one, since NumPy would take expressions of CasADi for arrays."""
    made = np.zeros((len(rows), len(rows[0])), object)
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            made[i, j] = value
    return made


def column(values):
    return table([[value] for value in values])


def scaled(array, factor):
    return table([[value * factor for value in row] for row in array])


def cross(v):
    """The matrix of the vector product of a column."""
    x, y, z = v[:, 0]
    return table([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def spatial(a, b, c, d):
    return np.vstack([np.hstack([a, b]), np.hstack([c, d])])


def cross_motion(v):
    return spatial(cross(v[:3]), ZERO, cross(v[3:]), cross(v[:3]))


def mirrored(array):
    """A symmetric matrix from its upper triangle."""
    return table([[array[min(i, j), max(i, j)] for j in range(6)] for i in range(6)])


ZERO, UNIT = table([[0] * 3] * 3), table(np.eye(3, dtype=int).tolist())


class Chain:
    """The links with numbers of one kind: axes of motion, inertias, and transformations at the coordinates q."""

    def __init__(self, links, kind, q):
        self.kind, self.links, self.n = kind, links, len(links)
        self.rotations, self.places, self.transforms, self.axes, self.inertias = [], [], [], [], []
        for link, coordinate in zip(links, q):
            turn, place = self.constant(link.turn), self.constant([[x] for x in link.place])
            axis = UNIT[:, [link.axis]]
            if link.slides:
                place = place + turn @ scaled(axis, coordinate)
            else:
                turn = turn @ self.rotation(link.axis, coordinate)
            self.rotations.append(turn)
            self.places.append(place)
            self.transforms.append(spatial(turn.T, ZERO, -(turn.T @ cross(place)), turn.T))
            self.axes.append(np.vstack([0 * axis, axis] if link.slides else [axis, 0 * axis]))
            self.inertias.append(self.inertia(link))

    def constant(self, rows):
        return table([[x if isinstance(x, int) else self.kind.number(x) for x in row] for row in rows])

    def rotation(self, axis, angle):
        turn, i, j = table([[0] * 3] * 3), (axis + 1) % 3, (axis + 2) % 3
        turn[axis, axis], turn[i, i], turn[j, j] = 1, self.kind.cos(angle), self.kind.cos(angle)
        turn[i, j], turn[j, i] = -self.kind.sin(angle), self.kind.sin(angle)
        return turn

    def inertia(self, link):
        mass, center = self.kind.number(link.mass), cross(self.constant([[x] for x in link.center]))
        about = self.constant(np.diag(np.array(link.inertia, object)).tolist())
        return spatial(about + scaled(center @ center.T, mass), scaled(center, mass), scaled(center.T, mass), scaled(UNIT, mass))

    def base_acceleration(self, gravity):
        """That of the ground, upwards, which stands for the weight of all bodies."""
        return column([0, 0, 0, 0, 0, self.kind.number(gravity)])

    def velocities(self, qd):
        """For each link its velocity and the part of its acceleration that is quadratic in the rates."""
        v, found = None, []
        for X, axis, rate in zip(self.transforms, self.axes, qd):
            own = scaled(axis, rate)
            v = own if v is None else X @ v + own
            found.append((v, cross_motion(v) @ own))
        return found

    def inverse(self, qd, qdd, gravity):
        """Forces of the joints: Newton-Euler."""
        a, wrenches = self.base_acceleration(gravity), []
        for X, axis, inertia, (v, bias), acceleration in zip(self.transforms, self.axes, self.inertias, self.velocities(qd), qdd):
            a = X @ a + bias + scaled(axis, acceleration)
            wrenches.append(inertia @ a - cross_motion(v).T @ (inertia @ v))
        forces = [None] * self.n
        for i in reversed(range(self.n)):
            forces[i] = (self.axes[i].T @ wrenches[i])[0, 0]
            if i:
                wrenches[i - 1] = wrenches[i - 1] + self.transforms[i].T @ wrenches[i]
        return forces

    def accelerations(self, qd, forces, gravity):
        """The articulated-body algorithm."""
        velocities, inertias = self.velocities(qd), list(self.inertias)
        wrenches = [-(cross_motion(v).T @ (inertia @ v)) for inertia, (v, _) in zip(inertias, velocities)]
        columns, inverses, rests = [None] * self.n, [None] * self.n, [None] * self.n
        for i in reversed(range(self.n)):
            axis, X, bias = self.axes[i], self.transforms[i], velocities[i][1]
            columns[i] = inertias[i] @ axis
            inverses[i] = 1 / (axis.T @ columns[i])[0, 0]
            rests[i] = forces[i] - (axis.T @ wrenches[i])[0, 0]
            if i:
                part = scaled(columns[i], inverses[i])
                left = mirrored(inertias[i] - part @ columns[i].T)
                inertias[i - 1] = inertias[i - 1] + mirrored(X.T @ left @ X)
                wrenches[i - 1] = wrenches[i - 1] + X.T @ (wrenches[i] + left @ bias + scaled(part, rests[i]))
        a, found = self.base_acceleration(gravity), []
        for i in range(self.n):
            a = self.transforms[i] @ a + velocities[i][1]
            found.append((rests[i] - (columns[i].T @ a)[0, 0]) * inverses[i])
            a = a + scaled(self.axes[i], found[i])
        return found

    def mass_matrix(self):
        """The upper triangle by columns: composite bodies."""
        composite, found = list(self.inertias), []
        for i in reversed(range(1, self.n)):
            composite[i - 1] = composite[i - 1] + mirrored(self.transforms[i].T @ composite[i] @ self.transforms[i])
        for j in range(self.n):
            wrench, upwards = composite[j] @ self.axes[j], []
            for i in reversed(range(j + 1)):
                upwards.append((self.axes[i].T @ wrench)[0, 0])
                wrench = self.transforms[i].T @ wrench
            found += reversed(upwards)
        return found

    def tip(self):
        """The place of the last frame on the ground."""
        place = column([0] * 3)
        for turn, step in zip(reversed(self.rotations), reversed(self.places)):
            place = step + turn @ place
        return list(place[:, 0])


def passive(links, kind, q, qd):
    """Forces of springs and dampers."""
    return [-kind.number(link.stiffness) * x - kind.number(link.damping) * rate for link, x, rate in zip(links, q, qd)]


def forward(links, kind, q, qd, tau):
    """Accelerations with springs, dampers, weight and the forces tau."""
    forces = [own + force for own, force in zip(passive(links, kind, q, qd), tau)]
    return Chain(links, kind, q).accelerations(qd, forces, chain.GRAVITY)


def inverse(links, kind, q, qd, qdd):
    """The forces tau that make these accelerations."""
    return [force - own for force, own in zip(Chain(links, kind, q).inverse(qd, qdd, chain.GRAVITY), passive(links, kind, q, qd))]


def along(start, direction, factor):
    return [x + factor * d for x, d in zip(start, direction)]


def derivative(function, start, direction):
    """d function(start + s direction) / ds at s = 0."""
    up, down = (function(along(start, direction, step)) for step in (STEP, -STEP))
    return [(a - b) / (2 * STEP) for a, b in zip(up, down)]


def held(links, q, qd, tau):
    """Accelerations while three forces at the tip keep its acceleration zero."""
    def tip(at):
        return Chain(links, EXACT, at).tip()

    def tip_acceleration(qdd):
        before, after = (tip(along(along(q, qd, step), qdd, step**2 / 2)) for step in (-STEP, STEP))
        return [(a - 2 * now + b) / STEP**2 for a, now, b in zip(after, tip(q), before)]

    n, rest = len(q), [mpmath.mpf(0)] * len(q)
    columns = [derivative(tip, q, [int(i == j) for j in range(n)]) for i in range(n)]
    still = Chain(links, EXACT, q)
    answers = [still.accelerations(rest, [each[k] for each in columns], 0) for k in range(3)]  # to a unit force along x, y, z
    matrix = mpmath.matrix([[sum(each[k] * a for each, a in zip(columns, answer)) for answer in answers] for k in range(3)])
    free = forward(links, EXACT, q, qd, tau)
    force = mpmath.lu_solve(matrix, -mpmath.matrix(tip_acceleration(free)))
    for k in range(3):
        free = along(free, answers[k], force[k])
    return free


def directions(n_rfe):
    """A vector with which matrices are multiplied before they are compared."""
    return chain.state(n_rfe + 1)[1][:3 * n_rfe + 1]


def reference(n_rfe):
    """Of each quantity its vectors, matrices times `directions`: rounded from 60 digits."""
    mpmath.mp.dps = DIGITS
    links, n = chain.links(n_rfe), 3 * n_rfe + 1
    q, qd, tau, qdd = ([mpmath.mpf(x) for x in row] for row in chain.state(n_rfe))
    w, rest = [mpmath.mpf(x) for x in directions(n_rfe)], [mpmath.mpf(0)] * n
    mass = Chain(links, EXACT, q).inverse(rest, w, 0)
    found = {
        "accelerations": [forward(links, EXACT, q, qd, tau)],
        "rows": [held(links, q, qd, tau)],
        "mass": [mass, Chain(links, EXACT, q).inverse(qd, rest, 0)],
        "d_accelerations": [derivative(lambda at: forward(links, EXACT, at, qd, tau), q, w), derivative(lambda at: forward(links, EXACT, q, at, tau), qd, w)],
        "inverse": [inverse(links, EXACT, q, qd, qdd)],
        "d_inverse": [derivative(lambda at: inverse(links, EXACT, at, qd, qdd), q, w), derivative(lambda at: inverse(links, EXACT, q, at, qdd), qd, w), mass],
    }
    with mpmath.workdps(2 * DIGITS):  # a difference of second differences
        found["d_rows"] = [derivative(lambda at: held(links, at, qd, tau), q, w), derivative(lambda at: held(links, q, at, tau), qd, w)]
    return {quantity: [[float(x) for x in vector] for vector in vectors] for quantity, vectors in found.items()}
