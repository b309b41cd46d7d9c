"""The formulas of gen/theory.md as they are written there, in numpy: sections 4, 5 and 7 compared with the sums of section 2.

The tree has prismatic and revolute joints, a branch, and three turns at one point. Placements, bodies and state are random.
"""
import types

import numpy
import pytest
from numpy import cross, eye, outer, trace, zeros

random = numpy.random.default_rng(20260725)
GRAVITY = numpy.array([0.3, -0.7, -9.8])
STEP = 1e-5  # of central differences


def rotation(axis, angle, order=0):
    """The rotation about an axis, or its derivative by the angle."""
    j, k, shifted = (axis + 1) % 3, (axis + 2) % 3, angle + order * numpy.pi / 2
    R = zeros((3, 3)) if order else numpy.diag(eye(3)[axis])
    R[[j, k], [j, k]], R[j, k], R[k, j] = numpy.cos(shifted), -numpy.sin(shifted), numpy.sin(shifted)
    return R


def skew(a):
    return numpy.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def random_body():
    """Six mass points."""
    masses, places = random.uniform(0.2, 1, 6), random.normal(0.2, 0.3, (6, 3))
    whole = numpy.column_stack([places, numpy.ones(6)])
    J = sum(m * (r @ r * eye(3) - outer(r, r)) for m, r in zip(masses, places))
    return types.SimpleNamespace(m=masses.sum(), mc=masses @ places, J=J, H=whole.T @ (masses[:, None] * whole))


def frame(parent, kind, axis, carried=None, at_same_place=False):
    """Section 2.1; `carried` False: without mass."""
    turned, _ = numpy.linalg.qr(random.normal(size=(3, 3)))
    body = types.SimpleNamespace(m=0, mc=zeros(3), J=zeros((3, 3)), H=zeros((4, 4))) if carried is False else random_body()
    R_A, x_A = (eye(3), zeros(3)) if at_same_place else (turned * numpy.linalg.det(turned), random.normal(0, 0.5, 3))
    return types.SimpleNamespace(parent=parent, is_revolute=kind == "revolute", axis=axis, body=body, R_A=R_A, x_A=x_A)


TREE = [frame(-1, "prismatic", 2), frame(0, "revolute", 2), frame(1, "revolute", 1),
        frame(2, "revolute", 2, False), frame(3, "revolute", 1, False, True), frame(4, "revolute", 0, None, True),
        frame(5, "prismatic", 0), frame(1, "revolute", 0), frame(7, "revolute", 2)]
FIRST, MIDDLE, LAST = BALL = 3, 4, 5
N = len(TREE)
Q, QD, QDD, FORCE = random.uniform(-0.8, 0.8, N), *random.normal(size=(3, N))


def path(i):
    return [] if i < 0 else path(TREE[i].parent) + [i]


def close(found, expected, tolerance=1e-12):
    error = abs(numpy.asarray(found) - expected).max() / abs(numpy.asarray(expected)).max()
    assert error < tolerance, f"{error:.1e}"


# ---- Section 2: the definitions ----

def joint_matrix(i, q, order):
    """D_i and its derivatives, 4 x 4."""
    f, D = TREE[i], eye(4) if order == 0 else zeros((4, 4))
    if f.is_revolute:
        D[:3, :3] = rotation(f.axis, q[i], order)
    elif order < 2:
        D[f.axis, 3] = q[i] if order == 0 else 1
    return D


def transformation(i, q, by=()):
    T = eye(4)
    for j in path(i):
        A = eye(4)
        A[:3, :3], A[:3, 3] = TREE[j].R_A, TREE[j].x_A
        T = T @ A @ joint_matrix(j, q, by.count(j))
    return T


def definitions(q, qd):
    """M, c, g and s = dEk/dq, by sections 2.2 and 4.11."""
    M, c, g, s = zeros((N, N)), zeros(N), zeros(N), zeros(N)
    for b in range(N):
        H, moving = TREE[b].body.H, path(b)
        T = {j: transformation(b, q, (j,)) for j in moving}
        second = {i: sum(transformation(b, q, (i, k)) * qd[k] for k in moving) for i in moving}
        D, Td = sum(second[i] * qd[i] for i in moving), sum(T[i] * qd[i] for i in moving)
        for i in moving:
            c[i] += trace(T[i] @ H @ D.T)
            s[i] += trace(Td @ H @ second[i].T)
            g[i] -= GRAVITY @ (T[i] @ H)[:3, 3]
            for j in moving:
                M[i, j] += trace(T[i] @ H @ T[j].T)
    return M, c, g, s


# ---- Section 4 ----

