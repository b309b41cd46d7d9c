"""Compiler flags that change arithmetic: the compilation of the runtime stops with a message, or its results equal those without the flags,
or it refuses to work and says why."""
import concurrent.futures
import re
import subprocess

import pytest

from program import CORE_LIBRARY, CORE_SOURCES, LONG, SOURCE, TESTS

RUNTIME = SOURCE / "runtime"
ARITHMETIC = RUNTIME / "core" / "base" / "arithmetic.h"
SENTENCE = re.compile(r"The runtime of refdyn needs [^\n]*: compile it with")


def compile_files(command, files, folder=None):
    """The finished compilations, two at a time."""
    def one(path):
        target = ["-c", path, "-o", folder / (path.stem + ".o")] if folder else ["-fsyntax-only", path]
        return subprocess.run([*command, "-I", SOURCE, "-I", RUNTIME, *target], capture_output=True, text=True)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, files))


def is_known(compiler, flags):
    """Whether this version of the compiler knows the flags."""
    done = subprocess.run([compiler, *flags, "-Werror", "-xc", "-c", "-o", "/dev/null", "-"], input="int x;\n", capture_output=True, text=True)
    return done.returncode == 0


def runs_here(flags):
    """Whether this processor has the instructions that the flags need."""
    return not [flag for flag in flags if flag.startswith("-m")] or " fma " in open("/proc/cpuinfo").read()


# ---- What compilers report ----

STOPPED = [("gcc", "-ffast-math"), ("gcc", "-Ofast"), ("gcc", "-funsafe-math-optimizations"),
           ("gcc", "-fassociative-math -fno-signed-zeros -fno-trapping-math"), ("gcc", "-fno-signed-zeros"), ("gcc", "-freciprocal-math"),
           ("gcc", "-ffinite-math-only"), ("gcc", "-Ofast -fno-finite-math-only"), ("gcc", "-ffast-math -fno-associative-math"),
           ("gcc", "-mfpmath=387"), ("gcc", "-mfpmath=both"), ("gcc", "-fsingle-precision-constant"), ("clang", "-ffast-math"),
           ("clang", "-Ofast"), ("clang", "-ffinite-math-only"), ("clang", "-ffp-model=fast"),
           ("clang", "-fno-honor-nans -fno-honor-infinities")]


@pytest.mark.parametrize("compiler, flags", STOPPED)
def test_compiling_stops(compiler, flags):
    """Whichever file of the library is compiled that way; all begin with the same checks, so that tests/run tries two of them."""
    files = CORE_SOURCES if LONG else CORE_SOURCES[::len(CORE_SOURCES) - 1]
    for path, done in zip(files, compile_files([compiler, "-std=gnu11", "-O2", *flags.split()], files)):
        assert done.returncode != 0 and SENTENCE.search(done.stderr.replace("\\\n", "")), f"{path.name}: {done.stderr[:1000]}"


@pytest.mark.parametrize("flags", ["-ffast-math", "-ffinite-math-only", "-funsafe-math-optimizations", "-mfpmath=387"])
def test_compiling_the_gsl_library_stops(flags):
    for done in compile_files(["gcc", *flags.split()], sorted((RUNTIME / "bindings" / "gsl").glob("*.c"))):
        assert done.returncode != 0 and SENTENCE.search(done.stderr), done.stderr[:1000]


def test_32_bit_x86():
    """By default it uses x87 arithmetic; the header needs no 32-bit libraries."""
    if "x86_64" not in subprocess.run(["gcc", "-dumpmachine"], capture_output=True, text=True).stdout:
        pytest.skip("the compiler is not one of x86-64")
    stopped = subprocess.run(["gcc", "-m32", "-fsyntax-only", "-xc", ARITHMETIC], capture_output=True, text=True)
    assert stopped.returncode != 0 and SENTENCE.search(stopped.stderr)
    told = ["-m32", "-msse2", "-mfpmath=sse"]
    subprocess.run(["gcc", *told, "-fsyntax-only", "-xc", ARITHMETIC], check=True)
    if subprocess.run(["gcc", *told, "-I", SOURCE, "-I", RUNTIME, "-fsyntax-only", RUNTIME / "core" / "base" / "workspace.c"], capture_output=True).returncode:
        pytest.skip("libraries of 32 bits (gcc-multilib) are not installed: the rest is left out")
    assert all(done.returncode == 0 for done in compile_files(["gcc", *told], CORE_SOURCES))


