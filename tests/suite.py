"""The stiff and extreme cases: their definition, how each is run, and the error of a run against its reference."""
import typing

import numpy

from program import REFERENCE, TESTS, motion, oracle, settings

SUITE = TESTS / "models" / "suite"
ARM, CHAIN, SWING, TOP = [SUITE / f"{name}.lua" for name in ("arm", "chain", "swing", "top")]
FOUR_BAR = TESTS / "models" / "four_bar.lua"
# Methods of every case; decades of tolerances from the case's `tol` on; outputs of a motion.
ONE_METHOD = ("rodas5p",)
METHODS = ("auto", *ONE_METHOD)
DECADES = 4
SAMPLES = 4
# Larger models have too many coordinates for a reference; positions of points replace them.
COORDINATES_MOST = 16


class Case(typing.NamedTuple):
    name: str
    extreme: str
    model: object
    until: float
    values: dict = {}
    options: tuple = ()
    # Largest error of a coordinate [rad] or a point [m] in units of the tolerance of a step.
    allowed: float = 1
    # The largest tolerance: smaller vibrations are not followed, and the error then is their amplitude.
    tol: float = 1e-4
    # Two methods, as different as possible for the case.
    references: tuple = (("rk8", "--tol", "1e-13"), ("rodas6p", "--tol", "1e-12"))

    @property
    def oracle(self):
        return "suite_" + self.name.replace(" ", "_").replace(",", "").replace("-", "_")


# Explicit steps of a millionth of a second or less would take hours.
STIFF = (("rodas6p", "--tol", "1e-12"), ("rodas5p", "--tol", "1e-11"))
# An explicit method for comparison: implicit ones lose digits here.
SINGULAR = (("rk8", "--tol", "1e-13"), ("rk4", "--step", "4e-7"))

