"""
What a caller of the runtime may get wrong and has to be told: names that are not there, values that are no numbers, models of another
version, tables whose counts or indices are out of range. All with the checks of gcc for addresses and undefined behaviour: the library is that of the
build with sanitizers.
"""
import re
import shutil
import subprocess

import pytest

from program import CORE_LIBRARY, REFERENCE, SOURCE, refdyn

RUNTIME = SOURCE / "runtime"
COMPILE = ["gcc", "-std=gnu11", "-O0", "-Wall", "-Wextra", "-I", SOURCE, "-I", RUNTIME]
CHECKS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]

PROGRAM = r"""
#include "manipulator.h"
#include "refdyn.h"
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures;
#define CHECK(condition) \
    ((condition) ? (void)0 : (void)(failures++, printf("line %d: %s\n", __LINE__, #condition)))

static const struct refdyn_model *const model = &manipulator_model;
static struct refdyn_workspace work;
static void *memory;
static size_t size;

static void open_workspace(void) {
    size = refdyn_workspace_size(model);
    memory = malloc(size);
    if (!size || refdyn_workspace_init(&work, model, memory, size))
        abort();
}

/* ---- Names ---- */

static const char *const strange[] = {"m_e", "m_E ", " m_E", "m_", "m_EE", "", "M_E", "arm_psi_1000", "%s%n", "\xff\xfe", NULL};
enum { STRANGE = sizeof strange / sizeof *strange };

static void set_what_is_there(void) {
    open_workspace();
    struct refdyn_workspace other = work;
    void *other_memory = memory;
    open_workspace();
    const int place = refdyn_find_name(model->parameters, model->parameter_count, "m_E");
    CHECK(refdyn_set_parameter(&work, "m_E", 2.5) == REFDYN_OK);
    other.p[place] = 2.5;
    refdyn_prepare(&other);
    CHECK(!memcmp(work.p, other.p, (size_t)(model->parameter_count + model->derived_count) * sizeof(double)));
    CHECK(work.p[place] == 2.5);
    CHECK(refdyn_set_input(&work, "tau", -3) == REFDYN_OK && work.x[0] == -3);
    double q[16] = {0};
    CHECK(refdyn_set_coordinate(model, q, "arm_psi", 0.3) == REFDYN_OK);
    CHECK(q[refdyn_find_name(model->coordinates, model->n, "arm_psi")] == 0.3);
    CHECK(refdyn_find_point(model, "E") == 0);
    for (int i = 0; i < model->m; i++)
        CHECK(refdyn_find_row(model, model->rows[i].name) == i);
    CHECK(model->anchored_count == 1 && refdyn_find_anchored(model, place) == -1);
    for (int j = 0; j < model->anchored_count; j++)
        CHECK(refdyn_find_anchored(model, model->anchored[j]) == j);
    free(other_memory);
    free(memory);
}

static void unknown_names(void) {
    double q[16] = {0};
    const double zeros[16] = {0};
    open_workspace();
    void *before = malloc(size);
    memcpy(before, memory, size);
    for (int i = 0; i < STRANGE; i++) {
        CHECK(refdyn_set_parameter(&work, strange[i], 1.25) == REFDYN_UNKNOWN_NAME);
        CHECK(refdyn_set_input(&work, strange[i], 1.25) == REFDYN_UNKNOWN_NAME);
        CHECK(refdyn_set_coordinate(model, q, strange[i], 1.25) == REFDYN_UNKNOWN_NAME);
        CHECK(refdyn_find_name(model->coordinates, model->n, strange[i]) == -1);
        CHECK(refdyn_find_row(model, strange[i]) == -1 && refdyn_find_point(model, strange[i]) == -1);
    }
    /* each kind has its own names */
    CHECK(refdyn_set_parameter(&work, "tau", 1) == REFDYN_UNKNOWN_NAME);
    CHECK(refdyn_set_input(&work, "m_E", 1) == REFDYN_UNKNOWN_NAME);
    CHECK(refdyn_set_coordinate(model, q, "E", 1) == REFDYN_UNKNOWN_NAME);
    CHECK(refdyn_find_name(NULL, 0, "m_E") == -1);
    CHECK(!memcmp(before, memory, size) && !memcmp(q, zeros, sizeof q));
    free(before);
    free(memory);
}

static void values_that_are_none(void) {
    const double values[] = {NAN, INFINITY, -INFINITY};
    double q[16] = {0};
    const double zeros[16] = {0};
    open_workspace();
    void *before = malloc(size);
    memcpy(before, memory, size);
    for (int i = 0; i < 3; i++) {
        CHECK(refdyn_set_parameter(&work, "m_E", values[i]) == REFDYN_BAD_VALUE);
        CHECK(refdyn_set_input(&work, "tau", values[i]) == REFDYN_BAD_VALUE);
        CHECK(refdyn_set_coordinate(model, q, "arm_psi", values[i]) == REFDYN_BAD_VALUE);
        CHECK(refdyn_set_parameter(&work, "typo", values[i]) == REFDYN_UNKNOWN_NAME);
    }
    CHECK(!memcmp(before, memory, size) && !memcmp(q, zeros, sizeof q));
    free(before);
    free(memory);
}

/* A method that was looked up under a wrong name, or is none. */
static void unknown_methods(void) {
    static const int wrong[] = {-1, -2, REFDYN_METHOD_COUNT, 1000, INT_MAX, INT_MIN};
    CHECK(refdyn_method_find("rk45") == -1 && refdyn_method_find("") == -1 && refdyn_method_find(NULL) == -1);
    open_workspace();
    void *room = malloc(1000000);
    for (int i = 0; i < 6; i++) {
        const enum refdyn_method method = (enum refdyn_method)wrong[i];
        const char *fact = NULL;
        struct refdyn_integrator integrator;
        struct refdyn_options options = refdyn_options_default(method);
        CHECK(refdyn_options_validate(&options, &fact) == REFDYN_BAD_OPTION && fact && strstr(fact, "method"));
        CHECK(refdyn_integrator_size(model, &options) == 0);
        CHECK(refdyn_integrator_init(&integrator, &work, &options, room, 1000000) == REFDYN_BAD_OPTION);
        CHECK(!refdyn_method_name(wrong[i]) && !refdyn_method_order(method) && !refdyn_can_run(model, method));
        CHECK(!refdyn_method_is_implicit(method));
    }
    free(room);
    free(memory);
}

/* Held coordinates that were looked up under a wrong name, or are none. */
static void unknown_held(void) {
    static const int wrong[] = {-1, -2, INT_MIN, INT_MAX, 1000};
    const struct refdyn_statics_options options = refdyn_statics_default();
    struct refdyn_statics_result result;
    const size_t room = refdyn_statics_size(model);
    void *statics = malloc(room);
    double q[16], qd[16];
    open_workspace();
    refdyn_initial_state(&work, q, qd);
    for (int i = 0; i < 5; i++) {
        int held[] = {0, wrong[i], 1};
        CHECK(refdyn_statics(&work, &options, held, 3, q, NULL, &result, statics, room) == REFDYN_BAD_OPTION);
        held[1] = model->n;
        CHECK(refdyn_statics(&work, &options, held, 2, q, NULL, &result, statics, room) == REFDYN_BAD_OPTION);
    }
    CHECK(refdyn_statics(&work, &options, model->held, model->held_count, q, NULL, &result, statics, room) == REFDYN_OK);
    free(statics);
    free(memory);
}

/* ---- Models ---- */

/* What returns no status leaves all as it is where the workspace was refused. */
static void nothing_changes(double values[16]) {
    const double before[16] = {0};
    refdyn_prepare(&work);
    refdyn_initial_state(&work, values, values + 8);
    refdyn_anchor(&work, 0, values, values + 8, NULL);
    CHECK(!memcmp(values, before, sizeof before));
}

/* Every function that takes a model refuses this one. */
static void refused(const struct refdyn_model *wrong, int status) {
    const struct refdyn_options options = refdyn_options_default(REFDYN_AUTO);
    const struct refdyn_statics_options of_statics = refdyn_statics_default();
    struct refdyn_statics_result result;
    struct refdyn_integrator integrator;
    double values[16] = {0}, room[4096];
    const int held[] = {0};
    CHECK(refdyn_workspace_size(wrong) == 0);
    CHECK(refdyn_integrator_size(wrong, &options) == 0);
    CHECK(refdyn_statics_size(wrong) == 0);
    CHECK(refdyn_set_coordinate(wrong, values, "arm_psi", 1) == status);
    CHECK(refdyn_find_row(wrong, "row") == -1 && refdyn_find_point(wrong, "E") == -1);
    CHECK(refdyn_find_anchored(wrong, model->anchored[0]) == -1);
    CHECK(refdyn_workspace_init(&work, wrong, room, sizeof room) == status);
    CHECK(refdyn_set_parameter(&work, "m_E", 1) == status && refdyn_set_input(&work, "tau", 1) == status);
    nothing_changes(values);
    CHECK(refdyn_integrator_init(&integrator, &work, &options, room, sizeof room) == status);
    CHECK(refdyn_statics(&work, &of_statics, held, 1, values, NULL, &result, room, sizeof room) == status);
}

static void other_versions(void) {
    static const int versions[] = {0, -1, REFDYN_MODEL_VERSION + 1, REFDYN_MODEL_VERSION - 1, INT_MAX, INT_MIN};
    for (int i = 0; i < 6; i++) {
        struct refdyn_model wrong = *model;
        wrong.interface_version = versions[i];
        refused(&wrong, REFDYN_OTHER_VERSION);
        /* of another version nothing but the number may be read: what follows may be anything, or not there */
        int *alone = malloc(sizeof *alone);
        *alone = versions[i];
        const struct refdyn_model *shorter = (const void *)alone;
        refused(shorter, REFDYN_OTHER_VERSION);
        for (int method = -1; method <= REFDYN_METHOD_COUNT; method++)
            CHECK(!refdyn_can_run(shorter, (enum refdyn_method)method) && !refdyn_has_tangent(shorter));
        free(alone);
    }
    CHECK(!refdyn_can_run(NULL, REFDYN_RK4) && !refdyn_has_tangent(NULL));
    CHECK(model->interface_version == REFDYN_MODEL_VERSION && (const void *)&model->interface_version == (const void *)model);
}

/* A table of version 0 had its name, a pointer, at its beginning. */
static void table_without_version(void) {
    struct refdyn_model wrong = *model;
    const char *name = "manipulator";
    memcpy(&wrong, &name, sizeof name);
    refused(&wrong, REFDYN_OTHER_VERSION);
}

#define COUNTS(F) \
    F(n) F(m) F(parameter_count) F(derived_count) F(input_count) F(point_count) F(course_count) F(break_count) F(switch_count) F(event_count) F(kink_count) F(change_count) \
    F(coupling_count) F(held_count) F(anchored_count)

static void counts_out_of_range(void) {
    static const int wrong_counts[] = {-1, INT_MIN, INT_MAX, 1 << 29, -65536};
    struct refdyn_model wrong;
    for (int i = 0; i < 5; i++) {
#define TRY(field) wrong = *model, wrong.field = wrong_counts[i], refused(&wrong, REFDYN_BAD_MODEL);
        COUNTS(TRY)
    }
    /* n n, m n or their sum would not be an int, or hardly */
    static const int squares[][3] = {{46341, 0, 0}, {65536, 0, 0}, {1, 46341, 0}, {46340, 46340, 0}, {15001, 0, 0}, {1, 15000, 0},
                                     {7500, 7501, 0}, {1, 1, 46341}, {1 << 28, 1 << 28, 1 << 28}, {0, 0, 0}, {0, 2, 0}};
    for (int i = 0; i < 11; i++) {
        wrong = *model;
        wrong.n = squares[i][0], wrong.m = squares[i][1], wrong.coupling_count = squares[i][2];
        refused(&wrong, REFDYN_BAD_MODEL);
    }
    refused(NULL, REFDYN_BAD_MODEL);
}

#define TABLES(F) F(coordinates) F(parameters) F(inputs) F(points) F(rows) F(held) F(anchored) F(parent) F(vector_places)

static void tables_that_are_missing(void) {
    struct refdyn_model wrong;
    const struct refdyn_model with_vectors = manipulator_model;
#define LOSE(field) wrong = with_vectors, wrong.tangent_vectors = wrong.M, wrong.field = NULL, refused(&wrong, REFDYN_BAD_MODEL);
    TABLES(LOSE)
}

#define PLACES(F) F(dependent, -1, n) F(held, -1, n) F(anchored, -1, parameter_count) F(parent, -2, n) \
    F(gains, -2, parameter_count + model->derived_count)

static void indices_out_of_range(void) {
    struct refdyn_model wrong;
    int places[64];
#define LEAD(field, below, end) \
    for (int i = 0; i < 64; i++) \
        places[i] = below; \
    wrong = *model, wrong.field = places, refused(&wrong, REFDYN_BAD_MODEL); \
    for (int i = 0; i < 64; i++) \
        places[i] = i == 0 ? model->end : 0; \
    refused(&wrong, REFDYN_BAD_MODEL); \
    places[0] = INT_MAX; \
    refused(&wrong, REFDYN_BAD_MODEL);
    PLACES(LEAD)
}

/* At the limits every size is found without an overflow, in every form of the equations and for every method. */
static void largest_models(void) {
    static const int largest[][3] = {{15000, 0, 0}, {1, 14999, 0}, {7500, 7500, 0}, {1, 0, 14999}, {5000, 5000, 5000}, {14998, 1, 1}};
    int *parents = calloc(15000, sizeof *parents), *gains = calloc(2 * 15000, sizeof *gains);
    for (int i = 0; i < 6; i++)
        for (int form = 0; form < 4; form++)
            for (int method = 0; method < REFDYN_METHOD_COUNT; method++) {
                struct refdyn_model large = *model;
                struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
                options.singular = REFDYN_PASS;
                large.n = largest[i][0], large.m = largest[i][1], large.coupling_count = largest[i][2];
                large.parent = large.vector_places = parents, large.gains = gains, large.dependent = NULL, large.held_count = 0;
                large.parameter_count = large.derived_count = large.switch_count = large.break_count = 1 << 28;
                large.tangent = form % 2 ? large.M : NULL;
                large.tangent_vectors = form / 2 ? large.M : NULL;
                CHECK(refdyn_workspace_size(&large) > (size_t)large.n * (size_t)large.n * sizeof(double));
                CHECK(refdyn_statics_size(&large) > (size_t)large.n * (size_t)large.n * sizeof(double));
                CHECK(refdyn_integrator_size(&large, &options) > (size_t)large.n * sizeof(double));
                CHECK(refdyn_workspace_init(&work, &large, memory, 8) == REFDYN_BAD_MEMORY);
            }
    free(parents);
    free(gains);
}

/* Calls with a workspace that was refused are refused, too. */
static void workspace_without_memory(void) {
    const struct refdyn_options options = refdyn_options_default(REFDYN_RK4);
    struct refdyn_integrator integrator;
    double room[4096];
    const size_t needed = refdyn_workspace_size(model);
    double values[16] = {0};
    CHECK(refdyn_workspace_init(&work, model, NULL, needed) == REFDYN_BAD_MEMORY);
    nothing_changes(values);
    CHECK(refdyn_set_parameter(&work, "m_E", 1) == REFDYN_BAD_MEMORY && refdyn_set_input(&work, "tau", 1) == REFDYN_BAD_MEMORY);
    CHECK(refdyn_integrator_init(&integrator, &work, &options, room, sizeof room) == REFDYN_BAD_MEMORY);
}

static void every_status_has_a_text(void) {
    for (int status = REFDYN_CONTACT_PULLS; status <= REFDYN_ROWS_UNMET; status++) {
        CHECK(strcmp(refdyn_status_text(status), refdyn_status_text(1000)) != 0);
        for (int other = REFDYN_CONTACT_PULLS; other < status; other++)
            CHECK(strcmp(refdyn_status_text(status), refdyn_status_text(other)) != 0);
    }
    CHECK(strcmp(refdyn_status_text(REFDYN_CONTACT_PULLS - 1), refdyn_status_text(1000)) == 0);
}

static const struct {
    const char *name;
    void (*run)(void);
} cases[] = {CASES};

int main(int count, char **arguments) {
    for (size_t i = 0; i < sizeof cases / sizeof *cases && count > 1; i++)
        if (!strcmp(cases[i].name, arguments[1])) {
            cases[i].run();
            printf("%d failed\n", failures);
        }
    return failures != 0;
}
"""
CASES = re.findall(r"^static void (?!open_workspace|nothing_changes|refused)(\w+)\(", PROGRAM, re.M)