def begins_with_the_checks(path):
    """Whether the first include is the header of the checks, or a header that itself begins with them."""
    first = SOURCE / re.search(r'^#include ["<](.*)[">]$', path.read_text(), re.M).group(1)
    return first == ARITHMETIC or (first.is_file() and begins_with_the_checks(first))


def test_every_file_begins_with_the_checks():
    """Before all functions, those of headers included: pragmas act on the lines after them alone."""
    files = CORE_SOURCES + sorted((RUNTIME / "bindings" / "gsl").glob("*.c"))
    assert len(files) > 25
    for path in files:
        assert begins_with_the_checks(path), path


# ---- What compilers do not report ----

MOTIONS = r"""
#include "manipulator_rigid.h"
#include "refdyn.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void print(const char *what, int status, const double *values, int count) {
    printf("%s %d", what, status);
    for (int i = 0; i < count; i++)
        printf(" %a", values[i]);
    printf("\n");
}

static void move(struct refdyn_workspace *work, struct refdyn_options options) {
    const size_t size = refdyn_integrator_size(work->model, &options);
    struct refdyn_integrator integrator;
    void *memory = malloc(size);
    double q[4], qd[4];
    int status = refdyn_integrator_init(&integrator, work, &options, memory, size);
    refdyn_initial_state(work, q, qd);
    refdyn_anchor(work, 0, q, qd, NULL);
    if (!status)
        status = refdyn_integrator_start(&integrator, 0, q, qd);
    for (int i = 1; i <= 3 && !status; i++)
        status = refdyn_integrator_to(&integrator, 0.21 * i);
    print(refdyn_method_name((int)options.method), status, integrator.q, 4);
    print("rates", status, integrator.qd, 4);
    print("accelerations", integrator.statistics.steps > 3, integrator.qdd, 4);
    q[1] = NAN;
    print("NaN", refdyn_integrator_start(&integrator, 0, q, qd), NULL, 0);
    q[1] = INFINITY;
    print("infinite", refdyn_integrator_start(&integrator, 0, q, qd), NULL, 0);
    free(memory);
}

int main(void) {
    const struct refdyn_model *model = &manipulator_rigid_model;
    const size_t size = refdyn_workspace_size(model);
    struct refdyn_workspace work;
    const int status = refdyn_workspace_init(&work, model, malloc(size), size);
    if (status) {
        printf("refused %s\n", refdyn_status_text(status));
        return 0;
    }
    for (int stabilise = REFDYN_NONE; stabilise <= REFDYN_PROJECT; stabilise++)
        for (int method = REFDYN_RK4; method <= REFDYN_RK8; method++) {
            struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
            options.stabilise = (enum refdyn_stabilise)stabilise;
            options.balance = 1;
            move(&work, options);
        }
    double nan_option = NAN;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK8);
    options.tol = nan_option;
    print("option", refdyn_options_validate(&options, NULL), NULL, 0);
    print("value", refdyn_set_parameter(&work, "m_E", nan_option), NULL, 0);
    return 0;
}
"""
UNIT = ["test_runtime", "test_runtime_motion", "test_runtime_statics"]


@pytest.fixture(scope="module")
def callers(tmp_path_factory):
    """Programs that call the runtime, compiled without the flags."""
    folder = tmp_path_factory.mktemp("callers")
    (folder / "motions.c").write_text(MOTIONS)
    files = [folder / "motions.c", SOURCE / "generated" / "manipulator_rigid.c", *(TESTS / "unit" / f"{name}.c" for name in UNIT)]
    command = ["gcc", "-std=gnu11", "-O1", "-I", SOURCE, "-I", RUNTIME, "-I", SOURCE / "generated"]
    assert all(done.returncode == 0 for done in compile_files(command, files, folder))
    return folder


def compile_core(folder, command):
    for done in compile_files(command, CORE_SOURCES, folder):
        assert done.returncode == 0 and not done.stderr, done.stderr[:2000]


def motions(callers, folder):
    """Output of the programs with the objects of the runtime in a folder."""
    objects = sorted(folder.glob("*.o"))
    subprocess.run(["gcc", callers / "motions.o", callers / "manipulator_rigid.o", *objects, "-lm", "-o", folder / "motions"], check=True)
    return subprocess.run([folder / "motions"], capture_output=True, text=True, check=True, timeout=100).stdout


