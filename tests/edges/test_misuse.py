"""
Misuse of the C interface: each function of the public headers with NULL, memory that nothing has initialised, a model of another version,
numbers that are none, negative counts and too little memory. Each call ends with a status that has a text, never with a crash.

The calls are made from the prototypes in the headers, and the members of the structs that they read, so that a new function is covered. A
parameter whose name and type are new needs a line in `ARGUMENTS`.
"""
import re
import subprocess

import pytest

from program import BUILD, MODELS, REFERENCE, SANITIZED, SOURCE, TESTS, refdyn

RUNTIME = SOURCE / "runtime"
HEADERS = ["refdyn.h", "refdyn_batch.h"] + (["refdyn_gsl.h"] if (BUILD / "librefdyn_gsl.a").exists() else [])
LIBRARIES = [BUILD / f"librefdyn_{name}.a" for name in ("gsl", "batch", "runtime") if (BUILD / f"librefdyn_{name}.a").exists()]


def header(name):
    """The text without comments and without the lines of the preprocessor."""
    path = next(RUNTIME.rglob(name))
    text = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.S)
    return re.sub(r"^ *#(?:.*\\\n)*.*$", "", text, flags=re.M)


TEXTS = "".join(header(name) for name in HEADERS)
# (result, name, parameters) of each function, (name, members) of each struct
FUNCTIONS = re.findall(r"^((?:const )?(?:struct |enum )?\w+ \*?)(refdyn_\w+)\(([^;{}]*?)\);", TEXTS, re.M)
STRUCTS = dict(re.findall(r"^struct (\w+) \{(.*?)^\};", TEXTS, re.M | re.S))

# A good value of each parameter, by its name, or by its type and name where a name has several meanings.
ARGUMENTS = {
    "model": "model", "work": "&work", "integrator": "&motion", "energy": "&balance", "double energy": "numbers", "gsl": "&gsl", "batch": "&batch", "derivatives": "&derivatives",
    "samples": "&samples", "options": "&options", "statics options": "&of_statics", "result": "&found", "before": "&residual", "fact": "&text",
    "memory": "room", "size": "needed", "name": "name", "names": "model->coordinates", "count": "model->n", "held": "held", "held_count": "1",
    "given": "held", "q": "numbers", "qd": "numbers + 40", "qdd": "numbers + 80", "lambda": "numbers + 120", "force": "numbers + 160", "x": "numbers",
    "forces": "numbers", "numbers": "numbers", "hold_force": "numbers + 80", "ended": "&ended", "t": "0", "t_out": "1e-3", "tol": "1e-3",
    "value": "1", "steps": "2", "status": "1", "method": "REFDYN_RK8", "gsl method": "REFDYN_BSIMP", "refusal": "REFDYN_NO_ROOM",
    "stabilise": "REFDYN_PROJECT", "parameter": "0",
}
# What may be NULL: (function, parameter).
OPTIONAL = {("refdyn_project", "before"), ("refdyn_statics", "hold_force"), ("refdyn_batch_run", "ended"), ("refdyn_options_validate", "fact"),
            ("refdyn_statics_validate", "fact"), ("refdyn_anchor", "given"), ("refdyn_integrator_contact_forces", "forces")}
# Structs that an initialisation must have seen.
INITIALISED = {"refdyn_workspace", "refdyn_integrator", "refdyn_gsl"}
# Structs of the caller, whose members are varied, too.
VARIED = {"refdyn_options", "refdyn_statics_options", "refdyn_batch", "refdyn_derivatives", "refdyn_samples"}
# Ends of the names of lengths of arrays, and of indices in arrays of the caller.
LENGTHS = ("count", "width", "number")
DOUBLES = ["NAN", "INFINITY", "-INFINITY", "-1", "1e300", "0"]

