"""An inextensible, shear-rigid rod, clamped at the origin along x, under a dead load at its tip: a boundary value problem solved by
shooting.

Independent of rigid finite elements: r' = R e_x, R' = R [k]x, R S (k - k_0) = m and m = (r_tip - r) x F, with S = diag(G It, E Iy, E Iz).
The only unknown is the position of the tip, since m depends on nothing else.
"""
import math

import numpy
from scipy.integrate import solve_ivp


def torsion_constant(a, b):
    """Saint-Venant's torsion constant of a rectangle with sides a >= b."""
    tail = sum(math.tanh(k * math.pi * a / (2 * b)) / k ** 5 for k in range(1, 400, 2))
    return a * b ** 3 / 3 * (1 - 192 * b / (math.pi ** 5 * a) * tail)


def rotation(q):
    q0, v = q[0], q[1:]
    cross = numpy.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return ((q0 * q0 - v @ v) * numpy.eye(3) + 2 * numpy.outer(v, v) + 2 * q0 * cross) / (q @ q)


def tip_reached(length, rigidity, curvature, force, tip):
    def rates(_, state):
        r, q = state[:3], state[3:]
        R = rotation(q)
        k = curvature + R.T @ numpy.cross(tip - r, force) / rigidity
        return numpy.concatenate([R[:, 0], [-q[1:] @ k / 2], (q[0] * k + numpy.cross(q[1:], k)) / 2])

    start = numpy.array([0, 0, 0, 1, 0, 0, 0], dtype=float)
    return solve_ivp(rates, (0, length), start, method="DOP853", rtol=3e-14, atol=1e-15).y[:3, -1]


def rod_tip(length, rigidity, force, curvature=(0, 0, 0)):
    """Position of the tip [m], solved to 1e-12; rigidity about x, y, z [N m^2]; curvature of the unloaded rod [rad/m]."""
    rigidity, force, curvature = (numpy.array(v, dtype=float) for v in (rigidity, force, curvature))
    tip = numpy.array([length, 0, 0], dtype=float)
    for part in (0.25, 0.5, 0.75, 1):
        for _ in range(30):
            miss = tip_reached(length, rigidity, curvature, part * force, tip) - tip
            if abs(miss).max() < 1e-12 * length:
                break
            step = 1e-6 * length * numpy.eye(3)
            slopes = [(tip_reached(length, rigidity, curvature, part * force, tip + d)
                       - tip_reached(length, rigidity, curvature, part * force, tip - d) - 2 * d) / (2e-6 * length) for d in step]
            tip = tip - numpy.linalg.solve(numpy.array(slopes).T, miss)
        assert abs(miss).max() < 1e-12 * length, miss
    return tip