@pytest.fixture(scope="module")
def emitted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("emitted")
    refdyn("gen", REFERENCE, "--set", "n_rfe=1", "--set", "drive=input", "--emit", "all", "-o", folder)
    return folder


@pytest.fixture(scope="module")
def program(emitted, tmp_path_factory):
    folder = tmp_path_factory.mktemp("program")
    for path in emitted.iterdir():
        shutil.copy(path, folder)
    entries = ", ".join(f'{{"{name}", {name}}}' for name in CASES)
    (folder / "program.c").write_text(PROGRAM.replace("CASES}", entries + "}"))
    subprocess.run([*COMPILE, *CHECKS, *folder.glob("*.c"), CORE_LIBRARY, "-lm", "-o", folder / "program"], check=True)
    return folder / "program"


def test_cases_are_found():
    assert len(CASES) == 13 and {"unknown_names", "other_versions", "largest_models"} <= set(CASES)


@pytest.mark.parametrize("case", CASES)
def test_refusals(case, program):
    done = subprocess.run([program, case], capture_output=True, text=True, timeout=100)
    assert done.returncode == 0 and done.stdout == "0 failed\n", done.stdout[-2000:] + done.stderr[-2000:]


# ---- The version in emitted files ----

HEADER = (RUNTIME / "refdyn_model.h").read_text()
DEFINITION = re.search(r"^#define REFDYN_MODEL_VERSION (\d+)$", HEADER, re.M)
COMPILERS = [["gcc", "-std=c11", "-xc"], ["clang", "-std=c11", "-xc"], ["g++", "-std=c++17", "-xc++"], ["clang++", "-std=c++17", "-xc++"]]