CASES = [
    Case("elements 4", "4 elements, no damping", ARM, 0.5, dict(n_rfe=4, ratio=0), allowed=5),
    Case("elements 4 spatial", "4 elements with bending, bending and torsion", ARM, 0.2,
         dict(n_rfe=4, dofs="psi,theta,phi", root="angles", ratio=0.002, rate=2)),
    Case("elements 16", "16 elements", ARM, 0.3, dict(n_rfe=16, ratio=0.001)),
    Case("elements 64", "64 elements", ARM, 0.1, dict(n_rfe=64, ratio=0.001), allowed=0.02),
    Case("elements 256", "256 elements", ARM, 0.02, dict(n_rfe=256, ratio=0.001), allowed=0.01, references=STIFF),
    Case("ratio 0", "no damping", ARM, 0.5, dict(n_rfe=8, ratio=0), allowed=25),
    Case("ratio 0.01", "damping 0.01 of critical", ARM, 0.5, dict(n_rfe=8, ratio=0.01)),
    Case("ratio 0.1", "damping 0.1 of critical", ARM, 0.5, dict(n_rfe=8, ratio=0.1), allowed=0.05),
    Case("ratio 1", "critical damping", ARM, 0.5, dict(n_rfe=8, ratio=1), allowed=0.05),
    *[Case(f"E {E:.0e}".replace("e+0", "e").replace("e+", "e"), f"{what}, bent at once by a load in proportion", ARM, 0.3,
           dict(n_rfe=6, root="clamp", E=f"{E:.0e}", push=2.5e-11 * E), allowed=allowed)
      for E, what, allowed in ((2e9, "soft", 1), (2e11, "steel", 3), (2e13, "stiff", 1), (2e15, "stiffer", 5))],
    Case("heavy tip", "tip 1e6 times the beam's mass", ARM, 2, dict(n_rfe=4, m_E=6e5, E=2.1e17)),
    Case("massless beam", "beam 1.6e-7 of the tip's mass", ARM, 0.5, dict(n_rfe=4, rho=2e-3, m_E=1), allowed=0.1),
    Case("chain, heavy below", "lower mass 1e6 times the upper", CHAIN, 0.05, dict(ratio=1e6), allowed=5),
    Case("chain, heavy above", "lower mass 1e-6 of the upper", CHAIN, 2, dict(ratio=1e-6), allowed=2),
    Case("massless effector", "effector of 1 mg on its slide", REFERENCE, 1, dict(n_rfe=4, eta=1.3e-3, m_E=1e-6),
         ("--from", "statics"), references=STIFF),
    Case("top 1e-1", "theta passes pi/2 at 0.1", TOP, 1, dict(miss=1e-1), allowed=5, references=SINGULAR),
    Case("top 1e-2", "theta passes pi/2 at 0.01", TOP, 1, dict(miss=1e-2), allowed=10, references=SINGULAR),
    Case("top 1e-3", "theta passes pi/2 at 0.001", TOP, 1, dict(miss=1e-3), allowed=30, references=SINGULAR),
    # Twice omega; the first frequency of the arm with prescribed tip is 127.9 rad/s.
    Case("programme, slow", "row at 0.05 of the first frequency", ARM, 1, dict(row="swing", m_E=0.05, omega=3.2), allowed=2),
    Case("programme, fast", "row at 0.3 of the first frequency", ARM, 1, dict(row="swing", m_E=0.05, omega=19, stroke=0.03)),
    Case("programme, resonant", "row at the first frequency", ARM, 0.5,
         dict(row="swing", m_E=0.05, omega=64, stroke=0.002)),
    Case("off, pulled in", "starts off the programme, Baumgarte", REFERENCE, 2, dict(n_rfe=1, program="chapter"),
         ("--stabilise", "baumgarte"), allowed=5),
    Case("off, projected", "starts off the programme, projected", REFERENCE, 2, dict(n_rfe=1, program="chapter"),
         ("--start", "project")),
    Case("released", "bent far by its weight, then pushed", ARM, 0.5,
         dict(n_rfe=8, root="clamp", E=2e9, m_E=0.01, push=0.5), ("--from", "statics"), allowed=2),
    Case("pushed", "a torque that jumps", ARM, 0.3, dict(g=0, push=20)),
    Case("four-bar", "three of five rows redundant", FOUR_BAR, 0.25),
    Case("no gravity", "no weight, a rate and a push", ARM, 0.5, dict(g=0, rate=5, push=-5), allowed=2),
    Case("root locked", "a row holds the root", ARM, 0.5, dict(row="lock_root")),
    Case("element locked", "a row holds an element", ARM, 0.5, dict(row="lock_element")),
]


def tolerances(case):
    return [case.tol / 10**k for k in range(DECADES + 1)]


def run(case, *arguments, timeout=300):
    """Columns and summary of one motion with SAMPLES outputs."""
    columns, _, summary = motion(case.model, *settings(case.values), *case.options, "--until", case.until, "--every",
                                 case.until / SAMPLES, *arguments, timeout=timeout)
    return columns, summary


def observed(columns):
    """Values that a reference keeps: positions of points, and coordinates if they are few."""
    coordinates = [name for name in columns if name + "_d" in columns]
    points = [name for name in columns if name + "dd" in columns]
    return points + (coordinates if len(coordinates) <= COORDINATES_MOST else [])


def error(columns, reference):
    """Largest difference from a reference; NaN if either contains NaN."""
    return max(abs(columns[name] - values).max() for name, values in reference.items())


def told(summary, reference):
    """The largest error that --verify estimates for the values of a reference; a point has three columns."""
    groups = summary["error"]["points"].items(), summary["error"]["coordinates"].items()
    listed = {name: values for group in groups for name, values in group}
    return max(numpy.max(values) for name, values in listed.items() if name in reference or f"{name}_x" in reference)


def measure(case, method, tol):
    """Error and summary of a run."""
    columns, summary = run(case, "--method", method, "--tol", tol)
    return error(columns, oracle(case.oracle)["columns"]), summary