PROGRAM = r"""
#define _GNU_SOURCE
#include "MODEL.h"
INCLUDES
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

static const struct refdyn_model *const model = &MODEL_model;
static struct refdyn_workspace work;
static struct refdyn_integrator motion;
static struct refdyn_energy balance;
static struct refdyn_options options;
static struct refdyn_statics_options of_statics;
static struct refdyn_statics_result found;
static struct refdyn_residual residual;
static struct refdyn_samples samples;
static struct refdyn_batch batch;
static struct refdyn_derivatives derivatives;
static struct refdyn_batch_column columns[2];
static struct refdyn_variable variables[1] = {{REFDYN_VARIED_RATE, 0}};
static struct refdyn_underivable underivable[1];
#ifdef REFDYN_GSL_H
static struct refdyn_gsl gsl;
#endif
static double numbers[1000], start[80], slopes[1000];
static const double times[] = {1e-3, 2e-3}, rows[] = {0, 1, 1e-3, 2}, values[] = {0, 0};
static int held[] = {0};
static long ended;
static const char *text, *name;
static void *room;
static size_t needed;
static int status;

/* Memory that ends where reading and writing it ends the process. */
static void *at_end(size_t size) {
    const size_t page = (size_t)sysconf(_SC_PAGESIZE), whole = (size + page - 1) / page * page;
    char *place = mmap(NULL, whole + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (place == MAP_FAILED || mprotect(place + whole, page, PROT_NONE))
        _exit(99);
    return place + whole - (size + 7) / 8 * 8;
}

static void *garbage(size_t size) {
    unsigned char *place = at_end(size);
    for (size_t i = 0; i < size; i++)
        place[i] = (unsigned char)(37 * i + 11);
    return place;
}

static struct refdyn_model *other_version(void) {
    int *alone = at_end(8);
    alone[0] = REFDYN_MODEL_VERSION + 1;
    return (void *)alone;
}

/* All arguments are good, and the functions have been called in their order. */
static void prepare(void) {
    size_t size = refdyn_workspace_size(model);
    name = model->coordinates[0].name;
    if (refdyn_workspace_init(&work, model, at_end(size), size))
        _exit(90);
    refdyn_initial_state(&work, start, start + 40);
    refdyn_anchor(&work, 0, start, start + 40, NULL);
    options = refdyn_options_default(REFDYN_GOOD_METHOD);
    size = refdyn_integrator_size(model, &options);
    if (refdyn_integrator_init(&motion, &work, &options, at_end(size), size) || refdyn_integrator_start(&motion, 0, start, start + 40))
        _exit(91);
    refdyn_energy_start(&balance, &motion);
    memcpy(numbers, start, sizeof start);
    of_statics = refdyn_statics_default();
    samples = (struct refdyn_samples){.count = 2, .width = model->input_count > 0, .place = held, .rows = rows};
    columns[0] = (struct refdyn_batch_column){REFDYN_VARIED_RATE, 0, values};
    columns[1] = (struct refdyn_batch_column){REFDYN_VARIED_SAMPLES, 0, values};
    batch = (struct refdyn_batch){.model = model, .options = refdyn_options_default(REFDYN_RK8), .times = times, .time_count = 2, .samples = &samples,
                                  .sample_count = 1, .count = 2, .column_count = 2, .columns = columns, .threads = 2};
    derivatives = (struct refdyn_derivatives){.batch = &batch, .count = 1, .variables = variables, .width = 2 * model->n,
                                              .derivatives = slopes, .underivable = underivable};
#ifdef REFDYN_GSL_H
    if (refdyn_gsl_init(&gsl, &motion, REFDYN_BSIMP))
        _exit(92);
#endif
}

static void of_memory(size_t size) {
    needed = size;
    room = at_end(size);
}

CALLS

static void (*const calls[])(void) = {NAMES};

int main(int count, char **arguments) {
    const int calls_in_all = (int)(sizeof calls / sizeof *calls);
    (void)count;
    (void)arguments;
    for (int i = 0; i < calls_in_all; i++) {
        int ends;
        fflush(stdout);
        const pid_t child = fork();
        if (child == 0) {
            alarm(20);
            status = INT_MIN;
            prepare();
            calls[i]();
            printf("%d %d %s\n", i, status, status == INT_MIN ? "" : refdyn_status_text(status));
            fflush(stdout);
            _exit(0);
        }
        waitpid(child, &ends, 0);
        if (ends)
            printf("%d crash %d\n", i, ends);
    }
    return 0;
}
"""


def parameters(text):
    """(type, is a pointer, name) of each parameter or member; pointers to functions are left out."""
    text = re.sub(r"\w+ \(\*\w+\)\([^;]*\);", "", text)
    found = re.findall(r"((?:const )?(?:struct |enum |unsigned )?\w+(?: const)?) (\**(?:const \*)?)(\w+)(\[\w+\])?(?=,|$|;)", re.sub(r"\s+", " ", text))
    return [(kind.replace("const ", ""), bool(stars or array), name) for kind, stars, name, array in found]


def good(function, kind, is_pointer, name):
    if name == "energy" and kind == "double":
        return ARGUMENTS["double energy"]
    if kind == "struct refdyn_statics_options":
        return ARGUMENTS["statics options"]
    if kind == "enum refdyn_gsl_method":
        return ARGUMENTS["gsl method"]
    return ARGUMENTS[name]


def faults(kind, is_pointer, name):
    """(words, C expression) of the bad values of one parameter."""
    if kind == "struct refdyn_model":
        return [("NULL", "NULL"), ("other version", "other_version()")]
    if is_pointer:
        struct = kind.removeprefix("struct ")
        return [("NULL", "NULL")] + ([("zero", f"at_end(sizeof({kind}))"), ("garbage", f"garbage(sizeof({kind}))")] if struct in INITIALISED else [])
    if kind == "double":
        return [(value, value) for value in DOUBLES]
    if kind == "size_t":
        return [("0", "0"), ("1", "1"), ("one too few", "needed - 1")]
    is_bounded = not name.endswith(LENGTHS)  # how long an array is only its caller knows
    return [(value, f"({kind})({value})") for value in ["-1", "INT_MIN", *(["INT_MAX"] if is_bounded else [])]]


def sizes(function):
    call = {"refdyn_workspace_init": "refdyn_workspace_size(model)", "refdyn_integrator_init": "refdyn_integrator_size(model, &options)",
            "refdyn_statics": "refdyn_statics_size(model)"}.get(function)
    return f"of_memory({call});" if call else ""