def compile_with(folder, compiler, header, change=lambda text: text):
    """The finished compilation of the file with the table, with this refdyn_model.h."""
    (folder / "refdyn_model.h").write_text(header)
    (folder / "manipulator.c").write_text(change((folder / "manipulator.c").read_text()))
    return subprocess.run([*compiler, "-fsyntax-only", folder / "manipulator.c"], capture_output=True, text=True)


@pytest.mark.parametrize("compiler", COMPILERS, ids=" ".join)
@pytest.mark.parametrize("definition", ["#define REFDYN_MODEL_VERSION 1", "#define REFDYN_MODEL_VERSION 0", "#define REFDYN_MODEL_VERSION -1",
                                        "#define REFDYN_MODEL_VERSION 1000", "", "#define REFDYN_MODEL_VERSION (1 + 1)"])
def test_stale_files_do_not_compile(definition, compiler, emitted, tmp_path):
    shutil.copytree(emitted, tmp_path, dirs_exist_ok=True)
    assert compile_with(tmp_path, compiler, HEADER).returncode == 0
    done = compile_with(tmp_path, compiler, HEADER.replace(DEFINITION.group(), definition))
    assert done.returncode != 0
    assert f"manipulator was emitted for version {DEFINITION.group(1)} of refdyn_model.h" in done.stderr and "emit it again" in done.stderr