def motion(q, qd, qdd=None, is_reference=False):
    """Sections 4.1 to 4.3, minus gravity; 7.1 with qdd; with wd = 0 after the ball joint as a reference of 5.5."""
    still = types.SimpleNamespace(w=zeros(3), v=zeros(3), wd=zeros(3), a=-GRAVITY, R=eye(3), r=zeros(3), B=zeros((3, 3)))
    frames = []
    for i, f in enumerate(TREE):
        p, e = frames[f.parent] if f.parent >= 0 else still, eye(3)[f.axis]
        own = types.SimpleNamespace(e=e, E=(f.R_A @ rotation(f.axis, q[i])).T if f.is_revolute else f.R_A.T)
        slide = zeros(3) if f.is_revolute else f.R_A @ e
        own.s = f.x_A + slide * q[i]
        own.s_rate = cross(p.w, own.s) + slide * qd[i]
        s_rate2 = p.B @ own.s + 2 * cross(p.w, slide * qd[i]) + slide * (0 if qdd is None else qdd[i])
        own.w = own.E @ p.w + e * qd[i] * f.is_revolute
        own.v, own.a = own.E @ (p.v + own.s_rate), own.E @ (p.a + s_rate2)
        own.wd = own.E @ p.wd + (cross(own.w, e * qd[i]) + e * (0 if qdd is None else qdd[i])) * f.is_revolute
        if is_reference and i == LAST:
            own.wd = zeros(3)
        own.B = skew(own.wd) + skew(own.w) @ skew(own.w)
        own.R, own.r = p.R @ own.E.T, p.r + p.R @ own.s
        own.e_rate, own.e_rate2 = cross(own.w, e), own.B @ e
        frames.append(own)
    return frames


def moved(k, wrench):
    """To the parent: section 4.6."""
    n, f = k.E.T @ wrench[:3], k.E.T @ wrench[3:]
    return numpy.concatenate([n + cross(k.s, f), f])


def on_joint(i, wrench):
    return wrench[TREE[i].axis + (0 if TREE[i].is_revolute else 3)]


def sums_inward(frames, own):
    sums = [numpy.array(value) for value in own]
    for i in reversed(range(N)):
        if TREE[i].parent >= 0:
            sums[TREE[i].parent] += moved(frames[i], sums[i])
    return sums


def load(i, k):
    """Section 4.7, of one body."""
    b = TREE[i].body
    return numpy.concatenate([b.J @ k.wd + cross(k.w, b.J @ k.w) + cross(b.mc, k.a), b.m * k.a + k.B @ b.mc])


def composites(frames):
    """Section 4.5."""
    Ic = [types.SimpleNamespace(m=f.body.m, mc=f.body.mc, J=f.body.J) for f in TREE]
    for i in reversed(range(N)):
        k, m, outside = frames[i], Ic[i].m, TREE[i].parent
        if outside < 0:
            continue
        s, mc, J = k.s, k.E.T @ Ic[i].mc, k.E.T @ Ic[i].J @ k.E
        into = Ic[outside]
        into.m, into.mc = into.m + m, into.mc + mc + m * s
        into.J = into.J + J + 2 * mc @ s * eye(3) - outer(mc, s) - outer(s, mc) + m * (s @ s * eye(3) - outer(s, s))
    return Ic


def unit_wrench(i, inertia):
    """Section 4.6."""
    e = eye(3)[TREE[i].axis]
    return numpy.concatenate([inertia.J @ e, cross(e, inertia.mc)] if TREE[i].is_revolute else [cross(inertia.mc, e), inertia.m * e])


def test_mass_matrix():
    frames, found = motion(Q, QD), zeros((N, N))
    for i, inertia in enumerate(composites(frames)):
        W = unit_wrench(i, inertia)
        for j in reversed(path(i)):
            found[i, j] = found[j, i] = on_joint(j, W)
            W = moved(frames[j], W)
    close(found, definitions(Q, QD)[0])


def test_bias_forces_and_gravity():
    frames = motion(Q, QD)
    _, c, g, _ = definitions(Q, QD)
    F = sums_inward(frames, [load(i, k) for i, k in enumerate(frames)])
    close([on_joint(i, F[i]) for i in range(N)], c + g)
    field = [k.R.T @ GRAVITY for k in frames]
    weights = [numpy.concatenate([cross(b.mc, grav), b.m * grav]) for b, grav in zip(composites(frames), field)]
    close([-on_joint(i, weights[i]) for i in range(N)], g)


def test_gravity_tangent():
    frames, found = motion(Q, QD), zeros((N, N))
    for j, inertia in enumerate(composites(frames)):
        change = frames[j].R @ unit_wrench(j, inertia)[3:]
        for i in path(j):
            if TREE[i].is_revolute:
                found[i, j] = found[j, i] = -cross(GRAVITY, frames[i].R @ frames[i].e) @ change
    close(found, differences(lambda q: definitions(q, QD)[2], Q), 1e-8)


