"""The friction suite: scenes that stick and slide, their equations written again by hand, and the criteria for a run.

The model files are in models/friction; `accelerations(t, q, v, w)` here is written independently of them.
"""
import typing

import numpy

from program import TESTS, motion, oracle

WIDTHS = ("1e-2", "1e-4", "1e-6", "1e-8", "1e-10")
TOLERANCES = ("1e-3", "1e-4", "1e-5", "1e-6", "1e-7", "1e-8", "1e-9")
# Samples of a motion; more would shorten the steps of collocation.
SAMPLES = 4
# Allowed error in tolerances, and allowed steps in multiples of the steps of the best single method.
ALLOWED, STEPS_ALLOWED = 10, 2
# At this tolerance `auto` must resolve the layers, although gauss12 alone may step over them and stay within ten tolerances: pendulum and
# stack.
ROUGH, ROUGH_STEPS_ALLOWED = "1e-3", 2.2


def belt(t, q, v, w):
    r = v - 0.1
    return -100 * q - numpy.tanh(r / w) * (4 + 4 * numpy.exp(-abs(r) / 0.05))


def slide(t, q, v, w):
    return 2 * numpy.sin(3 * t) - 1.3 * numpy.tanh(v / w)


def masses(t, q, v, w):
    r = v - 0.15
    friction = numpy.array([3, 4]) * (1 + 0.6 * numpy.exp(-abs(r) / 0.1)) * r / numpy.sqrt(r * r + w * w)
    pull = 60 * (q[1] - q[0])
    return (numpy.array([pull - 80 * q[0], -pull - 90 * q[1]]) - friction) / numpy.array([1, 1.7])


def pendulum(t, q, v, w):
    return -9.81 / 0.5 * numpy.sin(q) - 1.1 * numpy.tanh(v / w) / (2 * 0.5**2)


def dragged(t, q, v, w):
    level = 2 + 1.5 * numpy.exp(-((v / 0.1) ** 2))
    return 40 * (0.05 * t - q) - level * 2 / numpy.pi * numpy.arctan(v / w)


def arm(t, q, v, w):
    (m1, l1), (m2, l2), g = (1.5, 0.4), (0.8, 0.3), 9.81
    bend, all_turned = q[1], q[0] + q[1]
    far = m2 * l1 * l2 * numpy.cos(bend)
    mass = numpy.array([[(m1 + m2) * l1**2 + m2 * l2**2 + 2 * far, m2 * l2**2 + far], [m2 * l2**2 + far, m2 * l2**2]])
    whirl = m2 * l1 * l2 * numpy.sin(bend)
    bias = numpy.array([whirl * v[1] * (2 * v[0] + v[1]), -whirl * v[0] ** 2])
    lower = m2 * g * l2 * numpy.sin(all_turned)
    weight = numpy.array([(m1 + m2) * g * l1 * numpy.sin(q[0]) + lower, lower])
    torque = numpy.array([4 * numpy.sin(2 * t), numpy.sin(5 * t)]) - numpy.array([1.5, 0.7]) * numpy.tanh(v / w)
    return numpy.linalg.solve(mass, torque + bias - weight)


def stack(t, q, v, w):
    """Accelerations of the lower block, and of the upper block relative to it."""
    low, top = numpy.array([1.8, 2.2]) * numpy.clip(v / w, -1, 1)
    a = (7 * numpy.sin(3 * t) - 20 * q[0] - low + top) / 2
    return numpy.array([a, -top - a])


class Scene(typing.NamedTuple):
    name: str
    what: str
    until: float
    coordinates: tuple
    accelerations: typing.Callable
    start: tuple

    @property
    def model(self):
        return TESTS / "models" / "friction" / f"{self.name}.lua"

    def reference(self, width):
        """(SAMPLES, coordinates)"""
        return numpy.array(oracle("friction")[self.name][width])


SCENES = [
    Scene("belt", "block on a belt, falling friction", 4, ("block_x",), belt, (0,)),
    Scene("slide", "pushed block, constant level", 3, ("block_x",), slide, (0,)),
    Scene("masses", "two masses on a belt", 4, ("a_x", "b_x"), masses, (0, 0)),
    Scene("pendulum", "pendulum with a dry joint", 6, ("bar_psi",), pendulum, (1.2,)),
    Scene("dragged", "slowly dragged block, falling friction", 6, ("block_x",), dragged, (0,)),
    Scene("arm", "arm with dry joints", 4, ("upper_psi", "lower_psi"), arm, (0, 0)),
    Scene("stack", "two contacts, one on the other", 4, ("low_x", "top_x"), stack, (0, 0)),
]


class Run(typing.NamedTuple):
    error: float
    steps: int
    summary: dict
    said: str


def run(scene, width, method, tol, *arguments, timeout=120):
    columns, said, summary = motion(scene.model, "--set", f"w={width}", "--until", scene.until, "--every", scene.until / SAMPLES,
                                    "--method", method, "--tol", tol, *arguments, timeout=timeout)
    found = numpy.array([columns[name][1:] for name in scene.coordinates]).T
    return Run(abs(found - scene.reference(width)).max(), summary["steps"], summary, said)
