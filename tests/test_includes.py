"""Who may include whom, and what no file of ours may contain."""
import re

from program import CORE_FILES, SOURCE

CORE = sorted({str(path.parent.relative_to(SOURCE)) for path in CORE_FILES})
OUR_HEADERS = {folder: {path.name for path in (SOURCE / folder).glob("*.h")} for folder in ("gen", *CORE, "runtime/tool")}
CORE_HEADERS = set().union(*(OUR_HEADERS[folder] for folder in CORE))


def includes(folder):
    """(file, included name) of every include line of a folder, without its sub-folders."""
    files = sorted((SOURCE / folder).glob("*.[ch]")) + sorted((SOURCE / folder).glob("*.def"))
    assert files, f"{folder} is empty"
    return [(path, match.group(1)) for path in files
            for match in re.finditer(r'^\s*#\s*include\s*["<]([^">]+)[">]', path.read_text(), re.M)]


def test_only_the_files_of_the_script_know_lua():
    known = {"gen/script_state.h", "gen/script.c", "gen/script_value.c", "gen/script_metatable.c", "gen/script_library.c"}
    users = {str(path.relative_to(SOURCE)) for folder in OUR_HEADERS for path, name in includes(folder)
             if name in ("lua.h", "lualib.h", "lauxlib.h", "lua.hpp", "script_state.h")}
    assert users == known


def test_generator_includes_no_runtime():
    """But for what emitted code and its callers agree on."""
    runtime = (CORE_HEADERS | OUR_HEADERS["runtime/tool"]) - {"refdyn_model.h", "chain_cost.h"}
    wrong = [(path.name, name) for path, name in includes("gen") if "runtime" in name or name.split("/")[-1] in runtime]
    assert not wrong


def test_runtime_core_stands_alone():
    """Only its own headers and those of C11: no generator, no Lua, no library, no POSIX."""
    standard = {"assert.h", "complex.h", "ctype.h", "errno.h", "fenv.h", "float.h", "inttypes.h", "limits.h", "math.h", "setjmp.h",
                "stdalign.h", "stdarg.h", "stdatomic.h", "stdbool.h", "stddef.h", "stdint.h", "stdlib.h", "string.h", "tgmath.h"}
    wrong = [(path.name, name) for folder in CORE for path, name in includes(folder)
             if name not in standard and name.split("/")[-1] not in CORE_HEADERS]
    assert not wrong


def test_only_the_tool_includes_both():
    users = {name.split("/")[-1] for _, name in includes("runtime/tool")}
    assert users & OUR_HEADERS["gen"] and users & CORE_HEADERS


def code(path):
    """A C file without comments and texts."""
    text = re.sub(r'"(\\.|[^"\\\n])*"', '""', path.read_text())
    return re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.S)


def test_runtime_core_is_quiet():
    """The core never prints, exits, or allocates."""
    for path in CORE_FILES:
        calls = re.findall(r"\b(printf|fprintf|puts|perror|exit|abort|malloc|calloc|realloc|free)\s*\(", code(path))
        assert not calls, f"{path.name} calls {sorted(set(calls))}"


def changing_variable(line):
    """Whether a line at file scope defines a variable that may change (a pointer to constants may, too)."""
    declared = re.match(r"(?!typedef|extern|return|goto|else|#)([A-Za-z_][\w\s*]*\w(\[[^\]]*\])*)\s*(=[^=]|;)", line)
    if not declared or re.match(r"(struct|enum|union)\s+\w+\s*;", line):
        return False
    return "const" not in re.sub(r"\[[^\]]*\]", "", declared.group(1)).split("*")[-1]


def test_changing_variables_are_seen():
    changing = ["static int counter;", "int x = 3;", "static double t[3] = {", "static const char *name;", "static char **list = NULL;"]
    constant = ["struct point;", "const double x = 1;", "static const double a[4 * 4] = {", "static const char *const names[] = {", "};", "void f(int a);"]
    assert all(map(changing_variable, changing)) and not any(map(changing_variable, constant))


def test_no_state_outside_functions():
    """In the generator, the runtime core and the emitted code."""
    for folder in ("gen", *CORE, "generated"):
        for path in sorted((SOURCE / folder).glob("*.c")):
            found = [line for line in code(path).splitlines() if changing_variable(line)]
            assert not found, f"{path.name}: {found}"


def test_no_path_of_a_machine():
    for folder in ("gen", "runtime", "models", "generated", "tests"):
        for path in sorted((SOURCE / folder).rglob("*")):
            if path.suffix in (".c", ".h", ".lua", ".md", ".py", ".cmake") and "__pycache__" not in path.parts:
                found = re.findall(r"(?<![\w.])/(?:home|root|work)/\w+", path.read_text())
                assert not found, f"{path}: {found}"