def test_every_emitted_table_has_the_number(emitted):
    """The number itself, not the macro, which would follow any header."""
    tables = [path for folder in (emitted, SOURCE / "generated") for path in folder.glob("*.c") if "struct refdyn_model " in path.read_text()]
    assert len(tables) == 3
    for path in tables:
        assert f"SET(interface_version) {DEFINITION.group(1)},\n    SET(name)" in path.read_text()


def without_version(text):
    """In the form of emitted files before tables had a version."""
    return re.sub(r"#if REFDYN_MODEL_VERSION.*?#endif\n", "", text, flags=re.S).replace(f"SET(interface_version) {DEFINITION.group(1)},", "")


def test_files_from_before_there_was_a_version(emitted, tmp_path):
    """C++ cannot compile them; compiled as C they have version 0, which the library refuses."""
    shutil.copytree(emitted, tmp_path, dirs_exist_ok=True)
    assert compile_with(tmp_path, COMPILERS[2], HEADER, without_version).returncode != 0
    (tmp_path / "main.c").write_text("""
#include "manipulator.h"
#include "refdyn.h"
int main(void) {
    static double memory[100000];
    struct refdyn_workspace work;
    return refdyn_workspace_init(&work, &manipulator_model, memory, sizeof memory) != REFDYN_OTHER_VERSION;
}
""")
    subprocess.run([*COMPILE, *CHECKS, *tmp_path.glob("*.c"), CORE_LIBRARY, "-lm", "-o", tmp_path / "main"],
                   check=True)
    subprocess.run([tmp_path / "main"], check=True)


# ---- The pages ----

def test_no_page_or_program_indexes_by_an_unseen_name():
    files = [path for folder in ("runtime", "gen", "models", "generated", "tests") for path in (SOURCE / folder).rglob("*")
             if path.suffix in (".c", ".h", ".md", ".py") and path.name != "test_interface.py"]
    assert len(files) > 200
    assert not [path for path in [*files, SOURCE / "README.md"] if re.search(r"\[\s*refdyn_(\w+_)?find", path.read_text(errors="replace"))]
