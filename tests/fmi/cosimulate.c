/*
 * Reads the library of an FMU of FMI 2.0, its GUID and the length of a step [s]; prints the first COUNT
 * variables after each of ten steps of Co-Simulation on stdout. For Linux, and with MinGW for Windows.
 */
#include "runtime/bindings/fmi/fmi2.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
static void *library_open(const char *path) {
    return (void *)LoadLibraryA(path);
}
static void (*library_find(void *library, const char *name))(void) {
    return (void (*)(void))GetProcAddress((HMODULE)library, name);
}
#else
#include <dlfcn.h>
static void *library_open(const char *path) {
    return dlopen(path, RTLD_NOW);
}
static void (*library_find(void *library, const char *name))(void) {
    void *found = dlsym(library, name);
    void (*function)(void) = NULL;
    memcpy(&function, &found, sizeof found);
    return function;
}
#endif

enum { STEPS = 10, COUNT = 5 };

static void tell(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                 fmi2String category, fmi2String message, ...) {
    (void)environment;
    fprintf(stderr, "%s, %d, %s: %s\n", name, (int)status, category, message);
}

/* The function of the library with the type of the declared one. */
#define FIND(name) __typeof__(&name) call_##name = (__typeof__(&name))library_find(library, #name)

static void check(int is_good, const char *what) {
    if (is_good)
        return;
    fprintf(stderr, "%s failed\n", what);
    exit(1);
}

int main(int count, char **words) {
    static const fmi2CallbackFunctions functions = {.logger = tell};
    check(count == 4, "step LIBRARY GUID STEP");
    void *library = library_open(words[1]);
    check(library != NULL, words[1]);
    FIND(fmi2Instantiate);
    FIND(fmi2SetupExperiment);
    FIND(fmi2EnterInitializationMode);
    FIND(fmi2ExitInitializationMode);
    FIND(fmi2DoStep);
    FIND(fmi2GetReal);
    FIND(fmi2FreeInstance);
    const double h = atof(words[3]);
    fmi2Component one =
        call_fmi2Instantiate("one", fmi2CoSimulation, words[2], "", &functions, fmi2False, fmi2False);
    check(one != NULL, "fmi2Instantiate");
    check(!call_fmi2SetupExperiment(one, fmi2False, 0, 0, fmi2False, 0), "fmi2SetupExperiment");
    check(!call_fmi2EnterInitializationMode(one), "fmi2EnterInitializationMode");
    check(!call_fmi2ExitInitializationMode(one), "fmi2ExitInitializationMode");
    for (int i = 0; i < STEPS; i++) {
        fmi2ValueReference references[COUNT];
        double values[COUNT];
        for (unsigned k = 0; k < COUNT; k++)
            references[k] = k;
        check(!call_fmi2DoStep(one, i * h, h, fmi2True), "fmi2DoStep");
        check(!call_fmi2GetReal(one, references, COUNT, values), "fmi2GetReal");
        for (int k = 0; k < COUNT; k++)
            printf("%.17g%c", values[k], k < COUNT - 1 ? ' ' : '\n');
    }
    call_fmi2FreeInstance(one);
    return 0;
}