def calls():
    """(function, what is wrong, statements) of each misuse."""
    for result, function, text in FUNCTIONS:
        listed = parameters("" if text == "void" else text)
        assert len(listed) == (0 if text == "void" else text.count(",") + 1), text
        values = [good(function, *one) for one in listed]
        takes = "status = " if result == "int " else "(void)" if result != "void " else ""

        def call(place=None, bad=None):
            return f"{takes}{function}({', '.join(bad if i == place else value for i, value in enumerate(values))});"

        yield function, "nothing", sizes(function) + call()
        for i, (kind, is_pointer, name) in enumerate(listed):
            for words, bad in faults(kind, is_pointer, name):
                yield function, f"{name} {words}", sizes(function) + call(i, bad)
            struct = kind.removeprefix("struct ")
            for member_kind, member_is_pointer, member in parameters(STRUCTS[struct]) if struct in VARIED else []:
                for words, bad in faults(member_kind, member_is_pointer, member):
                    if not member_kind.startswith("struct") or member_is_pointer:
                        yield function, f"{name}.{member} {words}", f"{sizes(function)}{values[i].removeprefix('&')}.{member} = {bad};{call()}"


CALLS = list(calls())
MODELS_USED = {"manipulator": (REFERENCE, "REFDYN_RODAS5P"), "ball": (TESTS / "models" / "contacts" / "ball.lua", "REFDYN_RODAS5P")}


@pytest.fixture(scope="module", params=MODELS_USED)
def results(request, tmp_path_factory):
    """Lines of the program for each call: its status, or how it ended."""
    folder = tmp_path_factory.mktemp("misuse")
    path, method = MODELS_USED[request.param]
    refdyn("gen", path, *(["--set", "n_rfe=1", "--set", "drive=input"] if path == REFERENCE else []), "--emit", "all,implicit", "-o", folder)
    texts = {"INCLUDES": "".join(f'#include "{name}"\n' for name in HEADERS), "REFDYN_GOOD_METHOD": method,
             "CALLS": "\n".join(f"static void call_{i}(void) {{ {text} }}" for i, (_, _, text) in enumerate(CALLS)),
             "NAMES": ", ".join(f"call_{i}" for i in range(len(CALLS)))}
    text = re.sub(r"\b(INCLUDES|REFDYN_GOOD_METHOD|CALLS|NAMES)\b", lambda match: texts[match.group()], PROGRAM).replace("MODEL.h", f"{request.param}.h")
    (folder / "program.c").write_text(re.sub(r"\bMODEL_model", f"{request.param}_model", text))
    checks = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"] if SANITIZED else []
    includes = [flag for name in HEADERS for flag in ("-I", next(RUNTIME.rglob(name)).parent)]
    gsl = ["-lgsl", "-lgslcblas"] if len(HEADERS) == 3 else []
    subprocess.run(["gcc", "-std=gnu11", "-O0", "-w", *checks, *includes, *folder.glob("*.c"), *LIBRARIES, *gsl, "-lpthread", "-lm", "-o", folder / "program"],
                   check=True)
    done = subprocess.run([folder / "program"], capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, done.stderr[-2000:]
    lines = dict(line.split(" ", 1) for line in done.stdout.splitlines())
    return [(function, wrong, lines[str(i)]) for i, (function, wrong, _) in enumerate(CALLS)]


def test_all_functions_are_called():
    assert len(FUNCTIONS) >= 70 and len({name for _, name, _ in FUNCTIONS}) == len(FUNCTIONS)
    assert len(FUNCTIONS) == len(re.findall(r"\brefdyn_\w+\(", re.sub(r"\b(?:REFDYN|refdyn)\w*\([^;]*\\\n", "", TEXTS)))


def test_no_call_crashes(results):
    assert [(function, wrong) for function, wrong, line in results if line.startswith("crash")] == []


def test_good_calls_are_not_refused(results):
    refused = [(function, line) for function, wrong, line in results if wrong == "nothing" and re.match(r"-(4|20) ", line)]
    assert refused == []


def test_missing_pointers_have_a_status(results):
    """Functions whose result is a status: those that list errors."""
    kinds = {name: result for result, name, _ in FUNCTIONS}
    statuses = {"refdyn_" + name for name in re.findall(r"refdyn_(\w+)", " ".join(documented()))}
    wrong = [(function, what) for function, what, line in results
             if re.fullmatch(r"\w+ (NULL|zero|garbage|other version)", what) and function in statuses and kinds[function] == "int "
             and (function, what.split()[0]) not in OPTIONAL and not re.search(r"_init \w+ (zero|garbage)$", f"{function} {what}") and not re.match(r"(-\d+) (?!unknown)", line)]
    assert wrong == []


def documented():
    """Names of the functions whose comments list errors."""
    text = "".join(next(RUNTIME.rglob(name)).read_text() for name in HEADERS)
    return re.findall(r"/\*\*(?:(?!\*/).)*\bErrors?\b(?:(?!\*/).)*\*/\nint (refdyn_\w+)\(", text, re.S)
