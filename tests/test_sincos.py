"""The pass over sines and cosines in emitted C: its error compared with long double and 60 digits, and the origin of its constants."""
import ctypes
import re
import shutil
import subprocess

import mpmath
import numpy
import pytest

from minimax import minimax
from program import REFERENCE, SOURCE, refdyn

BOUND = 0.85     # units in the last place; measured over a million angles in each range: 0.82
LARGEST = 1e5    # [rad], beyond it libm is called
BUILDS = [["gcc", "-O2", "-ffp-contract=off"], ["gcc", "-O3", "-march=native", "-ffp-contract=fast"],
          ["clang", "-O2", "-ffp-contract=off"], ["clang", "-O3", "-march=native", "-ffp-contract=fast"]]

DOUBLES = numpy.ctypeslib.ndpointer(numpy.float64, flags="C")


@pytest.fixture(scope="module")
def emitted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sincos")
    refdyn("gen", REFERENCE, "--emit", "qdd_free", "-o", folder)
    shutil.copy(SOURCE / "runtime" / "refdyn_model.h", folder)
    (folder / "pass.c").write_text("#include \"manipulator.c\"\nvoid pass(const double *x, double *s, double *c, int n);\n"
                                   "void pass(const double *x, double *s, double *c, int n) { manipulator_sincos(x, s, c, n); }\n")
    return folder


@pytest.fixture(scope="module", params=BUILDS, ids=" ".join)
def sincos(request, emitted):
    library = emitted / ("".join(request.param) + ".so")
    subprocess.run([*request.param, "-std=c11", "-fPIC", "-shared", "pass.c", "-o", library, "-lm"], cwd=emitted, check=True)
    function = ctypes.CDLL(str(library))["pass"]
    function.argtypes = [DOUBLES, DOUBLES, DOUBLES, ctypes.c_int]
    function.restype = None

    def call(x):
        sine, cosine = numpy.empty_like(x), numpy.empty_like(x)
        function(x, sine, cosine, len(x))
        return sine, cosine
    return call


def worst(found, exact):
    """In units of the last place of the exact value; `exact` in long double."""
    unit = numpy.spacing(abs(exact).astype(numpy.float64))
    return float(numpy.max(abs(found.astype(numpy.longdouble) - exact) / unit))


@pytest.mark.parametrize("low, high", [(-0.79, 0.79), (-3.2, 3.2), (-100, 100), (-LARGEST, LARGEST)])
def test_random_angles(sincos, low, high):
    x = numpy.random.default_rng(3).uniform(low, high, 200000)
    sine, cosine = sincos(x)
    wide = x.astype(numpy.longdouble)
    assert worst(sine, numpy.sin(wide)) <= BOUND
    assert worst(cosine, numpy.cos(wide)) <= BOUND


def test_small_angles(sincos):
    x = 10.0 ** numpy.random.default_rng(4).uniform(-300, 0, 100000)
    sine, cosine = sincos(x)
    assert worst(sine, numpy.sin(x.astype(numpy.longdouble))) <= BOUND
    assert worst(cosine, numpy.cos(x.astype(numpy.longdouble))) <= BOUND


def test_beside_multiples_of_a_right_angle(sincos):
    """The double next to k pi/2: the result of the reduction has no digit of the angle's own precision."""
    with mpmath.workdps(60):
        multiples = list(range(1, 400)) + list(range(400, 63660, 23))
        x = numpy.array([float(k * mpmath.pi / 2) for k in multiples])
        found = sincos(x)
        for i, k in enumerate(multiples):
            small = found[k % 2][i]
            exact = (mpmath.cos if k % 2 else mpmath.sin)(mpmath.mpf(x[i]))
            assert abs(mpmath.mpf(small) - exact) <= BOUND * numpy.spacing(abs(float(exact))), k
            assert abs(found[1 - k % 2][i]) == 1


def test_what_libm_is_asked(sincos):
    x = numpy.array([0.5, 2e5, -1e22, 1e300, LARGEST, numpy.inf, -numpy.inf, numpy.nan, 3.0])
    sine, cosine = sincos(x)
    assert numpy.array_equal(numpy.isnan(sine), ~numpy.isfinite(x)) and numpy.array_equal(numpy.isnan(cosine), ~numpy.isfinite(x))
    finite = numpy.isfinite(x)
    assert abs(sine[finite] - numpy.sin(x[finite])).max() <= 2.3e-16
    assert abs(cosine[finite] - numpy.cos(x[finite])).max() <= 2.3e-16


@pytest.mark.parametrize("count", range(4, 14))
def test_every_count(sincos, count):
    x = numpy.linspace(-2, 5, count)
    sine, cosine = sincos(x)
    assert abs(sine - numpy.sin(x)).max() <= 2.3e-16 and abs(cosine - numpy.cos(x)).max() <= 2.3e-16


def numbers(emitted):
    text = (emitted / "manipulator.c").read_text()
    text = text[text.index("const double above ="):text.index("even * cos_r")]
    return [float(word) for word in re.findall(r"\d\.\d{6,}(?:e-\d+)?|\d\.\d+e-\d+", text)]


def test_coefficients_are_minimax(emitted):
    """Relative to sin x and to 1, on z = x^2 from 0 to (pi/4)^2 and a little beyond."""
    with mpmath.workdps(50):
        high = (mpmath.pi / 4)**2 * mpmath.mpf("1.0001")
        low = mpmath.mpf("1e-9")

        def sine_rest(z):    # (sin x / x - 1) / z
            return mpmath.nsum(lambda k: (-1)**(int(k) + 1) * z**int(k) / mpmath.factorial(2 * k + 3), [0, 24])

        def cosine_rest(z):  # (cos x - 1 + z/2) / z^2
            return mpmath.nsum(lambda k: (-1)**int(k) * z**int(k) / mpmath.factorial(2 * k + 4), [0, 24])

        sine, _ = minimax(sine_rest, lambda z: z * mpmath.sqrt(z) / mpmath.sin(mpmath.sqrt(z)), low, high, 5)
        cosine, _ = minimax(cosine_rest, lambda z: z * z, low, high, 5)
        expected = [abs(float(c)) for c in sine + cosine]
        printed = numbers(emitted)
        assert printed[-12:] == pytest.approx(expected, rel=1e-9), printed
        two_over_pi, *parts = printed[:4]
        assert two_over_pi == float(2 / mpmath.pi)
        assert abs(sum(map(mpmath.mpf, parts)) - mpmath.pi / 2) < mpmath.mpf(2)**-125
        assert parts[0] * 2.0**36 % 1 == 0 and parts[1] * 2.0**73 % 1 == 0 and parts[1] < 2.0**-38