def check_units(callers, folder):
    for name in UNIT:
        subprocess.run(["gcc", callers / f"{name}.o", *folder.glob("*.o"), "-ldl", "-lm", "-o", folder / name], check=True)
        done = subprocess.run([folder / name], cwd=SOURCE, capture_output=True, text=True, timeout=100)
        assert done.returncode == 0, done.stdout[-2000:]


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The folder of the runtime compiled without the flags, as the build has it."""
    folder = tmp_path_factory.mktemp("plain")
    subprocess.run(["ar", "x", CORE_LIBRARY], cwd=folder, check=True)
    return folder


@pytest.fixture(scope="module")
def expected(callers, plain):
    text = motions(callers, plain)
    assert len(text.splitlines()) == 9 * 5 + 2 and "refused" not in text
    assert {line.split()[1] for line in text.splitlines() if line.startswith(("NaN", "infinite"))} == {"1"}
    return text


# Fused sums, and the most that clang takes; compiling the library takes 10 s each time.
EQUAL = [("gcc", "-O1 -march=haswell -ffp-contract=fast"), ("clang", "-O1 -ffast-math -fno-finite-math-only")]
if LONG:
    EQUAL += [("gcc", "-O3 -fno-trapping-math -fno-math-errno"), ("gcc", "-O2 -march=haswell"),
              ("gcc", "-O1 -frounding-math -fexcess-precision=fast -ffloat-store"), ("clang", "-O1"), ("clang", "-Ofast -fno-finite-math-only"),
              ("clang", "-O1 -fassociative-math -fno-signed-zeros -fno-trapping-math"), ("clang", "-O2 -funsafe-math-optimizations"),
              ("clang", "-O2 -freciprocal-math -march=haswell"), ("clang", "-O1 -fno-honor-nans -fapprox-func"), ("clang", "-O2 -fno-honor-infinities")]


@pytest.mark.parametrize("compiler, flags", EQUAL)
def test_results_are_those_without_the_flags(compiler, flags, callers, expected, tmp_path):
    """To the last bit; NaN and infinities are detected."""
    flags = flags.split()
    if not is_known(compiler, flags) or not runs_here(flags):
        pytest.skip(f"{compiler} or the processor has no {' '.join(flags)}")
    compile_core(tmp_path, [compiler, "-std=gnu11", *flags])
    assert motions(callers, tmp_path) == expected
    check_units(callers, tmp_path)


# Older compilers do not define the macros of gcc 12: without these the library must detect the flags itself.
SILENT = [f"-U{macro}" for macro in ("__FAST_MATH__", "__FINITE_MATH_ONLY__", "__ASSOCIATIVE_MATH__", "__RECIPROCAL_MATH__",
                                     "__NO_SIGNED_ZEROS__")]
REFUSED = [("gcc", "-ffast-math"), ("gcc", "-funsafe-math-optimizations"), ("gcc", "-ffinite-math-only"), ("gcc", "-freciprocal-math"),
           ("gcc", "-fassociative-math -fno-signed-zeros -fno-trapping-math"), ("gcc", "-fno-signed-zeros"), ("gcc", "-Ofast"),
           ("clang", "-march=haswell -ffp-contract=fast")]


@pytest.mark.parametrize("optimisation", ["-O1", "-O2", "-O3"] if LONG else ["-O2"])
@pytest.mark.parametrize("compiler, flags", REFUSED)
def test_what_nobody_told_is_found(compiler, flags, optimisation, callers, expected, plain, tmp_path):
    """By the compiled code of the one file that checks it."""
    flags = flags.split()
    if not is_known(compiler, flags) or not runs_here(flags):
        pytest.skip(f"{compiler} or the processor has no {' '.join(flags)}")
    command = [compiler, "-std=gnu11", optimisation, *flags, *(SILENT if compiler == "gcc" else [])]
    assert compile_files(command, [RUNTIME / "core" / "base" / "arithmetic.c"], tmp_path)[0].returncode == 0
    others = [path for path in plain.glob("*.o") if not path.name.startswith("arithmetic.")]
    subprocess.run(["gcc", callers / "motions.o", callers / "manipulator_rigid.o", *others, tmp_path / "arithmetic.o", "-lm", "-o",
                    tmp_path / "motions"], check=True)
    text = subprocess.run([tmp_path / "motions"], capture_output=True, text=True, check=True).stdout
    assert text == "refused the library was compiled with flags that change arithmetic, such as -ffast-math\n"