def test_energy_and_printed_sum():
    frames = motion(Q, QD)
    M, c, _, s = definitions(Q, QD)
    own = [numpy.concatenate([b.J @ k.w + cross(b.mc, k.v), b.m * k.v + cross(k.w, b.mc)])
           for b, k in zip([f.body for f in TREE], frames)]
    close(sum(k.v @ p[3:] + k.w @ p[:3] for k, p in zip(frames, own)), QD @ M @ QD)
    found = []
    for f, k, beyond in zip(TREE, frames, sums_inward(frames, own)):
        turning = cross(k.w, k.e)
        found.append(turning @ beyond[:3] + cross(k.v, k.e) @ beyond[3:] if f.is_revolute else turning @ beyond[3:])
    close(found, s)
    close(QD @ s, QD @ c)


# ---- Section 5 ----

def inertia_to_parent(k, IA):
    """Section 5.1."""
    J, H, M = (k.E.T @ block @ k.E for block in (IA[:3, :3], IA[:3, 3:], IA[3:, 3:]))
    H_moved = H + skew(k.s) @ M
    J_moved = J - H @ skew(k.s) + skew(k.s) @ H_moved.T
    return numpy.block([[J_moved, H_moved], [H_moved.T, M]])


def ball_axes(frames):
    """cos and tilt of section 5.3, and the axes first, middle, last in the middle frame."""
    axes = [TREE[i].axis for i in BALL]
    first = frames[MIDDLE].E @ frames[FIRST].e
    return first[axes[0]], first[axes[2]], axes


def eliminate_ball(frames, IA, p):
    """Section 5.3: what is passed on, and how wd follows from a."""
    J, H, M = IA[:3, :3], IA[:3, 3:], IA[3:, 3:]
    cos, tilt, axes = ball_axes(frames)
    m = zeros(3)
    m[axes] = (FORCE[FIRST] - tilt * FORCE[LAST]) / cos, FORCE[MIDDLE], FORCE[LAST]
    m = frames[LAST].E @ m
    at_rest, J_inverse_H = numpy.linalg.solve(J, m - p[:3]), numpy.linalg.solve(J, H)
    rest = zeros((6, 6))
    rest[3:, 3:] = M - H.T @ J_inverse_H
    wrench = numpy.concatenate([m, p[3:] + H.T @ at_rest])
    for i in reversed(BALL):
        rest, wrench = inertia_to_parent(frames[i], rest), moved(frames[i], wrench)
    return rest, wrench, lambda a: at_rest - J_inverse_H @ a


def ball_coordinates(frames, inside, outside):
    """Sections 5.3 and 5.5, from whole angular accelerations."""
    cos, tilt, axes = ball_axes(frames)
    for i in (FIRST, MIDDLE):
        inside = frames[i].E @ inside + cross(frames[i].w, frames[i].e * QD[i])
    k = frames[LAST]
    delta = (k.E.T @ (outside - cross(k.w, k.e * QD[LAST])) - inside)[axes]
    return [delta[0] / cos, delta[1], delta[2] - tilt * delta[0] / cos]


STAGES = [(i,) for i in range(FIRST)] + [BALL] + [(i,) for i in range(LAST + 1, N)]


def unit_motion(i):
    return eye(6)[TREE[i].axis + (0 if TREE[i].is_revolute else 3)]


def eliminate(frames):
    """Sections 5.1, 5.2 and 5.4, inward: the data that each stage keeps for the outward recursion."""
    IA = [numpy.block([[f.body.J, skew(f.body.mc)], [skew(f.body.mc).T, f.body.m * eye(3)]]) for f in TREE]
    p, kept = [load(i, k) for i, k in enumerate(frames)], {}
    for stage in reversed(STAGES):
        i, outside = stage[-1], TREE[stage[0]].parent
        if stage == BALL:
            rest, wrench, kept[stage] = eliminate_ball(frames, IA[i], p[i])
        else:
            e, U = unit_motion(i), IA[i] @ unit_motion(i)
            D, u = e @ U, FORCE[i] - e @ p[i]
            kept[stage] = U, D, u
            rest, wrench = inertia_to_parent(frames[i], IA[i] - outer(U, U) / D), moved(frames[i], p[i] + U * u / D)
        if outside >= 0:
            IA[outside], p[outside] = IA[outside] + rest, p[outside] + wrench
    return kept


def carried(frames, stage, parent):
    """Section 5.4: the parent's motion at the last frame of a stage, with the joints of the stage at rest."""
    wd, a = parent[:3], parent[3:] + cross(parent[:3], frames[stage[0]].s)
    for i in stage:
        wd, a = frames[i].E @ wd, frames[i].E @ a
    return numpy.concatenate([wd, a])


