"""Emitted C in single precision: compiled, loaded, and called with the same state as the C in double precision."""
import ctypes
import re
import subprocess

import numpy

from compiled import WARNINGS, Compiled
from program import SOURCE, refdyn

STRICT = [*WARNINGS, "-Wdouble-promotion"]
# What microcontrollers with a floating-point unit for single precision alone are compiled for.
CORES = {"m4": ["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"], "m7": ["-mcpu=cortex-m7", "-mfpu=fpv5-sp-d16"]}
ARM = ["arm-none-eabi-gcc", "-std=c11", "-mthumb", "-mfloat-abi=hard"]


def real(values):
    return numpy.ascontiguousarray(values, dtype=numpy.float32)


def pointer(values):
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_float))


def emit_single(model, folder, *options):
    """Emits a model in single precision. Returns its name and the names of its C files."""
    folder.mkdir(parents=True, exist_ok=True)
    refdyn("gen", model, *options, "--real", "float", "-o", folder)
    name = min(folder.glob("*.h"), key=lambda file: len(file.name)).stem
    return name, sorted(folder.glob("*.c"))


class Single:
    """A model in single precision, and `double`, the same in double precision, with inputs, parameters and start."""

    def __init__(self, model, folder, *options):
        self.double = Compiled(model, folder / "double", *options)
        self.name, files = emit_single(model, folder / "float", *options)
        subprocess.run(["gcc", "-std=c11", "-O0", "-ffp-contract=off", *STRICT, "-fPIC", "-shared", "-o", folder / "single.so", *files, "-lm"],
                       check=True)
        self.library = ctypes.CDLL(str(folder / "single.so"))
        self.header = "".join(path.read_text() for path in sorted((folder / "float").glob("*.h")))
        size = int(re.search(r"_parameter_bytes = (\d+)", self.header)[1]) // 4
        self.p, self.x = real(numpy.zeros(size + 1)), real(self.double.x)
        if f"{self.name}_defaults(" in self.header:
            getattr(self.library, f"{self.name}_defaults")(pointer(self.p))

    def __call__(self, quantity, state):
        """The quantity in single precision, or None if the model lacks it."""
        if not hasattr(self.library, f"{self.name}_{quantity}"):
            return None
        out = real(numpy.full(self.double.shape(quantity), numpy.nan))
        rates = numpy.split(numpy.asarray(state["qd"]), len(state["qd"]) // self.double.n)  # inverse dynamics: qd, then qdd
        getattr(self.library, f"{self.name}_{quantity}")(pointer(self.p), pointer(self.x), ctypes.c_float(state["t"]), pointer(real(state["q"])),
                                                         *map(pointer, map(real, rates)), pointer(out))
        return out

    def blocks(self, quantity, state):
        """The blocks of a function of derivatives: pairs in single and in double precision by name."""
        body = re.search(rf"struct {self.name}_{quantity}_result \{{(.*?)\}};", self.header, re.S)[1]
        sizes = [(name, int(size)) for name, size in re.findall(r"float (\w+)\[(\d+)\]", body)]
        rates, total, found = numpy.split(numpy.asarray(state["qd"]), len(state["qd"]) // self.double.n), sum(size for _, size in sizes), []
        for library, kind, number, p, x in self.both():
            out, arrays = numpy.full(total, numpy.nan, dtype=kind), [numpy.ascontiguousarray(values, dtype=kind) for values in (p, x, state["q"], *rates)]
            p, x, *state_of = [array.ctypes.data_as(ctypes.POINTER(number)) for array in arrays]
            getattr(library, f"{self.name}_{quantity}")(p, x, number(state["t"]), *state_of, out.ctypes.data_as(ctypes.POINTER(number)))
            found.append(numpy.split(out, numpy.cumsum([size for _, size in sizes])[:-1]))
        return {name: pair for (name, _), pair in zip(sizes, zip(*found))}

    def both(self):
        """Library, type of numbers in numpy and in ctypes, parameters and inputs, in single and in double precision."""
        return ((self.library, numpy.float32, ctypes.c_float, self.p, self.x),
                (self.double.library, float, ctypes.c_double, self.double.p, self.double.x))

    def steps(self, state, h, count, method="rk4"):
        """The state after steps without derivatives, in single and in double precision; None: they failed."""
        ends, n = [], self.double.n
        size = int(re.search(rf"_step_{method}_work = (\d+)", self.header)[1])
        for library, kind, number, p, x in self.both():
            arrays = [numpy.ascontiguousarray(values, dtype=kind) for values in (p, x, state[:n], state[n:], numpy.zeros(2 * n), numpy.zeros(size))]
            p, x, q, qd, end, work = [array.ctypes.data_as(ctypes.POINTER(number)) for array in arrays]
            failed = getattr(library, f"{self.name}_step_{method}")(p, x, number(0), number(h), count, q, qd, end, None, work)
            ends.append(None if failed else arrays[4])
        return ends

    def state(self, seed=5, size=0.02):
        """A state near the start without symmetry, whose numbers are floats."""
        n = self.double.n
        values = real(self.double.start + size * numpy.random.default_rng(seed).standard_normal(2 * n)).astype(float)
        return {"t": 0.25, "q": values[:n], "qd": values[n:]}


def error(found, exact):
    """Largest difference over the largest entry."""
    scale = abs(exact).max()
    return abs(found - exact).max() / scale if scale else abs(found).max()
