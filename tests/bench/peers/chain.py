"""The reference manipulator as the other programs read it: a serial chain of joints with one coordinate each.

The parameters are those of models/manipulator.lua, which has the same manipulator for Refdyn. `links` builds the chain from them, `text`
writes it for the C++ programs, `mjcf` for MuJoCo. `state` is the random state at which all programs are compared and timed.
"""
import math
import random
import typing

SUPPORT_STIFFNESS, SUPPORT_DAMPING, BASE_MASS = 1e4, 2.5, 18.54331045  # N/m, N s/m, kg
COLUMN_MASS, COLUMN_HEIGHT, COLUMN_INERTIA = 10.0, 1.1, 0.05  # kg, m, kg m^2 about its axis; its other moments never act
LENGTH, DIAMETER, YOUNG, POISSON, DENSITY = 2.0, 0.01413200743, 2.1e11, 0.3, 7801.0  # of the arm: m, m, Pa, 1, kg/m^3
EFFECTOR_MASS, GRAVITY = 2.0, 9.81  # kg, m/s^2
SMALLEST_INERTIA = 2e-15  # kg m^2: MuJoCo refuses bodies with less than 1e-15

NO_TURN = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
ABOUT_X = ((1, 0, 0), (0, 0, -1), (0, 1, 0))  # a quarter turn
ABOUT_Y = ((0, 0, 1), (0, 1, 0), (-1, 0, 0))
QUATERNIONS = {NO_TURN: "1 0 0 0", ABOUT_X: f"{math.sqrt(0.5)!r} {math.sqrt(0.5)!r} 0 0", ABOUT_Y: f"{math.sqrt(0.5)!r} 0 {math.sqrt(0.5)!r} 0"}


class Link(typing.NamedTuple):
    """A joint and the body on it. A body without mass joins two joints at one place."""
    slides: bool
    axis: int  # 0, 1, 2: x, y, z
    place: tuple = (0, 0, 0)  # of the joint in the frame before it, m
    turn: tuple = NO_TURN  # the rotation matrix of this placement
    mass: float = 0.0
    center: tuple = (0, 0, 0)
    inertia: tuple = (0, 0, 0)  # principal moments about the center, along the axes
    stiffness: float = 0.0
    damping: float = 0.0


def rod(length):
    """Mass properties of a piece of the arm."""
    mass = DENSITY * math.pi * DIAMETER**2 / 4 * length
    across = DENSITY * math.pi * DIAMETER**4 / 64 * length  # about a diameter of the cross-section
    bending = mass * length**2 / 12 + across
    return {"mass": mass, "center": (length / 2, 0, 0), "inertia": (2 * across, bending, bending)}


def links(n_rfe):
    """Base, column, arm of n_rfe rigid finite elements, end-effector on a slide along the arm."""
    spacing = LENGTH if n_rfe == 1 else LENGTH / (n_rfe - 1)
    second_moment = math.pi * DIAMETER**4 / 64
    bending = YOUNG * second_moment / spacing
    torsion = YOUNG / (2 * (1 + POISSON)) * 2 * second_moment / spacing
    first = LENGTH if n_rfe == 1 else spacing / 2
    flat = COLUMN_MASS * COLUMN_HEIGHT**2 / 12
    chain = [
        Link(True, 2, mass=BASE_MASS, stiffness=SUPPORT_STIFFNESS, damping=SUPPORT_DAMPING),
        Link(False, 2, mass=COLUMN_MASS, center=(0, 0, COLUMN_HEIGHT / 2), inertia=(flat, flat, COLUMN_INERTIA)),
        Link(False, 2, place=(0, 0, COLUMN_HEIGHT), turn=ABOUT_X, **rod(first)),
    ]
    for element in range(1, n_rfe):
        offset = spacing / 2 if element == 1 else spacing
        length = spacing / 2 if element == n_rfe - 1 else spacing
        chain += [Link(False, 2, place=(offset, 0, 0), stiffness=bending), Link(False, 1, stiffness=bending),
                  Link(False, 0, stiffness=torsion, **rod(length))]
    return chain + [Link(True, 2, place=(first, 0, 0), turn=ABOUT_Y, mass=EFFECTOR_MASS)]


def state(n_rfe):
    """Random coordinates, rates, forces and accelerations: the arm near 45 degrees, its springs bent by at most 0.1 rad, a torque on the column."""
    draw = random.Random(1000 + n_rfe)
    n = 3 * n_rfe + 1
    q = [draw.uniform(-0.1, 0.1) for _ in range(n)]
    q[1], q[2] = draw.uniform(-1, 1), math.pi / 4 + q[2]
    tau = [0.0, draw.uniform(-1, 1), *[0.0] * (n - 2)]
    qd, qdd = ([draw.uniform(-1, 1) for _ in range(n)] for _ in range(2))
    return [q, qd, tau, qdd]


def numbers(values):
    return " ".join(repr(float(value)) for value in values)


def text(n_rfe):
    """n and gravity, then one line a link: slides, axis, place, turn by rows, mass, center, inertia, stiffness, damping."""
    chain = links(n_rfe)
    lines = [f"{len(chain)} {GRAVITY!r}"]
    for link in chain:
        lines.append(f"{int(link.slides)} {link.axis} " + numbers([*link.place, *sum(link.turn, ()), link.mass, *link.center, *link.inertia,
                                                                    link.stiffness, link.damping]))
    return "\n".join(lines) + "\n"


def bodies(chain):
    """Groups of links that make one body with several joints."""
    group = []
    for link in chain:
        group.append(link)
        if link.mass:
            yield group
            group = []


def mjcf(n_rfe, integrator="Euler"):
    """The chain for MuJoCo, without contacts and limits."""
    lines = [f'<mujoco model="manipulator"><compiler angle="radian" autolimits="true"/><size memory="64M"/><option gravity="0 0 {-GRAVITY}" '
             f'integrator="{integrator}"><flag contact="disable" constraint="disable" eulerdamp="disable"/></option><worldbody>']
    groups = list(bodies(links(n_rfe)))
    for group in groups:
        first, last = group[0], group[-1]
        inertia = [max(moment, SMALLEST_INERTIA) for moment in last.inertia]
        lines.append(f'<body pos="{numbers(first.place)}" quat="{QUATERNIONS[first.turn]}"><inertial pos="{numbers(last.center)}" '
                     f'mass="{last.mass!r}" diaginertia="{numbers(inertia)}"/>')
        for link in group:
            axis = " ".join(str(int(k == link.axis)) for k in range(3))
            lines.append(f'<joint type="{"slide" if link.slides else "hinge"}" axis="{axis}" stiffness="{link.stiffness!r}" damping="{link.damping!r}"/>')
    return "\n".join(lines) + "</body>" * len(groups) + "</worldbody></mujoco>\n"


def write(n_rfe, folder):
    """models/N.txt, models/N.xml and models/stateN.txt in the working folder."""
    models = folder / "models"
    models.mkdir(exist_ok=True)
    (models / f"{n_rfe}.txt").write_text(text(n_rfe))
    (models / f"{n_rfe}.xml").write_text(mjcf(n_rfe))
    (models / f"state{n_rfe}.txt").write_text("\n".join(map(numbers, state(n_rfe))) + "\n")