def accelerate(frames, kept):
    """Section 5.4, outward."""
    x, motions = zeros(N), {-1: zeros(6)}
    for stage in STAGES:
        i, outside = stage[-1], TREE[stage[0]].parent
        own = carried(frames, stage, motions[outside])
        if stage == BALL:
            own[:3] = kept[stage](own[3:])
            x[list(BALL)] = ball_coordinates(frames, motions[outside][:3] + frames[outside].wd, own[:3] + frames[i].wd)
        else:
            U, D, u = kept[stage]
            x[i] = (u - U @ own) / D
            own = own + unit_motion(i) * x[i]
        motions[i] = own
    return x


@pytest.mark.parametrize("is_reference", [False, True])
def test_articulated_bodies(is_reference):
    """Sections 5.1 to 5.5, at either kind of reference accelerations."""
    frames = motion(Q, QD, None, is_reference)
    M, c, g, _ = definitions(Q, QD)
    close(accelerate(frames, eliminate(frames)), numpy.linalg.solve(M, FORCE - c - g), 1e-11)


# ---- Section 7 ----

def differences(function, at):
    return numpy.array([(function(at + h) - function(at - h)) / (2 * STEP) for h in eye(N) * STEP]).T


def inertia_forces(q, qd):
    M, c, g, _ = definitions(q, qd)
    return M @ QDD + c + g


def far_vectors(frames):
    """Sections 7.4 and 7.5, in the ground frame."""
    Ic, vectors = composites(frames), [None] * N
    b, E = [zeros(3)] * N, [zeros((3, 3))] * N
    L = sums_inward(frames, [load(i, k) for i, k in enumerate(frames)])
    for i in reversed(range(N)):
        k, body, m, mc, J = frames[i], TREE[i].body, Ic[i].m, Ic[i].mc, Ic[i].J
        b[i] = b[i] + cross(k.w, body.mc)
        E[i] = E[i] + skew(k.w) @ (trace(body.J) / 2 * eye(3) - body.J)
        around, lever = trace(E[i]) * eye(3) - E[i], cross(k.a, k.e)
        if TREE[i].is_revolute:
            spin = around.T @ k.e
            damping = [J @ k.e_rate + around @ k.e, cross(k.e_rate, mc) + cross(k.e, b[i])]
            stiffness = [J @ k.e_rate2 + 2 * around @ k.e_rate + cross(k.e, L[i][:3]) + cross(mc, lever),
                         cross(k.e_rate2, mc) + 2 * cross(k.e_rate, b[i]) + cross(k.e, L[i][3:]) + m * lever]
        else:
            spin = cross(b[i], k.e)
            damping = [cross(mc, k.e_rate), m * k.e_rate]
            stiffness = [cross(mc, k.e_rate2) + cross(k.e, L[i][3:]), m * k.e_rate2]
        W = unit_wrench(i, Ic[i])
        vectors[i] = [k.R @ v for v in (W[:3], W[3:], spin, *damping, *stiffness, k.e, k.e_rate, k.e_rate2, lever)]
        if TREE[i].parent >= 0:
            up, b_up = TREE[i].parent, k.E.T @ b[i]
            E[up] = E[up] + k.E.T @ E[i] @ k.E + outer(b_up, k.s) + outer(k.s_rate, k.E.T @ mc + m * k.s)
            b[up] = b[up] + b_up + m * k.s_rate
    return vectors


def test_tangent():
    """Section 7.4: K, D and M of the inertia forces and gravity by pairs of coordinates."""
    frames = motion(Q, QD, QDD)
    vectors, M, K, D = far_vectors(frames), zeros((N, N)), zeros((N, N)), zeros((N, N))
    for i in range(N):
        mass, A, spin, damping, damping_force, stiffness, stiffness_force = vectors[i][:7]
        for j in reversed(path(i)):
            e, e_rate, e_rate2, lever = vectors[j][7:]
            K[j, i], D[j, i] = (e @ stiffness, 2 * e @ damping) if TREE[j].is_revolute else (e @ stiffness_force, 2 * e @ damping_force)
            if TREE[j].is_revolute:
                M[i, j] = M[j, i] = e @ mass
                D[i, j] = 2 * e_rate @ mass + 2 * e @ spin
                K[i, j] = e_rate2 @ mass + 2 * e_rate @ spin + lever @ A
            else:
                M[i, j] = M[j, i] = e @ A
                D[i, j], K[i, j] = 2 * e_rate @ A, e_rate2 @ A
            if TREE[j].parent >= 0:
                R = frames[TREE[j].parent].R
                s, s_rate = R @ frames[j].s, R @ frames[j].s_rate
                mass, spin = mass + cross(s, A), spin + cross(s_rate, A)
                damping, stiffness = damping + cross(s, damping_force), stiffness + cross(s, stiffness_force)
    close(M, definitions(Q, QD)[0])
    close(K, differences(lambda q: inertia_forces(q, QD), Q), 1e-8)
    close(D, differences(lambda qd: inertia_forces(Q, qd), QD), 1e-8)
