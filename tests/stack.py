"""The bound of the stack in an emitted header, compared with what gcc or clang report by -fstack-usage."""
import collections
import re
import subprocess

from program import SOURCE, refdyn
from single import ARM, CORES

# The real type and the compiler by target. The floating-point unit of the last one computes in double precision.
TARGETS = {"gcc, x86-64": ("double", ["gcc"]), "clang, x86-64": ("double", ["clang"]),
           **{f"floats, Cortex-{core.upper()}": ("float", [*ARM, *words]) for core, words in CORES.items()},
           "doubles, Cortex-M4": ("double", [*ARM, *CORES["m4"]]),
           "doubles, Cortex-M7": ("double", [*ARM, "-mcpu=cortex-m7", "-mfpu=fpv5-d16"])}
LEVELS = ("-O2", "-Os")
EMIT = "all,M_h,f,d_qdd,d_qdd_free,d_force,d_statics,d_rows,inverse,d_inverse,tangent,tangent_vectors,step.p"


def bounds(folder):
    """Bytes by function, from the headers."""
    header = min(folder.glob("*.h"), key=lambda path: len(path.name))
    name, found = header.stem, {}
    for quantity, bound in re.findall(r"^ \*   (\w+) +(?:\d+ +){4}(\d+)$", header.read_text().split("*/")[0], re.M):
        found[f"{name}_{quantity}"] = int(bound)
    for path in folder.glob("*_step.h"):
        for bound, function in re.findall(r"Stack: at most (\d+) bytes\. \*/\nint (\w+)\(", path.read_text()):
            found[function] = int(bound)
    return found


def calls(folder):
    """The functions that each function of the C files calls, or passes on as pointers."""
    bodies = {}
    for path in folder.glob("*.c"):
        text = re.sub(r"\bSTEP_(D_)?QDD\b", lambda word: path.stem[:-len("_step")] + ("_d_qdd" if word[1] else "_qdd"), path.read_text())
        bodies.update(re.findall(r"^\w[\w *]*?\b(\w+)\([^{};]*\) \{\n(.*?)^\}", text, re.M | re.S))
    return {name: {word for word in re.findall(r"\w+", body) if word in bodies and word != name} for name, body in bodies.items()}


def frames(folder, words):
    """Bytes of each function's own frame. Compilers add suffixes to the names of parts and copies, whose frames add up. A static
    function that several files have counts once, with its largest frame."""
    own = collections.Counter()
    for path in folder.glob("*.c"):
        subprocess.run([*words, "-w", "-I", SOURCE / "runtime", "-fstack-usage", "-c", path.name, "-o", "x.o"], cwd=folder, check=True)
        of_file = collections.Counter()
        for line in (folder / "x.su").read_text().splitlines():
            place, size, _ = line.split("\t")
            of_file[place.split(":")[-1].split(".")[0]] += int(size)
        own |= of_file
    return own


def deepest(name, own, called, above=()):
    inner = [deepest(other, own, called, above + (name,)) for other in called.get(name, ()) if other not in above]
    return own.get(name, 0) + max(inner, default=0)


def emit(model, folder, real, *options):
    """Emits all that the model has."""
    folder.mkdir(parents=True, exist_ok=True)
    if refdyn("gen", model, *options, "--real", real, "--emit", EMIT, "-o", folder, status=None).returncode:
        refdyn("gen", model, *options, "--real", real, "-o", folder)


def compare(folder, words):
    """For each function: its name, its bound, and for each level the bytes that it and the functions it calls use with a compiler."""
    own, called = [frames(folder, [*words, level]) for level in LEVELS], calls(folder)
    return [(name, bound, [deepest(name, of_level, called) for of_level in own]) for name, bound in bounds(folder).items()]
