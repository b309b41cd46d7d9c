"""A method is added as the page of runtime/core/methods tells: one file, one line. It has its order, and error control."""
import math
import re
import shutil
import subprocess

import pytest

from program import SCALE, SOURCE, UNOPTIMISED

PAGE = SOURCE / "runtime" / "core" / "methods" / "README.md"
# The rigid manipulator, its rows not stabilised.
PROGRAM = """
#include "manipulator_rigid.h"
#include "refdyn.h"
#include <stdio.h>
#include <stdlib.h>

/* argv: method, fixed step or 0, tolerance or 0; prints status, steps and the state at 0.2 s. */
int main(int argc, char **argv) {
    if (argc != 4)
        return 1;
    const int method = refdyn_method_find(argv[1]);
    struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
    options.step = atof(argv[2]);
    options.tol = atof(argv[3]);
    options.stabilise = REFDYN_NONE;
    static double work_memory[100000], memory[100000];
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    double q[16], qd[16];
    int status = refdyn_workspace_init(&work, &manipulator_rigid_model, work_memory, sizeof work_memory);
    if (!status)
        status = refdyn_integrator_init(&integrator, &work, &options, memory, sizeof memory);
    refdyn_initial_state(&work, q, qd);
    refdyn_anchor(&work, 0, q, qd, NULL);
    if (!status)
        status = refdyn_integrator_start(&integrator, 0, q, qd);
    for (int i = 1; i <= 3 && !status; i++)
        status = refdyn_integrator_to(&integrator, 0.2 * i / 3);
    printf("%d %ld", status, integrator.statistics.steps);
    for (int j = 0; j < work.n; j++)
        printf(" %.17g", integrator.q[j]);
    printf("\\n");
    return 0;
}
"""


def blocks():
    return re.findall(r"^```c\n(.*?)^```$", PAGE.read_text(), re.M | re.S)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """The program, linked with a copy of the core to which the method was added."""
    folder = tmp_path_factory.mktemp("added")
    runtime = folder / "runtime"
    shutil.copytree(SOURCE / "runtime", runtime, ignore=shutil.ignore_patterns("tool", "batch", "gradients", "bindings", "record"))
    file, line = blocks()
    (runtime / "core" / "methods" / "heun.c").write_text(file)
    header = (runtime / "refdyn.h").read_text()
    added, count = re.subn(r"(?m)^(    /\*\*.*\\\n    REFDYN_ENTRY\(REFDYN_ROS34PW2, ros34pw2\))$", lambda last: line + last[1], header)
    assert count == 1, "the list ends with another entry"
    (runtime / "refdyn.h").write_text(added)
    (folder / "main.c").write_text(PROGRAM)
    sources = sorted(runtime.rglob("*.c"))
    assert len(sources) > 25 and runtime / "core" / "methods" / "heun.c" in sources
    include = ["-I", folder, "-I", runtime, "-I", SOURCE / "generated"]
    for source in (folder / "main.c", SOURCE / "generated" / "manipulator_rigid.c", *sources):
        subprocess.run([*UNOPTIMISED, *include, "-c", source, "-o", folder / f"{source.stem}.o"], check=True)
    subprocess.run(["gcc", "-std=c11", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", *include, runtime / "core" / "methods" / "heun.c"], check=True)
    subprocess.run([*UNOPTIMISED, *folder.glob("*.o"), "-lm", "-o", folder / "main"], check=True)

    def run(method, step, tol):
        done = subprocess.run([folder / "main", method, repr(float(step)), repr(float(tol))], capture_output=True, text=True, check=True)
        status, steps, *q = done.stdout.split()
        assert status == "0"
        return int(steps), [float(value) for value in q]
    return run


def distance(a, b):
    return max(abs(x - y) for x, y in zip(a, b, strict=True))


def test_order(program):
    _, exact = program("rk8", 0.0, 1e-13)
    errors = [distance(program("heun", step, 0.0)[1], exact) for step in (1e-3, 5e-4)]
    assert errors[1] > 1e-9, "the error is lost in rounding"
    assert abs(math.log2(errors[0] / errors[1]) - 2) < 0.1 * SCALE, errors


def test_error_control(program):
    """By the embedded formula, and interpolated at outputs: steps go with the root of the tolerance."""
    _, exact = program("rk8", 0.0, 1e-13)
    runs = [program("heun", 0.0, tol) for tol in (1e-6, 1e-8)]
    assert 5 < runs[1][0] / runs[0][0] < 20, [steps for steps, _ in runs]
    assert all(distance(q, exact) < 100 * tol * SCALE for (_, q), tol in zip(runs, (1e-6, 1e-8)))


def test_the_page_names_what_is_there():
    """Links of the page lead to files."""
    links = re.findall(r"\]\(([^)#]+)\)", PAGE.read_text())
    assert len(links) > 3 and all((PAGE.parent / link).exists() for link in links), links
